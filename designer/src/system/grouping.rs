//! Folding and unfolding the selected group, and what a folded group stands for.

use std::collections::BTreeSet;

use eframe::egui;

use super::edits;
use super::state::SystemView;
use crate::commands::{Command, about};
use crate::item::Item;
use crate::layout;
use crate::view::View;
use crate::workspace::Workspace;

impl SystemView {
    /// The number of the selected group, and whether it is folded; none of a note.
    pub(super) fn selected_group(&self) -> Option<(usize, bool)> {
        let item @ Item::Decoration { number, .. } = self.pane.only()? else { return None };
        let diagram = &self.drawing.diagram;
        let is_folded = diagram.node(item).is_some();
        let is_group = diagram.decorations.iter().any(|it| it.item == item && !it.is_note);
        (is_folded || is_group).then_some((number, is_folded))
    }

    /// Folds the selected group, or unfolds it.
    pub(super) fn toggle_fold(&mut self, workspace: &mut Workspace) {
        let Some((number, is_folded)) = self.selected_group() else { return };
        let item = Item::Decoration { view: View::System, number };
        let mut new = None;
        if is_folded {
            workspace.edit("unfold the group", |documents| {
                new = Some(layout::unfold(documents.system()?, number)?);
                Ok(())
            });
        } else {
            let inside = self.inside(item);
            let mut members: Vec<_> = inside.iter().filter_map(component_name).collect();
            members.sort();
            if members.is_empty()
                && !inside.iter().any(|item| self.drawing.diagram.node(*item).is_some())
            {
                workspace.messages.warn("Not folded: there is no component in the group.");
                return;
            }
            let inner: Vec<_> = inside.iter().filter_map(decoration_number).collect();
            let shown = self.unplaced();
            workspace.edit("fold the group", |documents| {
                edits::place(documents, &shown)?;
                new = Some(layout::fold(documents.system()?, number, &members, &inner)?);
                Ok(())
            });
        }
        let item = new.map(|number| Item::Decoration { view: View::System, number });
        self.pane.select_when_drawn(item);
    }

    /// What is wholly within a group that is not folded.
    fn inside(&self, group: Item) -> Vec<Item> {
        let diagram = &self.drawing.diagram;
        let Some(area) = diagram.rect(group) else { return Vec::new() };
        let nodes = diagram.nodes.iter().filter(|node| area.contains_rect(node.rect));
        let inner = diagram.decorations.iter().filter(|it| it.item != group);
        let inner = inner.filter(|it| area.contains_rect(it.rect));
        nodes.map(|node| node.item).chain(inner.map(|it| it.item)).collect()
    }

    /// What is selected, with what the selected folded groups hide.
    pub(super) fn selected_with_hidden(&self) -> BTreeSet<Item> {
        let mut selected = self.pane.selected();
        let within = self.drawing.hidden.within.iter();
        let hidden = within.filter(|(_, group)| selected.contains(group)).map(|(item, _)| *item);
        let hidden: Vec<_> = hidden.collect();
        selected.extend(hidden);
        selected
    }

    /// The item of the drawing that shows an item: the folded group that hides it, or itself.
    pub(super) fn shown_item(&self, item: Item) -> Item {
        self.drawing.hidden.within.get(&item).copied().unwrap_or(item)
    }

    /// The components of a selected group, and the button that folds or unfolds it.
    pub(super) fn show_fold_button(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let Some((number, is_folded)) = self.selected_group() else { return };
        let item = Item::Decoration { view: View::System, number };
        let entry = about(Command::Fold);
        let keys = entry.keys.map(|keys| ui.ctx().format_shortcut(&keys)).unwrap_or_default();
        let name = if is_folded { "Unfold" } else { "Fold" };
        let button = egui::Button::new(name).shortcut_text(keys);
        if ui.add(button).on_hover_text(entry.doc).clicked() {
            workspace.order_command(Command::Fold);
        }
        let members: Vec<_> = if is_folded {
            let within = self.drawing.hidden.within.iter();
            within.filter(|(_, group)| **group == item).map(|(item, _)| *item).collect()
        } else {
            self.inside(item)
        };
        let names = members.iter().filter_map(component_name).collect::<Vec<_>>().join(", ");
        if !names.is_empty() {
            ui.weak(format!("In it: {names}"));
        }
    }
}

fn component_name(item: &Item) -> Option<String> {
    match item {
        Item::Component(name) => Some(name.to_string()),
        _ => None,
    }
}

fn decoration_number(item: &Item) -> Option<usize> {
    match item {
        Item::Decoration { number, .. } => Some(*number),
        _ => None,
    }
}
