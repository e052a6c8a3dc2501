//! `armor watch NAME`: the changes of a component's state, and its reports, as they come.

use std::process::ExitCode;
use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Result, bail};
use armor_inspect::words::describe_call;
use armor_inspect::{LONG_CALL_S, ObservedSystem};
use armor_sdk::control::{Answer, ControlConnection, ControlEvent, ReportKind, Role};
use clap::Args;
use serde_json::{Value, json};

use crate::arguments::{OutputFormat, RunningSystem, parse_name};
use crate::date::format_clock_time;
use crate::inspect_cli::select_system;
use crate::print::{end_printing, end_when_stdout_closes, print_line};
use crate::verb::Verb;
use armor_robotfile::advise_similar;

/// Time between two looks at whether a component is registered again.
const LOOK_EVERY: Duration = Duration::from_millis(200);

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
        check_name(&observed, &self.component)?;
        let left = self.count.unwrap_or(u64::MAX);
        let mut printer = WatchPrinter {
            component: &self.component,
            format,
            observed: &observed,
            left,
            call: false,
        };
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
    /// Lines to be printed.
    left: u64,
    /// The call that runs has been shown.
    call: bool,
}

impl WatchPrinter<'_> {
    /// Prints until there are enough lines, or the system ends.
    fn follow(&mut self) -> Result<()> {
        while self.left > 0 {
            let Ok(listing) = self.observed.list() else {
                return self.print("the system has ended", json!({"event": "end"}));
            };
            let entry = listing.components.into_iter().find(|entry| entry.name == self.component);
            let (sender, events) = mpsc::channel();
            let connection = entry.and_then(|entry| {
                let sink = move |event| drop(sender.send(event));
                ControlConnection::connect(&entry, Role::Observer, "armor watch", sink).ok()
            });
            if connection.is_none() {
                std::thread::sleep(LOOK_EVERY);
                continue;
            }
            while self.left > 0 {
                // The sender is dropped after `Closed`.
                let Ok(event) = events.recv() else { break };
                self.print_event(event)?;
            }
        }
        Ok(())
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
            ControlEvent::Closed(reason) => self.print(
                &format!("gone: {reason}; waiting for its next start"),
                json!({"event": "gone", "reason": reason}),
            ),
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
