//! `armor mission times`: when the steps of drawn routes end, and the slack of every limit; what follows
//! from the times is in `times_preview.rs`.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_ground::with_drive_lengths;
use armor_robotfile::timing::{CHANCE_DRAWS, MissionPreview, StepLimit, StepTime, Timetable};
use armor_robotfile::{Code, Date, Severity};
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::findings_error::refuse_file;
use crate::inspect_cli::mission::times_preview::{
    print_chance_records, print_chances, print_encounter_records, print_encounters,
};
use crate::print::{Table, end_printing, print_line, print_notice, print_text, terminal_width};

/// The findings with which times can still be printed.
const OF_TIMES: [Code; 4] =
    [Code::TimesConflict, Code::TimeMayLack, Code::BatteryEmpty, Code::BatteryOpen];

/// Prints a row for each step, where robots come too close, and with a seed how probable it is that limits
/// are kept; a mission whose limits cannot be kept fails after that.
///
/// # Errors
/// If the file has another error, or no route.
pub fn print_times(
    file: &Path,
    begin: Option<Date>,
    chances: Option<u64>,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let reading = armor_robotfile::check(armor_robotfile::load(file), &[], None);
    let findings = &reading.findings;
    let is_other = |code: Code| code.severity() == Severity::Error && !OF_TIMES.contains(&code);
    let has_other = findings.iter().any(|finding| is_other(finding.code));
    let Some(configuration) = reading.configuration.as_ref().filter(|_| !has_other) else {
        return Err(refuse_file(file, findings));
    };
    let mission = configuration.mission.as_ref();
    let mission = mission
        .filter(|mission| !mission.routes.is_empty())
        .with_context(|| format!("{} has no <route>", file.display()))?;
    let system = &configuration.system;
    let (table, preview) = with_drive_lengths(mission, |lengths| {
        let table = Timetable::of_mission(mission, system, lengths, begin);
        (table, MissionPreview::of_mission(mission, system, lengths, begin))
    });
    let ending = end_printing(match format {
        OutputFormat::Json => {
            print_records(&table).and_then(|()| print_preview(preview.as_ref(), chances, true))
        }
        _ => print_rows(&table).and_then(|()| print_preview(preview.as_ref(), chances, false)),
    })?;
    for finding in findings.iter().filter(|finding| OF_TIMES.contains(&finding.code)) {
        print_notice(format_args!("{}: {}", finding.code.as_str(), finding.message));
    }
    Ok(if findings.has_errors() { CommandEnding::Failed } else { ending })
}

fn print_preview(
    preview: Option<&MissionPreview>,
    seed: Option<u64>,
    are_records: bool,
) -> Result<()> {
    // Meetings in a circle are an error of the file, which has ended the command.
    let Some(preview) = preview else { return Ok(()) };
    match are_records {
        true => print_encounter_records(preview)?,
        false => print_encounters(preview)?,
    }
    let Some(seed) = seed else { return Ok(()) };
    let drawn = preview.draw_chances(seed, CHANCE_DRAWS, &|| false);
    let Some(chances) = drawn else { return Ok(()) };
    match are_records {
        true => print_chance_records(preview, &chances),
        false => print_chances(preview, &chances),
    }
}

fn print_rows(table: &Timetable) -> Result<()> {
    let headings = ["route", "step", "earliest", "nominal", "latest", "limit", "slack"];
    let rows = table.steps.iter().flat_map(list_rows).collect();
    print_text(Table::new(&headings, rows).format(terminal_width()))?;
    match table.begin_by {
        Some(date) => print_line(format_args!(
            "to keep every date even at the slowest, the mission begins not later than {date}"
        )),
        None => Ok(()),
    }
}

/// A row for the step with its first limit, and one for each further limit.
fn list_rows(step: &StepTime) -> Vec<Vec<String>> {
    let time = |time: Option<Duration>| time.map_or("?".to_owned(), format_seconds);
    let times = [step.earliest, step.nominal, step.latest].map(time);
    let first: Vec<_> = [step.route.clone(), step.step.clone()].into_iter().chain(times).collect();
    let with_limit = |mut row: Vec<String>, limit: &StepLimit| {
        let slack = limit.slack_ns.map_or("?".to_owned(), format_slack);
        row.extend([limit.words.clone(), slack]);
        row
    };
    let Some((own, further)) = step.limits.split_first() else {
        let mut row = first;
        row.extend([String::new(), String::new()]);
        return vec![row];
    };
    let mut rows = vec![with_limit(first, own)];
    rows.extend(further.iter().map(|limit| with_limit(vec![String::new(); 5], limit)));
    rows
}

/// One JSON object per step, and one for the begin.
fn print_records(table: &Timetable) -> Result<()> {
    for step in &table.steps {
        let limits: Vec<_> = step
            .limits
            .iter()
            .map(|limit| json!({ "limit": limit.words, "slack_s": limit.slack_ns.map(as_seconds) }))
            .collect();
        print_line(json!({
            "route": step.route,
            "step": step.step,
            "earliest_s": step.earliest.map(|time| time.as_secs_f64()),
            "nominal_s": step.nominal.map(|time| time.as_secs_f64()),
            "latest_s": step.latest.map(|time| time.as_secs_f64()),
            "limits": limits,
        }))?;
    }
    match table.begin_by {
        Some(date) => print_line(json!({ "begin_by": date.to_string() })),
        None => Ok(()),
    }
}

pub(super) fn format_seconds(time: Duration) -> String {
    format!("{:.1} s", time.as_secs_f64())
}

fn format_slack(slack_ns: i128) -> String {
    format!("{:.1} s", as_seconds(slack_ns))
}

fn as_seconds(ns: i128) -> f64 {
    ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_has_a_row_for_each_limit() {
        let limit = |words: &str, slack_ns| StepLimit { words: words.into(), slack_ns };
        let step = StepTime {
            route: "red".into(),
            step: "l1".into(),
            earliest: Some(Duration::from_millis(1500)),
            nominal: Some(Duration::from_millis(2000)),
            latest: None,
            limits: vec![limit("by 1 min", Some(-2_040_000_000)), limit("not after …", None)],
        };
        let rows = list_rows(&step);
        assert_eq!(rows[0], ["red", "l1", "1.5 s", "2.0 s", "?", "by 1 min", "-2.0 s"]);
        assert_eq!(rows[1], ["", "", "", "", "", "not after …", "?"]);
    }
}
