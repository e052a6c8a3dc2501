//! Everything the panels change, as data: a field that is being typed in holds the change it will
//! make, so that nothing is lost when something else is selected meanwhile.

use armor_robotfile::mission::ArcKind;

use super::edits::{self, Decides, Timing};
use crate::item::Item;
use crate::layout;
use crate::map_view::edits as map_edits;
use crate::project::elsewhere::NameChange;
use crate::project::{Documents, Refused};
use crate::view::View;

/// One change of the mission, one step of the history.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A place, transition or variable gets another name, everywhere.
    Rename(Item, String),
    /// An attribute of the mission, a place, a transition or a variable; without a value it goes.
    Attribute(Item, &'static str, Option<String>),
    /// Whether a component is active while a place is marked.
    Component {
        /// The place.
        place: String,
        /// The component.
        component: String,
        /// Whether it is.
        is_active: bool,
    },
    /// A value that a place gives; without one, that of the system counts.
    PlaceParameter {
        /// The place.
        place: String,
        /// The component.
        component: String,
        /// Its parameter.
        parameter: String,
        /// The value.
        value: Option<String>,
    },
    /// When a transition fires.
    Timing(String, Timing),
    /// Who decides that a transition fires.
    Decides(String, Decides),
    /// What a transition sets a variable to; without a value, it leaves it.
    SetVariable(String, String, Option<String>),
    /// What an arc does.
    ArcKind(Item, ArcKind),
    /// How many tokens an arc moves.
    Weight(Item, u32),
    /// An arc in the panel of its transition.
    AddArc(Item),
    /// An exclusive set of these.
    AddExclusive(Vec<String>),
    /// Whether a component is in an exclusive set.
    Exclusive(usize, String, bool),
    /// A variable that follows a field of data, or one that transitions set.
    AddVariable(String, Option<String>),
    /// Something to be proven.
    AddCheck(String),
    /// What a check states.
    Check(usize, String),
    /// Another mission's file.
    AddSubmission(String),
    /// `ref`, `in` or `out` of a sub-mission.
    Submission(usize, &'static str, Option<String>),
    /// An attribute of the map; without a value it goes.
    Map(&'static str, Option<String>),
    /// An attribute of a symbol on the map, by its number; without a value it goes.
    Symbol(usize, &'static str, Option<String>),
    /// An attribute of an exit of a route, by its number; without a value it goes.
    Exit(Item, usize, &'static str, Option<String>),
    /// A route gets exits.
    AddExits(Item),
    /// What a group or note of the drawing states.
    Decoration(usize, String),
    /// These are removed together.
    Remove(Vec<Item>),
}

impl Change {
    /// What it does, as undo calls it.
    pub fn what(&self) -> String {
        match self {
            Self::Rename(item, name) => format!("rename {item} to {name}"),
            Self::Attribute(item, "at", Some(_)) => format!("move {item}"),
            Self::Attribute(item, name, Some(_)) => format!("set {name} of {item}"),
            Self::Attribute(item, name, None) => format!("remove {name} of {item}"),
            Self::Component { place, component, is_active: true } => {
                format!("activate {component} in {place}")
            }
            Self::Component { place, component, .. } => {
                format!("deactivate {component} in {place}")
            }
            Self::PlaceParameter { place, component, parameter, .. } => {
                format!("set {component}.{parameter} in {place}")
            }
            Self::Timing(transition, _) => format!("set timing of {transition}"),
            Self::Decides(transition, _) => format!("set who decides {transition}"),
            Self::SetVariable(transition, variable, _) => {
                format!("set {variable} in {transition}")
            }
            Self::ArcKind(item, _) | Self::Weight(item, _) => format!("change {item}"),
            Self::AddArc(item) => format!("add {item}"),
            Self::AddExclusive(_) => "add an exclusive set".into(),
            Self::Exclusive(number, ..) => format!("change exclusive set {}", number + 1),
            Self::AddVariable(name, _) => format!("add variable {name}"),
            Self::AddCheck(_) => "add a check".into(),
            Self::Check(number, _) => format!("change check {}", number + 1),
            Self::AddSubmission(file) => format!("add sub-mission {file}"),
            Self::Submission(number, ..) => format!("change sub-mission {}", number + 1),
            Self::Map(name, Some(_)) => format!("set {name} of the map"),
            Self::Map(name, None) => format!("remove {name} of the map"),
            Self::Symbol(number, name, _) => format!("set {name} of symbol {}", number + 1),
            Self::Exit(route, number, name, _) => {
                format!("set {name} of exit {} of {route}", number + 1)
            }
            Self::AddExits(route) => format!("add exits to {route}"),
            Self::Decoration(..) => "edit text".into(),
            Self::Remove(items) => match &items[..] {
                [one] => format!("remove {one}"),
                many => format!("remove {} items", many.len()),
            },
        }
    }

    /// The part of it that other files may have to follow: a place or transition that is renamed or
    /// removed, or the mission itself, whose name before is given.
    pub fn name_change(&self, mission: Option<&str>) -> Option<NameChange> {
        match self {
            Self::Attribute(Item::Mission, "name", new) if new.as_deref() != mission => {
                let old = mission.map(str::to_owned);
                Some(NameChange::RenameMission { old, new: new.clone() })
            }
            Self::Rename(item @ (Item::Place(name) | Item::Transition(name)), new)
                if name != new =>
            {
                Some(NameChange::Rename { item: *item, new: new.clone() })
            }
            Self::Remove(items) => NameChange::removal(items),
            _ => None,
        }
    }

    /// Makes it.
    ///
    /// # Errors
    /// If the file does not allow it.
    pub fn apply(&self, documents: &mut Documents) -> Result<(), Refused> {
        let document = documents.mission()?;
        match self {
            Self::Rename(item, name) => document.rename(named(item)?, name)?,
            Self::Attribute(item, name, value) => {
                document.set_attribute(named(item)?, name, value.as_deref())?;
            }
            Self::Component { place, component, is_active } => {
                edits::set_component(document, place, component, *is_active)?;
            }
            Self::PlaceParameter { place, component, parameter, value } => {
                document.set_place_parameter(place, component, parameter, value.as_deref())?;
            }
            Self::Timing(transition, timing) => edits::set_timing(document, transition, timing)?,
            Self::Decides(transition, decides) => {
                edits::set_decides(document, transition, *decides)?;
            }
            Self::SetVariable(transition, variable, value) => {
                edits::set_variable(document, transition, variable, value.as_deref())?;
            }
            Self::ArcKind(Item::Arc { transition, place, kind }, to) => {
                edits::set_arc_kind(document, transition, place, *kind, *to)?;
            }
            Self::Weight(Item::Arc { transition, place, kind }, weight) => {
                edits::set_weight(document, transition, place, *kind, *weight)?;
            }
            Self::AddArc(Item::Arc { transition, place, kind }) => {
                edits::add_arc(document, transition, place, *kind)?;
            }
            Self::ArcKind(item, _) | Self::Weight(item, _) | Self::AddArc(item) => {
                return Err(Refused::Rule(format!("{item} is not an arc")));
            }
            Self::AddExclusive(components) => {
                let names: Vec<_> = components.iter().map(String::as_str).collect();
                edits::add_exclusive(document, &names)?;
            }
            Self::Exclusive(number, component, is_in) => {
                edits::toggle_exclusive(document, *number, component, *is_in)?;
            }
            Self::AddVariable(name, source) => {
                edits::add_variable(document, name, source.as_deref())?;
            }
            Self::AddCheck(text) => edits::add_check(document, text)?,
            Self::Check(number, text) => edits::set_check(document, *number, text)?,
            Self::AddSubmission(file) => edits::add_submission(document, file)?,
            Self::Submission(number, attribute, value) => {
                edits::set_submission(document, *number, attribute, value.as_deref())?;
            }
            Self::Map(name, value) => map_edits::set_map(document, name, value.as_deref())?,
            Self::Symbol(number, name, value) => {
                map_edits::set_symbol(document, *number, name, value.as_deref())?;
            }
            Self::Exit(Item::Route(route), number, name, value) => {
                map_edits::set_exit(document, route, *number, name, value.as_deref())?;
            }
            Self::AddExits(Item::Route(route)) => map_edits::add_exits(document, route)?,
            Self::Exit(item, ..) | Self::AddExits(item) => {
                return Err(Refused::Rule(format!("{item} is not a route")));
            }
            Self::Decoration(number, text) => {
                layout::write_decoration(document, View::Mission, *number, text)?;
            }
            Self::Remove(items) => edits::remove(document, items)?,
        }
        Ok(())
    }
}

fn named(item: &Item) -> Result<armor_robotfile::Item<'_>, Refused> {
    item.named().ok_or_else(|| Refused::Rule(format!("{item} has no name in the file")))
}
