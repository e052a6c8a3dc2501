//! Arcs: in the short form `from`/`to` while their weight is 1, else as child elements.

use armor_robotfile::mission::ArcKind;
use armor_robotfile::tree::Element;
use armor_robotfile::{Document, EditError, Item};

use super::elements::{self, new_arc, set_list};

pub(super) const KINDS: [ArcKind; 5] =
    [ArcKind::Take, ArcKind::Put, ArcKind::Read, ArcKind::Inhibitor, ArcKind::Reset];

/// Where an arc stands in the file.
enum Place {
    /// In the list `from` or `to`.
    Listed(&'static str),
    /// As the child element at this path.
    Child(Vec<usize>),
}

/// Adds an arc of weight 1.
pub fn add_arc(
    document: &mut Document,
    transition: &str,
    place: &str,
    kind: ArcKind,
) -> Result<(), EditError> {
    match short_form(kind) {
        Some(list) => {
            let mut names = elements::list(document, Item::Transition(transition), list);
            names.push(place.to_owned());
            let names: Vec<_> = names.iter().map(String::as_str).collect();
            set_list(document, Item::Transition(transition), list, &names)
        }
        None => add_child(document, transition, place, kind, 1),
    }
}

/// Removes an arc; without effect if there is none.
pub fn remove_arc(
    document: &mut Document,
    transition: &str,
    place: &str,
    kind: ArcKind,
) -> Result<(), EditError> {
    match find(document, transition, place, kind) {
        None => Ok(()),
        Some(Place::Child(path)) => document.remove_element(&path),
        Some(Place::Listed(list)) => unlist(document, transition, place, list),
    }
}

/// Gives an arc a weight.
pub fn set_weight(
    document: &mut Document,
    transition: &str,
    place: &str,
    kind: ArcKind,
    weight: u32,
) -> Result<(), EditError> {
    match find(document, transition, place, kind) {
        Some(Place::Listed(list)) if weight > 1 => {
            unlist(document, transition, place, list)?;
            add_child(document, transition, place, kind, weight)
        }
        Some(Place::Child(path)) => {
            let text = weight.to_string();
            let value = (weight > 1).then_some(text.as_str());
            document.set_attribute_at(&path, "weight", value)
        }
        _ => Ok(()),
    }
}

/// Makes an arc one of another kind between the same two, with the same weight where it can.
pub fn set_arc_kind(
    document: &mut Document,
    transition: &str,
    place: &str,
    from: ArcKind,
    to: ArcKind,
) -> Result<(), EditError> {
    let weight = weight(document, transition, place, from);
    remove_arc(document, transition, place, from)?;
    add_arc(document, transition, place, to)?;
    if to == ArcKind::Reset { Ok(()) } else { set_weight(document, transition, place, to, weight) }
}

/// Leads an arc from one transition and place to others, with the same weight.
pub fn lead_arc(
    document: &mut Document,
    (transition, place): (&str, &str),
    (new_transition, new_place): (&str, &str),
    kind: ArcKind,
) -> Result<(), EditError> {
    let weight = weight(document, transition, place, kind);
    remove_arc(document, transition, place, kind)?;
    add_arc(document, new_transition, new_place, kind)?;
    set_weight(document, new_transition, new_place, kind, weight)
}

fn weight(document: &Document, transition: &str, place: &str, kind: ArcKind) -> u32 {
    let Some(Place::Child(path)) = find(document, transition, place, kind) else { return 1 };
    let element = document.tree().element(&path);
    let weight = element.and_then(|element| element.attribute("weight"));
    weight.and_then(|weight| weight.value.trim().parse().ok()).unwrap_or(1)
}

/// The path of the element that an arc has of its own, if it has one.
pub fn arc_element(
    document: &Document,
    transition: &str,
    place: &str,
    kind: ArcKind,
) -> Option<Vec<usize>> {
    match find(document, transition, place, kind)? {
        Place::Child(path) => Some(path),
        Place::Listed(_) => None,
    }
}

/// The list of a transition that may hold an arc.
pub(super) fn short_form(kind: ArcKind) -> Option<&'static str> {
    match kind {
        ArcKind::Take => Some("from"),
        ArcKind::Put => Some("to"),
        ArcKind::Read | ArcKind::Inhibitor | ArcKind::Reset => None,
    }
}

fn find(document: &Document, transition: &str, place: &str, kind: ArcKind) -> Option<Place> {
    if let Some(list) = short_form(kind)
        && elements::list(document, Item::Transition(transition), list).iter().any(|n| n == place)
    {
        return Some(Place::Listed(list));
    }
    let mut path = document.find(Item::Transition(transition))?;
    let element = document.tree().element(&path)?;
    path.push(element.elements().position(|child| is_arc(child, place, kind))?);
    Some(Place::Child(path))
}

fn is_arc(element: &Element, place: &str, kind: ArcKind) -> bool {
    place_of(element, kind) == Some(place)
}

/// The place of an element that is an arc of this kind.
pub(super) fn place_of(element: &Element, kind: ArcKind) -> Option<&str> {
    let (name, attribute) = elements::arc_names(kind);
    let given = element.attribute(attribute).filter(|_| element.name == name)?;
    Some(&given.value)
}

fn unlist(
    document: &mut Document,
    transition: &str,
    place: &str,
    list: &str,
) -> Result<(), EditError> {
    let names = elements::list(document, Item::Transition(transition), list);
    let left: Vec<_> = names.iter().map(String::as_str).filter(|name| *name != place).collect();
    set_list(document, Item::Transition(transition), list, &left)
}

fn add_child(
    document: &mut Document,
    transition: &str,
    place: &str,
    kind: ArcKind,
    weight: u32,
) -> Result<(), EditError> {
    let path = document.find(Item::Transition(transition)).ok_or(EditError::NoElement)?;
    let count = document.tree().element(&path).map_or(0, |element| element.elements().count());
    document.insert_element(&path, count, &new_arc(kind, place, weight))
}
