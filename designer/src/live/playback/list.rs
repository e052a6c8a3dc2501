//! The marks of a recording as a list: choosing one goes to its moment.

use eframe::egui::{self, RichText, ScrollArea, Sense, vec2};

use super::marks::{FoundMarks, MarkKind, TimeMark};
use super::track::{draw_sign, format_clock};
use crate::live::words::printable;
use armor_picture::theme::ThemeColours;

/// Shows the marks of these kinds, the earliest first; `at_s` is the moment that is reached, in system
/// time, and `from_s` that from which is counted. Returns the one that was chosen.
pub fn show(
    ui: &mut egui::Ui,
    found: &FoundMarks,
    hidden: &[MarkKind],
    from_s: f64,
    at_s: f64,
) -> Option<TimeMark> {
    let shown: Vec<&TimeMark> =
        found.marks.iter().filter(|mark| !hidden.contains(&mark.kind)).collect();
    if shown.is_empty() {
        ui.weak(match (found.is_complete, found.marks.is_empty()) {
            (false, _) => "The marks of the recording are being read.",
            (true, true) => "Nothing fired, nothing was reported and nothing was lost.",
            (true, false) => "The legend above hides all marks.",
        });
        return None;
    }
    let colours = ThemeColours::of(ui.visuals());
    let reached = shown.iter().rposition(|mark| mark.at_s <= at_s);
    let mut chosen = None;
    let row = ui.spacing().interact_size.y;
    ScrollArea::vertical().auto_shrink(false).show_rows(ui, row, shown.len(), |ui, rows| {
        for number in rows {
            let mark = shown[number];
            ui.horizontal(|ui| {
                let (rect, _) = ui.allocate_exact_size(vec2(14.0, row), Sense::hover());
                draw_sign(ui.painter(), rect.center(), mark.kind, mark.kind.colour(colours));
                let time = format_clock(mark.at_s - from_s);
                let text = RichText::new(format!("{time:>10}  {}", printable(ui, &mark.text)));
                let text = text.monospace().color(if mark.at_s > at_s {
                    colours.weak
                } else {
                    colours.text
                });
                let line = ui.selectable_label(reached == Some(number), text);
                let kind = match mark.kind {
                    MarkKind::Firing => "firing",
                    MarkKind::Report => "report",
                    MarkKind::Failure => "failure",
                    MarkKind::Loss => "loss",
                };
                let name = format!("{kind} {} at {time}", mark.text);
                let line = line.accessible_name(name);
                if line.on_hover_text("Goes to this moment").clicked() {
                    chosen = Some(mark.clone());
                }
            });
        }
    });
    chosen
}
