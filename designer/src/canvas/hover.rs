//! Texts over a drawing: the tooltip at the pointer, and the hint of an empty drawing.

use eframe::egui::{self, Align2, FontId};

use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::hit::Hit;
use crate::canvas::labels::paintable;
use crate::canvas::state::{Canvas, CanvasOutput};

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
        let colour = ui.visuals().weak_text_color();
        let at = self.rect.center();
        ui.painter().text(at, Align2::CENTER_CENTER, text, FontId::proportional(16.0), colour);
    }
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
