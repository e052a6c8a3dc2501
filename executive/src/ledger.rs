//! What has been decided: marking, firings in flight, activations, standing reports.
//!
//! It changes by records alone (`applying.rs`), so replaying the journal gives the same ledger, to
//! the nanosecond. The other files in `ledger/` that take a `Ledger` are the parts of that; nothing
//! here imports them.

pub(crate) mod activation;
pub(crate) mod applying;
pub(crate) mod authority;
#[cfg(test)]
mod comparison;
mod error;
pub(crate) mod firing;
pub(crate) mod firing_steps;
pub(crate) mod gates;
mod orders;
mod reports;
pub(crate) mod snapshot;
pub(crate) mod stage;
pub(crate) mod transfer;

use crate::order::Judged;
use crate::terms::{Cause, MissionOutcome, Tokens};
use armor_petri::{FiringClass, NetState, PlaceId, TransitionId};
use armor_plan::{ComponentId, Plan};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use gates::Gates;

pub(crate) use activation::Activation;
pub(crate) use authority::{Authority, Consent};
pub use authority::{Lease, Pause};
#[cfg(test)]
pub(crate) use comparison::check_same;
pub use error::LedgerError;
pub use firing::{Firing, Phase};
pub(crate) use gates::DateState;
pub use stage::MissionStage;

/// All that is decided, and nothing that is merely observed.
#[derive(Clone, Debug)]
pub struct Ledger {
    plan: Arc<Plan>,
    state: NetState,
    firings: BTreeMap<u64, Firing>,
    activations: Vec<Activation>,
    /// Reports that stand until a transition consumes them.
    standing: BTreeMap<(ComponentId, String), f64>,
    /// The values of the variables that transitions set.
    counters: Vec<i64>,
    gates: Gates,
    stage: MissionStage,
    authority: Authority,
    last_firing: u64,
    last_activation: u64,
    /// Transitions fired so far.
    fired: u64,
    /// The last of them, and when; the oldest first.
    history: VecDeque<(String, Duration)>,
    /// Why it retreated or has given up.
    why: String,
    /// How many records it has applied.
    records: u64,
    /// The time of the last record.
    at: Duration,
    /// Since when the version of the file is in force.
    version_since: Duration,
}

impl Ledger {
    /// Before the first record: nothing is marked.
    pub fn new(plan: Arc<Plan>) -> Self {
        let nothing = vec![0; plan.places().len()];
        let state = NetState::with_marking(Arc::clone(plan.net()), nothing, Duration::ZERO);
        Self {
            state,
            firings: BTreeMap::new(),
            activations: plan
                .components()
                .iter()
                .map(|c| Activation { open: !c.is_controlled(), ..Activation::default() })
                .collect(),
            standing: BTreeMap::new(),
            counters: plan.counters().iter().map(|counter| counter.counts.initial).collect(),
            gates: Gates::new(&plan),
            stage: MissionStage::Playing,
            authority: Authority::default(),
            last_firing: 0,
            last_activation: 0,
            fired: 0,
            history: VecDeque::new(),
            why: String::new(),
            records: 0,
            at: Duration::ZERO,
            version_since: Duration::ZERO,
            plan,
        }
    }

    /// Returns the plan in force.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// Returns the tokens per place.
    pub fn marking(&self) -> &[u32] {
        self.state.marking()
    }

    /// Returns the firings in flight, by number.
    pub fn firings(&self) -> &BTreeMap<u64, Firing> {
        &self.firings
    }

    /// Returns the stage of the mission as a whole.
    pub fn stage(&self) -> MissionStage {
        self.stage
    }

    /// Returns the net's state: its clocks, and which transitions are enabled.
    pub fn state(&self) -> &NetState {
        &self.state
    }

    /// Returns the lease, if an operator commands.
    pub fn lease(&self) -> Option<&Lease> {
        self.authority.lease.as_ref()
    }

    /// Returns the pause, if the mission stands still.
    pub fn pause(&self) -> Option<&Pause> {
        self.authority.pause.as_ref()
    }

    /// Returns the last orders and when they were given; the oldest first.
    pub fn orders(&self) -> impl Iterator<Item = &(Judged, Duration)> {
        self.authority.orders()
    }

    /// Returns the variables that transitions set, and their values.
    pub fn values(&self) -> impl Iterator<Item = (&str, i64)> {
        let names = self.plan.counters().iter().map(|counter| counter.name.as_str());
        names.zip(self.counters.iter().copied())
    }

    /// Returns the values of the plan's counters.
    pub(crate) fn counters(&self) -> &[i64] {
        &self.counters
    }

    /// Returns the last activation of a component.
    pub(crate) fn activation(&self, component: ComponentId) -> &Activation {
        &self.activations[component.index()]
    }

    /// Whether a report stands.
    pub(crate) fn has_report(&self, report: &(ComponentId, String)) -> bool {
        self.standing.contains_key(report)
    }

    pub(crate) fn authority(&self) -> &Authority {
        &self.authority
    }

    /// Whether a guard is true; true of a transition without one.
    pub(crate) fn guard_holds(&self, id: TransitionId) -> bool {
        self.gates.guard(id)
    }

    /// Returns where the dates of a transition stand.
    pub(crate) fn date(&self, id: TransitionId) -> DateState {
        self.gates.date(id)
    }

    /// Whether its dates let a transition fire; true of one without dates.
    pub(crate) fn is_in_date(&self, id: TransitionId) -> bool {
        self.gates.is_in_date(&self.plan, id)
    }

    /// Whether the tokens are as a transition wants them, whatever its gate and its clock.
    pub(crate) fn is_wanted(&self, id: TransitionId) -> bool {
        let transition = self.plan.net().transition(id);
        let mut needed = transition.inputs.iter().chain(&transition.reads);
        needed.all(|arc| self.state.tokens(arc.0) >= arc.1)
            && transition.inhibitors.iter().all(|arc| self.state.tokens(arc.0) < arc.1)
    }

    /// Returns the number of the firing that begins next.
    pub(crate) fn next_firing(&self) -> u64 {
        self.last_firing + 1
    }

    /// Returns the number of the last activation.
    pub(crate) fn last_activation(&self) -> u64 {
        self.last_activation
    }

    /// Returns how many transitions have fired.
    pub(crate) fn fired(&self) -> u64 {
        self.fired
    }

    /// Returns the last transitions that fired, and when; the oldest first.
    pub(crate) fn history(&self) -> impl Iterator<Item = &(String, Duration)> {
        self.history.iter()
    }

    /// Returns why it retreated or has given up; empty if it has not.
    pub(crate) fn why(&self) -> &str {
        &self.why
    }

    /// Returns the time of the last record.
    pub(crate) fn last_at(&self) -> Duration {
        self.at
    }

    /// Returns since when the version of the file is in force.
    pub(crate) fn version_since(&self) -> Duration {
        self.version_since
    }

    /// Moves the net's clocks on. That is no decision: replaying the records moves them too.
    pub(crate) fn advance(&mut self, now: Duration) {
        self.state.advance(now);
    }

    /// Whether a marked place or a firing in flight needs the component.
    pub(crate) fn is_needed(&self, component: ComponentId) -> bool {
        self.is_marked(component)
            || self.firings.values().any(|f| self.plan.activates(&f.to, component))
    }

    /// Whether the components of a place run while it is marked: a pause stops all but safety's.
    pub(crate) fn plays(&self, place: PlaceId) -> bool {
        self.authority.pause.is_none() || self.plan.place(place).safety
    }

    /// Whether the last activation of the component is over: for a moment nothing needed it. A process
    /// that still runs belongs to no activation, and starts again if it is needed again.
    pub(crate) fn is_activation_over(&self, component: ComponentId) -> bool {
        let is_controlled = self.plan.component(component).is_controlled();
        is_controlled && !self.activations[component.index()].open
    }

    /// Whether a marked place wants the component to run, now.
    pub(crate) fn runs(&self, component: ComponentId) -> bool {
        let places = &self.plan.component(component).places;
        places.iter().any(|place| self.state.tokens(*place) > 0 && self.plays(*place))
    }

    /// Whether these places, once marked, want the component to run, now.
    pub(crate) fn activates_now(&self, to: &[(PlaceId, u32)], component: ComponentId) -> bool {
        let places = &self.plan.component(component).places;
        to.iter().any(|(place, _)| places.contains(place) && self.plays(*place))
    }

    /// Whether a firing in flight stays where it is until the pause is over.
    pub(crate) fn is_held(&self, firing: &Firing) -> bool {
        let of_safety = match &firing.cause {
            Cause::Transition(name) => self
                .plan
                .transition_named(name)
                .is_some_and(|id| self.plan.net().transition(id).class == FiringClass::Safety),
            Cause::Retreat => true,
            Cause::Start | Cause::Failure { .. } => false,
        };
        let to_safety = || firing.to.iter().any(|arc| self.plan.place(arc.0).safety);
        self.authority.pause.is_some() && !of_safety && !to_safety()
    }

    fn is_marked(&self, component: ComponentId) -> bool {
        let places = &self.plan.component(component).places;
        places.iter().any(|place| self.state.tokens(*place) > 0)
    }

    /// Returns tokens by the names of their places.
    pub(crate) fn tokens_named(&self, tokens: &[(PlaceId, u32)]) -> Vec<Tokens> {
        let name = |&(place, tokens): &(PlaceId, u32)| Tokens {
            place: self.plan.net().place(place).to_owned(),
            tokens,
        };
        tokens.iter().map(name).collect()
    }

    fn resolve_tokens(&self, tokens: &[Tokens]) -> Result<Vec<(PlaceId, u32)>, LedgerError> {
        tokens.iter().map(|it| Ok((self.find_place(&it.place)?, it.tokens))).collect()
    }

    fn find_place(&self, name: &str) -> Result<PlaceId, LedgerError> {
        self.plan.place_named(name).ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    }

    fn find_transition(&self, name: &str) -> Result<TransitionId, LedgerError> {
        self.plan.transition_named(name).ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    }

    fn find_component(&self, name: &str) -> Result<ComponentId, LedgerError> {
        self.plan.component_named(name).ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    }

    fn firing_mut(&mut self, number: u64) -> Result<&mut Firing, LedgerError> {
        self.firings.get_mut(&number).ok_or(LedgerError::UnknownFiring(number))
    }

    /// Ends a pause, if there is one: the net's clocks run again.
    fn end_pause(&mut self) -> Option<Pause> {
        let pause = self.authority.end_pause(self.at)?;
        self.state.release();
        Some(pause)
    }

    /// Ends the mission if its goal or its safe place is marked. A pause delays the end at the
    /// goal.
    fn conclude_if_ended(&mut self) {
        let marked = |place: Option<PlaceId>| place.is_some_and(|p| self.state.tokens(p) > 0);
        if marked(self.plan.safe()) {
            self.stage = MissionStage::Ending(MissionOutcome::Safe);
        } else if marked(self.plan.goal())
            && self.stage == MissionStage::Playing
            && self.authority.pause.is_none()
        {
            self.stage = MissionStage::Ending(MissionOutcome::Goal);
        }
        if self.stage != MissionStage::Playing {
            self.firings.clear();
            self.end_pause();
        }
    }

    /// Opens or shuts the gate of a transition: open while guard, report and dates all let it fire.
    fn set_gate(&mut self, id: TransitionId) {
        let on = self.plan.transition(id).on.as_ref();
        let is_reported = on.is_none_or(|on| self.standing.contains_key(on));
        let open = self.guard_holds(id) && is_reported && self.is_in_date(id);
        self.state.set_gate(id, open);
    }
}
