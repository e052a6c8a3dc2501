//! Whether a mission is over, and texts of processes as the fonts can show them.

use armor_marking::MarkingStage;
use eframe::egui;

/// Whether nothing more can be ordered.
pub fn is_over(stage: MarkingStage) -> bool {
    stage.has_ended() || stage == MarkingStage::Stopping
}

/// What a process states, as the fonts can show it.
pub fn printable(ui: &egui::Ui, text: &str) -> String {
    crate::text::paintable(ui.ctx(), &text.replace('\u{2192}', "->")).into_owned()
}
