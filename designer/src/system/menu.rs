//! The menu at the pointer, and what an empty drawing states.

use eframe::egui::{self, Pos2};

use super::choices::SystemPicker;
use super::state::SystemView;
use crate::diagram_pane::{DECORATION_MENU, EMPTY_MENU, GROUP_MENU, NODE_MENU, WIRE_MENU};
use crate::item::Item;
use crate::workspace::Workspace;

impl SystemView {
    pub(super) fn show_menu(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        of: Option<Item>,
        at: Pos2,
    ) {
        ui.set_min_width(170.0);
        let commands = match of {
            Some(Item::Component(_)) => NODE_MENU,
            Some(Item::Link { .. }) => WIRE_MENU,
            Some(_) if self.selected_group().is_some() => GROUP_MENU,
            Some(_) => DECORATION_MENU,
            None => EMPTY_MENU,
        };
        if of.is_none() && ui.button("Add a component…").clicked() {
            self.picker = Some(SystemPicker::to_add(workspace, at));
            ui.close();
        }
        for command in commands {
            let may = self.can_run(*command, workspace).unwrap_or(false);
            workspace.offer_command(ui, *command, may);
        }
    }

    /// Three steps to begin with, where there is nothing yet.
    pub(super) fn show_empty_hint(&self, ui: &egui::Ui, workspace: &Workspace) {
        if !self.drawing.diagram.nodes.is_empty() {
            return;
        }
        let text = if workspace.project.is_broken() || workspace.project.configuration().is_none() {
            "The file cannot be drawn. The problems below show why."
        } else {
            "Drag a component from the list on the left, or press A.\n\
             Drag from an output to an input to link them.\n\
             Double-click a block to edit its properties."
        };
        self.pane.canvas.show_hint(ui, text);
    }
}
