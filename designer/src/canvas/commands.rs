//! The commands about how a drawing is looked at, which are the same in every view.

use eframe::egui::Rect;

use super::{Canvas, Diagram};
use crate::commands::Command;
use crate::item::Item;

impl Canvas {
    /// Carries out a command about the looking; others are left to the view.
    pub fn run(&mut self, command: Command, diagram: &Diagram) {
        match command {
            Command::SelectAll => {
                let nodes = diagram.nodes.iter().map(|node| &node.item);
                let rest = diagram.decorations.iter().map(|decoration| &decoration.item);
                self.selection = nodes.chain(rest).cloned().collect();
            }
            Command::SelectNone => {
                let was_busy = self.cancel();
                if !was_busy {
                    self.selection.clear();
                }
            }
            Command::ZoomIn => self.zoom_by(1.25),
            Command::ZoomOut => self.zoom_by(0.8),
            Command::ZoomActual => self.viewport.zoom = 1.0,
            Command::ZoomFit => self.fit_everything(),
            Command::ZoomSelected => {
                let areas = self.selection.iter().filter_map(|item| diagram.rect(item));
                if let Some(area) = areas.reduce(Rect::union) {
                    self.fit_area(area);
                }
            }
            _ => {}
        }
    }

    /// What is selected, if it is one thing.
    pub fn only(&self) -> Option<&Item> {
        let mut selected = self.selection.iter();
        selected.next().filter(|_| selected.next().is_none())
    }
}
