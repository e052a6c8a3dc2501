//! A drawing put into the text of a file: only lines of the drawing change. Pure.

use std::path::Path;

use armor_robotfile::tree::Element;
use armor_robotfile::{Configuration, Document, EditError, Findings, Item, NewElement};

use super::drawing::{Drawing, ExistingDrawing};

/// The places of a new mission: where its route ends, and where a robot ends that cannot continue.
pub const GOAL: &str = "over";
const SAFE: &str = "hold";

/// Why nothing can be drawn into a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MapFault {
    /// Its map has an origin that cannot be read.
    #[error("the origin of its map cannot be read: `armor check` explains it")]
    Origin,
    /// Its map is turned about an origin that it does not have.
    #[error("its map has a heading and no origin: write its origin first")]
    Heading,
}

/// Returns what a file has drawn already.
///
/// # Errors
/// If where its map is cannot be known.
pub fn find_existing(
    document: &Document,
    configuration: Option<&Configuration>,
) -> Result<ExistingDrawing, MapFault> {
    let mission = configuration.and_then(|configuration| configuration.mission.as_ref());
    let map = mission.and_then(|mission| mission.map.as_ref());
    let element = |item| document.find(item).and_then(|path| document.tree().element(&path));
    let mut existing = ExistingDrawing {
        placement: map.and_then(|map| map.placement),
        ..ExistingDrawing::default()
    };
    let name_of = |child: &Element| child.attribute("name").map(|name| name.value.clone());
    if let Some(mission) = element(Item::Mission) {
        let routes = mission.elements().filter(|child| child.name == "route");
        existing.routes.extend(routes.filter_map(name_of));
    }
    let Some(map) = element(Item::Map) else { return Ok(existing) };
    let has = |name| map.attribute(name).is_some();
    if existing.placement.is_none() && has("origin") {
        return Err(MapFault::Origin);
    }
    if !has("origin") && has("heading") {
        return Err(MapFault::Heading);
    }
    // They have names and corners; lines are not imported.
    let mut lines = 0;
    for child in map.elements() {
        let count = match child.name.as_str() {
            "point" => &mut existing.points,
            "rally" => &mut existing.rallies,
            "zone" => &mut existing.zones,
            "line" => &mut lines,
            _ => continue,
        };
        *count += 1;
        existing.marks.extend(name_of(child));
        let shape = child.attribute("shape").map_or("", |shape| shape.value.as_str());
        existing.corners += shape.split_ascii_whitespace().count();
    }
    Ok(existing)
}

/// Puts a drawing into a file: into its map and its mission, which it gets if it has none.
/// `system` is the file with the system of a new mission.
///
/// # Errors
/// If the file breaks a limit with it. Nothing is changed then.
pub fn insert_drawing(
    document: &mut Document,
    drawing: &Drawing,
    system: Option<&str>,
) -> Result<(), EditError> {
    let mut changed = document.clone();
    if document.find(Item::Mission).is_none() {
        let index = document.tree().root().elements().count();
        changed.insert_element(&[], index, &make_mission(drawing, system))?;
    } else if document.find(Item::Map).is_none() {
        let map = std::iter::once(make_map(drawing));
        let new: Vec<_> = map.chain(drawing.route.clone()).collect();
        changed.add_elements(Item::Mission, &new)?;
    } else {
        if let Some(origin) = &drawing.origin {
            changed.set_attribute(Item::Map, "origin", Some(origin))?;
        }
        changed.add_elements(Item::Map, &drawing.marks)?;
        if let Some(route) = &drawing.route {
            changed.add_elements(Item::Mission, std::slice::from_ref(route))?;
        }
    }
    *document = changed;
    Ok(())
}

fn make_map(drawing: &Drawing) -> NewElement {
    let mut map = NewElement::new("map");
    if let Some(origin) = &drawing.origin {
        map = map.attribute("origin", origin.as_str());
    }
    drawing.marks.iter().fold(map, |map, mark| map.child(mark.clone()))
}

fn make_mission(drawing: &Drawing, system: Option<&str>) -> NewElement {
    let mut mission = NewElement::new("mission");
    if let Some(system) = system {
        mission = mission.attribute("system", system);
    }
    mission = mission.attribute("goal", GOAL).attribute("safe", SAFE).child(make_map(drawing));
    if let Some(route) = &drawing.route {
        mission = mission.child(route.clone());
    }
    [GOAL, SAFE].iter().fold(mission, |mission, name| {
        mission.child(NewElement::new("place").attribute("name", *name))
    })
}

/// A file with nothing in it.
///
/// # Errors
/// None that occurs: the text is well-formed.
pub fn make_file(path: &Path) -> Result<Document, Findings> {
    let text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<armor version=\"1\">\n</armor>\n";
    Document::open(path, text.as_bytes())
}
