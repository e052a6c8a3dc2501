//! What ends the steps of a route early, `<otherwise>`, in the file.

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named, NewElement};

use crate::project::Refused;

/// What ends a step of a new route early.
const NEW_EXITS: &str = "lost-link blocked late";

/// Adds how a new route ends early: at the nearest rally point, or in the safe place while the map has none.
///
/// # Errors
/// If there is no such route.
pub fn add_exits(document: &mut Document, route: &str) -> Result<(), Refused> {
    let map = document.find(Named::Map).and_then(|path| document.tree().element(&path));
    let has_rally =
        map.into_iter().flat_map(Element::elements).any(|element| element.name == "rally");
    let path = path_of(document, route)?;
    let count = document.tree().element(&path).into_iter().flat_map(Element::elements).count();
    let target = if has_rally { "rally" } else { "hold" };
    let exits = NewElement::new("otherwise").attribute("on", NEW_EXITS).attribute("do", target);
    Ok(document.insert_element(&path, count, &exits)?)
}

/// Sets an attribute of an exit of a route, by its number; without a value it goes.
///
/// # Errors
/// If there is no such exit, or the file does not allow it.
pub fn set_exit(
    document: &mut Document,
    route: &str,
    number: usize,
    attribute: &str,
    value: Option<&str>,
) -> Result<(), Refused> {
    let mut path = path_of(document, route)?;
    let children = document.tree().element(&path).into_iter().flat_map(Element::elements);
    let exits = children.enumerate().filter(|(_, child)| child.name == "otherwise");
    let place = exits.map(|(place, _)| place).nth(number);
    let missing = || Refused::Rule(format!("route {route} has no exit {}", number + 1));
    path.push(place.ok_or_else(missing)?);
    Ok(document.set_attribute_at(&path, attribute, value)?)
}

fn path_of(document: &Document, route: &str) -> Result<Vec<usize>, Refused> {
    let missing = || Refused::Rule(format!("there is no route {route} in the file"));
    document.find(Named::Route(route)).ok_or_else(missing)
}
