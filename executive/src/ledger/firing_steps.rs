//! What the steps of a firing change in the ledger: tokens taken, redirected and put; and the
//! retreat, which replaces all firings by one.

use super::Ledger;
use super::activation::have_same_terms;
use super::error::LedgerError;
use super::firing::{Firing, Phase};
use super::reports::{finished_in, forget_reports_of, set_listening_gates};
use super::stage::MissionStage;
use crate::terms::{Cause, MissionOutcome, Tokens};
use armor_petri::PlaceId;
use armor_plan::{ComponentId, GivenValue};
use std::collections::BTreeSet;

/// How many of the last transitions fired are remembered, for people to look at.
const HISTORY: usize = 20;

pub(super) fn begin_firing(
    ledger: &mut Ledger,
    number: u64,
    cause: &Cause,
    from: &[Tokens],
    to: &[Tokens],
) -> Result<(), LedgerError> {
    let (from, to) = (ledger.resolve_tokens(from)?, ledger.resolve_tokens(to)?);
    let mut leaving: BTreeSet<_> = from.iter().map(|arc| arc.0).collect();
    match cause {
        Cause::Transition(name) => take_tokens(ledger, name)?,
        Cause::Start | Cause::Retreat => leaving = ledger.plan.place_ids().collect(),
        Cause::Failure { place, .. } => {
            for &(from, tokens) in &from {
                let refused = |why| LedgerError::NotAllowed { what: place.clone(), why };
                ledger.state.remove(from, tokens).map_err(refused)?;
            }
        }
    }
    ledger.last_firing = ledger.last_firing.max(number);
    // After the tokens are taken: which values a component gets depends on what is still marked.
    let renewing = components_to_renew(ledger, &to, None);
    let firing = Firing {
        cause: cause.clone(),
        from,
        to,
        phase: Phase::Stopping,
        since: ledger.at,
        redirected: false,
        leaving,
        renewing,
    };
    ledger.firings.insert(number, firing);
    Ok(())
}

fn take_tokens(ledger: &mut Ledger, name: &str) -> Result<(), LedgerError> {
    let id = ledger.find_transition(name)?;
    let refused = |why| LedgerError::NotAllowed { what: name.to_owned(), why };
    ledger.state.take(id).map_err(refused)?;
    ledger.authority.forget_consent(id);
    ledger.fired += 1;
    ledger.history.push_back((name.to_owned(), ledger.at));
    if ledger.history.len() > HISTORY {
        ledger.history.pop_front();
    }
    if ledger.plan.transition(id).dates.is_some() {
        ledger.gates.use_date(id);
        ledger.set_gate(id);
    }
    if let Some(on) = &ledger.plan.transition(id).on {
        let on = on.clone();
        ledger.standing.remove(&on);
        set_listening_gates(ledger, &on);
    }
    Ok(())
}

pub(super) fn redirect_firing(
    ledger: &mut Ledger,
    number: u64,
    to: &[Tokens],
) -> Result<(), LedgerError> {
    let (to, at) = (ledger.resolve_tokens(to)?, ledger.at);
    let renewing = components_to_renew(ledger, &to, Some(number));
    let firing = ledger.firing_mut(number)?;
    // What was started for the places it led to has to stop again.
    firing.leaving.extend(firing.to.iter().map(|arc| arc.0));
    (firing.to, firing.renewing) = (to, renewing);
    (firing.phase, firing.since, firing.redirected) = (Phase::Stopping, at, true);
    Ok(())
}

pub(super) fn put_tokens(ledger: &mut Ledger, number: u64) -> Result<(), LedgerError> {
    let firing = ledger.firings.remove(&number).ok_or(LedgerError::UnknownFiring(number))?;
    for &(place, tokens) in &firing.to {
        let what = || ledger.plan.net().place(place).to_owned();
        let refused = |why| LedgerError::NotAllowed { what: what(), why };
        ledger.state.add(place, tokens).map_err(refused)?;
    }
    // A pause can prevent the fresh start of a component; it then starts after the pause, and
    // its old reports must not count until then.
    for component in firing.renewing {
        let activation = &mut ledger.activations[component.index()];
        (activation.done, activation.failed, activation.interrupted) = (false, None, false);
        forget_reports_of(ledger, component);
    }
    ledger.conclude_if_ended();
    Ok(())
}

pub(super) fn begin_retreat(ledger: &mut Ledger, why: &str) {
    ledger.why = why.to_owned();
    ledger.firings.clear();
    ledger.state.clear();
    ledger.end_pause();
    let Some(safe) = ledger.plan.safe() else {
        ledger.stage = MissionStage::Ending(MissionOutcome::Failed);
        return;
    };
    ledger.stage = MissionStage::Retreating;
    ledger.last_firing += 1;
    let to = vec![(safe, 1)];
    let firing = Firing {
        cause: Cause::Retreat,
        from: Vec::new(),
        renewing: components_to_renew(ledger, &to, None),
        to,
        // Each component of the safe place starts as soon as those it excludes are off; a
        // brake does not wait for a camera.
        phase: Phase::Starting,
        since: ledger.at,
        redirected: true,
        leaving: ledger.plan.place_ids().collect(),
    };
    ledger.firings.insert(ledger.last_firing, firing);
}

/// The components of a firing's places that run and have to be started afresh: those that have
/// finished, and those that get other values. `firing` is its number, if it is in flight.
fn components_to_renew(
    ledger: &Ledger,
    to: &[(PlaceId, u32)],
    firing: Option<u64>,
) -> BTreeSet<ComponentId> {
    let mut renewed = finished_in(ledger, to);
    let components = to.iter().flat_map(|arc| &ledger.plan.place(arc.0).components);
    renewed.extend(components.filter(|component| {
        let last = &ledger.activations[component.index()];
        let runs = last.open && ledger.plan.component(**component).is_controlled();
        let values = || values_with(ledger, **component, to, firing);
        runs && last.number > 0 && !have_same_terms(&last.values, &values())
    }));
    renewed
}

/// Returns the values of an activation that begins now.
pub(crate) fn values_for(ledger: &Ledger, component: ComponentId) -> Vec<GivenValue> {
    values_with(ledger, component, &[], None)
}

/// Returns the values of a component from the marked places, the places that firings in flight
/// lead to (without the firing `except`), and `to`.
fn values_with(
    ledger: &Ledger,
    component: ComponentId,
    to: &[(PlaceId, u32)],
    except: Option<u64>,
) -> Vec<GivenValue> {
    let flights = ledger.firings.iter().filter(|(number, _)| Some(**number) != except);
    let arriving: BTreeSet<_> =
        flights.flat_map(|(_, firing)| &firing.to).chain(to).map(|arc| arc.0).collect();
    let is_marked = |place: PlaceId| ledger.state.tokens(place) > 0 || arriving.contains(&place);
    ledger.plan.values_in(component, is_marked)
}
