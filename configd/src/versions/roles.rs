//! Which components the mission commands. A component learns it once, when it starts, and the
//! executive refuses a version of the file that would have it otherwise while the system runs. A
//! process that restarts under such a version must therefore get the same answer as before:
//! otherwise it would be active by itself together with components that exclude it.

use std::collections::BTreeMap;

use armor_robotfile::Configuration;

/// Whether the mission commands each component, by the first version that had it.
#[derive(Debug, Default)]
pub(super) struct Roles(BTreeMap<String, bool>);

impl Roles {
    /// Adds the roles of components that no earlier version had.
    pub(super) fn add_roles(&mut self, configuration: &Configuration) {
        for component in &configuration.system.components {
            let name = &component.name.value;
            if !self.0.contains_key(name) {
                self.0.insert(name.clone(), configuration.commands(component));
            }
        }
    }

    /// Whether the mission commands a component, as long as the system runs.
    pub(super) fn is_commanded(&self, component: &str) -> bool {
        self.0.get(component).copied().unwrap_or_default()
    }
}
