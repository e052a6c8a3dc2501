//! The menu at the pointer, and what an empty drawing states.

use eframe::egui::{self, Pos2};

use super::choices::MissionPicker;
use super::state::{MissionView, mission_of};
use crate::commands::Command;
use crate::diagram_pane::{DECORATION_MENU, EMPTY_MENU, NODE_MENU, WIRE_MENU};
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::derived::is_derived;
use crate::name::ItemName;
use crate::workspace::Workspace;

impl MissionView {
    pub(super) fn show_menu(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        of: Option<Item>,
        at: Pos2,
    ) {
        ui.set_min_width(170.0);
        let commands = match of {
            Some(Item::Place(_) | Item::Transition(_)) => NODE_MENU,
            Some(Item::Arc { .. } | Item::Submission(_)) => WIRE_MENU,
            Some(Item::Step { .. }) => &[Command::Fold, Command::Properties],
            Some(_) => DECORATION_MENU,
            None => EMPTY_MENU,
        };
        let simulate: &[Command] = if of.is_none() { &[Command::Simulate] } else { &[] };
        let is_still = self.simulator.is_none();
        if of.is_none() && is_still && ui.button("Add to the mission…").clicked() {
            self.picker = Some(MissionPicker::to_add(workspace, at));
            ui.close();
        }
        let is_own =
            |name: &str| mission_of(workspace).is_some_and(|mission| !is_derived(mission, name));
        if let (Some(Item::Place(name)), true) = (of, is_still)
            && is_own(&name)
        {
            self.show_roles(ui, name, workspace);
        }
        if let (Some(Item::Transition(name)), false) = (of, is_still)
            && ui.button(format!("Fire {name}")).clicked()
        {
            self.fire(&name, workspace);
            ui.close();
        }
        for command in commands.iter().chain(simulate) {
            let may = self.can_run(*command, workspace).unwrap_or(false);
            workspace.offer_command(ui, *command, may);
        }
    }

    /// The roles that the menu of a place offers.
    fn show_roles(&mut self, ui: &mut egui::Ui, name: ItemName, workspace: &mut Workspace) {
        let item = Item::Place(name);
        let roles = [
            ("Begin here", Change::Attribute(item, "initial", Some("true".into()))),
            ("Make it the goal", Change::Attribute(Item::Mission, "goal", Some(name.to_string()))),
            (
                "Make it the safe place",
                Change::Attribute(Item::Mission, "safe", Some(name.to_string())),
            ),
        ];
        for (label, change) in roles {
            if ui.button(label).clicked() {
                self.make(vec![Ok(change)], workspace);
                ui.close();
            }
        }
        ui.separator();
    }

    /// Three steps to begin with, where there is nothing yet.
    pub(super) fn show_empty_hint(&self, ui: &egui::Ui, workspace: &Workspace) {
        if !self.diagram.nodes.is_empty() {
            return;
        }
        let text = if workspace.project.is_broken() || workspace.project.configuration().is_none() {
            "The file cannot be drawn. The problems below show why."
        } else {
            "Drag a place from the list on the left, or press A.\n\
             Drag from the handle at its right edge to another place: a transition connects them.\n\
             Set in its properties what the transition waits for."
        };
        self.pane.canvas.show_hint(ui, text);
    }
}
