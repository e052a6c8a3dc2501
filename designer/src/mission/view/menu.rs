//! The menu at the pointer, and what an empty drawing says.

use eframe::egui::{self, Pos2};

use super::MissionView;
use super::quick::Quick;
use crate::commands::Command;
use crate::desk::Desk;
use crate::item::Item;
use crate::mission::changes::Change;

impl MissionView {
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
            Some(Item::Place(_) | Item::Transition(_)) => &[
                C::Properties,
                C::Rename,
                C::Link,
                C::Copy,
                C::Cut,
                C::Duplicate,
                C::Group,
                C::Delete,
            ],
            Some(Item::Arc { .. } | Item::Submission(_)) => &[C::Properties, C::Delete],
            Some(_) => &[C::Properties, C::Copy, C::Duplicate, C::Delete],
            None => &[C::Paste, C::Note, C::SelectAll, C::Arrange, C::ZoomFit, C::Simulate],
        };
        let is_still = self.simulator.is_none();
        if of.is_none() && is_still && ui.button("Add to the mission..").clicked() {
            self.quick = Some(Quick::to_add(desk, at));
            ui.close();
        }
        if let (Some(Item::Place(name)), true) = (of, is_still) {
            self.roles(ui, name, desk);
        }
        if let (Some(Item::Transition(name)), false) = (of, is_still) {
            let name = name.clone();
            if ui.button(format!("Fire {name}")).clicked() {
                self.fire(&name, desk);
                ui.close();
            }
        }
        for command in commands {
            let may = self.may_run(*command, desk).unwrap_or(false);
            desk.offer(ui, *command, may);
        }
    }

    /// What a place can be made, from its menu.
    fn roles(&mut self, ui: &mut egui::Ui, name: &str, desk: &mut Desk) {
        let item = Item::Place(name.to_owned());
        let roles = [
            ("Begin here", Change::Attribute(item, "initial", Some("true".into()))),
            ("Make it the goal", Change::Attribute(Item::Mission, "goal", Some(name.into()))),
            ("Make it the safe place", Change::Attribute(Item::Mission, "safe", Some(name.into()))),
        ];
        for (label, change) in roles {
            if ui.button(label).clicked() {
                self.make(vec![Ok(change)], desk);
                ui.close();
            }
        }
        ui.separator();
    }

    /// Three steps to begin with, where there is nothing yet.
    pub(super) fn empty_hint(&self, ui: &egui::Ui, desk: &Desk) {
        if !self.diagram.nodes.is_empty() {
            return;
        }
        let text = if desk.project.is_broken() || desk.project.configuration().is_none() {
            "The file cannot be drawn: the problems below say why."
        } else {
            "Drag a place here from the list at the left, or press A.\n\
             Drag from the handle at its right edge to another place: a transition joins them.\n\
             Say in its properties what the transition waits for."
        };
        self.canvas.hint(ui, text);
    }
}
