//! Values that the mission gives to parameters for the duration of an activation. They go before
//! those of the file and after those of `--set`; only parameters that the component has asked for
//! are handed over.

use std::collections::BTreeSet;

use armor_wire::config::Assigned;
use armor_wire::control::GivenParameter;

use super::requests::{ParameterRequests, RequestState, is_same};

/// Origin of a value that goes before all others.
const OVERRIDE: &str = "--set";

impl ParameterRequests {
    /// Applies the values of an activation. If it `starts` the component, all of them are handed
    /// over; otherwise those that have changed. A parameter that the activation before was given and
    /// this one is not has the file's value again.
    ///
    /// # Errors
    /// In words, which of them cannot be read as the component declares them.
    pub fn give(&self, given: Vec<GivenParameter>, starts: bool) -> Result<(), String> {
        let mut state = self.lock();
        let given = given.into_iter().map(|one| (one.name, one.assigned)).collect();
        let before = std::mem::replace(&mut state.given, given);
        let names: BTreeSet<_> = before.keys().chain(state.given.keys()).cloned().collect();
        let mut problems = Vec::new();
        for name in names {
            // One that was not asked for, or not answered, gets its value with the answer.
            let Some(own) = state.own.get(&name) else { continue };
            let was = choose(before.get(&name), own.as_ref());
            let is = choose(state.given.get(&name), own.as_ref());
            if is_same(was, is) && !(starts && state.given.contains_key(&name)) {
                continue;
            }
            match self.read_value(&name, is) {
                Ok(value) => state.arrived.push_back((name, value)),
                Err(problem) => problems.push(format!("parameter `{name}`: {problem}")),
            }
        }
        self.note_arrived(&state);
        if problems.is_empty() { Ok(()) } else { Err(problems.join("; ")) }
    }
}

impl RequestState {
    /// The value that applies to a parameter whose own value is `own`.
    pub fn effective<'a>(&'a self, name: &str, own: Option<&'a Assigned>) -> Option<&'a Assigned> {
        choose(self.given.get(name), own)
    }
}

/// The value given, unless the command line sets another one; without either, the parameter's own.
fn choose<'a>(given: Option<&'a Assigned>, own: Option<&'a Assigned>) -> Option<&'a Assigned> {
    let is_overridden = own.is_some_and(|own| own.origin == OVERRIDE);
    given.filter(|_| !is_overridden).or(own)
}
