//! One journal record at a time, and whole journals, applied to a ledger.

use super::Ledger;
use super::authority::Consent;
use super::error::LedgerError;
use super::firing::Phase;
use super::firing_steps::{begin_firing, begin_retreat, put_tokens, redirect_firing};
use super::orders::{begin_pause, carry_out_order, set_consent};
use super::reports::{begin_activation, forget_obsolete_reports, take_report};
use super::snapshot::{check_mission, restore_ledger};
use super::stage::MissionStage;
use super::transfer::{end_activations, take_version};
use crate::record::{JournalEntry, JournalRecord};
use crate::terms::{GuardTurned, MissionOutcome, ValueSet};
use armor_plan::{DatePhase, Plan, PlannedCounter};
use std::sync::Arc;

/// Plays a whole journal.
///
/// # Errors
/// At the first record that does not fit.
pub fn replay_records(plan: Arc<Plan>, records: &[JournalRecord]) -> Result<Ledger, LedgerError> {
    let mut ledger = Ledger::new(plan);
    for record in records {
        apply_record(&mut ledger, record)?;
    }
    Ok(ledger)
}

/// Takes one record in.
///
/// # Errors
/// If it does not fit; the ledger is not to be used further then.
pub fn apply_record(ledger: &mut Ledger, record: &JournalRecord) -> Result<(), LedgerError> {
    if let JournalEntry::Snapshot(snapshot) = &record.entry {
        *ledger = restore_ledger(Arc::clone(&ledger.plan), snapshot, record.at)?;
        return Ok(());
    }
    // The clocks move first: what a record changes, it changes at its own time.
    ledger.records += 1;
    ledger.at = ledger.at.max(record.at);
    ledger.state.advance(ledger.at);
    match &record.entry {
        JournalEntry::Snapshot(_) => {}
        JournalEntry::Began { mission, fingerprint, .. } => {
            check_mission(ledger, mission, fingerprint)?;
        }
        JournalEntry::Changed { version, fingerprint, restarts, .. } => {
            take_version(ledger, version, fingerprint)?;
            end_activations(ledger, restarts)?;
        }
        JournalEntry::Refused { .. } => {}
        JournalEntry::Took { firing, cause, from, to, sets, guards, .. } => {
            begin_firing(ledger, *firing, cause, from, to)?;
            set_values(ledger, sets, guards)?;
        }
        JournalEntry::Stopped { firing } => {
            let at = ledger.at;
            let firing = ledger.firing_mut(*firing)?;
            (firing.phase, firing.since) = (Phase::Starting, at);
        }
        JournalEntry::Activating { component, activation, values } => {
            let component = ledger.find_component(component)?;
            begin_activation(ledger, component, *activation, values);
        }
        JournalEntry::Redirected { firing, to, .. } => redirect_firing(ledger, *firing, to)?,
        JournalEntry::Put { firing } => put_tokens(ledger, *firing)?,
        JournalEntry::Heard { component, instance, serial, report } => {
            let component = ledger.find_component(component)?;
            take_report(ledger, component, (*instance, *serial), report);
        }
        JournalEntry::Ordered(judged) => carry_out_order(ledger, judged)?,
        JournalEntry::Asked { transition } => {
            let since = ledger.at;
            set_consent(ledger, transition, Consent::Asked(since))?;
        }
        JournalEntry::Unanswered { transition, fires: true } => {
            set_consent(ledger, transition, Consent::Granted)?;
        }
        JournalEntry::Unanswered { transition, fires: false } => {
            set_consent(ledger, transition, Consent::Declined)?;
        }
        JournalEntry::LinkLost { .. } => ledger.authority.lose_link(ledger.at),
        JournalEntry::Held { .. } => begin_pause(ledger, "the executive"),
        JournalEntry::Guard { transition, holds, .. } => set_guard(ledger, transition, *holds)?,
        JournalEntry::Dated { transition, phase, .. } => {
            set_date_phase(ledger, transition, *phase)?;
        }
        JournalEntry::Retreated { why } => begin_retreat(ledger, why),
        JournalEntry::GaveUp { why } => {
            ledger.why.clone_from(why);
            ledger.firings.clear();
            ledger.stage = MissionStage::Ending(MissionOutcome::Failed);
            ledger.end_pause();
        }
        JournalEntry::Ended { outcome } => ledger.stage = MissionStage::Ended(*outcome),
    }
    // Consequences that have no record of their own. Only here, so that a replay draws them after
    // the same record as the executive that wrote it.
    forget_obsolete_reports(ledger);
    let state = &ledger.state;
    ledger.authority.retain_consents(|id| state.enabled_since(id).is_some());
    Ok(())
}

fn set_date_phase(ledger: &mut Ledger, name: &str, phase: DatePhase) -> Result<(), LedgerError> {
    let id = ledger.find_transition(name)?;
    ledger.gates.set_date_phase(id, phase);
    ledger.set_gate(id);
    Ok(())
}

fn set_guard(ledger: &mut Ledger, name: &str, is_true: bool) -> Result<(), LedgerError> {
    let id = ledger.find_transition(name)?;
    ledger.gates.set_guard(id, is_true);
    ledger.set_gate(id);
    Ok(())
}

/// Sets the variables of a firing. It does so when the tokens are taken, so that the next
/// decision is made with the new values.
fn set_values(
    ledger: &mut Ledger,
    sets: &[ValueSet],
    guards: &[GuardTurned],
) -> Result<(), LedgerError> {
    for set in sets {
        let named = |counter: &PlannedCounter| counter.name == set.variable;
        let index = ledger.plan.counters().iter().position(named);
        let index = index.ok_or_else(|| LedgerError::UnknownName(set.variable.clone()))?;
        ledger.counters[index] = set.value;
    }
    guards.iter().try_for_each(|turned| set_guard(ledger, &turned.transition, turned.holds))
}
