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

impl Ledger {
    /// The record that a new ledger needs to be as this one is.
    pub fn snapshot(&self) -> JournalRecord {
        // Without `..`: what is added to the ledger has to be added here.
        let Self {
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
        } = self;
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
        let counted =
            plan.counters().iter().map(|it| it.name.clone()).zip(counters.iter().copied());
        let dated = ids().filter(|id| plan.transition(*id).dates.is_some());
        let snapshot = LedgerSnapshot {
            mission: plan.mission().to_owned(),
            fingerprint: plan.fingerprint(),
            began: (**plan.began()).clone(),
            version: (**plan.version()).clone(),
            version_since: *version_since,
            records: *records,
            marking: self.tokens_named(&marked.collect::<Vec<_>>()),
            clocks: ids().filter_map(clock).collect(),
            held_since: state.held_since(),
            firings: firings.iter().map(|(number, it)| (*number, self.flight(it))).collect(),
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

    fn flight(&self, firing: &Firing) -> FiringSnapshot {
        let place = |id: &PlaceId| self.plan.net().place(*id).to_owned();
        let component = |id: &ComponentId| self.plan.component(*id).name.clone();
        FiringSnapshot {
            cause: firing.cause.clone(),
            from: self.tokens_named(&firing.from),
            to: self.tokens_named(&firing.to),
            phase: firing.phase,
            since: firing.since,
            redirected: firing.redirected,
            leaving: firing.leaving.iter().map(place).collect(),
            renewing: firing.renewing.iter().map(component).collect(),
        }
    }

    /// The ledger that a snapshot was taken of, at `at`.
    pub(super) fn from_snapshot(
        plan: Arc<Plan>,
        snapshot: &LedgerSnapshot,
        at: Duration,
    ) -> Result<Self, LedgerError> {
        let (number, version) = (snapshot.version.number, &snapshot.version);
        let plan = if *version == **plan.version() {
            plan
        } else {
            let refused = |why| LedgerError::NotTaken { version: number, why };
            Arc::new(plan.read_next(version).map_err(refused)?)
        };
        let mut ledger = Self::new(plan);
        ledger.check_mission(&snapshot.mission, &snapshot.fingerprint)?;
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
            let firing = ledger.firing_of(flight)?;
            ledger.firings.insert(*number, firing);
        }
        ledger.authority = ledger.authority_of(snapshot)?;
        ledger.wind_up(snapshot, at)?;
        Ok(ledger)
    }

    fn firing_of(&self, flight: &FiringSnapshot) -> Result<Firing, LedgerError> {
        let leaving: Result<_, _> =
            flight.leaving.iter().map(|name| self.find_place(name)).collect();
        let renewing: Result<_, _> =
            flight.renewing.iter().map(|name| self.find_component(name)).collect();
        Ok(Firing {
            cause: flight.cause.clone(),
            from: self.resolve_tokens(&flight.from)?,
            to: self.resolve_tokens(&flight.to)?,
            phase: flight.phase,
            since: flight.since,
            redirected: flight.redirected,
            leaving: leaving?,
            renewing: renewing?,
        })
    }

    fn authority_of(&self, snapshot: &LedgerSnapshot) -> Result<Authority, LedgerError> {
        let consents = snapshot.consents.iter();
        let consents: Result<_, LedgerError> =
            consents.map(|(name, consent)| Ok((self.find_transition(name)?, *consent))).collect();
        Ok(Authority {
            lease: snapshot.lease.clone(),
            link_lost: snapshot.link_lost,
            pause: snapshot.pause.clone(),
            resumed_at: snapshot.resumed_at,
            consents: consents?,
            orders: snapshot.orders.iter().cloned().collect(),
        })
    }

    /// Marks the net, opens its gates, and sets its clocks going where they stood.
    fn wind_up(&mut self, snapshot: &LedgerSnapshot, at: Duration) -> Result<(), LedgerError> {
        let mut marking = vec![0; self.plan.places().len()];
        for (place, tokens) in self.resolve_tokens(&snapshot.marking)? {
            marking[place.index()] = tokens;
        }
        let from = snapshot.held_since.unwrap_or(at);
        self.state = NetState::with_marking(Arc::clone(self.plan.net()), marking, from);
        if snapshot.held_since.is_some() {
            self.state.hold();
        }
        self.state.advance(at);
        for id in self.plan.net().transition_ids() {
            self.set_gate(id);
        }
        for (name, since) in &snapshot.clocks {
            self.state.resume_clock(self.find_transition(name)?, *since);
        }
        Ok(())
    }
}
