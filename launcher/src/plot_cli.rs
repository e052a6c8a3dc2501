//! `armor plot DATA.FIELD…`: values over time, as a chart in the terminal, a picture, or JSON.

mod chart;
mod curves;
mod sources;

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use armor_inspect::MAX_POINTS;
use armor_picture::plot_sheet::PictureFormat;
use clap::Args;
use ratatui::crossterm::event::{KeyCode, KeyModifiers};
use serde_json::json;

use crate::arguments::{OutputFormat, RunningSystem, parse_duration};
use crate::exit::CommandEnding;
use crate::print::{
    end_printing, end_when_stdout_closes, print_line, print_notice, terminal_width,
};
use crate::terminal_session::{SessionEvent, TerminalSession};
use crate::verb::Verb;
use curves::PlotCurves;
use sources::{PlottedField, SourceEvent, follow_fields};

/// How long values are collected, if they are not shown on a terminal and no time is given.
const USUAL_TIME: Duration = Duration::from_secs(10);
/// Time between two drawings: the eye sees no more than ten a second.
const DRAW_EVERY: Duration = Duration::from_millis(100);
/// Size of a chart that is printed.
const PRINTED_HEIGHT: u16 = 20;
const PRINTED_WIDTH: usize = 80;
/// Most fields of one plot; more cannot be distinguished.
const MAX_FIELDS: usize = 8;

/// Plot values of fields over time.
///
/// A terminal shows them as they come, until q or --for; a pipe gets one chart after the time of --for,
/// and --png writes it into a file. Fields with the same unit share a chart. A slow terminal loses its
/// own copies of the data, and delays no component.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor plot simulator.odometry.pose.pose.position.x driver.velocity.linear.x
  armor plot simulator.scan.ranges.0 --window 60s
  armor plot driver.velocity.linear.x --for 30s --png speed.png")]
pub struct PlotArguments {
    /// COMPONENT.OUTPUT.FIELD, the field as `armor describe` lists it; without FIELD the only number of
    /// the message.
    #[arg(required = true, value_name = "DATA.FIELD", value_parser = sources::parse_field)]
    fields: Vec<PlottedField>,
    /// The time that the chart on a terminal shows.
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "20s")]
    window: Duration,
    /// Collect values for this time, then end; 10s unless they are shown on a terminal.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_duration)]
    duration: Option<Duration>,
    /// Write the chart into a file, FILE.png or FILE.svg.
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for PlotArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(plot_fields(&self, format)?.into())
    }
}

fn plot_fields(arguments: &PlotArguments, format: OutputFormat) -> Result<CommandEnding> {
    if arguments.fields.len() > MAX_FIELDS {
        bail!("{} fields are given; one plot has at most {MAX_FIELDS}", arguments.fields.len());
    }
    if let Some(path) = &arguments.png {
        // A wrong name is reported before the values are collected.
        PictureFormat::from_path(path)?;
    }
    let events = follow_fields(&arguments.running, &arguments.fields)?;
    let mut curves = PlotCurves::new(&arguments.fields);
    let is_shown = io::stdout().is_terminal() && arguments.png.is_none();
    let ending = match format {
        OutputFormat::Json => print_values(arguments, &events)?,
        _ if is_shown => show_curves(arguments, &events, &mut curves)?,
        _ => {
            collect_values(arguments, &events, &mut curves)?;
            print_curves(arguments, &curves)?
        }
    };
    Ok(ending)
}

/// Takes values until `end`. Calls `take` with each.
fn take_until(
    end: Option<Instant>,
    events: &Receiver<SourceEvent>,
    mut take: impl FnMut(SourceEvent) -> Result<()>,
) -> Result<()> {
    loop {
        let left = end.map_or(DRAW_EVERY, |end| end.saturating_duration_since(Instant::now()));
        if left.is_zero() {
            return Ok(());
        }
        match events.recv_timeout(left) {
            Ok(SourceEvent::Failed(error)) => return Err(error),
            Ok(event) => take(event)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => bail!("the data are no longer followed"),
        }
    }
}

fn collect_values(
    arguments: &PlotArguments,
    events: &Receiver<SourceEvent>,
    curves: &mut PlotCurves,
) -> Result<()> {
    let end = Instant::now() + arguments.duration.unwrap_or(USUAL_TIME);
    take_until(Some(end), events, |event| {
        curves.add_event(event);
        Ok(())
    })
}

/// Prints each value as a line.
fn print_values(
    arguments: &PlotArguments,
    events: &Receiver<SourceEvent>,
) -> Result<CommandEnding> {
    end_when_stdout_closes();
    let end = arguments.duration.map(|duration| Instant::now() + duration);
    let mut has_values = false;
    let printed = end_printing(take_until(end, events, |event| {
        let SourceEvent::Value { field, stamp_s, value } = event else { return Ok(()) };
        has_values = true;
        let PlottedField { data, path } = &arguments.fields[field];
        print_line(json!({"data": data, "field": path, "stamp_s": stamp_s, "value": value}))
    }))?;
    Ok(if has_values { printed } else { report_nothing() })
}

/// Prints the chart, or writes it into the file.
fn print_curves(arguments: &PlotArguments, curves: &PlotCurves) -> Result<CommandEnding> {
    if curves.is_empty() {
        return Ok(report_nothing());
    }
    if curves.forgotten() > 0 {
        print_notice(format_args!(
            "the first {} values are left out: a curve has at most {MAX_POINTS} points",
            curves.forgotten()
        ));
    }
    let Some(path) = &arguments.png else {
        let width = terminal_width().unwrap_or(PRINTED_WIDTH);
        let width = u16::try_from(width).unwrap_or(u16::MAX);
        let text = chart::format_chart(curves, width, PRINTED_HEIGHT);
        return end_printing(print_line(text.trim_end()));
    };
    chart::draw_sheet(curves)
        .write_file(path)
        .with_context(|| format!("{} cannot be written", path.display()))?;
    end_printing(print_line(format_args!("{} values are in {}", curves.len(), path.display())))
}

fn report_nothing() -> CommandEnding {
    print_notice("no value has arrived; `armor hz` reports why an output is silent");
    CommandEnding::Failed
}

/// Shows the curves until the user, a signal or the time ends it.
fn show_curves(
    arguments: &PlotArguments,
    events: &Receiver<SourceEvent>,
    curves: &mut PlotCurves,
) -> Result<CommandEnding> {
    let end = arguments.duration.map(|duration| Instant::now() + duration);
    let window_s = arguments.window.as_secs_f64();
    let mut session = TerminalSession::enter()?;
    loop {
        while let Ok(event) = events.try_recv() {
            match event {
                SourceEvent::Failed(error) => return Err(error),
                event => curves.add_event(event),
            }
        }
        session.draw(|frame| chart::draw(frame, curves, Some(window_s)))?;
        if end.is_some_and(|end| Instant::now() >= end) {
            return Ok(CommandEnding::Fine);
        }
        match session.next_event(DRAW_EVERY)? {
            SessionEvent::Signal => return Ok(CommandEnding::Interrupted),
            SessionEvent::Key(key) => match key.code {
                KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => {
                    return Ok(CommandEnding::Interrupted);
                }
                KeyCode::Char('q') | KeyCode::Esc => return Ok(CommandEnding::Fine),
                _ => {}
            },
            SessionEvent::Resized | SessionEvent::Nothing => {}
        }
    }
}
