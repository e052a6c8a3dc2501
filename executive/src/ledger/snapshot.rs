//! The whole ledger to a snapshot and back.

use super::Ledger;
use super::authority::Authority;
use super::error::LedgerError;
use super::firing::Firing;
use crate::record::{JournalEntry, JournalRecord};
use crate::snapshot::{FiringSnapshot, LedgerSnapshot, StandingReport};
use armor_petri::{NetState, PlaceId, TransitionId};
use armor_plan::{ComponentId, Plan};
use std::sync::Arc;
use std::time::Duration;

/// Returns the record that gives a new ledger the state of this one.
pub(crate) fn snapshot_of(ledger: &Ledger) -> JournalRecord {
    // Without `..`: what is added to the ledger has to be added here.
    let Ledger {
        plan,
        state,
        firings,
        activations,
        standing,
        counters,
        gates,
        stage,
        authority,
        last_firing,
        last_activation,
        fired,
        history,
        why,
        records,
        at,
        version_since,
    } = ledger;
    let Authority { lease, link_lost, pause, resumed_at, consents, orders } = authority;
    let component = |id: ComponentId| plan.component(id).name.clone();
    let transition = |id: TransitionId| plan.net().transition(id).name.clone();
    let ids = || plan.net().transition_ids();
    let marked = plan.place_ids().map(|id| (id, state.tokens(id))).filter(|arc| arc.1 > 0);
    let clock = |id| Some((transition(id), state.enabled_since(id)?));
    let standing = standing.iter().map(|((id, report), value)| StandingReport {
        component: component(*id),
        report: report.clone(),
        value: *value,
    });
    let holding = ids().filter(|id| plan.transition(*id).guard.is_some() && gates.guard(*id));
    let counted = plan.counters().iter().map(|it| it.name.clone()).zip(counters.iter().copied());
    let dated = ids().filter(|id| plan.transition(*id).dates.is_some());
    let snapshot = LedgerSnapshot {
        mission: plan.mission().to_owned(),
        fingerprint: plan.fingerprint(),
        began: (**plan.began()).clone(),
        version: (**plan.version()).clone(),
        version_since: *version_since,
        records: *records,
        marking: ledger.tokens_named(&marked.collect::<Vec<_>>()),
        clocks: ids().filter_map(clock).collect(),
        held_since: state.held_since(),
        firings: firings.iter().map(|(number, it)| (*number, flight_of(ledger, it))).collect(),
        activations: plan.component_ids().map(component).zip(activations.clone()).collect(),
        standing: standing.collect(),
        counters: counted.collect(),
        holds: holding.map(transition).collect(),
        dates: dated.map(|id| (transition(id), gates.date(id))).collect(),
        stage: *stage,
        lease: lease.clone(),
        link_lost: *link_lost,
        pause: pause.clone(),
        resumed_at: *resumed_at,
        consents: consents.iter().map(|(id, consent)| (transition(*id), *consent)).collect(),
        orders: orders.iter().cloned().collect(),
        last_firing: *last_firing,
        last_activation: *last_activation,
        fired: *fired,
        history: history.iter().cloned().collect(),
        why: why.clone(),
    };
    JournalRecord { at: *at, entry: JournalEntry::Snapshot(Box::new(snapshot)) }
}

fn flight_of(ledger: &Ledger, firing: &Firing) -> FiringSnapshot {
    let place = |id: &PlaceId| ledger.plan.net().place(*id).to_owned();
    let component = |id: &ComponentId| ledger.plan.component(*id).name.clone();
    FiringSnapshot {
        cause: firing.cause.clone(),
        from: ledger.tokens_named(&firing.from),
        to: ledger.tokens_named(&firing.to),
        phase: firing.phase,
        since: firing.since,
        redirected: firing.redirected,
        leaving: firing.leaving.iter().map(place).collect(),
        renewing: firing.renewing.iter().map(component).collect(),
    }
}

/// Returns the ledger that a snapshot was taken of, at `at`.
pub(super) fn restore_ledger(
    plan: Arc<Plan>,
    snapshot: &LedgerSnapshot,
    at: Duration,
) -> Result<Ledger, LedgerError> {
    let (number, version) = (snapshot.version.number, &snapshot.version);
    let plan = if *version == **plan.version() {
        plan
    } else {
        let refused = |why| LedgerError::NotTaken { version: number, why };
        Arc::new(plan.read_next(version).map_err(refused)?)
    };
    let mut ledger = Ledger::new(plan);
    check_mission(&ledger, &snapshot.mission, &snapshot.fingerprint)?;
    (ledger.records, ledger.version_since) = (snapshot.records, snapshot.version_since);
    ledger.at = at;
    (ledger.stage, ledger.why) = (snapshot.stage, snapshot.why.clone());
    ledger.last_firing = snapshot.last_firing;
    ledger.last_activation = snapshot.last_activation;
    ledger.fired = snapshot.fired;
    ledger.history = snapshot.history.iter().cloned().collect();
    for (name, activation) in &snapshot.activations {
        let component = ledger.find_component(name)?;
        ledger.activations[component.index()] = activation.clone();
    }
    for it in &snapshot.standing {
        let component = ledger.find_component(&it.component)?;
        ledger.standing.insert((component, it.report.clone()), it.value);
    }
    for (name, value) in &snapshot.counters {
        let index = ledger.plan.counters().iter().position(|counter| counter.name == *name);
        let index = index.ok_or_else(|| LedgerError::UnknownName(name.clone()))?;
        ledger.counters[index] = *value;
    }
    for name in &snapshot.holds {
        let id = ledger.find_transition(name)?;
        ledger.gates.set_guard(id, true);
    }
    for (name, dated) in &snapshot.dates {
        let id = ledger.find_transition(name)?;
        ledger.gates.set_date(id, *dated);
    }
    for (number, flight) in &snapshot.firings {
        let firing = firing_of(&ledger, flight)?;
        ledger.firings.insert(*number, firing);
    }
    ledger.authority = authority_of(&ledger, snapshot)?;
    restore_net(&mut ledger, snapshot, at)?;
    Ok(ledger)
}

fn firing_of(ledger: &Ledger, flight: &FiringSnapshot) -> Result<Firing, LedgerError> {
    let leaving: Result<_, _> = flight.leaving.iter().map(|name| ledger.find_place(name)).collect();
    let renewing: Result<_, _> =
        flight.renewing.iter().map(|name| ledger.find_component(name)).collect();
    Ok(Firing {
        cause: flight.cause.clone(),
        from: ledger.resolve_tokens(&flight.from)?,
        to: ledger.resolve_tokens(&flight.to)?,
        phase: flight.phase,
        since: flight.since,
        redirected: flight.redirected,
        leaving: leaving?,
        renewing: renewing?,
    })
}

fn authority_of(ledger: &Ledger, snapshot: &LedgerSnapshot) -> Result<Authority, LedgerError> {
    let consents = snapshot.consents.iter();
    let consents: Result<_, LedgerError> =
        consents.map(|(name, consent)| Ok((ledger.find_transition(name)?, *consent))).collect();
    Ok(Authority {
        lease: snapshot.lease.clone(),
        link_lost: snapshot.link_lost,
        pause: snapshot.pause.clone(),
        resumed_at: snapshot.resumed_at,
        consents: consents?,
        orders: snapshot.orders.iter().cloned().collect(),
    })
}

/// Marks the net, opens its gates, and continues its clocks from where they stood.
fn restore_net(
    ledger: &mut Ledger,
    snapshot: &LedgerSnapshot,
    at: Duration,
) -> Result<(), LedgerError> {
    let mut marking = vec![0; ledger.plan.places().len()];
    for (place, tokens) in ledger.resolve_tokens(&snapshot.marking)? {
        marking[place.index()] = tokens;
    }
    // A hold is rebuilt at the moment it began, before time advances: the clocks that it stopped
    // have to stand where they stood then.
    let from = snapshot.held_since.unwrap_or(at);
    ledger.state = NetState::with_marking(Arc::clone(ledger.plan.net()), marking, from);
    if snapshot.held_since.is_some() {
        ledger.state.hold();
    }
    ledger.state.advance(at);
    for id in ledger.plan.net().transition_ids() {
        ledger.set_gate(id);
    }
    // Last: opening a gate starts a clock, which has to be set back to its own beginning.
    for (name, since) in &snapshot.clocks {
        ledger.state.resume_clock(ledger.find_transition(name)?, *since);
    }
    Ok(())
}

/// Checks that a record belongs to the mission of the plan in force.
pub(super) fn check_mission(
    ledger: &Ledger,
    mission: &str,
    fingerprint: &str,
) -> Result<(), LedgerError> {
    if mission == ledger.plan.mission() && fingerprint == ledger.plan.fingerprint() {
        return Ok(());
    }
    Err(LedgerError::OtherMission {
        mission: mission.to_owned(),
        fingerprint: fingerprint.to_owned(),
    })
}
