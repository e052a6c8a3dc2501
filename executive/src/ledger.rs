//! What has been decided: marking, firings in flight, activations, standing reports. It changes by
//! records alone ([`Ledger::apply`]), so replaying the journal gives the same ledger, to the
//! nanosecond.

pub(crate) mod activation;
pub(crate) mod authority;
#[cfg(test)]
mod comparison;
mod error;
pub(crate) mod firing;
pub(crate) mod gates;
mod orders;
mod reports;
mod snapshot;
pub(crate) mod stage;
mod transfer;

use crate::order::Judged;
use crate::record::{JournalEntry, JournalRecord};
use crate::terms::{Cause, GuardTurned, MissionOutcome, Tokens, ValueSet};
use armor_petri::{FiringClass, NetState, PlaceId, TransitionId};
use armor_plan::{ComponentId, DatePhase, GivenValue, Plan, PlannedCounter};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
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

/// How many of the last transitions fired are remembered, for people to look at.
const HISTORY: usize = 20;

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

    /// Plays a whole journal.
    ///
    /// # Errors
    /// At the first record that does not fit.
    pub fn replay(plan: Arc<Plan>, records: &[JournalRecord]) -> Result<Self, LedgerError> {
        let mut ledger = Self::new(plan);
        for record in records {
            ledger.apply(record)?;
        }
        Ok(ledger)
    }

    /// Takes one record in.
    ///
    /// # Errors
    /// If it does not fit; the ledger is not to be used further then.
    pub fn apply(&mut self, record: &JournalRecord) -> Result<(), LedgerError> {
        if let JournalEntry::Snapshot(snapshot) = &record.entry {
            *self = Self::from_snapshot(Arc::clone(&self.plan), snapshot, record.at)?;
            return Ok(());
        }
        self.records += 1;
        self.at = self.at.max(record.at);
        self.state.advance(self.at);
        match &record.entry {
            JournalEntry::Snapshot(_) => {}
            JournalEntry::Began { mission, fingerprint, .. } => {
                self.check_mission(mission, fingerprint)?;
            }
            JournalEntry::Changed { version, fingerprint, .. } => {
                self.take_version(version, fingerprint)?;
            }
            JournalEntry::Refused { .. } => {}
            JournalEntry::Took { firing, cause, from, to, sets, guards, .. } => {
                self.begin_firing(*firing, cause, from, to)?;
                self.set_values(sets, guards)?;
            }
            JournalEntry::Stopped { firing } => {
                let at = self.at;
                let firing = self.firing_mut(*firing)?;
                (firing.phase, firing.since) = (Phase::Starting, at);
            }
            JournalEntry::Activating { component, activation, values } => {
                self.begin_activation(self.find_component(component)?, *activation, values);
            }
            JournalEntry::Redirected { firing, to, .. } => self.redirect_firing(*firing, to)?,
            JournalEntry::Put { firing } => self.put_tokens(*firing)?,
            JournalEntry::Heard { component, instance, serial, report } => {
                self.take_report(self.find_component(component)?, (*instance, *serial), report);
            }
            JournalEntry::Ordered(judged) => self.carry_out(judged)?,
            JournalEntry::Asked { transition } => {
                self.set_consent(transition, Consent::Asked(self.at))?;
            }
            JournalEntry::Unanswered { transition, fires: true } => {
                self.set_consent(transition, Consent::Granted)?;
            }
            JournalEntry::Unanswered { transition, fires: false } => {
                self.set_consent(transition, Consent::Declined)?;
            }
            JournalEntry::LinkLost { .. } => self.authority.lose_link(self.at),
            JournalEntry::Held { .. } => self.begin_pause("the executive"),
            JournalEntry::Guard { transition, holds, .. } => self.set_guard(transition, *holds)?,
            JournalEntry::Dated { transition, phase, .. } => {
                self.set_date_phase(transition, *phase)?;
            }
            JournalEntry::Retreated { why } => self.begin_retreat(why),
            JournalEntry::GaveUp { why } => {
                self.why.clone_from(why);
                self.firings.clear();
                self.stage = MissionStage::Ending(MissionOutcome::Failed);
                self.end_pause();
            }
            JournalEntry::Ended { outcome } => self.stage = MissionStage::Ended(*outcome),
        }
        self.forget_what_no_longer_counts();
        let state = &self.state;
        self.authority.retain_consents(|id| state.enabled_since(id).is_some());
        Ok(())
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

    /// Returns the values of an activation that begins now.
    pub(crate) fn values_for(&self, component: ComponentId) -> Vec<GivenValue> {
        self.values_with(component, &[], None)
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

    fn check_mission(&self, mission: &str, fingerprint: &str) -> Result<(), LedgerError> {
        if mission == self.plan.mission() && fingerprint == self.plan.fingerprint() {
            return Ok(());
        }
        Err(LedgerError::OtherMission {
            mission: mission.to_owned(),
            fingerprint: fingerprint.to_owned(),
        })
    }

    fn begin_firing(
        &mut self,
        number: u64,
        cause: &Cause,
        from: &[Tokens],
        to: &[Tokens],
    ) -> Result<(), LedgerError> {
        let (from, to) = (self.resolve_tokens(from)?, self.resolve_tokens(to)?);
        let mut leaving: BTreeSet<_> = from.iter().map(|arc| arc.0).collect();
        match cause {
            Cause::Transition(name) => self.take_tokens(name)?,
            Cause::Start | Cause::Retreat => leaving = self.plan.place_ids().collect(),
            Cause::Failure { place, .. } => {
                for &(from, tokens) in &from {
                    let refused = |why| LedgerError::NotAllowed { what: place.clone(), why };
                    self.state.remove(from, tokens).map_err(refused)?;
                }
            }
        }
        self.last_firing = self.last_firing.max(number);
        let renewing = self.to_renew(&to, None);
        let firing = Firing {
            cause: cause.clone(),
            from,
            to,
            phase: Phase::Stopping,
            since: self.at,
            redirected: false,
            leaving,
            renewing,
        };
        self.firings.insert(number, firing);
        Ok(())
    }

    fn take_tokens(&mut self, name: &str) -> Result<(), LedgerError> {
        let id = self.find_transition(name)?;
        let refused = |why| LedgerError::NotAllowed { what: name.to_owned(), why };
        self.state.take(id).map_err(refused)?;
        self.authority.forget_consent(id);
        self.fired += 1;
        self.history.push_back((name.to_owned(), self.at));
        if self.history.len() > HISTORY {
            self.history.pop_front();
        }
        if self.plan.transition(id).dates.is_some() {
            self.gates.use_date(id);
            self.set_gate(id);
        }
        if let Some(on) = &self.plan.transition(id).on {
            let on = on.clone();
            self.standing.remove(&on);
            self.set_gates(&on);
        }
        Ok(())
    }

    fn set_guard(&mut self, name: &str, is_true: bool) -> Result<(), LedgerError> {
        let id = self.find_transition(name)?;
        self.gates.set_guard(id, is_true);
        self.set_gate(id);
        Ok(())
    }

    fn redirect_firing(&mut self, number: u64, to: &[Tokens]) -> Result<(), LedgerError> {
        let (to, at) = (self.resolve_tokens(to)?, self.at);
        let renewing = self.to_renew(&to, Some(number));
        let firing = self.firing_mut(number)?;
        firing.leaving.extend(firing.to.iter().map(|arc| arc.0));
        (firing.to, firing.renewing) = (to, renewing);
        (firing.phase, firing.since, firing.redirected) = (Phase::Stopping, at, true);
        Ok(())
    }

    fn put_tokens(&mut self, number: u64) -> Result<(), LedgerError> {
        let firing = self.firings.remove(&number).ok_or(LedgerError::UnknownFiring(number))?;
        for &(place, tokens) in &firing.to {
            let what = || self.plan.net().place(place).to_owned();
            let refused = |why| LedgerError::NotAllowed { what: what(), why };
            self.state.add(place, tokens).map_err(refused)?;
        }
        // A pause can prevent the fresh start of a component; it then starts after the pause, and
        // its old reports must not count until then.
        for component in firing.renewing {
            let activation = &mut self.activations[component.index()];
            (activation.done, activation.failed, activation.interrupted) = (false, None, false);
            self.forget_reports_of(component);
        }
        self.conclude_if_ended();
        Ok(())
    }

    fn begin_retreat(&mut self, why: &str) {
        self.why = why.to_owned();
        self.firings.clear();
        self.state.clear();
        self.end_pause();
        let Some(safe) = self.plan.safe() else {
            self.stage = MissionStage::Ending(MissionOutcome::Failed);
            return;
        };
        self.stage = MissionStage::Retreating;
        self.last_firing += 1;
        let to = vec![(safe, 1)];
        let firing = Firing {
            cause: Cause::Retreat,
            from: Vec::new(),
            renewing: self.to_renew(&to, None),
            to,
            // Each component of the safe place starts as soon as those it excludes are off; a
            // brake does not wait for a camera.
            phase: Phase::Starting,
            since: self.at,
            redirected: true,
            leaving: self.plan.place_ids().collect(),
        };
        self.firings.insert(self.last_firing, firing);
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

    fn set_date_phase(&mut self, name: &str, phase: DatePhase) -> Result<(), LedgerError> {
        let id = self.find_transition(name)?;
        self.gates.set_date_phase(id, phase);
        self.set_gate(id);
        Ok(())
    }

    /// Opens or shuts the gate of a transition: open while guard, report and dates all let it fire.
    fn set_gate(&mut self, id: TransitionId) {
        let on = self.plan.transition(id).on.as_ref();
        let is_reported = on.is_none_or(|on| self.standing.contains_key(on));
        let open = self.guard_holds(id) && is_reported && self.is_in_date(id);
        self.state.set_gate(id, open);
    }

    /// Sets the variables of a firing. It does so when the tokens are taken, so that the next
    /// decision is made with the new values.
    fn set_values(&mut self, sets: &[ValueSet], guards: &[GuardTurned]) -> Result<(), LedgerError> {
        for set in sets {
            let named = |counter: &PlannedCounter| counter.name == set.variable;
            let index = self.plan.counters().iter().position(named);
            let index = index.ok_or_else(|| LedgerError::UnknownName(set.variable.clone()))?;
            self.counters[index] = set.value;
        }
        guards.iter().try_for_each(|turned| self.set_guard(&turned.transition, turned.holds))
    }

    /// The components of a firing's places that run and have to be started afresh: those that have
    /// finished, and those that get other values. `firing` is its number, if it is in flight.
    fn to_renew(&self, to: &[(PlaceId, u32)], firing: Option<u64>) -> BTreeSet<ComponentId> {
        let mut renewed = self.finished_in(to);
        let components = to.iter().flat_map(|arc| &self.plan.place(arc.0).components);
        renewed.extend(components.filter(|component| {
            let last = &self.activations[component.index()];
            let is_same = |values: &[GivenValue]| {
                let terms = values.iter().map(GivenValue::terms);
                terms.eq(last.values.iter().map(GivenValue::terms))
            };
            let runs = last.open && self.plan.component(**component).is_controlled();
            runs && last.number > 0 && !is_same(&self.values_with(**component, to, firing))
        }));
        renewed
    }

    /// Returns the values of a component from the marked places, the places that firings in flight
    /// lead to (without the firing `except`), and `to`.
    fn values_with(
        &self,
        component: ComponentId,
        to: &[(PlaceId, u32)],
        except: Option<u64>,
    ) -> Vec<GivenValue> {
        let flights = self.firings.iter().filter(|(number, _)| Some(**number) != except);
        let arriving: BTreeSet<_> =
            flights.flat_map(|(_, firing)| &firing.to).chain(to).map(|arc| arc.0).collect();
        let is_marked = |place: PlaceId| self.state.tokens(place) > 0 || arriving.contains(&place);
        self.plan.values_in(component, is_marked)
    }
}
