//! The things of a file that have names, and their elements.

use std::fmt;

use armor_wire::name::{is_name, split_data};

use crate::edit::document::Document;
use crate::edit::error::EditError;
use crate::source::Location;
use crate::tree::{Element, Tree};

/// Something in a file that can be called by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Item<'a> {
    /// `<system>`.
    System,
    /// `<mission>`.
    Mission,
    /// The frame with this name.
    Frame(&'a str),
    /// The component with this name.
    Component(&'a str),
    /// The link from an output to an input, both as `component.port`.
    Link {
        /// The output.
        from: &'a str,
        /// The input.
        to: &'a str,
    },
    /// The place with this name.
    Place(&'a str),
    /// The transition with this name.
    Transition(&'a str),
    /// The variable with this name.
    Variable(&'a str),
    /// The mission's `<map>`.
    Map,
    /// The point on the map with this name.
    MapPoint(&'a str),
    /// The rally point with this name.
    Rally(&'a str),
    /// The zone with this name.
    Zone(&'a str),
    /// The line with this name.
    MapLine(&'a str),
    /// The route with this name.
    Route(&'a str),
    /// The leg, stay or meeting with this name in a route.
    Step {
        /// The route.
        route: &'a str,
        /// The step.
        step: &'a str,
    },
}

impl<'a> Item<'a> {
    /// Returns its name, if other elements refer to it by a name.
    pub(crate) fn name(self) -> Option<&'a str> {
        match self {
            Self::System | Self::Mission | Self::Map | Self::Link { .. } => None,
            Self::Frame(name)
            | Self::Component(name)
            | Self::Place(name)
            | Self::Transition(name)
            | Self::Variable(name)
            | Self::MapPoint(name)
            | Self::Rally(name)
            | Self::Zone(name)
            | Self::MapLine(name)
            | Self::Route(name)
            | Self::Step { step: name, .. } => Some(name),
        }
    }

    /// Returns the name by which checks and the layout name its places: of a step with its route.
    pub(crate) fn derived_name(self) -> Option<String> {
        match self {
            Self::Route(route) => Some(route.to_owned()),
            Self::Step { route, step } => Some(format!("{route}.{step}")),
            _ => None,
        }
    }

    /// Returns the same kind of item with another name.
    pub(crate) fn renamed<'b>(self, new: &'b str) -> Option<Item<'b>>
    where
        'a: 'b,
    {
        match self {
            Self::System | Self::Mission | Self::Map | Self::Link { .. } => None,
            Self::Frame(_) => Some(Item::Frame(new)),
            Self::Component(_) => Some(Item::Component(new)),
            Self::Place(_) => Some(Item::Place(new)),
            Self::Transition(_) => Some(Item::Transition(new)),
            Self::Variable(_) => Some(Item::Variable(new)),
            Self::MapPoint(_) => Some(Item::MapPoint(new)),
            Self::Rally(_) => Some(Item::Rally(new)),
            Self::Zone(_) => Some(Item::Zone(new)),
            Self::MapLine(_) => Some(Item::MapLine(new)),
            Self::Route(_) => Some(Item::Route(new)),
            Self::Step { route, .. } => Some(Item::Step { route, step: new }),
        }
    }

    /// Returns the names of its parent element and of its own.
    pub(crate) fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::System => ("armor", "system"),
            Self::Mission => ("armor", "mission"),
            Self::Frame(_) => ("system", "frame"),
            Self::Component(_) => ("system", "component"),
            Self::Link { .. } => ("system", "link"),
            Self::Place(_) => ("mission", "place"),
            Self::Transition(_) => ("mission", "transition"),
            Self::Variable(_) => ("mission", "variable"),
            Self::Map => ("mission", "map"),
            Self::MapPoint(_) => ("map", "point"),
            Self::Rally(_) => ("map", "rally"),
            Self::Zone(_) => ("map", "zone"),
            Self::MapLine(_) => ("map", "line"),
            Self::Route(_) => ("mission", "route"),
            Self::Step { .. } => ("route", "leg"),
        }
    }

    /// Returns whether it is a place or transition of a sub-mission, which only checks name:
    /// `dock.creep`.
    pub(crate) fn is_of_submission(self) -> bool {
        matches!(self, Self::Place(name) | Self::Transition(name) if name.contains('.'))
    }

    fn is(self, element: &Element) -> bool {
        let has = |attribute: &str, value: &str| {
            element.attribute(attribute).is_some_and(|a| a.value == value)
        };
        let is_of_sort = match self {
            Self::Step { .. } => STEPS.contains(&element.name.as_str()),
            other => element.name == other.names().1,
        };
        is_of_sort
            && match self {
                Self::System | Self::Mission | Self::Map => true,
                Self::Link { from, to } => has("from", from) && has("to", to),
                named => named.name().is_some_and(|name| has("name", name)),
            }
    }
}

/// The elements of a route that are its steps.
pub(crate) const STEPS: [&str; 3] = ["leg", "stay", "meet"];

/// Writes `component laser`, as in messages.
impl fmt::Display for Item<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sort = self.names().1;
        match self {
            Self::System | Self::Mission | Self::Map => write!(f, "<{sort}>"),
            Self::Link { from, to } => write!(f, "link from {from} to {to}"),
            Self::Step { route, step } => write!(f, "step {step} of route {route}"),
            Self::Frame(name)
            | Self::Component(name)
            | Self::Place(name)
            | Self::Transition(name)
            | Self::Variable(name)
            | Self::MapPoint(name)
            | Self::Rally(name)
            | Self::Zone(name)
            | Self::MapLine(name)
            | Self::Route(name) => write!(f, "{sort} {name}"),
        }
    }
}

/// What a place or transition is derived from.
#[derive(Clone, Debug)]
pub struct Derivation {
    /// Such as "leg l1 of route red".
    pub from: String,
    /// Where that is.
    pub at: Location,
}

/// The path of an item in a tree.
pub(crate) fn find(tree: &Tree, item: Item<'_>) -> Option<Vec<usize>> {
    let mut path = match (item, item.names().0) {
        (Item::Step { route, .. }, _) => find(tree, Item::Route(route))?,
        (_, "armor") => Vec::new(),
        (_, "system") => find(tree, Item::System)?,
        (_, "map") => find(tree, Item::Map)?,
        _ => find(tree, Item::Mission)?,
    };
    let parent = tree.element(&path)?;
    path.push(parent.elements().position(|element| item.is(element))?);
    Some(path)
}

impl Document {
    /// The path of an item, the first of its name.
    pub fn find(&self, item: Item<'_>) -> Option<Vec<usize>> {
        find(self.tree(), item)
    }

    pub(crate) fn path_of(&self, item: Item<'_>) -> Result<Vec<usize>, EditError> {
        self.find(item).ok_or_else(|| match self.derivation(item) {
            Some(Derivation { from, at }) => {
                EditError::Derived { what: item.to_string(), from, at }
            }
            None => EditError::Absent {
                what: item.to_string(),
                file: self.tree().source().path().to_path_buf(),
            },
        })
    }

    /// What a place or transition of a route is derived from: the step that it is named after, or
    /// the route. `None` for everything that is in the file itself.
    pub fn derivation(&self, item: Item<'_>) -> Option<Derivation> {
        let (Item::Place(name) | Item::Transition(name)) = item else { return None };
        let (route_name, rest) = name.split_once('.')?;
        let route = self.tree().element(&self.find(Item::Route(route_name))?)?;
        let step_name = rest.split('.').next();
        let is_step = |element: &&Element| {
            matches!(element.name.as_str(), "leg" | "stay" | "meet")
                && element.attribute("name").map(|name| name.value.as_str()) == step_name
        };
        let (from, element) = match (route.elements().find(is_step), step_name) {
            (Some(step), Some(name)) => {
                (format!("{} {name} of route {route_name}", step.name), step)
            }
            _ => (format!("route {route_name}"), route),
        };
        Some(Derivation { from, at: Location::new(self.tree().source(), element.span) })
    }
}

/// Refuses a text that is not a name of the format, or one of a sub-mission's: `dock.creep`.
pub(crate) fn check_qualified(name: &str) -> Result<(), EditError> {
    let is_qualified = name.contains('.') && name.split('.').all(is_name);
    if is_qualified { Ok(()) } else { Err(EditError::BadName { name: name.to_owned() }) }
}

/// Refuses a text that is not a name of the format.
pub(crate) fn check_name(name: &str) -> Result<(), EditError> {
    if is_name(name) { Ok(()) } else { Err(EditError::BadName { name: name.to_owned() }) }
}

/// Refuses a text that is not `component.port`.
pub(crate) fn check_port(text: &str) -> Result<(&str, &str), EditError> {
    split_data(text).ok_or_else(|| EditError::BadPort { text: text.to_owned() })
}
