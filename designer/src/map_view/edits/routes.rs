//! The changes of routes and their steps in the file.

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item as Named, NewElement};

use super::exits::add_exits;
use super::{DrawnNames, map_of, names_on_map, no_such_corner, numbered};
use crate::map_view::movers::RouteDrivers;
use crate::project::Refused;

/// How long a new stay is.
const NEW_STAY: &str = "10s";
/// How long a robot waits at a new meeting.
const NEW_PATIENCE: &str = "2min";

/// Adds a leg to a point, before a step or at the end of the route; returns its name.
///
/// # Errors
/// If the file does not allow it.
pub fn add_leg(
    document: &mut Document,
    route: &str,
    before: Option<&str>,
    to: &str,
) -> Result<String, Refused> {
    let name = free_step(document, "l", &[route]);
    document.add_leg(route, &name, before, &[("to", to)])?;
    Ok(name)
}

/// What a new route needs.
pub struct NewRoute<'a> {
    /// What drives it.
    pub drivers: &'a RouteDrivers,
    /// The point where the robot is at first.
    pub start: &'a str,
    /// The place that it leads to.
    pub out: &'a str,
}

/// The goal of the mission and its safe place, which it gets if it has none. Returns the goal.
///
/// # Errors
/// If the file does not allow it.
pub fn ensure_ends(document: &mut Document) -> Result<String, Refused> {
    let mut goal = None;
    for (attribute, preferred) in [("goal", "over"), ("safe", "hold")] {
        let mission = document.find(Named::Mission).unwrap_or_default();
        let mission = document.tree().element(&mission);
        let given = mission.and_then(|mission| mission.attribute(attribute));
        let name = match given {
            Some(given) => given.value.clone(),
            None => {
                if document.find(Named::Place(preferred)).is_none() {
                    document.add(Named::Place(preferred), &[])?;
                }
                document.set_attribute(Named::Mission, attribute, Some(preferred))?;
                preferred.to_owned()
            }
        };
        goal = goal.or(Some(name));
    }
    goal.ok_or(Refused::Absent { what: "<mission>" })
}

/// Adds a route without steps; returns its name.
///
/// # Errors
/// If the file does not allow it.
pub fn add_route(document: &mut Document, new: &NewRoute<'_>) -> Result<String, Refused> {
    let mission = document.find(Named::Mission).unwrap_or_default();
    let elements = document.tree().element(&mission).into_iter().flat_map(Element::elements);
    let routes = elements.filter(|element| element.name == "route");
    let taken: Vec<_> =
        routes.filter_map(|route| Some(route.attribute("name")?.value.as_str())).collect();
    let name = match taken.contains(&"route") {
        false => "route".to_owned(),
        true => numbered("route-", &taken),
    };
    let drivers = new.drivers;
    let mut attributes = vec![("mover", drivers.mover.as_str())];
    attributes.extend(drivers.pace.as_deref().map(|pace| ("pace", pace)));
    attributes.extend(drivers.pose.as_deref().map(|pose| ("pose", pose)));
    attributes.extend(drivers.fence.as_deref().map(|fence| ("fence", fence)));
    attributes.extend([("start", new.start), ("out", new.out)]);
    document.add(Named::Route(&name), &attributes)?;
    Ok(name)
}

/// The route that a path is added to.
#[derive(Clone, Copy, Debug)]
pub enum PathEnd<'a> {
    /// This one, behind its last step.
    Of(&'a str),
    /// A new one, which begins at the first point.
    New(&'a RouteDrivers),
}

/// Draws points, and a leg to each of them; returns the route and the names of the legs. However long the
/// path is, these are a few edits of the file.
///
/// # Errors
/// If the file does not allow it.
pub fn add_path(
    document: &mut Document,
    end: PathEnd<'_>,
    positions: &[String],
) -> Result<(String, Vec<String>), Refused> {
    map_of(document)?;
    let mut names = names_on_map(document);
    let points: Vec<_> = positions.iter().map(|_| names.free("P1", "P")).collect();
    let elements = points.iter().zip(positions);
    let elements = elements
        .map(|(name, at)| NewElement::new("point").attribute("name", name).attribute("at", at));
    document.add_elements(Named::Map, &elements.collect::<Vec<_>>())?;
    let (route, ends) = match end {
        PathEnd::Of(route) => (route.to_owned(), points.as_slice()),
        PathEnd::New(drivers) => {
            let out = ensure_ends(document)?;
            let (start, rest) = points.split_first().ok_or_else(no_such_corner)?;
            (add_route(document, &NewRoute { drivers, start, out: &out })?, rest)
        }
    };
    let mut steps = names_of_steps(document, &route);
    let legs: Vec<_> = ends.iter().map(|_| steps.free("l1", "l")).collect();
    let elements = legs.iter().zip(ends);
    let elements = elements
        .map(|(name, to)| NewElement::new("leg").attribute("name", name).attribute("to", to));
    append_steps(document, &route, &elements.collect::<Vec<_>>())?;
    if matches!(end, PathEnd::New(_)) {
        add_exits(document, &route)?;
    }
    Ok((route, legs))
}

/// Adds steps behind the last one of a route.
///
/// # Errors
/// If there is no such route.
pub fn append_steps(
    document: &mut Document,
    route: &str,
    steps: &[NewElement],
) -> Result<(), Refused> {
    let missing = || Refused::Rule(format!("there is no route {route} in the file"));
    let path = document.find(Named::Route(route)).ok_or_else(missing)?;
    let element = document.tree().element(&path).ok_or_else(missing)?;
    let is_step = |element: &Element| matches!(element.name.as_str(), "leg" | "stay" | "meet");
    let elements: Vec<_> = element.elements().collect();
    let last = elements.iter().rposition(|element| is_step(element));
    // Without a step they are the first elements: before what ends steps early.
    Ok(document.insert_elements(&path, last.map_or(0, |last| last + 1), steps)?)
}

/// The names of the steps of a route.
pub fn names_of_steps(document: &Document, route: &str) -> DrawnNames {
    let path = document.find(Named::Route(route));
    DrawnNames::of(path.and_then(|path| document.tree().element(&path)))
}

/// Adds a stay behind a step; returns its name.
///
/// # Errors
/// If the step is not there.
pub fn add_stay(document: &mut Document, route: &str, after: &str) -> Result<String, Refused> {
    let name = free_step(document, "s", &[route]);
    let stay = NewElement::new("stay").attribute("name", &name).attribute("for", NEW_STAY);
    insert_step(document, route, after, &stay)?;
    Ok(name)
}

/// Lets two routes meet, each behind one of its steps; returns the name of the meeting, the same in both.
///
/// # Errors
/// If a step is not there.
pub fn add_meeting(document: &mut Document, ends: [(&str, &str); 2]) -> Result<String, Refused> {
    let [one, other] = ends;
    let name = free_step(document, "m", &[one.0, other.0]);
    for ((route, after), with) in [(one, other.0), (other, one.0)] {
        let meet = NewElement::new("meet").attribute("name", &name).attribute("with", with);
        insert_step(document, route, after, &meet.attribute("patience", NEW_PATIENCE))?;
    }
    Ok(name)
}

fn insert_step(
    document: &mut Document,
    route: &str,
    after: &str,
    new: &NewElement,
) -> Result<(), Refused> {
    let missing =
        || Refused::Rule(format!("there is no step {after} of route {route} in the file"));
    let path = document.find(Named::Step { route, step: after }).ok_or_else(missing)?;
    let (index, parent) = path.split_last().ok_or_else(missing)?;
    Ok(document.insert_element(parent, index + 1, new)?)
}

/// A name that no step of these routes has.
fn free_step(document: &Document, prefix: &str, routes: &[&str]) -> String {
    let elements = routes.iter().filter_map(|route| document.find(Named::Route(route)));
    let elements = elements.filter_map(|path| document.tree().element(&path));
    let steps = elements.flat_map(Element::elements);
    let taken: Vec<_> =
        steps.filter_map(|step| Some(step.attribute("name")?.value.as_str())).collect();
    numbered(prefix, &taken)
}
