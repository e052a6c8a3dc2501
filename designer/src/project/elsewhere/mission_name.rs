//! The name of a sub-mission precedes the names of its places and transitions in the missions that
//! include it. Another name may change those of its siblings, too: the second `dock` is `dock-2`.

use std::path::Path;

use super::references::FileReferences;
use super::{NameChange, item_name};
use crate::item::Item;
use crate::project::Project;

/// Names of places or transitions that are only in use between two names.
const BETWEEN: &str = "renamed-meanwhile";

impl Project {
    /// Returns how the qualified names change in the file at `path` when the mission at `inner`,
    /// whose names are given before and after, is renamed.
    pub(super) fn mission_renames(
        &self,
        path: &Path,
        inner: &Path,
        [old, new]: [Option<&str>; 2],
        references: &mut FileReferences<'_>,
    ) -> Vec<NameChange> {
        let Some(document) = self.current_document(path) else { return Vec::new() };
        references.set_name(inner, old);
        let before = references.inclusions(path, inner);
        references.set_name(inner, new);
        let after = references.inclusions(path, inner);
        let mut renames = Vec::new();
        for (old, new) in before.iter().zip(&after).filter(|(old, new)| old.prefix != new.prefix) {
            for item in self.items_of(&old.file) {
                let qualified = |prefix: &str| match item {
                    Item::Place(name) => Item::place(format!("{prefix}.{name}")),
                    Item::Transition(name) => Item::transition(format!("{prefix}.{name}")),
                    other => other,
                };
                let from = qualified(&old.prefix);
                let is_named = |named| !document.mentions(named).is_empty();
                if let Some(to) = item_name(qualified(&new.prefix))
                    && from.named().is_some_and(is_named)
                {
                    renames.push((from, to.to_owned()));
                }
            }
        }
        in_order(renames)
    }

    /// The places and transitions of a file.
    fn items_of(&self, path: &Path) -> Vec<Item> {
        let Some(document) = self.current_document(path) else { return Vec::new() };
        let mission = document.find(armor_robotfile::Item::Mission);
        let Some(mission) = mission.and_then(|at| document.tree().element(&at)) else {
            return Vec::new();
        };
        let items = mission.elements().filter_map(|element| {
            let name = &element.attribute("name")?.value;
            match element.name.as_str() {
                "place" => Some(Item::place(name)),
                "transition" => Some(Item::transition(name)),
                _ => None,
            }
        });
        items.collect()
    }
}

/// Renames in an order in which no new name is still another item's. Those that exchange names have
/// a name between.
fn in_order(mut renames: Vec<(Item, String)>) -> Vec<NameChange> {
    let mut ordered = Vec::new();
    while !renames.is_empty() {
        let is_free = |to: &String| renames.iter().all(|(from, _)| item_name(*from) != Some(to));
        let next = renames.iter().position(|(_, to)| is_free(to));
        let (item, new) = match next {
            Some(next) => renames.remove(next),
            None => {
                let (item, new) = renames.remove(0);
                let between = format!("{BETWEEN}.n{}", ordered.len());
                let with = match item {
                    Item::Place(_) => Item::place(&between),
                    _ => Item::transition(&between),
                };
                renames.push((with, new));
                (item, between)
            }
        };
        ordered.push(NameChange::Rename { item, new });
    }
    ordered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_is_given_while_another_item_has_it() {
        let check = |renames: &[(&str, &str)], expected: &[(&str, &str)]| {
            let renames = renames.iter().map(|(from, to)| (Item::place(from), (*to).to_owned()));
            let ordered = in_order(renames.collect()).into_iter().map(|change| match change {
                NameChange::Rename { item, new } => (item_name(item).unwrap().to_owned(), new),
                other => panic!("{other:?}"),
            });
            let expected = expected.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned()));
            assert_eq!(ordered.collect::<Vec<_>>(), expected.collect::<Vec<_>>());
        };
        check(&[("b.p", "c.p"), ("a.p", "b.p")], &[("b.p", "c.p"), ("a.p", "b.p")]);
        check(&[("a.p", "b.p"), ("b.p", "c.p")], &[("b.p", "c.p"), ("a.p", "b.p")]);
        let between = format!("{BETWEEN}.n0");
        check(
            &[("a.p", "b.p"), ("b.p", "a.p")],
            &[("a.p", &between), ("b.p", "a.p"), (&between, "b.p")],
        );
    }
}
