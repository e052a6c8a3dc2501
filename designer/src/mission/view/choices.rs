//! What the small list at the pointer offers: what can be added there, and what an arc dropped on
//! nothing can be connected with.

use eframe::egui::Pos2;

use crate::canvas::PortAt;
use crate::item::Item;
use crate::panels::pick::{Entry, Picker};
use crate::workspace::Workspace;

/// What is done with what is picked.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum MissionChoice {
    /// A place, and the components that it activates.
    Place(Vec<String>),
    /// A transition.
    Transition,
    /// A transition that leads on to a new place.
    TransitionAndPlace(Vec<String>),
    /// These are joined.
    Join(PortAt, PortAt),
}

/// The list.
pub(super) struct MissionPicker {
    pub(super) picker: Picker,
    pub(super) name: &'static str,
    pub(super) entries: Vec<Entry<MissionChoice>>,
    pub(super) at: Pos2,
    /// What the arc comes from, and whether it is drawn backwards.
    pub(super) from: Option<(Item, bool)>,
}

impl MissionPicker {
    /// Everything that can be added.
    pub(super) fn to_add(workspace: &Workspace, at: Pos2) -> Self {
        let mut entries = vec![
            entry("place", "A state of the mission.", MissionChoice::Place(Vec::new())),
            entry("transition", "A change of state.", MissionChoice::Transition),
        ];
        entries.extend(components(workspace).into_iter().map(|name| {
            let label = format!("place with {name}");
            entry(&label, "A place that activates it.", MissionChoice::Place(vec![name]))
        }));
        Self { picker: Picker::default(), name: "Add to the mission", entries, at, from: None }
    }
}

pub(super) fn entry(name: &str, about: &str, value: MissionChoice) -> Entry<MissionChoice> {
    Entry { name: name.to_owned(), about: about.to_owned(), value }
}

/// The components that a mission may control.
pub(super) fn components(workspace: &Workspace) -> Vec<String> {
    let system = workspace.project.configuration().map(|configuration| &configuration.system);
    let components = system.into_iter().flat_map(|system| &system.components);
    let kinds = workspace.project.kinds();
    let may = components.filter(|component| kinds.explain_uncontrolled(component).is_none());
    may.map(|component| component.name.value.clone()).collect()
}
