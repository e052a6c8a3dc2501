//! The items of the open files: what can be selected, opened, found, and named in a finding.

use std::fmt;

use armor_robotfile::mission::ArcKind;
use armor_robotfile::tree::{Element, Tree};

use crate::name::ItemName;
use crate::view::View;

/// One thing of the system or the mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Item {
    /// The component with this name.
    Component(ItemName),
    /// A link between two ports, both as `component.port`.
    Link {
        /// The output.
        from: ItemName,
        /// The input.
        to: ItemName,
    },
    /// The place with this name.
    Place(ItemName),
    /// The transition with this name.
    Transition(ItemName),
    /// An arc of a transition.
    Arc {
        /// The transition's name.
        transition: ItemName,
        /// The place's name.
        place: ItemName,
        /// What the arc does.
        kind: ArcKind,
    },
    /// The variable with this name.
    Variable(ItemName),
    /// A sub-mission, by its number among them.
    Submission(usize),
    /// An exclusive set, by its number among them.
    Exclusive(usize),
    /// A `<check>`, by its number among them.
    Check(usize),
    /// A group or note of a drawing, by its number among them.
    Decoration {
        /// Whose drawing.
        view: View,
        /// Its number in the layout.
        number: usize,
    },
    /// The point on the map with this name.
    MapPoint(ItemName),
    /// The rally point with this name.
    Rally(ItemName),
    /// The zone of the map with this name.
    Zone(ItemName),
    /// The line on the map with this name.
    MapLine(ItemName),
    /// A military symbol on the map, by its number among them.
    Symbol(usize),
    /// The route with this name.
    Route(ItemName),
    /// A leg, stay or meeting of a route.
    Step {
        /// The route's name.
        route: ItemName,
        /// The step's name.
        step: ItemName,
    },
    /// The system as a whole.
    System,
    /// The mission as a whole.
    Mission,
}

impl Item {
    /// The component with this name.
    pub fn component(name: impl AsRef<str>) -> Self {
        Self::Component(ItemName::new(name.as_ref()))
    }

    /// The link from an output to an input, both as `component.port`.
    pub fn link(from: impl AsRef<str>, to: impl AsRef<str>) -> Self {
        Self::Link { from: ItemName::new(from.as_ref()), to: ItemName::new(to.as_ref()) }
    }

    /// The place with this name.
    pub fn place(name: impl AsRef<str>) -> Self {
        Self::Place(ItemName::new(name.as_ref()))
    }

    /// The transition with this name.
    pub fn transition(name: impl AsRef<str>) -> Self {
        Self::Transition(ItemName::new(name.as_ref()))
    }

    /// The arc of a transition at a place.
    pub fn arc(transition: impl AsRef<str>, place: impl AsRef<str>, kind: ArcKind) -> Self {
        let (transition, place) =
            (ItemName::new(transition.as_ref()), ItemName::new(place.as_ref()));
        Self::Arc { transition, place, kind }
    }

    /// The variable with this name.
    pub fn variable(name: impl AsRef<str>) -> Self {
        Self::Variable(ItemName::new(name.as_ref()))
    }

    /// The point on the map with this name.
    pub fn map_point(name: impl AsRef<str>) -> Self {
        Self::MapPoint(ItemName::new(name.as_ref()))
    }

    /// The rally point with this name.
    pub fn rally(name: impl AsRef<str>) -> Self {
        Self::Rally(ItemName::new(name.as_ref()))
    }

    /// The zone of the map with this name.
    pub fn zone(name: impl AsRef<str>) -> Self {
        Self::Zone(ItemName::new(name.as_ref()))
    }

    /// The line on the map with this name.
    pub fn map_line(name: impl AsRef<str>) -> Self {
        Self::MapLine(ItemName::new(name.as_ref()))
    }

    /// The route with this name.
    pub fn route(name: impl AsRef<str>) -> Self {
        Self::Route(ItemName::new(name.as_ref()))
    }

    /// The step of a route.
    pub fn step(route: impl AsRef<str>, step: impl AsRef<str>) -> Self {
        Self::Step { route: ItemName::new(route.as_ref()), step: ItemName::new(step.as_ref()) }
    }

    /// The view that shows it.
    pub fn view(self) -> View {
        match self {
            Self::Component(_) | Self::Link { .. } | Self::System => View::System,
            Self::Decoration { view, .. } => view,
            Self::MapPoint(_)
            | Self::Rally(_)
            | Self::Zone(_)
            | Self::MapLine(_)
            | Self::Symbol(_)
            | Self::Route(_)
            | Self::Step { .. } => View::Map,
            _ => View::Mission,
        }
    }

    /// The same in the words of the file, if it has a name there.
    pub fn named(self) -> Option<armor_robotfile::Item<'static>> {
        use armor_robotfile::Item as Named;
        Some(match self {
            Self::Component(name) => Named::Component(name.as_str()),
            Self::Link { from, to } => Named::Link { from: from.as_str(), to: to.as_str() },
            Self::Place(name) => Named::Place(name.as_str()),
            Self::Transition(name) => Named::Transition(name.as_str()),
            Self::Variable(name) => Named::Variable(name.as_str()),
            Self::MapPoint(name) => Named::MapPoint(name.as_str()),
            Self::Rally(name) => Named::Rally(name.as_str()),
            Self::Zone(name) => Named::Zone(name.as_str()),
            Self::MapLine(name) => Named::MapLine(name.as_str()),
            Self::Route(name) => Named::Route(name.as_str()),
            Self::Step { route, step } => {
                Named::Step { route: route.as_str(), step: step.as_str() }
            }
            Self::System => Named::System,
            Self::Mission => Named::Mission,
            _ => return None,
        })
    }

    /// The item within `<map>` or `<route>` at a byte of a file.
    fn drawn_at(parent: &Element, offset: usize) -> Self {
        let route = parent.attribute("name").map(|name| name.value.as_str());
        let whole = match route {
            Some(route) if parent.name == "route" => Self::route(route),
            _ => Self::Mission,
        };
        let inside =
            |element: &&Element| (element.span.start()..element.span.end()).contains(&offset);
        let Some(element) = parent.elements().find(inside) else { return whole };
        let name = element.attribute("name").map(|name| name.value.as_str());
        match (element.name.as_str(), name, route) {
            ("point", Some(name), _) => Self::map_point(name),
            ("rally", Some(name), _) => Self::rally(name),
            ("zone", Some(name), _) => Self::zone(name),
            ("line", Some(name), _) => Self::map_line(name),
            ("symbol", ..) => {
                let symbols = parent.elements().filter(|other| other.name == "symbol");
                Self::Symbol(symbols.take_while(|other| other.span != element.span).count())
            }
            ("leg" | "stay" | "meet", Some(step), Some(route)) => Self::step(route, step),
            _ => whole,
        }
    }

    /// Returns the item at a byte of a file: the one whose element contains the byte.
    pub fn at(tree: &Tree, offset: usize) -> Option<Self> {
        let inside =
            |element: &&Element| (element.span.start()..element.span.end()).contains(&offset);
        let half = tree.root().elements().find(inside)?;
        let Some(element) = half.elements().find(inside) else {
            return match half.name.as_str() {
                "system" => Some(Self::System),
                "mission" => Some(Self::Mission),
                _ => None,
            };
        };
        let value = |name: &str| element.attribute(name).map(|a| &a.value);
        let number = || {
            let same = half.elements().filter(|other| other.name == element.name);
            same.take_while(|other| other.span != element.span).count()
        };
        match element.name.as_str() {
            "component" => Some(Self::component(value("name")?)),
            "link" => Some(Self::link(value("from")?, value("to")?)),
            "place" => Some(Self::place(value("name")?)),
            "transition" => Some(Self::transition(value("name")?)),
            "variable" => Some(Self::variable(value("name")?)),
            "submission" => Some(Self::Submission(number())),
            "exclusive" => Some(Self::Exclusive(number())),
            "check" => Some(Self::Check(number())),
            "map" | "route" => Some(Self::drawn_at(element, offset)),
            _ if half.name == "system" => Some(Self::System),
            _ => Some(Self::Mission),
        }
    }
}

/// Such as "component laser", for labels and messages.
impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Component(name) => write!(f, "component {name}"),
            Self::Link { from, to } => write!(f, "link {from} to {to}"),
            Self::Place(name) => write!(f, "place {name}"),
            Self::Transition(name) => write!(f, "transition {name}"),
            Self::Arc { transition, place, kind } => {
                let verb = match kind {
                    ArcKind::Take => "takes from",
                    ArcKind::Put => "puts into",
                    ArcKind::Read => "reads",
                    ArcKind::Inhibitor => "is inhibited by",
                    ArcKind::Reset => "empties",
                };
                write!(f, "arc: {transition} {verb} {place}")
            }
            Self::Variable(name) => write!(f, "variable {name}"),
            Self::Submission(number) => write!(f, "sub-mission {}", number + 1),
            Self::Exclusive(number) => write!(f, "exclusive set {}", number + 1),
            Self::Check(number) => write!(f, "check {}", number + 1),
            Self::Decoration { number, .. } => write!(f, "decoration {}", number + 1),
            Self::MapPoint(name) => write!(f, "point {name}"),
            Self::Rally(name) => write!(f, "rally point {name}"),
            Self::Zone(name) => write!(f, "zone {name}"),
            Self::MapLine(name) => write!(f, "line {name}"),
            Self::Symbol(number) => write!(f, "symbol {}", number + 1),
            Self::Route(name) => write!(f, "route {name}"),
            Self::Step { route, step } => write!(f, "step {step} of route {route}"),
            Self::System => f.write_str("the system"),
            Self::Mission => f.write_str("the mission"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_of_the_file_leads_to_what_stands_there() {
        let file = "<armor version=\"1\"><system>\
            <component name=\"a\" kind=\"k\"><parameter name=\"p\" value=\"1\"/></component>\
            <link from=\"a.x\" to=\"a.y\"/></system>\
            <mission><place name=\"here\"/><check>never here</check><check>eventually here</check>\
            </mission></armor>";
        let tree = armor_robotfile::parse_tree("a.xml".as_ref(), file.as_bytes()).unwrap();
        let at = |text: &str| Item::at(&tree, file.find(text).unwrap());
        assert_eq!(at("value=\"1\""), Some(Item::component("a")));
        assert_eq!(at("a.x"), Some(Item::link("a.x", "a.y")));
        assert_eq!(at("here"), Some(Item::place("here")));
        assert_eq!(at("eventually"), Some(Item::Check(1)));
        assert_eq!(at("<mission>"), Some(Item::Mission));
        assert_eq!(at("armor"), None);
    }

    #[test]
    fn what_is_drawn_on_the_map_is_found_by_its_bytes_too() {
        let file = "<armor><mission><map><point name=\"P1\" at=\"1 2\"/><symbol at=\"0 0\"/>\
            <zone name=\"z\" shape=\"s\"/><symbol at=\"3 4\"/></map><route name=\"red\">\
            <leg name=\"l1\"/><otherwise do=\"hold\"/></route></mission></armor>";
        let tree = armor_robotfile::parse_tree("a.xml".as_ref(), file.as_bytes()).unwrap();
        let at = |text: &str| Item::at(&tree, file.find(text).unwrap());
        for (text, expected) in [
            ("1 2", Item::map_point("P1")),
            ("shape", Item::zone("z")),
            ("3 4", Item::Symbol(1)),
            ("l1", Item::step("red", "l1")),
            ("hold", Item::route("red")),
            ("<map", Item::Mission),
        ] {
            assert_eq!(at(text), Some(expected), "{text}");
            let view = if text == "<map" { View::Mission } else { View::Map };
            assert_eq!(expected.view(), view);
        }
    }
}
