//! What can be pointed at in the open files: selected, opened, found, complained of.

use std::fmt;

use armor_robotfile::mission::ArcKind;
use armor_robotfile::tree::{Element, Tree};

use crate::desk::View;

/// One thing of the system or the mission.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Item {
    /// The component with this name.
    Component(String),
    /// A link between two ports, both as `component.port`.
    Link {
        /// The output.
        from: String,
        /// The input.
        to: String,
    },
    /// The place with this name.
    Place(String),
    /// The transition with this name.
    Transition(String),
    /// An arc of a transition.
    Arc {
        /// The transition's name.
        transition: String,
        /// The place's name.
        place: String,
        /// What the arc does.
        kind: ArcKind,
    },
    /// The variable with this name.
    Variable(String),
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
    /// The view that shows it.
    pub fn view(&self) -> View {
        match self {
            Self::Component(_) | Self::Link { .. } | Self::System => View::System,
            Self::Decoration { view, .. } => *view,
            _ => View::Mission,
        }
    }

    /// The same in the words of the file, if it has a name there.
    pub fn named(&self) -> Option<armor_robotfile::Item<'_>> {
        use armor_robotfile::Item as Named;
        Some(match self {
            Self::Component(name) => Named::Component(name),
            Self::Link { from, to } => Named::Link { from, to },
            Self::Place(name) => Named::Place(name),
            Self::Transition(name) => Named::Transition(name),
            Self::Variable(name) => Named::Variable(name),
            Self::System => Named::System,
            Self::Mission => Named::Mission,
            _ => return None,
        })
    }

    /// What stands at a byte of a file: the item whose element the byte is in.
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
        let value = |name: &str| element.attribute(name).map(|a| a.value.clone());
        let number = || {
            let same = half.elements().filter(|other| other.name == element.name);
            same.take_while(|other| other.span != element.span).count()
        };
        match element.name.as_str() {
            "component" => Some(Self::Component(value("name")?)),
            "link" => Some(Self::Link { from: value("from")?, to: value("to")? }),
            "place" => Some(Self::Place(value("name")?)),
            "transition" => Some(Self::Transition(value("name")?)),
            "variable" => Some(Self::Variable(value("name")?)),
            "submission" => Some(Self::Submission(number())),
            "exclusive" => Some(Self::Exclusive(number())),
            "check" => Some(Self::Check(number())),
            _ if half.name == "system" => Some(Self::System),
            _ => Some(Self::Mission),
        }
    }
}

/// "component laser", as labels and messages say it.
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
                    ArcKind::Inhibitor => "is held by",
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
        assert_eq!(at("value=\"1\""), Some(Item::Component("a".into())));
        assert_eq!(at("a.x"), Some(Item::Link { from: "a.x".into(), to: "a.y".into() }));
        assert_eq!(at("here"), Some(Item::Place("here".into())));
        assert_eq!(at("eventually"), Some(Item::Check(1)));
        assert_eq!(at("<mission>"), Some(Item::Mission));
        assert_eq!(at("armor"), None);
    }
}
