//! The small list at the pointer, and what is done with what is picked from it.

use eframe::egui;

use super::choices::{SystemChoice, SystemPicker};
use super::edits;
use super::state::SystemView;
use crate::canvas::Direction;
use crate::item::Item;
use crate::panels::pick::Picked;
use crate::workspace::Workspace;

impl SystemView {
    pub(super) fn show_picker(&mut self, ui: &egui::Ui, workspace: &mut Workspace) {
        let Some(mut picker) = self.picker.take() else { return };
        let at = self.pane.canvas.to_window(picker.at);
        match picker.picker.show_at(ui, picker.name, at, &picker.entries) {
            Picked::Open => self.picker = Some(picker),
            Picked::One(pick) => self.take_choice(pick, &picker, workspace),
            Picked::Left => {}
        }
    }

    fn take_choice(
        &mut self,
        pick: SystemChoice,
        picker: &SystemPicker,
        workspace: &mut Workspace,
    ) {
        match pick {
            SystemChoice::Add(kind) => {
                self.add(&kind, picker.at, workspace);
            }
            SystemChoice::Join(from, to) => self.join(from, to, workspace),
            SystemChoice::AddLinked { kind, port } => {
                let Some((direction, data)) = &picker.from else { return };
                let mut added = None;
                let shown = self.unplaced();
                // One step: the component and its link.
                workspace.edit(format!("add {kind} to {data}"), |documents| {
                    edits::place(documents, &shown)?;
                    let name = edits::add_component(documents, &kind, picker.at)?;
                    let own = format!("{name}.{port}");
                    if *direction == Direction::Out {
                        edits::join(documents, data, &own)?;
                    } else {
                        edits::join(documents, &own, data)?;
                    }
                    added = Some(name);
                    Ok(())
                });
                self.pane.select_when_drawn(added.map(Item::component));
            }
        }
    }
}
