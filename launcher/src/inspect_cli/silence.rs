//! Why data that a tool waits for does not arrive: no such output, a frozen component, one that has
//! not published.

use std::time::Duration;

use anyhow::{Error, anyhow};
use armor_inspect::ObservedSystem;
use armor_robotfile::advise_similar;
use armor_sdk::directory::{DirectoryError, Listing};
use armor_sdk::tap::TapError;
use armor_wire::control::{RunState, Status};

use crate::arguments::RunningSystem;
use crate::print::print_notice;

/// How long no data arrives before the silence is explained.
pub const NOTICE_AFTER: Duration = Duration::from_millis(1500);

/// Reports on stderr why no data arrives, once per reason.
pub struct SilenceReporter<'a> {
    running: &'a RunningSystem,
    tool: &'a str,
    data: &'a str,
    /// Made at the first silence.
    observed: Option<ObservedSystem>,
    reported: String,
}

impl<'a> SilenceReporter<'a> {
    /// Nothing is reported yet.
    pub fn new(running: &'a RunningSystem, tool: &'a str, data: &'a str) -> Self {
        Self { running, tool, data, observed: None, reported: String::new() }
    }

    /// Reports why no data has arrived for [`NOTICE_AFTER`], unless that was the last report.
    pub fn report(&mut self) {
        self.report_with("; waiting");
    }

    /// Reports why no data has arrived, and that it is not waited for any more.
    pub fn report_end(&mut self) {
        self.report_with("");
    }

    fn report_with(&mut self, end: &str) {
        if self.observed.is_none() {
            self.observed = super::select_system(self.running, self.tool).ok();
        }
        let Some(observed) = &self.observed else { return };
        let component = self.data.split('.').next().unwrap_or_default();
        let reason = match observed.ask_component(component) {
            Ok(status) => explain_silence(&status, self.data),
            Err(problem) => format!("`{component}` does not answer: {problem}"),
        };
        if reason != self.reported {
            print_notice(format_args!("no {} so far: {reason}{end}", self.data));
            self.reported = reason;
        }
    }
}

/// Returns why an output is silent although the link to it is up. The text is the same as long as
/// the reason is.
fn explain_silence(status: &Status, data: &str) -> String {
    let Status { name, state, exec_calls, last_error, .. } = status;
    let because = if last_error.is_empty() { String::new() } else { format!(" ({last_error})") };
    let published = status.outputs.iter().find(|output| output.data == data);
    let has_published = published.is_some_and(|output| output.published > 0);
    match state {
        RunState::Starting => format!(
            "`{name}` is still starting: its constructor runs, or it waits for its parameters"
        ),
        RunState::Frozen if status.controllable => format!(
            "`{name}` is frozen, and publishes again when the mission activates it (`armor mission \
             show` shows the mission)"
        ),
        RunState::Frozen => format!("`{name}` is frozen"),
        RunState::Done => format!("`{name}` has reported that it is done, and is not called again"),
        RunState::Failed => format!(
            "`{name}` has failed{because}; `armor restart {name}` starts it again, if no mission does"
        ),
        RunState::Active if has_published => {
            format!("`{name}` is active and has published it before, but not in the last moments")
        }
        RunState::Active if *exec_calls == 0 => format!(
            "`{name}` is active, but none of its code has been called: it has no rate, and no data \
             arrives at its inputs (`armor graph` shows them)"
        ),
        RunState::Active => format!("`{name}` is active, but has never published it{because}"),
    }
}

/// Replaces the error of a link to data that no component provides by what is known about it.
pub fn explain_missing(error: Error, observed: &ObservedSystem, data: &str) -> Error {
    match error.downcast_ref::<TapError>() {
        Some(TapError::Directory(DirectoryError::Refused(_))) => {
            explain_unprovided(observed, data).unwrap_or(error)
        }
        _ => error,
    }
}

/// Returns what is known about data that no component provides; none if the registry does not answer.
pub fn explain_unprovided(observed: &ObservedSystem, data: &str) -> Option<Error> {
    let component = data.split('.').next().unwrap_or_default();
    let status = observed.ask_component(component).ok();
    if let Some(text) = status.and_then(|status| describe_input(&status, data)) {
        return Some(anyhow!(text));
    }
    Some(anyhow!(describe_missing(&observed.list().ok()?, data)))
}

/// Returns what feeds the input, if the name is that of an input: only outputs can be read.
fn describe_input(status: &Status, data: &str) -> Option<String> {
    let (_, port) = data.split_once('.')?;
    let links: Vec<_> = status.inputs.iter().filter(|input| input.id == port).collect();
    let sources = links.iter().map(|input| input.data.as_str()).filter(|source| !source.is_empty());
    Some(match sources.collect::<Vec<_>>().as_slice() {
        [] if links.is_empty() => return None,
        [] => format!("{data} is an input, and no link feeds it"),
        [source] => format!("{data} is an input; what arrives there is {source}: give that name"),
        several => {
            let several = several.join(", ");
            format!("{data} is an input; what arrives there is {several}: give one of these names")
        }
    })
}

fn describe_missing(listing: &Listing, data: &str) -> String {
    let component = data.split('.').next().unwrap_or_default();
    let outputs = || listing.data.iter().map(|entry| entry.data.as_str());
    let advice = advise_similar(data, outputs());
    let own: Vec<&str> =
        outputs().filter(|output| output.split('.').next() == Some(component)).collect();
    let is_running = listing.components.iter().any(|entry| entry.name == component);
    match (is_running, &own[..]) {
        (true, []) => format!(
            "{data} cannot be read: `{component}` is running, but has no outputs (yet): its \
             constructor declares them"
        ),
        (true, own) => {
            format!(
                "`{component}` has no output called {data}{advice} (it has: {})",
                own.join(", ")
            )
        }
        (false, _) => {
            let names = listing.components.iter().map(|entry| entry.name.as_str());
            let advice = if advice.is_empty() { advise_similar(component, names) } else { advice };
            format!(
                "no component provides {data}: none called `{component}` is running{advice} \
                 (`armor data list` lists all outputs)"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_wire::control::{InputStatus, OutputStatus};
    use armor_wire::registry::{ComponentEntry, DataEntry};

    fn listing() -> Listing {
        let component = |name: &str| ComponentEntry {
            name: name.into(),
            kind: "k".into(),
            instance: 1,
            pid: 1,
            host: "h".into(),
            endpoint: "e".into(),
        };
        let data = |data: &str| DataEntry {
            data: data.into(),
            type_name: "Number".into(),
            schema: "f64".into(),
            latched: false,
        };
        Listing {
            components: vec![component("laser"), component("arm")],
            data: vec![data("laser.scan"), data("laser.range")],
        }
    }

    #[test]
    fn a_name_that_does_not_exist_is_answered_with_one_that_does() {
        let check = |data, part: &str| {
            let text = describe_missing(&listing(), data);
            assert!(text.contains(part), "{text}");
        };
        check("laser.scna", "`laser` has no output called laser.scna; did you mean laser.scan?");
        check("laser.ran", "`laser` has no output called laser.ran; did you mean laser.range?");
        check("laser.power", "(it has: laser.scan, laser.range)");
        check("lasr.scan", "none called `lasr` is running; did you mean laser.scan?");
        check("lasr.x", "did you mean laser?");
        check("arm.angle", "has no outputs (yet)");
        check("wheel.speed", "`armor data list`");
    }

    fn status(state: RunState, exec_calls: u64, published: u64) -> Status {
        let (id, data, type_name) = ("scan".into(), "laser.scan".into(), "Scan".into());
        Status {
            name: "laser".into(),
            kind: "laser".into(),
            state,
            activation: 0,
            controllable: true,
            uptime_s: 1.0,
            exec_calls,
            skipped_ticks: 0,
            skipped_share: 0.0,
            clock_offset_s: 0.0,
            clock_error_s: None,
            last_error: "no power".into(),
            untaken_events: 0,
            time_s: 0.0,
            busy: false,
            call: None,
            outputs: vec![OutputStatus {
                id,
                data,
                type_name,
                published,
                published_bytes: 0,
                links: Vec::new(),
            }],
            inputs: Vec::new(),
        }
    }

    #[test]
    fn an_input_is_answered_with_the_output_that_feeds_it() {
        let input = |id: &str, data: &str| InputStatus {
            id: id.into(),
            data: data.into(),
            connected: true,
            received: 0,
            waiting: 0,
            lost: 0,
            dropped: 0,
            skipped: 0,
            history_dropped: 0,
            connections: 1,
            problem: String::new(),
        };
        let inputs = vec![
            input("pose", "slam.pose"),
            input("goal", ""),
            input("scans", "front.scan"),
            input("scans", "rear.scan"),
        ];
        let status = Status { inputs, ..status(RunState::Active, 0, 0) };
        let text = describe_input(&status, "laser.pose").expect("an input");
        assert_eq!(text, "laser.pose is an input; what arrives there is slam.pose: give that name");
        let text = describe_input(&status, "laser.goal").expect("an input");
        assert_eq!(text, "laser.goal is an input, and no link feeds it");
        let text = describe_input(&status, "laser.scans").expect("an input");
        assert!(text.ends_with("is front.scan, rear.scan: give one of these names"), "{text}");
        assert_eq!(describe_input(&status, "laser.scan"), None);
    }

    #[test]
    fn silence_is_explained_by_what_the_component_does() {
        let check = |status, part: &str| {
            let text = explain_silence(&status, "laser.scan");
            assert!(text.contains(part), "{text}");
        };
        check(status(RunState::Frozen, 7, 7), "is frozen");
        check(status(RunState::Starting, 0, 0), "still starting");
        check(status(RunState::Failed, 7, 7), "has failed (no power); `armor restart laser`");
        check(status(RunState::Done, 7, 7), "is done");
        check(status(RunState::Active, 7, 0), "has never published it (no power)");
        check(status(RunState::Active, 0, 0), "none of its code has been called");
        check(status(RunState::Active, 7, 7), "has published it before");
    }
}
