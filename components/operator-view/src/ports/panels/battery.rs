//! The charge of the battery.

use armor_sdk::prelude::*;
use eframe::egui::Ui;

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::input::{ConsoleUpdate, ScreenInput, ScreenPort};
use crate::ports::panel_kind::PanelKind;
use crate::readings::BatteryReading;
use crate::scene::SceneError;
use crate::screen::{SidePanel, show_rows};

pub(super) const PANEL: PanelKind =
    PanelKind { inputs: &[ScreenPort::of::<BatteryInput>()], make: || Box::new(BatteryPanel) };

struct BatteryInput;

impl ScreenInput for BatteryInput {
    const ID: &'static str = "battery";
    const DOC: &'static str = "charge of the battery";
    const IS_STEADY: bool = true;
    type Message = BatteryState;

    fn read_message(state: BatteryState) -> Result<ConsoleUpdate, SceneError> {
        let measured = |value: f32| value.is_finite().then(|| f64::from(value));
        let reading = BatteryReading {
            charge: measured(state.percentage),
            volts: measured(state.voltage),
            is_charging: state.power_supply_status == PowerSupplyStatus::Charging,
        };
        Ok(Box::new(move |console| {
            console.readings.store(reading);
            Ok(())
        }))
    }
}

struct BatteryPanel;

impl SidePanel for BatteryPanel {
    fn name(&self) -> &'static str {
        "battery"
    }

    fn is_visible(&self, console: &Console, _: ClockTimes) -> bool {
        console.is_linked(BatteryInput::ID)
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        show_rows(ui, self.name(), vec![("battery", format_battery(console.readings.newest()))]);
        Vec::new()
    }
}

fn format_battery(reading: Option<&BatteryReading>) -> String {
    let Some(reading) = reading else { return "-".into() };
    let charge = reading.charge.map(|charge| format!("{:.0} %", 100.0 * charge));
    let volts = reading.volts.map(|volts| format!("{volts:.1} V"));
    let charging = reading.is_charging.then(|| "charging".to_owned());
    let parts: Vec<_> = [charge, volts, charging].into_iter().flatten().collect();
    if parts.is_empty() { "not measured".into() } else { parts.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_measured_is_shown() {
        let reading = |charge, volts, is_charging| BatteryReading { charge, volts, is_charging };
        assert_eq!(format_battery(None), "-");
        assert_eq!(format_battery(Some(&reading(None, None, false))), "not measured");
        let all = reading(Some(0.5), Some(12.04), true);
        assert_eq!(format_battery(Some(&all)), "50 %, 12.0 V, charging");
    }
}
