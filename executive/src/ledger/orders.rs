//! What orders of operators change: the lease, answers, the pause, and tokens that are moved.

use super::Ledger;
use super::authority::Consent;
use super::error::LedgerError;
use super::firing_steps::begin_retreat;
use super::stage::MissionStage;
use crate::order::{Judged, MissionOrder, MovedTokens};

/// Carries out an order that was accepted, and remembers it.
pub(super) fn carry_out_order(ledger: &mut Ledger, judged: &Judged) -> Result<(), LedgerError> {
    ledger.authority.note_order(&ledger.plan, judged, ledger.at);
    if !judged.accepted {
        return Ok(());
    }
    match &judged.order {
        MissionOrder::Lease => ledger.authority.give_lease(&judged.by, ledger.at),
        MissionOrder::Release => ledger.authority.release_lease(),
        MissionOrder::Fire(name) | MissionOrder::Confirm(name) => {
            set_consent(ledger, name, Consent::Granted)?;
        }
        MissionOrder::Decline(name) => set_consent(ledger, name, Consent::Declined)?,
        MissionOrder::Pause => begin_pause(ledger, &judged.by.author),
        MissionOrder::Resume => end_pause_by_order(ledger),
        MissionOrder::Safe if ledger.stage == MissionStage::Playing => {
            begin_retreat(ledger, &format!("{} ordered it", judged.by.author));
        }
        MissionOrder::Safe | MissionOrder::Rejoin => {}
        MissionOrder::Move(moves) => move_tokens(ledger, moves)?,
    }
    Ok(())
}

/// Notes a question about a transition, its answer, or what follows without one.
pub(super) fn set_consent(
    ledger: &mut Ledger,
    name: &str,
    consent: Consent,
) -> Result<(), LedgerError> {
    let id = ledger.find_transition(name)?;
    ledger.authority.set_consent(id, consent);
    Ok(())
}

/// Begins a pause: clocks stop, and what runs is interrupted. Its reports so far stand afterwards.
pub(super) fn begin_pause(ledger: &mut Ledger, by: &str) {
    if ledger.authority.pause.is_some() || ledger.stage != MissionStage::Playing {
        return;
    }
    ledger.authority.begin_pause(by, ledger.at);
    ledger.state.hold();
    for component in ledger.plan.component_ids() {
        let runs_on = ledger.runs(component) || !ledger.plan.component(component).is_controlled();
        let activation = &mut ledger.activations[component.index()];
        activation.interrupted = activation.open && !runs_on;
    }
}

fn end_pause_by_order(ledger: &mut Ledger) {
    let Some(pause) = ledger.end_pause() else {
        return;
    };
    let stood = ledger.at.saturating_sub(pause.since);
    ledger.authority.put_off_questions(&ledger.plan, stood);
    for firing in ledger.firings.values_mut() {
        firing.since = ledger.at;
    }
    ledger.conclude_if_ended();
}

fn move_tokens(ledger: &mut Ledger, moves: &[MovedTokens]) -> Result<(), LedgerError> {
    let place = |name: &str| {
        let found = ledger.plan.place_named(name);
        found.ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    };
    let moves: Vec<_> = moves
        .iter()
        .map(|it| Ok((place(&it.from)?, place(&it.to)?, it.tokens)))
        .collect::<Result<_, LedgerError>>()?;
    let refused = |why| LedgerError::NotAllowed { what: "the move of tokens".to_owned(), why };
    for &(from, to, tokens) in &moves {
        ledger.state.remove(from, tokens).map_err(refused)?;
        ledger.state.add(to, tokens).map_err(refused)?;
    }
    Ok(())
}
