//! The goal that the robot is sent to.

use crate::screen::colours_of;
use eframe::egui::{Button, Ui};

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::SidePanel;

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(GoalPanel) };

struct GoalPanel;

impl SidePanel for GoalPanel {
    fn name(&self) -> &'static str {
        "goal"
    }

    fn is_visible(&self, console: &Console, now: ClockTimes) -> bool {
        console.orders.goal().is_some()
            || console.recent_refusal(now).is_some()
            || console.recent_arrival(now).is_some()
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        now: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let mut orders = Vec::new();
        if let Some(refusal) = console.recent_refusal(now) {
            ui.colored_label(colours_of(ui).error, format!("refused: {}", refusal.why));
        }
        if console.recent_arrival(now).is_some() {
            ui.colored_label(colours_of(ui).good, "goal reached");
        }
        let Some(goal) = console.orders.goal() else { return orders };
        ui.horizontal(|ui| {
            let place = goal.place;
            let robot = console.scene.robot();
            let distance_m = robot.map(|robot| robot.point().distance_m(place.point()));
            let away = distance_m.map_or(String::new(), |far_m| format!(", {far_m:.1} m away"));
            ui.label(format!("goal {:.2}, {:.2}{away}", place.x_m, place.y_m));
            let may_order = console.connection.check_orders().is_ok();
            if ui.add_enabled(may_order, Button::new("cancel")).clicked() {
                orders.push(OperatorOrder::Cancel);
            }
        });
        if let Some(problem) = console.goal_problem(now) {
            ui.colored_label(colours_of(ui).error, problem);
        }
        orders
    }
}
