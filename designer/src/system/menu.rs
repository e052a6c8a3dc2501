//! The menu at the pointer, and what an empty drawing says.

use eframe::egui::{self, Pos2};

use crate::commands::Command;
use crate::desk::Desk;
use crate::item::Item;
use crate::system::SystemView;
use crate::system::quick::Quick;

impl SystemView {
    pub(super) fn show_menu(
        &mut self,
        ui: &mut egui::Ui,
        desk: &mut Desk,
        of: Option<&Item>,
        at: Pos2,
    ) {
        use Command as C;
        ui.set_min_width(170.0);
        let commands: &[C] = match of {
            Some(Item::Component(_)) => &[
                C::Properties,
                C::Rename,
                C::Link,
                C::Copy,
                C::Cut,
                C::Duplicate,
                C::Group,
                C::Delete,
            ],
            Some(Item::Link { .. }) => &[C::Properties, C::Delete],
            Some(_) => &[C::Properties, C::Copy, C::Duplicate, C::Delete],
            None => &[C::Paste, C::Note, C::SelectAll, C::Arrange, C::ZoomFit],
        };
        if of.is_none() && ui.button("Add a component..").clicked() {
            self.quick = Some(Quick::to_add(desk, at));
            ui.close();
        }
        for command in commands {
            let may = self.may_run(*command, desk).unwrap_or(false);
            desk.offer(ui, *command, may);
        }
    }

    /// Three steps to begin with, where there is nothing yet.
    pub(super) fn empty_hint(&self, ui: &egui::Ui, desk: &Desk) {
        if !self.drawing.diagram.nodes.is_empty() {
            return;
        }
        let text = if desk.project.is_broken() || desk.project.configuration().is_none() {
            "The file cannot be drawn: the problems below say why."
        } else {
            "Drag a component here from the list at the left, or press A.\n\
             Drag from an output to an input to link them.\n\
             Double-click a block to edit its properties."
        };
        self.canvas.hint(ui, text);
    }
}
