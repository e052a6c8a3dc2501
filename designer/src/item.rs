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

    /// The view that shows it.
    pub fn view(self) -> View {
        match self {
            Self::Component(_) | Self::Link { .. } | Self::System => View::System,
            Self::Decoration { view, .. } => view,
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
            Self::System => Named::System,
            Self::Mission => Named::Mission,
            _ => return None,
        })
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
}
