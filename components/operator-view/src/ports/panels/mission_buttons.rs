//! The buttons of the mission: each sends an event of its name.

use eframe::egui::Ui;

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::SidePanel;

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(MissionButtons) };

struct MissionButtons;

impl SidePanel for MissionButtons {
    fn name(&self) -> &'static str {
        "mission"
    }

    fn is_visible(&self, console: &Console, _: ClockTimes) -> bool {
        !console.buttons.is_empty()
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        now: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let mut orders = Vec::new();
        let is_reached = console.connection.check_orders().is_ok();
        ui.horizontal_wrapped(|ui| {
            if !is_reached {
                ui.disable();
            }
            for name in &console.buttons {
                if ui.button(name).on_hover_text("sends this event to the mission").clicked() {
                    orders.push(OperatorOrder::Press(name.clone()));
                }
            }
        });
        if let Some((name, at_s)) = console.orders.pressed() {
            let ago_s = (console.run_time(now).host_s - at_s).max(0.0);
            ui.weak(format!("{name}: sent {}", format_ago(ago_s)));
            let followed = console.orders.followed_button();
            if !followed.is_empty() {
                ui.weak(format!("the mission went to {}", followed.join(", then "))).on_hover_text(
                    "the places that were marked after the button; if it came back at once, a \
                     component has refused: see the alerts and the component's log",
                );
            }
        }
        orders
    }
}

fn format_ago(ago_s: f64) -> String {
    if ago_s < 60.0 {
        format!("{ago_s:.0} s ago")
    } else {
        format!("{:.0} min ago", (ago_s / 60.0).floor())
    }
}
