//! What an edit reads from a file before it changes the file.

use armor_robotfile::mission::ArcKind;
use armor_robotfile::tree::Element;
use armor_robotfile::{Document, EditError, Item, NewElement};

use crate::fragment::Names;

/// Attributes of a mission's elements that name one place.
pub(super) const NAMES_A_PLACE: &[&str] =
    &["goal", "safe", "on-failure", "on-stop-fail", "on-start-fail", "overrun", "in", "out"];

/// Returns a name that nothing of this sort has: the preferred one, or that with a number appended.
pub fn free_name(document: &Document, sort: &str, preferred: &str) -> String {
    free(&mut names_of(document, sort), preferred)
}

/// The names that nothing new of a sort can be given.
pub fn names_of(document: &Document, sort: &str) -> Names {
    Names::new(names(document, sort))
}

/// A name like the preferred one, taken from then on.
pub fn free(names: &mut Names, preferred: &str) -> String {
    let stem = preferred.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('-');
    names.free(preferred, stem)
}

/// The names of the mission's elements of a sort.
pub(super) fn names<'a>(
    document: &'a Document,
    sort: &'a str,
) -> impl Iterator<Item = &'a str> + use<'a> {
    let of_sort = elements(document).filter(move |(_, element)| element.name == sort);
    of_sort.filter_map(|(_, element)| Some(element.attribute("name")?.value.as_str()))
}

/// The mission's elements with their paths.
pub(super) fn elements(document: &Document) -> impl Iterator<Item = (Vec<usize>, &Element)> {
    let mission = document.find(Item::Mission);
    let found = mission.and_then(|path| Some((document.tree().element(&path)?, path)));
    found.into_iter().flat_map(|(mission, path)| {
        mission.elements().enumerate().map(move |(number, element)| {
            let mut path = path.clone();
            path.push(number);
            (path, element)
        })
    })
}

/// The words of a list.
pub(super) fn list(document: &Document, item: Item<'_>, attribute: &str) -> Vec<String> {
    let element = document.find(item).and_then(|path| document.tree().element(&path));
    let value = element.and_then(|element| element.attribute(attribute));
    let words = value.map(|value| value.value.split_ascii_whitespace().map(str::to_owned));
    words.into_iter().flatten().collect()
}

/// The parameters of a component that a place gives values.
pub(super) fn place_parameters(document: &Document, place: &str, component: &str) -> Vec<String> {
    let path = document.find(Item::Place(place));
    let element = path.and_then(|path| document.tree().element(&path));
    let given = element.into_iter().flat_map(Element::elements).filter(|given| {
        given.name == "parameter"
            && given.attribute("component").is_some_and(|named| named.value == component)
    });
    given.filter_map(|given| Some(given.attribute("name")?.value.clone())).collect()
}

/// The path of the exclusive set, check or sub-mission of this number.
pub(super) fn numbered(
    document: &Document,
    sort: &str,
    number: usize,
) -> Result<Vec<usize>, EditError> {
    let mut of_sort = elements(document).filter(|(_, element)| element.name == sort);
    of_sort.nth(number).map(|(path, _)| path).ok_or(EditError::NoElement)
}

/// Gives a list of names, or removes the attribute if there is none.
pub fn set_list(
    document: &mut Document,
    item: Item<'_>,
    attribute: &str,
    names: &[&str],
) -> Result<(), EditError> {
    let text = names.join(" ");
    document.set_attribute(item, attribute, (!names.is_empty()).then_some(text.as_str()))
}

/// The element of an arc, and its attribute that names the place.
pub(super) fn arc_names(kind: ArcKind) -> (&'static str, &'static str) {
    match kind {
        ArcKind::Take => ("arc", "from"),
        ArcKind::Put => ("arc", "to"),
        ArcKind::Read => ("read", "place"),
        ArcKind::Inhibitor => ("inhibitor", "place"),
        ArcKind::Reset => ("reset", "place"),
    }
}

/// The element of a new arc that the short form cannot express.
pub(super) fn new_arc(kind: ArcKind, place: &str, weight: u32) -> NewElement {
    let (name, attribute) = arc_names(kind);
    let arc = NewElement::new(name).attribute(attribute, place);
    if weight > 1 { arc.attribute("weight", weight.to_string()) } else { arc }
}
