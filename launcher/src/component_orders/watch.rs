//! `armor watch NAME`: the changes of a component's state, its reports, its deaths and starts, as
//! they come.

use std::process::ExitCode;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use armor_inspect::run_control::{self, AbsentState, ComponentHistory, RunRequest};
use armor_inspect::systems::RunRecord;
use armor_inspect::words::describe_call;
use armor_inspect::{LONG_CALL_S, ObservedSystem};
use armor_sdk::control::{Answer, ControlConnection, ControlEvent, ReportKind, Role};
use armor_wire::registry::ComponentEntry;
use clap::Args;
use serde_json::{Value, json};

use crate::arguments::{OutputFormat, RunningSystem, parse_name};
use crate::date::format_clock_time;
use crate::inspect_cli::select_system;
use crate::print::{end_printing, end_when_stdout_closes, print_line};
use crate::system;
use crate::verb::Verb;
use armor_robotfile::advise_similar;

/// Time between two looks at whether a component is registered again.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// Longest time from the end of a connection until the launcher has noticed the end of the process:
/// the silence after which it kills one, and the time for the last lines of its output.
const CAUSE_WITHIN: Duration = Duration::from_secs(5);

/// Follow what a component does: its states, its reports to the mission, its deaths and starts.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor watch explorer
  armor watch explorer --count 3        the next three lines
  armor --format json watch explorer    one JSON object per line")]
pub struct WatchArguments {
    /// The component.
    #[arg(value_parser = parse_name)]
    pub component: String,
    /// Stop after N lines.
    #[arg(long, short = 'n', value_name = "N")]
    pub count: Option<u64>,
    #[command(flatten)]
    pub running: RunningSystem,
}

impl Verb for WatchArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        end_when_stdout_closes();
        let observed = select_system(&self.running, "watch")?;
        let mut printer = WatchPrinter {
            component: &self.component,
            format,
            observed: &observed,
            // Only the launcher knows why a process has ended; it is asked where it is of this user.
            record: system::find_record(&self.running).ok(),
            left: self.count.unwrap_or(u64::MAX),
            call: false,
            ended: None,
            closed: None,
            instance: None,
        };
        if printer.fetch_history().is_none() {
            check_name(&observed, &self.component)?;
        }
        Ok(end_printing(printer.follow())?.into())
    }
}

/// # Errors
/// If the registry does not answer, or no such component is registered.
pub(super) fn check_name(observed: &ObservedSystem, component: &str) -> Result<()> {
    let components = observed.list()?.components;
    if components.iter().any(|entry| entry.name == component) {
        return Ok(());
    }
    let names: Vec<&str> = components.iter().map(|entry| entry.name.as_str()).collect();
    let advice = advise_similar(component, names.iter().copied());
    bail!("no component called {component} is running{advice} (there are: {})", names.join(", "))
}

struct WatchPrinter<'a> {
    component: &'a str,
    format: OutputFormat,
    observed: &'a ObservedSystem,
    record: Option<RunRecord>,
    /// Lines to be printed.
    left: u64,
    /// The call that runs has been shown.
    call: bool,
    /// Number of its processes whose end needs no line any more; none before the first look.
    ended: Option<u32>,
    /// Why and when the connection ended, until the end of the process is known.
    closed: Option<(String, Instant)>,
    /// The process start that was connected last.
    instance: Option<u64>,
}

impl WatchPrinter<'_> {
    /// Prints until there are enough lines, or the system ends.
    fn follow(&mut self) -> Result<()> {
        while self.left > 0 {
            let Ok(listing) = self.observed.list() else {
                if let Some((reason, _)) = self.closed.take() {
                    self.report_closed(&reason)?;
                }
                if armor_socket::has_proxy() {
                    // A system on another host may be cut off.
                    std::thread::sleep(LOOK_EVERY);
                    continue;
                }
                return self.print("the system has ended", json!({"event": "end"}));
            };
            let history = self.fetch_history();
            self.report_end(history.as_ref())?;
            let entry = listing.components.into_iter().find(|entry| entry.name == self.component);
            let (sender, events) = mpsc::channel();
            let connection = entry.and_then(|entry| {
                let sink = move |event| drop(sender.send(event));
                let connected =
                    ControlConnection::connect(&entry, Role::Observer, "armor watch", sink).ok()?;
                Some((entry, connected))
            });
            let Some((entry, _connected)) = connection else {
                std::thread::sleep(LOOK_EVERY);
                continue;
            };
            self.report_start(&entry, history.as_ref())?;
            while self.left > 0 {
                // The sender is dropped after `Closed`.
                let Ok(event) = events.recv() else { break };
                self.print_event(event)?;
            }
        }
        Ok(())
    }

    fn fetch_history(&self) -> Option<ComponentHistory> {
        let request = RunRequest::History { component: self.component.into() };
        run_control::request(self.record.as_ref()?, &request).ok()?.history
    }

    /// Prints how its last process ended, once; without the launcher, why the connection did.
    fn report_end(&mut self, history: Option<&ComponentHistory>) -> Result<()> {
        if let Some(history) = history {
            let seen = self.ended.replace(history.ended);
            // At the first look only a component that does not run is worth a line.
            let is_new = match seen {
                Some(seen) => history.ended > seen,
                None => history.state.is_some() && !history.last_end.is_empty(),
            };
            if is_new {
                self.closed = None;
                let text = describe_end(self.component, history);
                let state = history.state.map(|state| state.to_string());
                let fields = json!({"event": "gone", "reason": history.last_end, "becomes": state});
                return self.print(&text, fields);
            }
        }
        let is_unknown = |since: &Instant| history.is_none() || since.elapsed() > CAUSE_WITHIN;
        match self.closed.take_if(|(_, since)| is_unknown(since)) {
            Some((reason, _)) => self.report_closed(&reason),
            None => Ok(()),
        }
    }

    fn report_closed(&mut self, reason: &str) -> Result<()> {
        self.print(
            &format!("gone: {reason}; waiting for its next start"),
            json!({"event": "gone", "reason": reason}),
        )
    }

    /// Prints that another process of it runs, if an earlier one did.
    fn report_start(
        &mut self,
        entry: &ComponentEntry,
        history: Option<&ComponentHistory>,
    ) -> Result<()> {
        if let Some((reason, _)) = self.closed.take() {
            self.report_closed(&reason)?;
        }
        let before = self.instance.replace(entry.instance);
        if before.is_none_or(|before| before == entry.instance) {
            return Ok(());
        }
        let (pid, start) = (entry.pid, history.map(|history| history.starts));
        let number = start.map(|start| format!(", start number {start}")).unwrap_or_default();
        self.print(
            &format!("started again: process {pid}{number}"),
            json!({"event": "start", "pid": pid, "start": start}),
        )
    }

    fn print_event(&mut self, event: ControlEvent) -> Result<()> {
        match event {
            ControlEvent::Answer(Answer::State { state, activation, .. }) => self.print(
                &match activation {
                    0 => state.to_string(),
                    activation => format!("{state}, activation {activation}"),
                },
                json!({"event": "state", "state": state, "activation": activation}),
            ),
            ControlEvent::Answer(Answer::Report { activation, outcome, .. }) => {
                let (text, mut fields) = describe_report(&outcome);
                fields["activation"] = activation.into();
                self.print(&text, fields)
            }
            ControlEvent::Answer(Answer::Beat { call }) => {
                let long = call.filter(|call| call.call_s >= LONG_CALL_S);
                let was_shown = std::mem::replace(&mut self.call, long.is_some());
                let Some(call) = long.filter(|_| !was_shown) else { return Ok(()) };
                let fields = json!({
                    "event": "long-call",
                    "function": call.function,
                    "call_s": call.call_s,
                });
                self.print(&describe_call(&call), fields)
            }
            ControlEvent::Answer(_) => Ok(()),
            ControlEvent::Closed(reason) => {
                self.closed = Some((reason, Instant::now()));
                Ok(())
            }
        }
    }

    fn print(&mut self, text: &str, mut fields: Value) -> Result<()> {
        self.left = self.left.saturating_sub(1);
        let now_s = self.observed.timestamp();
        if self.format == OutputFormat::Json {
            fields["component"] = self.component.into();
            fields["stamp_s"] = now_s.into();
            return print_line(fields);
        }
        print_line(format_args!("{}  {}  {text}", format_clock_time(now_s), self.component))
    }
}

/// Returns how its last process ended, and what brings the next one.
fn describe_end(component: &str, history: &ComponentHistory) -> String {
    let last_end = &history.last_end;
    match history.state {
        Some(AbsentState::Ended | AbsentState::Stopped | AbsentState::GivenUp) => {
            format!("gone: {last_end}; `armor restart {component}` starts it")
        }
        Some(AbsentState::Starting) | None => format!("gone: {last_end}"),
    }
}

fn describe_report(outcome: &ReportKind) -> (String, Value) {
    match outcome {
        ReportKind::Done => ("reports done".into(), json!({"event": "report", "report": "done"})),
        ReportKind::Failed { reason } => (
            format!("reports failed: {reason}"),
            json!({"event": "report", "report": "failed", "reason": reason}),
        ),
        ReportKind::Event { name, value } => (
            format!("reports {name}, value {value}"),
            json!({"event": "report", "report": name, "value": value}),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_names_its_cause_and_what_brings_the_next_start() {
        let history = |state, last_end: &str| ComponentHistory {
            state,
            starts: 2,
            ended: 2,
            last_end: last_end.into(),
        };
        let check = |state, last_end, expected: &str| {
            assert_eq!(describe_end("arm", &history(state, last_end)), expected);
        };
        let killed = "ended by signal 9 (SIGKILL); it starts again in 0.1 s";
        let gone = "gone: ended by signal 9 (SIGKILL); it starts again in 0.1 s";
        check(Some(AbsentState::Starting), killed, gone);
        check(None, killed, gone);
        check(
            Some(AbsentState::GivenUp),
            "ended with code 7; it is given up after 5 starts in 1.6 s",
            "gone: ended with code 7; it is given up after 5 starts in 1.6 s; `armor restart arm` \
             starts it",
        );
    }

    #[test]
    fn reports_are_lines_for_people_and_objects_for_programs() {
        let event = ReportKind::Event { name: "half".into(), value: 0.5 };
        let (text, fields) = describe_report(&event);
        assert_eq!(text, "reports half, value 0.5");
        assert_eq!(fields, json!({"event": "report", "report": "half", "value": 0.5}));
        let (text, fields) = describe_report(&ReportKind::Failed { reason: "no power".into() });
        assert_eq!(
            (text.as_str(), &fields["reason"]),
            ("reports failed: no power", &json!("no power"))
        );
    }
}
