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
    /// over; otherwise those that have changed. A parameter that the activation before was given
    /// and this one is not has the file's value again.
    ///
    /// # Errors
    /// In words, which of them cannot be read as the component declares them.
    pub fn apply_given(&self, given: Vec<GivenParameter>, starts: bool) -> Result<(), String> {
        let mut state = self.lock_state();
        let given = given.into_iter().map(|one| (one.name, one.assigned)).collect();
        let before = std::mem::replace(&mut state.given, given);
        let names: BTreeSet<_> = before.keys().chain(state.given.keys()).cloned().collect();
        let mut problems = Vec::new();
        for name in names {
            // One that was not asked for, or not answered, gets its value with the answer.
            let Some(own) = state.own.get(&name) else { continue };
            let was = choose_value(before.get(&name), own.as_ref());
            let is = choose_value(state.given.get(&name), own.as_ref());
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
    pub fn effective_value<'a>(
        &'a self,
        name: &str,
        own: Option<&'a Assigned>,
    ) -> Option<&'a Assigned> {
        choose_value(self.given.get(name), own)
    }
}

/// The value given, unless the command line sets another one; without either, the parameter's own.
fn choose_value<'a>(
    given: Option<&'a Assigned>,
    own: Option<&'a Assigned>,
) -> Option<&'a Assigned> {
    let is_overridden = own.is_some_and(|own| own.origin == OVERRIDE);
    given.filter(|_| !is_overridden).or(own)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use armor_wire::manifest::ParameterManifest;

    use super::*;
    use crate::identity::ProcessIdentity;
    use crate::parameter::Parameter;
    use crate::wake::Wakers;

    const SPEED: Parameter = Parameter::number("speed", "m/s").default("2m/s").range(0.0, 10.0);

    fn requests() -> ParameterRequests {
        let identity = ProcessIdentity { name: "mover".into(), kind: "mover".into(), instance: 1 };
        let declared: Vec<ParameterManifest> = vec![SPEED.manifest()];
        ParameterRequests::new(Arc::new(identity), declared, Arc::new(Wakers::new().unwrap()))
    }

    fn assigned(text: &str, origin: &str) -> Assigned {
        Assigned { text: text.into(), base: String::new(), origin: origin.into() }
    }

    fn given(text: &str) -> Vec<GivenParameter> {
        vec![GivenParameter { name: "speed".into(), assigned: assigned(text, "robot.xml:9:1") }]
    }

    /// The values that are handed over, in m/s.
    fn handed(requests: &ParameterRequests) -> Vec<f64> {
        let next = || requests.take_arrived().map(|(_, value)| value.number().unwrap());
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn values_of_the_mission_go_before_the_files_for_the_duration_of_the_activation() {
        let requests = requests();
        requests.ask_for("speed");
        requests.accept_answer("speed", Some(&assigned("1m/s", "robot.xml:3:1")));
        assert_eq!(handed(&requests), [1.0]);
        requests.apply_given(given("50cm/s"), true).unwrap();
        assert_eq!(handed(&requests), [0.5]);
        requests.apply_given(given("50cm/s"), false).unwrap();
        assert_eq!(handed(&requests), [] as [f64; 0], "it is active and has the value");
        requests.accept_answer("speed", Some(&assigned("3m/s", "robot.xml:3:1")));
        assert_eq!(handed(&requests), [] as [f64; 0], "the mission's value hides the file's");
        requests.apply_given(Vec::new(), true).unwrap();
        assert_eq!(handed(&requests), [3.0]);
    }

    #[test]
    fn values_of_the_command_line_go_before_the_missions() {
        let requests = requests();
        requests.ask_for("speed");
        requests.accept_answer("speed", Some(&assigned("4m/s", OVERRIDE)));
        assert_eq!(handed(&requests), [4.0]);
        requests.apply_given(given("1m/s"), false).unwrap();
        assert_eq!(handed(&requests), [] as [f64; 0]);
    }

    #[test]
    fn a_value_that_is_not_in_its_range_is_refused_with_its_place() {
        let requests = requests();
        requests.ask_for("speed");
        requests.accept_answer("speed", None);
        assert_eq!(handed(&requests), [2.0], "its default");
        let problem = requests.apply_given(given("11m/s"), true).unwrap_err();
        assert!(problem.contains("`speed`") && problem.contains("robot.xml:9:1"), "{problem}");
    }
}
