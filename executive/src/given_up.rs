//! The components that the launcher has given up. A thread of the process writes what the launcher
//! reports; the executive looks at it in every turn.

use crate::event::ControllerEvent;
use armor_plan::Plan;
use parking_lot::Mutex;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Which components are given up, and why. Clones share the list.
#[derive(Clone, Debug, Default)]
pub struct GivenUpComponents(Arc<Mutex<BTreeMap<String, String>>>);

impl GivenUpComponents {
    /// Notes that a component is given up and why, or that it is started again.
    pub fn note_component(&self, component: &str, why: Option<String>) {
        let mut list = self.0.lock();
        match why {
            Some(why) => drop(list.insert(component.to_owned(), why)),
            None => drop(list.remove(component)),
        }
    }

    /// Returns why a mission need not wait for all of its components: the first one given up.
    pub(crate) fn find_first(&self, plan: &Plan) -> Option<String> {
        let list = self.0.lock();
        plan.components().iter().find_map(|component| list.get(&component.name).cloned())
    }
}

/// What the controller knows of the list.
#[derive(Debug)]
pub(crate) struct GivenUpNews {
    components: GivenUpComponents,
    reported: BTreeMap<String, String>,
}

impl GivenUpNews {
    /// The controller knows nothing yet.
    pub(crate) fn new(components: GivenUpComponents) -> Self {
        Self { components, reported: BTreeMap::new() }
    }

    /// Returns what has changed since the last call.
    pub(crate) fn take_changes(&mut self, plan: &Plan) -> Vec<ControllerEvent> {
        let list = self.components.0.lock();
        if *list == self.reported {
            return Vec::new();
        }
        let before = std::mem::replace(&mut self.reported, list.clone());
        let has_changed = |name: &&String| before.get(*name) != list.get(*name);
        let names: BTreeSet<_> = before.keys().chain(list.keys()).filter(has_changed).collect();
        names
            .into_iter()
            .filter_map(|name| {
                let component = plan.component_named(name)?;
                Some(ControllerEvent::GivenUp { component, why: list.get(name).cloned() })
            })
            .collect()
    }
}
