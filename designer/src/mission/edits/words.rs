//! What an edit reads of a file before it changes it.

use armor_missions::tree::{Element, Node};
use armor_missions::{Document, Item, NewElement};

/// Attributes of a mission's elements that name one place.
const NAMES_A_PLACE: &[&str] =
    &["goal", "safe", "on-failure", "on-stop-fail", "on-start-fail", "overrun", "in", "out"];

/// A name that nothing of this sort has: the wish, or the wish with a number behind it.
pub fn free_name(document: &Document, sort: &str, wish: &str) -> String {
    let known: Vec<_> = names(document, sort).collect();
    let is_free = |name: &str| !known.contains(&name);
    if is_free(wish) {
        return wish.to_owned();
    }
    let stem = wish.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('-');
    // One more than there are names is free at the latest.
    let numbered = (2..known.len() + 3).map(|number| format!("{stem}-{number}"));
    numbered.into_iter().find(|name| is_free(name)).unwrap_or_else(|| wish.to_owned())
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

/// The attributes that name a place, other than as an arc, each with the path of its element.
pub(super) fn naming(document: &Document, place: &str) -> Vec<(&'static str, Vec<usize>)> {
    let mission = document.find(Item::Mission).unwrap_or_default();
    let own = document.tree().element(&mission).map(|element| (mission, element));
    let all = own.into_iter().chain(elements(document));
    let mut found = Vec::new();
    for (path, element) in all {
        for name in NAMES_A_PLACE {
            if element.attribute(name).is_some_and(|attribute| attribute.value == place) {
                found.push((*name, path.clone()));
            }
        }
    }
    found
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

/// An element of a file as a new one.
pub fn same_element(element: &Element) -> NewElement {
    copied(element, &|_, value| value.to_owned())
}

/// The same with another value for one of its attributes.
pub fn renamed_element(element: &Element, attribute: &str, value: &str) -> NewElement {
    copied(element, &|name, old| if name == attribute { value } else { old }.to_owned())
}

fn copied(element: &Element, change: &dyn Fn(&str, &str) -> String) -> NewElement {
    let mut new = NewElement::new(element.name.as_str());
    for attribute in element.attributes.iter().filter(|a| !a.name.contains(':')) {
        new = new.attribute(attribute.name.as_str(), change(&attribute.name, &attribute.value));
    }
    for node in &element.children {
        if let Node::Element(child) = node {
            new = new.child(copied(child, &|_, value| value.to_owned()));
        }
    }
    let (text, _) = element.text();
    if text.is_empty() { new } else { new.text(text) }
}
