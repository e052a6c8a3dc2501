//! The actions that change the view of a drawing, the same in every view.

use eframe::egui::Rect;

use crate::canvas::diagram::{Diagram, DiagramId};
use crate::canvas::selection::Selection;
use crate::canvas::state::Canvas;

/// How much one step enlarges.
const ZOOM_STEP: f32 = 1.25;

/// A change of what is shown or selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewAction {
    /// Selects everything but the wires.
    SelectAll,
    /// Ends what is being dragged, or else selects nothing.
    SelectNone,
    /// Enlarges.
    ZoomIn,
    /// Shrinks.
    ZoomOut,
    /// Shows it at actual size.
    ZoomActual,
    /// Shows everything.
    ZoomFit,
    /// Shows what is selected.
    ZoomSelected,
}

impl<Id: DiagramId> Canvas<Id> {
    /// Carries out an action.
    pub fn perform_action(&mut self, action: ViewAction, diagram: &Diagram<Id>) {
        match action {
            ViewAction::SelectAll => {
                let nodes = diagram.nodes.iter().map(|node| node.item);
                let rest = diagram.decorations.iter().map(|decoration| decoration.item);
                self.selection = nodes.chain(rest).collect();
            }
            ViewAction::SelectNone => {
                let was_busy = self.cancel();
                if !was_busy {
                    self.selection = Selection::default();
                }
            }
            ViewAction::ZoomIn => self.zoom_by(ZOOM_STEP),
            ViewAction::ZoomOut => self.zoom_by(1.0 / ZOOM_STEP),
            ViewAction::ZoomActual => self.show_actual_size(diagram),
            ViewAction::ZoomFit => self.fit_everything(),
            ViewAction::ZoomSelected => {
                let areas = self.selection.iter().filter_map(|item| diagram.rect(item));
                if let Some(area) = areas.reduce(Rect::union) {
                    self.fit_area(area);
                }
            }
        }
    }
}
