//! The quality of mapping.

use armor_sdk::prelude::*;
use eframe::egui::Ui;

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::input::{ConsoleUpdate, ScreenInput, ScreenPort};
use crate::ports::panel_kind::PanelKind;
use crate::scene::SceneError;
use crate::screen::{SidePanel, show_rows};

pub(super) const PANEL: PanelKind =
    PanelKind { inputs: &[ScreenPort::of::<DiagnosticsInput>()], make: || Box::new(MappingPanel) };

struct DiagnosticsInput;

impl ScreenInput for DiagnosticsInput {
    const ID: &'static str = "diagnostics";
    const DOC: &'static str = "quality of mapping";
    const IS_STEADY: bool = true;
    type Message = SlamDiagnostics;

    fn read_message(diagnostics: SlamDiagnostics) -> Result<ConsoleUpdate, SceneError> {
        Ok(Box::new(move |console| {
            console.readings.store(diagnostics);
            Ok(())
        }))
    }
}

struct MappingPanel;

impl SidePanel for MappingPanel {
    fn name(&self) -> &'static str {
        "mapping"
    }

    fn is_visible(&self, console: &Console, _: ClockTimes) -> bool {
        console.readings.newest::<SlamDiagnostics>().is_some()
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let Some(mapping) = console.readings.newest::<SlamDiagnostics>() else {
            return Vec::new();
        };
        let (effective, all) = (mapping.effective_particles, mapping.particles);
        let mut rows = vec![
            ("particles", format!("{effective:.1} of {all} effective")),
            ("scans match", format!("{:.0} %", 100.0 * mapping.match_score)),
            ("loops closed", mapping.closures.to_string()),
            ("time per scan", format!("{:.1} ms", 1e3 * mapping.update_time)),
        ];
        if mapping.dropped > 0 {
            rows.push(("scans dropped", mapping.dropped.to_string()));
        }
        show_rows(ui, self.name(), rows);
        Vec::new()
    }
}
