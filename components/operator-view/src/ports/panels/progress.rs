//! The progress of the active task.

use armor_sdk::prelude::*;
use eframe::egui::{ProgressBar, Ui};

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::input::{ConsoleUpdate, ScreenInput, ScreenPort};
use crate::ports::panel_kind::PanelKind;
use crate::readings::TaskReading;
use crate::scene::SceneError;
use crate::screen::SidePanel;

pub(super) const PANEL: PanelKind =
    PanelKind { inputs: &[ScreenPort::of::<ProgressInput>()], make: || Box::new(ProgressPanel) };

struct ProgressInput;

impl ScreenInput for ProgressInput {
    const ID: &'static str = "progress";
    const DOC: &'static str = "progress of the active task";
    const IS_STEADY: bool = false;
    type Message = Progress;

    fn read_message(progress: Progress) -> Result<ConsoleUpdate, SceneError> {
        Ok(Box::new(move |console| {
            console.readings.store(TaskReading { task: progress.task.clone() });
            console.readings.store(progress);
            Ok(())
        }))
    }
}

/// Height of the bar, in points.
const BAR_HEIGHT: f32 = 20.0;

struct ProgressPanel;

impl SidePanel for ProgressPanel {
    fn name(&self) -> &'static str {
        "progress"
    }

    fn is_visible(&self, console: &Console, _: ClockTimes) -> bool {
        console.readings.newest::<Progress>().is_some_and(|progress| !progress.task.is_empty())
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let Some(progress) = console.readings.newest::<Progress>() else { return Vec::new() };
        ui.label(&progress.task);
        if let Some(fraction) = progress.known_fraction() {
            ui.add(ProgressBar::new(fraction).desired_height(BAR_HEIGHT).show_percentage());
        }
        if !progress.detail.is_empty() {
            ui.weak(&progress.detail);
        }
        Vec::new()
    }
}
