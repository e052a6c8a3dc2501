//! Transitions that do not fire by themselves: the operator's, and those that ask. Asking, the
//! deadline of an answer, and what happens without one.

use super::context::Context;
use super::mission_dates::MissionDates;
use crate::ledger::{Consent, Ledger};
use crate::record::JournalEntry;
use armor_petri::{FiringClass, TransitionId};
use armor_robotfile::mission::{Autonomy, LostLink};
use std::time::Duration;

/// Returns the transition whose turn it is: what operators let fire, else what fires by itself.
/// Safety comes before both.
pub(super) fn next_ready(cx: &Context, dates: &MissionDates) -> Option<TransitionId> {
    let state = cx.ledger().state();
    let mut ready = state.ready().filter(|id| !dates.waits_for_utc(cx.plan(), *id));
    let by_itself = ready.find(|id| fires_by_itself(cx.ledger(), *id))?;
    let safety = cx.plan().net().transition(by_itself).class == FiringClass::Safety;
    let granted = || {
        state
            .ready()
            .find(|id| is_granted(cx.ledger(), *id) && !dates.waits_for_utc(cx.plan(), *id))
    };
    if safety || !cx.ledger().authority().has_consents() {
        return Some(by_itself);
    }
    granted().or(Some(by_itself))
}

/// Returns when a transition fires next if nothing else happens.
pub(super) fn next_firing(cx: &Context, dates: &MissionDates) -> Option<Duration> {
    let state = cx.ledger().state();
    let held = state.held_since().is_some();
    let runs =
        |id: &TransitionId| !held || cx.plan().net().transition(*id).class == FiringClass::Safety;
    // A question that is still to be asked is asked when the transition could fire.
    let acts = |id: &TransitionId| {
        fires_by_itself(cx.ledger(), *id)
            || cx.plan().transition(*id).asks() && is_unasked(cx.ledger(), *id)
    };
    let knows = |id: &TransitionId| !dates.waits_for_utc(cx.plan(), *id);
    let next = state.enabled().find(|id| runs(id) && knows(id) && acts(id))?;
    state.earliest(next).map(|at| at.max(state.now()))
}

/// Asks about transitions whose time has come, and decides those whose time for an answer is over.
pub(super) fn ask_operator(cx: &mut Context, dates: &MissionDates) {
    if !cx.is_playing() {
        return;
    }
    let silent: Vec<_> = answers_due(cx).filter(|due| due.1 <= cx.now()).collect();
    for (id, _) in silent {
        let Autonomy::Confirm { fire_unanswered: fires, .. } = cx.plan().transition(id).autonomy
        else {
            continue;
        };
        let transition = cx.plan().net().transition(id).name.clone();
        cx.record_entry(JournalEntry::Unanswered { transition, fires });
    }
    if next_ready(cx, dates).is_some() {
        return;
    }
    let unasked = cx.ledger().state().ready().filter(|id| {
        let asks = cx.plan().transition(*id).asks() && !fires_by_itself(cx.ledger(), *id);
        asks && is_unasked(cx.ledger(), *id) && !dates.waits_for_utc(cx.plan(), *id)
    });
    for id in unasked.collect::<Vec<_>>() {
        let transition = cx.plan().net().transition(id).name.clone();
        cx.record_entry(JournalEntry::Asked { transition });
    }
}

/// Returns until when answers are waited for.
pub(super) fn answers_due(cx: &Context) -> impl Iterator<Item = (TransitionId, Duration)> {
    let playing = cx.may_fire();
    let consents = cx.ledger().authority().consents();
    consents.filter_map(move |(id, consent)| {
        let Consent::Asked(since) = consent else {
            return None;
        };
        let due = since.saturating_add(answer_within(cx.ledger(), *id)?);
        (playing && !is_put_off(cx.ledger(), *id)).then_some((*id, due))
    })
}

/// Returns how long an answer is waited for.
pub(super) fn answer_within(ledger: &Ledger, id: TransitionId) -> Option<Duration> {
    match ledger.plan().transition(id).autonomy {
        Autonomy::Confirm { within, .. } => within,
        Autonomy::Auto | Autonomy::Operator => None,
    }
}

/// Whether the time for an answer stands still.
pub(super) fn is_put_off(ledger: &Ledger, id: TransitionId) -> bool {
    let held = ledger.pause().is_some()
        && ledger.plan().net().transition(id).class == FiringClass::Ordinary;
    let waits = ledger.authority().link_lost().is_some()
        && ledger.plan().transition(id).lost_link == Some(LostLink::Wait);
    held || waits
}

/// Whether it fires without a question: by itself, without an operator, or as it was granted.
pub(super) fn fires_by_itself(ledger: &Ledger, id: TransitionId) -> bool {
    let planned = ledger.plan().transition(id);
    let on_its_own =
        || ledger.authority().link_lost().is_some() && planned.lost_link == Some(LostLink::Fire);
    planned.autonomy == Autonomy::Auto || on_its_own() || is_granted(ledger, id)
}

pub(super) fn is_granted(ledger: &Ledger, id: TransitionId) -> bool {
    ledger.authority().consent(id) == Some(Consent::Granted)
}

/// Whether it does not fire until it is newly enabled.
pub(super) fn is_declined(ledger: &Ledger, id: TransitionId) -> bool {
    ledger.authority().consent(id) == Some(Consent::Declined)
}

pub(super) fn is_unasked(ledger: &Ledger, id: TransitionId) -> bool {
    ledger.authority().consent(id).is_none()
}
