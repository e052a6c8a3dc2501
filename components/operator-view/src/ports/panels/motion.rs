//! Speed and place of the robot, and the drift of its odometry.

use eframe::egui::Ui;

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::{SidePanel, show_rows};

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(MotionPanel) };

struct MotionPanel;

impl SidePanel for MotionPanel {
    fn name(&self) -> &'static str {
        "motion"
    }

    fn is_visible(&self, console: &Console, _: ClockTimes) -> bool {
        console.is_linked("odometry") || console.scene.is_localised
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let scene = &console.scene;
        let mut rows = Vec::new();
        if console.is_linked("odometry") {
            let speed = |(mps, _): (f64, f64)| format!("{mps:.2} m/s");
            let turn = |(_, radps): (f64, f64)| format!("{:.0}°/s", radps.to_degrees());
            rows.push(("speed", scene.velocity.map_or("-".into(), speed)));
            rows.push(("turn", scene.velocity.map_or("-".into(), turn)));
        }
        if let Some(robot) = scene.robot() {
            rows.push(("position", format!("{}, {} m", in_cm(robot.x_m), in_cm(robot.y_m))));
            rows.push(("heading", format!("{:.0}°", robot.yaw_rad.to_degrees())));
        } else if scene.is_localised {
            rows.push(("position", "unknown".into()));
        }
        if let Some((off_m, off_rad)) = scene.drift() {
            rows.push(("odometry off", format!("{off_m:.2} m, {:.0}°", off_rad.to_degrees())));
        }
        show_rows(ui, self.name(), rows);
        Vec::new()
    }
}

/// Metres to the centimetre, without the sign of a zero.
fn in_cm(metres: f64) -> String {
    format!("{:.2}", (metres * 100.0).round() / 100.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::in_cm;

    #[test]
    fn a_zero_has_no_sign() {
        assert_eq!([-0.001, 0.0, -1.234].map(in_cm), ["0.00", "0.00", "-1.23"]);
    }
}
