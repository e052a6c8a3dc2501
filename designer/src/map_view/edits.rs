//! The changes of the map in the file, without a window; those of its routes are in `edits/`. Each
//! function is one edit, or a few that the caller makes as one step of the history.

mod exits;
mod routes;

use std::collections::{BTreeMap, BTreeSet};

use armor_geo::{MapPlacement, MapPoint};
use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::tree::Element;
use armor_robotfile::{Document, EditError, ElementEdit, Item as Named, Mission, NewElement};

use crate::item::Item;
use crate::map_view::corner::Corner;
use crate::map_view::position_text::{PositionStyle, ShapeText, is_geographic};
use crate::project::Refused;
pub use exits::{add_exits, set_exit};
pub use routes::{
    NewRoute, PathEnd, add_leg, add_meeting, add_path, add_route, add_stay, append_steps,
    ensure_ends, names_of_steps,
};

/// The code of a new symbol: a friend's unit on land.
const NEW_SYMBOL: &str = "10031000001211000000";

/// The map of the file, which gets one if it has none.
///
/// # Errors
/// If it cannot be added.
pub fn map_of(document: &mut Document) -> Result<Vec<usize>, Refused> {
    if document.find(Named::Map).is_none() {
        document.add(Named::Map, &[])?;
    }
    document.find(Named::Map).ok_or(Refused::Absent { what: "<map>" })
}

/// Adds a point or a rally point; returns its name.
///
/// # Errors
/// If the file does not allow it.
pub fn add_point(document: &mut Document, is_rally: bool, at: &str) -> Result<String, Refused> {
    map_of(document)?;
    let name = free_name(document, if is_rally { "R" } else { "P" });
    let item = if is_rally { Named::Rally(&name) } else { Named::MapPoint(&name) };
    document.add(item, &[("at", at)])?;
    Ok(name)
}

/// Adds a zone or a line of a kind; returns its name.
///
/// # Errors
/// If the file does not allow it.
pub fn add_area(
    document: &mut Document,
    is_zone: bool,
    kind: &str,
    shape: &str,
) -> Result<String, Refused> {
    map_of(document)?;
    let name = free_name(document, if is_zone { "zone" } else { "line" });
    let mut attributes = vec![("kind", kind), ("shape", shape)];
    if is_zone && kind == "speed" {
        attributes.push(("speed", "0.5m/s"));
    }
    let item = if is_zone { Named::Zone(&name) } else { Named::MapLine(&name) };
    document.add(item, &attributes)?;
    Ok(name)
}

/// Adds a symbol; returns its number.
///
/// # Errors
/// If the file does not allow it.
pub fn add_symbol(document: &mut Document, at: &str) -> Result<usize, Refused> {
    let path = map_of(document)?;
    let map = document.tree().element(&path).ok_or(EditError::NoElement)?;
    let children: Vec<&Element> = map.elements().collect();
    let number = children.iter().filter(|child| child.name == "symbol").count();
    let last = children.iter().rposition(|child| child.name == "symbol");
    let index = last.map_or(children.len(), |last| last + 1);
    let new = NewElement::new("symbol").attribute("at", at).attribute("sidc", NEW_SYMBOL);
    document.insert_element(&path, index, &new)?;
    Ok(number)
}

/// The names of everything on the map.
pub fn names_on_map(document: &Document) -> DrawnNames {
    let path = document.find(Named::Map);
    DrawnNames::of(path.and_then(|path| document.tree().element(&path)))
}

/// Names that are taken, and further ones with a number behind a letter: `P1`, `l2`.
pub struct DrawnNames {
    taken: BTreeSet<String>,
    next: BTreeMap<String, usize>,
}

impl DrawnNames {
    fn of(parent: Option<&Element>) -> Self {
        let children = parent.into_iter().flat_map(Element::elements);
        let taken = children.filter_map(|child| Some(child.attribute("name")?.value.clone()));
        Self { taken: taken.collect(), next: BTreeMap::new() }
    }

    /// The preferred name if it is free, otherwise the stem with the first number that gives a free one.
    /// It is taken from then on.
    pub fn free(&mut self, preferred: &str, stem: &str) -> String {
        if self.taken.insert(preferred.to_owned()) {
            return preferred.to_owned();
        }
        let next = self.next.entry(stem.to_owned()).or_insert(1);
        loop {
            let name = format!("{stem}{next}");
            *next += 1;
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}

/// Puts positions of items elsewhere, each in the form in which it is written.
///
/// # Errors
/// If an item is not there, or its shape is not what is drawn.
pub fn place_corners(
    document: &mut Document,
    placement: Option<&MapPlacement>,
    placed: &[(Corner, MapPoint)],
) -> Result<(), Refused> {
    let mut edits: Vec<ElementEdit> = Vec::new();
    let mut done: Vec<Item> = Vec::new();
    for (corner, at) in placed {
        if done.contains(&corner.item) {
            continue;
        }
        done.push(corner.item);
        let path = path_of(document, corner.item)?;
        let element = document.tree().element(&path).ok_or(EditError::NoElement)?;
        let (name, value) = match element.attribute("shape") {
            Some(shape) => {
                let of_item = placed.iter().filter(|(other, _)| other.item == corner.item);
                ("shape", placed_shape(&shape.value, placement, of_item)?)
            }
            None => {
                let written = element.attribute("at").map_or("", |at| at.value.as_str());
                let style = style_of(is_geographic(written), placement);
                ("at", style.write(*at, " "))
            }
        };
        edits.push(ElementEdit::Attribute { path, name, value: Some(value) });
    }
    Ok(document.edit_elements(&edits)?)
}

fn placed_shape<'a>(
    text: &str,
    placement: Option<&MapPlacement>,
    placed: impl Iterator<Item = &'a (Corner, MapPoint)>,
) -> Result<String, Refused> {
    let mut text = text.to_owned();
    for (corner, at) in placed {
        let shape = ShapeText::new(&text);
        let changed = if shape.is_circle() && corner.number == 1 {
            shape.with_radius(circle_radius_m(&shape, placement, *at)?)
        } else {
            let style = style_of(shape.is_geographic(corner.number), placement);
            shape.with_corner(corner.number, &style.write(*at, ","))
        };
        text = changed.ok_or_else(no_such_corner)?;
    }
    Ok(text)
}

/// The radius of a circle whose boundary goes through a position.
fn circle_radius_m(
    shape: &ShapeText<'_>,
    placement: Option<&MapPlacement>,
    rim: MapPoint,
) -> Result<f64, Refused> {
    let centre = shape.corner_point(0, placement).ok_or_else(no_such_corner)?;
    let radius_m = centre.distance_m(rim);
    if radius_m < 1e-3 {
        return Err(Refused::Rule("a circle has a radius of at least a millimetre".into()));
    }
    Ok(radius_m)
}

/// Gives a zone or line one more corner, before corner `number`.
///
/// # Errors
/// If the item is not there, or has no such corners.
pub fn insert_corner(
    document: &mut Document,
    placement: Option<&MapPlacement>,
    corner: Corner,
    at: MapPoint,
) -> Result<(), Refused> {
    change_shape(document, corner.item, |shape| {
        let style = style_of(shape.is_geographic(0), placement);
        shape.with_new_corner(corner.number, &style.write(at, ","))
    })
}

/// Removes a corner of a zone or line, which keeps three or two.
///
/// # Errors
/// If the item is not there, or has too few corners.
pub fn remove_corner(document: &mut Document, corner: Corner) -> Result<(), Refused> {
    let least = if matches!(corner.item, Item::Zone(_)) { 3 } else { 2 };
    change_shape(document, corner.item, |shape| {
        let is_enough = shape.count() > least;
        is_enough.then(|| shape.without_corner(corner.number)).flatten()
    })
    .map_err(|refused| match refused {
        Refused::Rule(_) => Refused::Rule(format!("{} needs {least} corners", corner.item)),
        other => other,
    })
}

fn change_shape(
    document: &mut Document,
    item: Item,
    change: impl FnOnce(&ShapeText<'_>) -> Option<String>,
) -> Result<(), Refused> {
    let path = path_of(document, item)?;
    let element = document.tree().element(&path).ok_or(EditError::NoElement)?;
    let shape = element.attribute("shape").ok_or_else(no_such_corner)?;
    let changed = change(&ShapeText::new(&shape.value)).ok_or_else(no_such_corner)?;
    Ok(document.set_attribute_at(&path, "shape", Some(&changed))?)
}

fn no_such_corner() -> Refused {
    Refused::Rule("the shape in the file does not have this corner".into())
}

/// Removes items. The legs to a removed point are removed with it; a route that begins at it, or an
/// exit that names it, is for a person to change, and refuses.
///
/// # Errors
/// If one is not there or is still needed.
pub fn remove(document: &mut Document, mission: &Mission, items: &[Item]) -> Result<(), Refused> {
    let mut named: Vec<Named<'_>> = Vec::new();
    for item in items {
        named.extend(item.named());
        let (Item::MapPoint(gone) | Item::Rally(gone)) = item else { continue };
        for route in &mission.routes {
            let legs = route.steps.iter().filter(
                |step| matches!(step, RouteStep::Leg(leg) if leg.to.value == gone.as_str()),
            );
            let route = route.name.value.as_str();
            named.extend(legs.map(|leg| Named::Step { route, step: &leg.name().value }));
        }
    }
    let mut seen: Vec<Named<'_>> = Vec::new();
    named.retain(|item| {
        !seen.contains(item) && {
            seen.push(*item);
            true
        }
    });
    document.remove_all(&named).map_err(|error| with_users(document, error))?;
    let symbols = items.iter().filter(|item| matches!(item, Item::Symbol(_)));
    let removals = symbols.map(|item| path_of(document, *item).map(ElementEdit::Removal));
    let removals = removals.collect::<Result<Vec<_>, _>>()?;
    Ok(document.edit_elements(&removals)?)
}

/// Names the routes and others that need an item, instead of their lines in the file.
fn with_users(document: &Document, error: EditError) -> Refused {
    let EditError::StillNamed { what, at } = &error else { return error.into() };
    let users = at.iter().filter_map(|at| Item::at(document.tree(), at.span.start()));
    let mut users: Vec<_> = users.map(|item| item.to_string()).collect();
    users.dedup();
    match users.as_slice() {
        [] => error.into(),
        users => Refused::Rule(format!("{what} is still named by {}", users.join(", "))),
    }
}

/// Gives an attribute of the map a value; `None` removes it.
///
/// # Errors
/// If the file does not allow it.
pub fn set_map(
    document: &mut Document,
    attribute: &str,
    value: Option<&str>,
) -> Result<(), Refused> {
    map_of(document)?;
    Ok(document.set_attribute(Named::Map, attribute, value)?)
}

/// Gives an attribute of a symbol a value; `None` removes it.
///
/// # Errors
/// If there is no such symbol.
pub fn set_symbol(
    document: &mut Document,
    number: usize,
    attribute: &str,
    value: Option<&str>,
) -> Result<(), Refused> {
    let path = path_of(document, Item::Symbol(number))?;
    Ok(document.set_attribute_at(&path, attribute, value)?)
}

/// The path of an item in the file.
fn path_of(document: &Document, item: Item) -> Result<Vec<usize>, Refused> {
    let missing = || Refused::Rule(format!("there is no {item} in the file"));
    let Item::Symbol(number) = item else {
        let named = item.named().ok_or_else(missing)?;
        return document.find(named).ok_or_else(missing);
    };
    let mut path = document.find(Named::Map).ok_or_else(missing)?;
    let map = document.tree().element(&path).ok_or_else(missing)?;
    let mut symbols = map.elements().enumerate().filter(|(_, child)| child.name == "symbol");
    path.push(symbols.nth(number).ok_or_else(missing)?.0);
    Ok(path)
}

fn style_of(is_geographic: bool, placement: Option<&MapPlacement>) -> PositionStyle<'_> {
    PositionStyle { placement: placement.filter(|_| is_geographic) }
}

/// A name that nothing on the map has.
fn free_name(document: &Document, prefix: &str) -> String {
    let path = document.find(Named::Map).unwrap_or_default();
    let children = document.tree().element(&path).into_iter().flat_map(Element::elements);
    let taken: Vec<_> =
        children.filter_map(|child| Some(child.attribute("name")?.value.as_str())).collect();
    numbered(prefix, &taken)
}

/// The prefix with the first number from 1 on that gives a free name.
fn numbered(prefix: &str, taken: &[&str]) -> String {
    let mut names = (1..).map(|number: usize| format!("{prefix}{number}"));
    names.find(|name| !taken.contains(&name.as_str())).unwrap_or_else(|| prefix.to_owned())
}

#[cfg(test)]
mod tests;
