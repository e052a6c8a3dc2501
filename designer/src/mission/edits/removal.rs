//! Removes places, transitions and arcs with what depends on them, in a few edits for any number.

use std::collections::BTreeSet;

use armor_robotfile::mission::ArcKind;
use armor_robotfile::tree::Element;
use armor_robotfile::{Document, ElementEdit, Item as Named};

use super::{arcs, elements};
use crate::item::Item;
use crate::layout;
use crate::project::Refused;
use crate::view::View;

/// Removes places with their arcs and whatever else leads to them, transitions, arcs, variables,
/// and what is known by its number. What a check or a guard states of one of them is for a person
/// to change, and refuses.
///
/// # Errors
/// If one is not there or is still needed.
pub fn remove(document: &mut Document, items: &[Item]) -> Result<(), Refused> {
    document.edit_elements(&Gone::of(items).edits(document))?;
    let named = items.iter().filter_map(|item| match item {
        Item::Place(_) | Item::Transition(_) | Item::Variable(_) => item.named(),
        _ => None,
    });
    document.remove_all(&named.collect::<Vec<_>>())?;
    let numbered = items.iter().filter_map(|item| match item {
        Item::Submission(number) => Some((*number, "submission")),
        Item::Exclusive(number) => Some((*number, "exclusive")),
        Item::Check(number) => Some((*number, "check")),
        _ => None,
    });
    let paths = numbered.map(|(number, sort)| elements::numbered(document, sort, number));
    let paths = paths.map(|path| path.map(ElementEdit::Removal)).collect::<Result<Vec<_>, _>>()?;
    document.edit_elements(&paths)?;
    let decorations = items.iter().filter_map(|item| match item {
        Item::Decoration { number, .. } => Some(*number),
        _ => None,
    });
    layout::remove_decorations(document, View::Mission, decorations)
}

/// What is removed, by name.
#[derive(Default)]
struct Gone<'a> {
    places: BTreeSet<&'a str>,
    transitions: BTreeSet<&'a str>,
    /// Of a transition, to a place.
    arcs: BTreeSet<(&'a str, &'a str, ArcKind)>,
}

impl<'a> Gone<'a> {
    fn of(items: &'a [Item]) -> Self {
        let mut gone = Self::default();
        for item in items {
            match item {
                Item::Place(name) => _ = gone.places.insert(name.as_str()),
                Item::Transition(name) => _ = gone.transitions.insert(name.as_str()),
                Item::Arc { transition, place, kind } => {
                    gone.arcs.insert((transition.as_str(), place.as_str(), *kind));
                }
                _ => {}
            }
        }
        gone
    }

    /// What is to be changed in that which stays.
    fn edits(&self, document: &Document) -> Vec<ElementEdit> {
        let mission = document.find(Named::Mission).unwrap_or_default();
        let own = document.tree().element(&mission).map(|element| (mission, element));
        let mut edits = Vec::new();
        for (path, element) in own.into_iter().chain(elements::elements(document)) {
            let name = element.attribute("name").map_or("", |name| name.value.as_str());
            if element.name == "transition" {
                if self.transitions.contains(name) {
                    continue;
                }
                self.arcs_of(name, element, &path, &mut edits);
            }
            let named = elements::NAMES_A_PLACE.iter().filter(|attribute| {
                let given = element.attribute(attribute);
                given.is_some_and(|given| self.places.contains(given.value.as_str()))
            });
            edits.extend(named.map(|name| attribute(&path, name, None)));
        }
        edits
    }

    /// The arcs to remove of a transition that stays.
    fn arcs_of(
        &self,
        transition: &str,
        element: &Element,
        path: &[usize],
        edits: &mut Vec<ElementEdit>,
    ) {
        let goes = |place: &str, kind| {
            self.places.contains(place) || self.arcs.contains(&(transition, place, kind))
        };
        for kind in arcs::KINDS {
            let Some(list) = arcs::short_form(kind) else { continue };
            let Some(given) = element.attribute(list) else { continue };
            let all = given.value.split_ascii_whitespace();
            let left: Vec<_> = all.clone().filter(|place| !goes(place, kind)).collect();
            if left.len() < all.count() {
                let value = (!left.is_empty()).then(|| left.join(" "));
                edits.push(attribute(path, list, value));
            }
        }
        for (number, child) in element.elements().enumerate() {
            let is_gone = |kind| arcs::place_of(child, kind).is_some_and(|place| goes(place, kind));
            if arcs::KINDS.into_iter().any(is_gone) {
                edits.push(ElementEdit::Removal([path, &[number]].concat()));
            }
        }
    }
}

fn attribute(path: &[usize], name: &'static str, value: Option<String>) -> ElementEdit {
    ElementEdit::Attribute { path: path.to_vec(), name, value }
}
