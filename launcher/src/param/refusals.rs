//! Values that are in the file and not in force: those that running components have refused, and those
//! that have not reached them.

use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

use armor_inspect::run_control::AbsentState;
use armor_inspect::words::describe_call;
use armor_inspect::{HANGING_CALL_S, ObservedSystem};
use armor_wire::control::Status;

use crate::arguments::RunningSystem;
use crate::inspect_cli::absence::list_absent;
use crate::inspect_cli::select_system;

/// How long a component may take to refuse a value that was set.
const REFUSED_WITHIN: Duration = Duration::from_secs(1);
/// Time between two looks at it.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// The components of a running system, as far as they answer.
pub struct RefusalReader {
    observed: Option<ObservedSystem>,
    running: RunningSystem,
}

impl RefusalReader {
    /// Finds the system. One that cannot be asked has refused nothing.
    pub fn open(running: &RunningSystem) -> Self {
        Self { observed: select_system(running, "param").ok(), running: running.clone() }
    }

    /// Returns what is wrong with each component, by its name.
    pub fn list_problems(&self) -> BTreeMap<String, String> {
        let sightings = self.observed.as_ref().and_then(|observed| observed.ask_statuses().ok());
        let statuses = sightings.into_iter().flatten().filter_map(|sighting| sighting.status.ok());
        statuses.map(|status| (status.name, status.last_error)).collect()
    }

    /// Returns why a component refuses the value that it has of a parameter now, if it does.
    pub fn find_refusal(&self, component: &str, parameter: &str) -> Option<String> {
        let status = self.observed.as_ref()?.ask_component(component).ok()?;
        refusal_of(&status.last_error, parameter).map(str::to_owned)
    }

    /// Returns why a component does not get a live value now, and when it will; `None` if it does.
    pub fn find_obstacle(&self, component: &str) -> Option<String> {
        let status = self.observed.as_ref()?.ask_component(component);
        if let Ok(status) = &status {
            return describe_delay(status);
        }
        let absent = list_absent(&self.running);
        let absent = absent.into_iter().find(|absent| absent.component == component)?;
        let state = match absent.state {
            AbsentState::Starting => {
                return Some(format!("{component} is being started, and has it then"));
            }
            AbsentState::Stopped => "is stopped",
            AbsentState::Ended => "has ended",
            AbsentState::GivenUp => "is given up",
        };
        Some(format!(
            "{component} {state}, and has it when it is started again: `armor restart {component}`"
        ))
    }

    /// Waits until a component refuses the value of a parameter otherwise than `before`, for a
    /// limited time.
    pub fn await_refusal(
        &self,
        component: &str,
        parameter: &str,
        before: Option<&str>,
    ) -> Option<String> {
        let deadline = Instant::now() + REFUSED_WITHIN;
        while Instant::now() < deadline {
            let refusal = self.find_refusal(component, parameter);
            if refusal.is_some() && refusal.as_deref() != before {
                return refusal;
            }
            thread::sleep(LOOK_EVERY);
        }
        None
    }
}

/// Returns that the component's own code delays a value, if it does.
fn describe_delay(status: &Status) -> Option<String> {
    let component = &status.name;
    let call = status.call.as_ref().filter(|call| call.call_s >= HANGING_CALL_S)?;
    Some(format!("{component} is {}, and gets it when that returns", describe_call(call)))
}

/// Returns the part of a component's problem that is about one parameter.
pub fn refusal_of<'a>(problem: &'a str, parameter: &str) -> Option<&'a str> {
    let begin = problem.find(&format!("parameter `{parameter}`: "))?;
    let rest = &problem[begin..];
    let end = rest.find("; parameter `").unwrap_or(rest.len());
    Some(&rest[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_about_one_parameter() {
        let problem = "no echo; parameter `speed`: too fast; its last good value stays in force; \
                       parameter `side`: not that one";
        let speed = "parameter `speed`: too fast; its last good value stays in force";
        assert_eq!(refusal_of(problem, "speed"), Some(speed));
        assert_eq!(refusal_of(problem, "side"), Some("parameter `side`: not that one"));
        assert_eq!(refusal_of(problem, "sid"), None);
        assert_eq!(refusal_of("", "speed"), None);
    }
}
