//! `armor mission replay`: a past mission, record by record, from its journal and its file alone.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use armor_executive::{
    JournalRecord, Ledger, LedgerError, MissionStage, Phase, apply_record, journal,
};
use armor_plan::Plan;
use serde_json::{Map, Value, json};

use super::arguments::ReplayArguments;
use super::firing;
use super::journal::{PastJournal, RecordPrinter, fail_if_damaged, read, time};
use crate::arguments::OutputFormat;
use crate::check;
use crate::exit::CommandEnding;
use crate::findings_error::refuse_file;
use crate::print::{end_printing, print_line, print_wrapped};

/// Prints each record and the marking after it.
///
/// # Errors
/// If the journal or the file cannot be used, or do not belong together.
pub fn run(arguments: &ReplayArguments, format: OutputFormat) -> Result<CommandEnding> {
    if let Some(trace) = &arguments.fire {
        // There is no journal: the mission file comes first.
        let plan = of_file(&arguments.journal, arguments)?;
        return firing::play(&plan, trace, arguments.step, format);
    }
    let PastJournal { story, damage } = read(&arguments.journal)?;
    let plan = Arc::new(plan(arguments, &story.records)?);
    let played = play(arguments, plan, &story.records, format);
    end_printing(played.and_then(|()| fail_if_damaged(damage)))
}

fn play(
    arguments: &ReplayArguments,
    plan: Arc<Plan>,
    records: &[JournalRecord],
    format: OutputFormat,
) -> Result<()> {
    let mut ledger = Ledger::new(Arc::clone(&plan));
    let mut printer = RecordPrinter::default();
    for record in records {
        apply_record(&mut ledger, record)
            .map_err(|error| mismatch(arguments, &plan, record, error))?;
        match format {
            OutputFormat::Json => print_line(json!({
                "at_s": record.at.as_secs_f64(),
                "record": record,
                "marking": marking(&ledger),
                "variables": ledger.values().collect::<BTreeMap<_, _>>(),
                "in_flight": ledger.firings().keys().collect::<Vec<_>>(),
                "stage": stage(&ledger),
            }))?,
            _ => {
                printer.print_record(record, format)?;
                print_wrapped(format!("{:13}{}", "", in_words(&ledger)))?;
            }
        }
        if arguments.step && io::stdin().read_line(&mut String::new())? == 0 {
            break;
        }
    }
    Ok(())
}

fn plan(arguments: &ReplayArguments, records: &[JournalRecord]) -> Result<Plan> {
    let Some(file) = &arguments.file else {
        let journal = arguments.journal.display();
        let began = journal::began_with(records);
        let version = began.with_context(|| {
            format!("{journal} does not hold the file it was played from: give that file, too")
        })?;
        return version.plan().map_err(|why| anyhow!("{journal}: {why}"));
    };
    of_file(file, arguments)
}

fn of_file(file: &Path, arguments: &ReplayArguments) -> Result<Plan> {
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let (overrides, malformed) = check::parse_overrides(&arguments.overrides, &folder);
    if let Some(finding) = malformed.first() {
        bail!("{finding}");
    }
    let reading = armor_robotfile::check(armor_robotfile::load(file), &overrides, None);
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(refuse_file(file, &reading.findings));
    };
    let plan = Plan::of(configuration).map_err(|findings| refuse_file(file, &findings))?;
    plan.with_context(|| format!("{} has no mission", file.display()))
}

fn mismatch(
    arguments: &ReplayArguments,
    plan: &Plan,
    record: &JournalRecord,
    error: LedgerError,
) -> anyhow::Error {
    let journal = arguments.journal.display();
    match (error, &arguments.file) {
        (LedgerError::OtherMission { mission, fingerprint }, Some(file)) => anyhow!(
            "{journal} is not a journal of {} as it is now: it was written for mission \
             `{mission}` with fingerprint {fingerprint}, the file holds `{}` with {}; give the \
             file as it was played",
            file.display(),
            plan.mission(),
            plan.fingerprint()
        ),
        (other, _) => anyhow!("{journal}, at {}: {other}", time(record)),
    }
}

fn marking(ledger: &Ledger) -> Map<String, Value> {
    let places = ledger.plan().net().places().iter().zip(ledger.marking());
    places.filter(|(_, tokens)| **tokens > 0).map(|(p, n)| (p.clone(), json!(n))).collect()
}

fn stage(ledger: &Ledger) -> String {
    match ledger.stage() {
        MissionStage::Playing if ledger.pause().is_some() => "paused".into(),
        MissionStage::Playing => "playing".into(),
        MissionStage::Retreating => "retreating".into(),
        MissionStage::Ending(_) => "ending".into(),
        MissionStage::Ended(outcome) => format!("ended {outcome}"),
    }
}

fn in_words(ledger: &Ledger) -> String {
    let place = |(name, tokens): (&String, &Value)| match tokens.as_u64() {
        Some(1) => name.clone(),
        _ => format!("{tokens} {name}"),
    };
    let marked: Vec<_> = marking(ledger).iter().map(place).collect();
    let marked = if marked.is_empty() { "nothing".to_owned() } else { marked.join(" ") };
    let flight = |(number, firing): (&u64, &armor_executive::Firing)| {
        let phase = match firing.phase {
            Phase::Stopping => "stopping",
            Phase::Starting => "starting",
        };
        format!("; firing {number} {phase}")
    };
    let flights: String = ledger.firings().iter().map(flight).collect();
    let stage = match ledger.stage() {
        MissionStage::Playing if ledger.pause().is_none() => String::new(),
        _ => format!("; {}", stage(ledger)),
    };
    let values = ledger.values().map(|(name, value)| format!("; {name} is {value}"));
    format!("= {marked}{}{flights}{stage}", values.collect::<String>())
}
