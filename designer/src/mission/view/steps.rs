//! Opening and folding the steps of routes.

use std::collections::BTreeSet;

use super::state::{MissionView, mission_of};
use crate::item::Item;
use crate::mission::drawing::foldable_steps;
use crate::workspace::Workspace;

impl MissionView {
    /// The steps that are selected, or that what is selected is derived from.
    pub(super) fn selected_steps(&self, workspace: &Workspace) -> BTreeSet<Item> {
        let mission = mission_of(workspace).filter(|_| !self.pane.canvas.selection.is_empty());
        mission.map(|it| foldable_steps(it, &self.pane.selected())).unwrap_or_default()
    }

    /// Opens steps of routes if one of them is folded, otherwise folds them all.
    pub(super) fn toggle_steps(&mut self, steps: &BTreeSet<Item>, workspace: &Workspace) {
        if steps.is_subset(&self.opened) {
            self.opened.retain(|step| !steps.contains(step));
        } else {
            self.opened.extend(steps);
        }
        self.pane.select_when_drawn(steps.iter().copied());
        self.pane.canvas.fit_again();
        self.update(workspace, self.was_dark());
    }

    /// Opens the step that hides an item.
    pub(super) fn open_step_of(&mut self, item: Item, workspace: &Workspace) {
        let is_inside = matches!(item, Item::Place(_) | Item::Transition(_) | Item::Arc { .. });
        if let Some(mission) = mission_of(workspace).filter(|_| is_inside) {
            self.opened.extend(foldable_steps(mission, &[item].into()));
        }
    }
}
