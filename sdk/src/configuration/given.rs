//! Values that the mission gives for as long as an activation lasts. They go over those of the file,
//! and below those of `--set`; only parameters that the component has asked for are handed over.

use std::collections::BTreeSet;
use std::sync::atomic::Ordering;

use armor_wire::config::Assigned;
use armor_wire::control::GivenParameter;

use super::{Asking, State, is_same, value_of};
use crate::shared::Shared;

/// Where a value is from that goes over all others.
const OVERRIDE: &str = "--set";

impl Asking {
    /// Takes in the values of an activation. If it is `fresh`, all of them are handed over; else
    /// those that are not as they were. What the activation before was given and this one is not is
    /// as the file has it again.
    ///
    /// # Errors
    /// In words, which of them cannot be read as what the component declares.
    pub fn give(
        &self,
        shared: &Shared,
        given: Vec<GivenParameter>,
        fresh: bool,
    ) -> Result<(), String> {
        let mut state = self.lock();
        let given = given.into_iter().map(|one| (one.name, one.assigned)).collect();
        let before = std::mem::replace(&mut state.given, given);
        let names: BTreeSet<_> = before.keys().chain(state.given.keys()).cloned().collect();
        let mut problems = Vec::new();
        for name in names {
            // One that was not asked for, or not answered, is given its value when it is.
            let Some(own) = state.own.get(&name) else { continue };
            let was = over(before.get(&name), own.as_ref());
            let is = over(state.given.get(&name), own.as_ref());
            if is_same(was, is) && !(fresh && state.given.contains_key(&name)) {
                continue;
            }
            match value_of(shared.declaration(&name), shared, is) {
                Ok(value) => state.arrived.push_back((name, value)),
                Err(problem) => problems.push(format!("parameter `{name}`: {problem}")),
            }
        }
        self.arrived.store(!state.arrived.is_empty(), Ordering::Release);
        if problems.is_empty() { Ok(()) } else { Err(problems.join("; ")) }
    }
}

impl State {
    /// What holds of a parameter whose own value is `own`.
    pub(super) fn in_force<'a>(
        &'a self,
        name: &str,
        own: Option<&'a Assigned>,
    ) -> Option<&'a Assigned> {
        over(self.given.get(name), own)
    }
}

/// The value given, over the component's own one; nothing is its default.
fn over<'a>(given: Option<&'a Assigned>, own: Option<&'a Assigned>) -> Option<&'a Assigned> {
    let is_overridden = own.is_some_and(|own| own.origin == OVERRIDE);
    given.filter(|_| !is_overridden).or(own)
}
