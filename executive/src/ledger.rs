//! What has been decided: marking, firings in flight, activations, standing reports. It changes
//! by records alone, so playing the journal again gives the same ledger, to the nanosecond.

use crate::authority::{Authority, Consent};
use crate::dates::Dated;
use crate::record::{Cause, Entry, Outcome, Record, Tokens};
use armor_petri::{PlaceId, State, TransitionId};
use armor_plan::{ComponentId, GivenValue, Plan};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// How many of the last transitions fired are remembered, for people to look at.
const HISTORY: usize = 20;

/// Why a record does not fit what came before it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LedgerError {
    /// The journal was written for another mission, or another version of it.
    #[error("the journal belongs to mission `{mission}` with fingerprint {fingerprint}")]
    OtherMission {
        /// Its mission.
        mission: String,
        /// Its fingerprint.
        fingerprint: String,
    },
    /// A new version of the file that cannot be taken there.
    #[error("the journal says that version {version} of the file was taken, but: {why}")]
    NotTaken {
        /// Its number.
        version: u64,
        /// What is wrong.
        why: String,
    },
    /// A name that the plan does not have.
    #[error("the journal speaks of `{0}`, which the mission does not have")]
    UnknownName(String),
    /// A number of no firing in flight.
    #[error("the journal speaks of firing {0}, which is not in flight")]
    UnknownFiring(u64),
    /// The net does not allow it there.
    #[error("the journal says that `{what}` happened, but the net does not allow it: {why}")]
    NotAllowed {
        /// What was to happen.
        what: String,
        /// What the net says.
        why: armor_petri::FireError,
    },
}

/// Where a firing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Until everything that must stop has confirmed it.
    Stopping,
    /// Until everything that must start has confirmed it.
    Starting,
}

/// Tokens on their way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Firing {
    /// Why.
    pub cause: Cause,
    /// What was taken.
    pub from: Vec<(PlaceId, u32)>,
    /// What will be put.
    pub to: Vec<(PlaceId, u32)>,
    /// Where it is.
    pub phase: Phase,
    /// Since when it is there.
    pub since: Duration,
    /// Whether it is already on its second way.
    pub redirected: bool,
    /// Places whose components must be off unless something else wants them.
    pub(crate) leaving: BTreeSet<PlaceId>,
    /// Components that are in both, but have finished and need a fresh start.
    pub(crate) renewing: BTreeSet<ComponentId>,
}

/// Where the mission is as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// It plays.
    Playing,
    /// It goes to the safe place.
    Retreating,
    /// Its last place is marked; what does not belong to it is being stopped.
    Ending(Outcome),
    /// It is over.
    Ended(Outcome),
}

/// The last activation of a component, and what came of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Activation {
    pub(crate) number: u64,
    /// Whether its reports count.
    pub(crate) open: bool,
    pub(crate) done: bool,
    pub(crate) failed: Option<String>,
    /// The values that places gave its parameters when it began.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) values: Vec<GivenValue>,
    /// A pause stopped it. If it has not finished it goes on, under another number.
    pub(crate) interrupted: bool,
    /// The last report that counted: process start and number.
    pub(crate) heard: (u64, u64),
}

/// All that is decided, and nothing that is merely observed.
#[derive(Clone, Debug)]
pub struct Ledger {
    pub(crate) plan: Arc<Plan>,
    pub(crate) state: State,
    pub(crate) firings: BTreeMap<u64, Firing>,
    pub(crate) activations: Vec<Activation>,
    /// Reports that stand until a transition consumes them.
    pub(crate) standing: BTreeMap<(ComponentId, String), f64>,
    /// The values of the variables that transitions set.
    pub(crate) counters: Vec<i64>,
    /// Per transition, whether its guard holds; true of those without one.
    pub(crate) holds: Vec<bool>,
    /// Per transition, where its dates stand.
    pub(crate) dates: Vec<Dated>,
    pub(crate) stage: Stage,
    pub(crate) authority: Authority,
    pub(crate) last_firing: u64,
    pub(crate) last_activation: u64,
    /// Transitions fired so far.
    pub(crate) fired: u64,
    /// The last of them, and when; the oldest first.
    pub(crate) history: VecDeque<(String, Duration)>,
    /// The last words on why it retreated or gave up.
    pub(crate) why: String,
    /// How many records it was told.
    pub(crate) records: u64,
    pub(crate) at: Duration,
    /// Since when the version of the file is played.
    pub(crate) version_since: Duration,
}

impl Ledger {
    /// Before the first record: nothing is marked.
    pub fn new(plan: Arc<Plan>) -> Self {
        let nothing = vec![0; plan.places().len()];
        let state = State::with_marking(Arc::clone(plan.net()), nothing, Duration::ZERO);
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
            holds: plan.transitions().iter().map(|t| t.guard.is_none()).collect(),
            dates: vec![Dated::default(); plan.transitions().len()],
            stage: Stage::Playing,
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
    pub fn replay(plan: Arc<Plan>, records: &[Record]) -> Result<Self, LedgerError> {
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
    pub fn apply(&mut self, record: &Record) -> Result<(), LedgerError> {
        if let Entry::Snapshot(snapshot) = &record.entry {
            *self = Self::of_snapshot(Arc::clone(&self.plan), snapshot, record.at)?;
            return Ok(());
        }
        self.records += 1;
        self.at = self.at.max(record.at);
        self.state.advance(self.at);
        match &record.entry {
            Entry::Snapshot(_) => {}
            Entry::Began { mission, fingerprint, .. } => self.began(mission, fingerprint)?,
            Entry::Changed { version, fingerprint, .. } => self.changed(version, fingerprint)?,
            Entry::Refused { .. } => {}
            Entry::Took { firing, cause, from, to, sets, guards, .. } => {
                self.took(*firing, cause, from, to)?;
                self.set_values(sets, guards)?;
            }
            Entry::Stopped { firing } => {
                let at = self.at;
                let firing = self.firing_mut(*firing)?;
                (firing.phase, firing.since) = (Phase::Starting, at);
            }
            Entry::Activating { component, activation, values } => {
                self.activating(self.component(component)?, *activation, values);
            }
            Entry::Redirected { firing, to, .. } => self.redirected(*firing, to)?,
            Entry::Put { firing } => self.put(*firing)?,
            Entry::Heard { component, instance, serial, report } => {
                self.heard(self.component(component)?, (*instance, *serial), report);
            }
            Entry::Ordered(judged) => self.ordered(judged)?,
            Entry::Asked { transition } => self.consent(transition, Consent::Asked(self.at))?,
            Entry::Unanswered { transition, fires: true } => {
                self.consent(transition, Consent::Granted)?;
            }
            Entry::Unanswered { transition, fires: false } => {
                self.consent(transition, Consent::Declined)?;
            }
            Entry::LinkLost { .. } => self.link_is_lost(),
            Entry::Held { .. } => self.hold("the executive"),
            Entry::Guard { transition, holds, .. } => self.weighed(transition, *holds)?,
            Entry::Dated { transition, phase, .. } => self.dated(transition, *phase)?,
            Entry::Retreated { why } => self.retreated(why),
            Entry::GaveUp { why } => {
                self.why.clone_from(why);
                self.firings.clear();
                self.stage = Stage::Ending(Outcome::Failed);
                self.end_pause();
            }
            Entry::Ended { outcome } => self.stage = Stage::Ended(*outcome),
        }
        self.forget_what_no_longer_counts();
        self.forget_consents();
        Ok(())
    }

    /// Tokens per place.
    pub fn marking(&self) -> &[u32] {
        self.state.marking()
    }

    /// Firings in flight, by number.
    pub fn firings(&self) -> &BTreeMap<u64, Firing> {
        &self.firings
    }

    /// Where the mission is as a whole.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The net's state: clocks and who is enabled.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Whether a marked place or a firing in flight needs the component.
    pub(crate) fn supports(&self, component: ComponentId) -> bool {
        self.marks(component)
            || self.firings.values().any(|f| self.plan.activates(&f.to, component))
    }

    /// Whether a marked place has the component.
    pub(crate) fn marks(&self, component: ComponentId) -> bool {
        let places = &self.plan.component(component).places;
        places.iter().any(|place| self.state.tokens(*place) > 0)
    }

    pub(crate) fn tokens_named(&self, tokens: &[(PlaceId, u32)]) -> Vec<Tokens> {
        let name = |&(place, tokens): &(PlaceId, u32)| Tokens {
            place: self.plan.net().place(place).to_owned(),
            tokens,
        };
        tokens.iter().map(name).collect()
    }

    pub(crate) fn began(&self, mission: &str, fingerprint: &str) -> Result<(), LedgerError> {
        if mission == self.plan.mission() && fingerprint == self.plan.fingerprint() {
            return Ok(());
        }
        Err(LedgerError::OtherMission {
            mission: mission.to_owned(),
            fingerprint: fingerprint.to_owned(),
        })
    }

    fn took(
        &mut self,
        number: u64,
        cause: &Cause,
        from: &[Tokens],
        to: &[Tokens],
    ) -> Result<(), LedgerError> {
        let (from, to) = (self.resolved(from)?, self.resolved(to)?);
        let mut leaving: BTreeSet<_> = from.iter().map(|arc| arc.0).collect();
        match cause {
            Cause::Transition(name) => self.take(name)?,
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

    fn take(&mut self, name: &str) -> Result<(), LedgerError> {
        let id = self.transition(name)?;
        let refused = |why| LedgerError::NotAllowed { what: name.to_owned(), why };
        self.state.take(id).map_err(refused)?;
        self.authority.consents.remove(&id);
        self.fired += 1;
        self.history.push_back((name.to_owned(), self.at));
        if self.history.len() > HISTORY {
            self.history.pop_front();
        }
        self.date_used(id);
        if let Some(on) = &self.plan.transition(id).on {
            let on = on.clone();
            self.standing.remove(&on);
            self.set_gates(&on);
        }
        Ok(())
    }

    pub(crate) fn weighed(&mut self, name: &str, holds: bool) -> Result<(), LedgerError> {
        let id = self.transition(name)?;
        self.holds[id.index()] = holds;
        self.set_gate(id);
        Ok(())
    }

    fn redirected(&mut self, number: u64, to: &[Tokens]) -> Result<(), LedgerError> {
        let (to, at) = (self.resolved(to)?, self.at);
        let renewing = self.to_renew(&to, Some(number));
        let firing = self.firing_mut(number)?;
        firing.leaving.extend(firing.to.iter().map(|arc| arc.0));
        (firing.to, firing.renewing) = (to, renewing);
        (firing.phase, firing.since, firing.redirected) = (Phase::Stopping, at, true);
        Ok(())
    }

    fn put(&mut self, number: u64) -> Result<(), LedgerError> {
        let firing = self.firings.remove(&number).ok_or(LedgerError::UnknownFiring(number))?;
        for &(place, tokens) in &firing.to {
            let what = || self.plan.net().place(place).to_owned();
            let refused = |why| LedgerError::NotAllowed { what: what(), why };
            self.state.add(place, tokens).map_err(refused)?;
        }
        // What a pause keeps from a fresh start has it afterwards, and nothing to report till then.
        for component in firing.renewing {
            let activation = &mut self.activations[component.index()];
            (activation.done, activation.failed, activation.interrupted) = (false, None, false);
            self.forget_reports_of(component);
        }
        self.conclude();
        Ok(())
    }

    pub(crate) fn retreated(&mut self, why: &str) {
        self.why = why.to_owned();
        self.firings.clear();
        self.state.clear();
        self.end_pause();
        let Some(safe) = self.plan.safe() else {
            self.stage = Stage::Ending(Outcome::Failed);
            return;
        };
        self.stage = Stage::Retreating;
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

    pub(crate) fn resolved(&self, tokens: &[Tokens]) -> Result<Vec<(PlaceId, u32)>, LedgerError> {
        tokens.iter().map(|it| Ok((self.place(&it.place)?, it.tokens))).collect()
    }

    pub(crate) fn place(&self, name: &str) -> Result<PlaceId, LedgerError> {
        self.plan.place_named(name).ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    }

    pub(crate) fn transition(&self, name: &str) -> Result<TransitionId, LedgerError> {
        self.plan.transition_named(name).ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    }

    pub(crate) fn component(&self, name: &str) -> Result<ComponentId, LedgerError> {
        self.plan.component_named(name).ok_or_else(|| LedgerError::UnknownName(name.to_owned()))
    }

    fn firing_mut(&mut self, number: u64) -> Result<&mut Firing, LedgerError> {
        self.firings.get_mut(&number).ok_or(LedgerError::UnknownFiring(number))
    }
}
