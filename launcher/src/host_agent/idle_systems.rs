//! Which systems an agent can forget: those of which nothing has run for a while. A launcher that is cut
//! off may still ask how a process has ended, so they are kept for some time.

use std::collections::HashMap;
use std::time::{Duration, Instant};

/// How long an agent remembers a system of which nothing runs.
const KEPT_FOR: Duration = Duration::from_secs(600);

/// The systems of which nothing runs, and since when.
#[derive(Debug, Default)]
pub(super) struct IdleSystems(HashMap<String, Instant>);

impl IdleSystems {
    /// Takes all systems, each with whether something of it runs, and returns those to be forgotten.
    pub(super) fn list_expired(
        &mut self,
        systems: impl IntoIterator<Item = (String, bool)>,
        now: Instant,
    ) -> Vec<String> {
        let idle = systems.into_iter().filter(|(_, is_used)| !is_used);
        let since = |system: &String| self.0.get(system).copied().unwrap_or(now);
        let idle = idle.map(|(system, _)| (since(&system), system));
        self.0 = idle.map(|(since, system)| (system, since)).collect();
        let is_expired = |since: &Instant| now.saturating_duration_since(*since) >= KEPT_FOR;
        let expired = self.0.iter().filter(|(_, since)| is_expired(since));
        expired.map(|(system, _)| system.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_forgotten_once_nothing_of_it_has_run_for_long() {
        let mut idle = IdleSystems::default();
        let start = Instant::now();
        let mut check = |after_s: u64, used: [bool; 2], expected: &[&str]| {
            let systems = ["a", "b"].map(str::to_owned).into_iter().zip(used);
            let now = start + Duration::from_secs(after_s);
            assert_eq!(idle.list_expired(systems, now), expected, "after {after_s} s");
        };
        check(0, [false, true], &[]);
        check(599, [false, false], &[]);
        check(600, [false, false], &["a"]);
        // What runs again is remembered from then on.
        check(601, [true, false], &[]);
        check(602, [false, false], &[]);
        check(1199, [false, false], &["b"]);
        assert!(idle.list_expired([], start).is_empty() && idle.0.is_empty());
    }
}
