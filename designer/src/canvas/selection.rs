//! What is selected in a drawing.

use std::collections::HashSet;

use crate::canvas::diagram::DiagramId;

/// A set that remembers in which order its ids were added.
#[derive(Clone, Debug)]
pub struct Selection<Id> {
    ids: HashSet<Id>,
    order: Vec<Id>,
}

impl<Id: DiagramId> Selection<Id> {
    /// Returns whether an id is selected.
    pub fn contains(&self, id: Id) -> bool {
        self.ids.contains(&id)
    }

    /// Adds an id; returns whether it was not selected before.
    pub fn insert(&mut self, id: Id) -> bool {
        let is_new = self.ids.insert(id);
        if is_new {
            self.order.push(id);
        }
        is_new
    }

    /// Removes an id; returns whether it was selected.
    pub fn remove(&mut self, id: Id) -> bool {
        let was_selected = self.ids.remove(&id);
        if was_selected {
            self.order.retain(|other| *other != id);
        }
        was_selected
    }

    /// Keeps only the ids that pass.
    pub fn retain(&mut self, mut is_kept: impl FnMut(Id) -> bool) {
        self.order.retain(|id| is_kept(*id));
        self.ids = self.order.iter().copied().collect();
    }

    /// Selects nothing.
    pub fn clear(&mut self) {
        self.ids.clear();
        self.order.clear();
    }

    /// Returns how many ids are selected.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Returns whether nothing is selected.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Returns the ids in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = Id> {
        self.order.iter().copied()
    }

    /// Returns the id that is selected, if it is exactly one.
    pub fn only(&self) -> Option<Id> {
        match self.order[..] {
            [id] => Some(id),
            _ => None,
        }
    }
}

impl<Id> Default for Selection<Id> {
    fn default() -> Self {
        Self { ids: HashSet::new(), order: Vec::new() }
    }
}

/// The order does not matter.
impl<Id: DiagramId> PartialEq for Selection<Id> {
    fn eq(&self, other: &Self) -> bool {
        self.ids == other.ids
    }
}

impl<Id: DiagramId> Extend<Id> for Selection<Id> {
    fn extend<Ids: IntoIterator<Item = Id>>(&mut self, ids: Ids) {
        ids.into_iter().for_each(|id| {
            self.insert(id);
        });
    }
}

impl<Id: DiagramId> FromIterator<Id> for Selection<Id> {
    fn from_iter<Ids: IntoIterator<Item = Id>>(ids: Ids) -> Self {
        let mut selection = Self::default();
        selection.extend(ids);
        selection
    }
}

impl<Id: DiagramId, const N: usize> From<[Id; N]> for Selection<Id> {
    fn from(ids: [Id; N]) -> Self {
        ids.into_iter().collect()
    }
}
