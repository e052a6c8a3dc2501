//! Texts over a drawing: the tooltip at the pointer, and the hint of an empty drawing.

use eframe::egui::text::LayoutJob;
use eframe::egui::{self, Align, Color32, FontId, Painter, Pos2, Rect};

use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::hit::Hit;
use crate::canvas::labels::paintable;
use crate::canvas::state::{Canvas, CanvasOutput};

/// What a hint leaves free at both sides.
const HINT_MARGIN: f32 = 16.0;

impl<Id: DiagramId> Canvas<Id> {
    /// Shows the tooltip of what is under the pointer.
    pub fn show_tooltip(&self, shown: &CanvasOutput<Id>, diagram: &Diagram<Id>) {
        let doc = shown.hovered.and_then(|hit| diagram.doc(hit)).filter(|doc| !doc.is_empty());
        if let Some(doc) = doc.filter(|_| !self.is_busy()) {
            let doc = paintable(&shown.response.ctx, doc).into_owned();
            shown.response.clone().on_hover_ui_at_pointer(|ui| {
                ui.set_max_width(360.0);
                ui.label(doc);
            });
        }
    }

    /// Shows in the middle of an empty drawing what to do.
    pub fn show_hint(&self, ui: &egui::Ui, text: &str) {
        paint_hint(ui.painter(), self.rect, text, ui.visuals().weak_text_color());
    }
}

/// Writes what to do in the middle of an empty drawing, in as many lines as its width takes. Returns
/// the place of the text.
pub fn paint_hint(painter: &Painter, area: Rect, text: &str, colour: Color32) -> Rect {
    let width = (area.width() - 2.0 * HINT_MARGIN).max(HINT_MARGIN);
    let mut job = LayoutJob::simple(text.to_owned(), FontId::proportional(16.0), colour, width);
    job.halign = Align::Center;
    let galley = painter.layout_job(job);
    let top = area.center().y - galley.size().y / 2.0;
    let at = Pos2::new(area.center().x, top);
    let covered = galley.rect.translate(at.to_vec2());
    painter.galley(at, galley, colour);
    covered
}

impl<Id: DiagramId> Diagram<Id> {
    /// The tooltip of something.
    pub fn doc(&self, hit: Hit) -> Option<&str> {
        match hit {
            Hit::Port(at) => self.port(at).map(|port| port.doc.as_str()),
            Hit::Node(node) => self.nodes.get(node).map(|node| node.doc.as_str()),
            Hit::Wire(wire) => self.wires.get(wire).map(|wire| wire.doc.as_str()),
            Hit::Grip { .. } => Some("Drag to connect it elsewhere."),
            Hit::Decoration(_) | Hit::Corner(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hint_stays_within_a_narrow_drawing() {
        let text = "Nothing is drawn on the map: choose a tool at the left, and click here.";
        for width in [120.0, 300.0, 900.0] {
            let area = Rect::from_min_size(Pos2::new(200.0, 40.0), egui::vec2(width, 400.0));
            egui::__run_test_ui(|ui| {
                let covered = paint_hint(ui.painter(), area, text, Color32::WHITE);
                assert!(area.contains_rect(covered), "{covered:?} in {area:?}");
            });
        }
    }
}
