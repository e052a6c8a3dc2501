//! Values that running components have refused: the file has them, but they are not in force.

use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

use armor_inspect::ObservedSystem;

use crate::arguments::RunningSystem;
use crate::inspect_cli::select_system;

/// How long a component may take to refuse a value that was set.
const REFUSED_WITHIN: Duration = Duration::from_secs(1);
/// Time between two looks at it.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// The components of a running system, as far as they answer.
pub struct RefusalReader {
    observed: Option<ObservedSystem>,
}

impl RefusalReader {
    /// Finds the system. One that cannot be asked has refused nothing.
    pub fn open(running: &RunningSystem) -> Self {
        Self { observed: select_system(running, "param").ok() }
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
