//! The controller: one pure state machine from events to actions.
//!
//! It owns a [`Ledger`] (what is decided) and a roster (what is observed), and after every event
//! settles the difference: firings move on, transitions begin, components are told what to do.
//! Everything decided is first an [`Action::Journal`]; nothing here knows sockets or clocks.

use crate::change::Change;
use crate::event::{Action, Event};
use crate::ledger::{Firing, Ledger, LedgerError, Phase, Stage};
use crate::moving::Moving;
use crate::operator::Link;
use crate::record::{Cause, Entry, Outcome, Record, ValueSet};
use crate::roster::{Doing, Roster};
use crate::senses::Senses;
use crate::time::{Deadlines, HostTimes, Now};
use crate::waits::Stuck;
use armor_petri::{PlaceId, Step, TransitionId};
use armor_plan::{ComponentId, OnResume, Plan};
use armor_robotfile::Date;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Reports and orders that changed nothing, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// From an activation that is over.
    pub late: u64,
    /// Told again, and already counted.
    pub repeated: u64,
    /// Nothing in the mission waits for them.
    pub unheard: u64,
    /// Orders that were refused and not even written down, as there were too many.
    pub orders: u64,
}

/// Plays one mission.
#[derive(Clone, Debug)]
pub struct Controller {
    pub(crate) plan: Arc<Plan>,
    pub(crate) ledger: Ledger,
    pub(crate) roster: Roster,
    /// Mission time.
    pub(crate) now: Duration,
    /// Host time.
    pub(crate) host: Duration,
    pub(crate) host_times: HostTimes,
    pub(crate) actions: Vec<Action>,
    pub(crate) dropped: Dropped,
    /// Components that had to be killed and are gone now, or that not even that is known of.
    pub(crate) unstopped: Vec<ComponentId>,
    /// Starts that nothing will let begin, by the number of the firing.
    pub(crate) stuck: BTreeMap<u64, Stuck>,
    /// It has been told to stop.
    pub(crate) stopping: bool,
    /// Of the holder of the lease, if there is one.
    pub(crate) link: Link,
    pub(crate) senses: Senses,
    /// A version of the file that is there and not played.
    pub(crate) change: Option<Change>,
    /// Tokens to be moved once that is proven to be safe.
    pub(crate) moving: Option<Moving>,
    /// Moves that this process was asked about.
    pub(crate) moves: u64,
    /// Versions offered to this process.
    pub(crate) offers: u64,
    /// The number of the newest version with the mission that is played.
    pub(crate) known_as: u64,
    /// UTC at mission time 0, as it has been told last.
    pub(crate) utc_at_start: Option<Date>,
    finished: bool,
    /// With a period: when it looks at the net next, if there is something to see.
    next_look: Option<Duration>,
}

impl Controller {
    /// Begins a mission. The initial places are entered once every component is known to be off.
    pub fn new(plan: Arc<Plan>, now: impl Into<Now>) -> (Self, Vec<Action>) {
        let mut controller = Self::around(Ledger::new(Arc::clone(&plan)), now.into(), false);
        controller.record(Entry::Began {
            mission: plan.mission().to_owned(),
            fingerprint: plan.fingerprint(),
            version: (**plan.version()).clone(),
        });
        let initial = plan.place_ids().zip(plan.net().initial().iter().copied());
        let initial: Vec<_> = initial.filter(|(_, tokens)| *tokens > 0).collect();
        controller.begin(Cause::Start, &[], &initial, Duration::ZERO);
        controller.settle();
        let actions = std::mem::take(&mut controller.actions);
        (controller, actions)
    }

    /// A mission whose journal is lost: nobody knows where it stood, or what it may do twice. It
    /// goes to its safe place, past all that may be running.
    pub(crate) fn lost(plan: Arc<Plan>, why: &str, now: impl Into<Now>) -> (Self, Vec<Action>) {
        let mut controller = Self::around(Ledger::new(Arc::clone(&plan)), now.into(), true);
        controller.record(Entry::Began {
            mission: plan.mission().to_owned(),
            fingerprint: plan.fingerprint(),
            version: (**plan.version()).clone(),
        });
        controller.retreat(why);
        controller.settle();
        let actions = std::mem::take(&mut controller.actions);
        (controller, actions)
    }

    /// Goes on where a journal ends. Every component counts as running until it says otherwise.
    ///
    /// # Errors
    /// If the journal is not one of this plan.
    pub fn resume(
        plan: Arc<Plan>,
        records: &[Record],
        now: impl Into<Now>,
    ) -> Result<(Self, Vec<Action>), LedgerError> {
        if records.is_empty() {
            return Ok(Self::new(plan, now));
        }
        Ok(Self::go_on(Ledger::replay(plan, records)?, now))
    }

    /// The same with the ledger that the journal gives.
    pub(crate) fn go_on(ledger: Ledger, now: impl Into<Now>) -> (Self, Vec<Action>) {
        let on_resume = ledger.plan.on_resume();
        let mut controller = Self::around(ledger, now.into(), true);
        if let Stage::Ended(outcome) = controller.ledger.stage {
            controller.finish(outcome);
        } else if on_resume == OnResume::Safe {
            controller.retreat("the executive was restarted, and the mission resumes in safety");
        } else if on_resume == OnResume::Hold
            && controller.ledger.stage == Stage::Playing
            && controller.ledger.pause().is_none()
        {
            let why = "the executive was restarted; an operator has to resume the mission";
            controller.record(Entry::Held { why: why.to_owned() });
        }
        controller.settle();
        let actions = std::mem::take(&mut controller.actions);
        (controller, actions)
    }

    /// Takes in one event at `now` (neither clock ever goes back) and says what to do.
    pub fn handle(&mut self, event: Event, now: impl Into<Now>) -> Vec<Action> {
        let Now { mission, host } = now.into();
        (self.now, self.host) = (self.now.max(mission), self.host.max(host));
        if !self.finished {
            self.take_in(event);
            self.settle();
        }
        std::mem::take(&mut self.actions)
    }

    /// When [`Event::Timer`] is due next, if nothing else happens.
    pub fn deadlines(&self) -> Deadlines {
        if self.finished {
            return Deadlines::default();
        }
        let firing = self.may_fire().then(|| self.next_firing()).flatten();
        let firing = match self.next_look {
            Some(look) => firing.map(|at| at.max(look)),
            None => firing,
        };
        let answers = self.answers_due().map(|due| due.1);
        let waits = self.pushes().chain(self.patience()).chain(self.senses_due());
        Deadlines {
            mission: firing
                .into_iter()
                .chain(answers)
                .chain(self.dates_due())
                .chain(self.waits_due())
                .min(),
            host: waits.chain(self.lease_due()).min(),
        }
    }

    /// The same where both clocks are one.
    pub fn next_deadline(&self) -> Option<Duration> {
        let Deadlines { mission, host } = self.deadlines();
        mission.into_iter().chain(host).min()
    }

    /// What has been decided.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Whether it has been told to stop.
    pub fn is_stopping(&self) -> bool {
        self.stopping
    }

    /// Reports that changed nothing.
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    fn around(ledger: Ledger, now: Now, is_restart: bool) -> Self {
        let plan = Arc::clone(&ledger.plan);
        let Now { mission, host } = now;
        let host = if plan.clock().is_none() { host.max(ledger.at) } else { host };
        let senses = Senses::new(&plan, is_restart.then_some(host));
        let mut host_times = HostTimes::default();
        host_times.follow(&ledger, host);
        Self {
            roster: Roster::new(&plan, host),
            now: mission.max(ledger.at),
            host,
            host_times,
            ledger,
            actions: Vec::new(),
            dropped: Dropped::default(),
            unstopped: Vec::new(),
            stuck: BTreeMap::new(),
            stopping: false,
            link: Link::Down(host),
            senses,
            change: None,
            moving: None,
            moves: 0,
            offers: 0,
            known_as: plan.version().number,
            plan,
            utc_at_start: None,
            finished: false,
            next_look: None,
        }
    }

    /// Goes on until nothing more can be decided without something happening first.
    pub(crate) fn settle(&mut self) {
        self.ledger.state.advance(self.now);
        let mut step = Step::new(self.plan.limits().step_bound);
        loop {
            let before = self.actions.len();
            self.push_orders();
            if !self.stopping {
                self.notice_lost_link();
                self.consider_change();
                self.notice_waits();
                self.move_firings_on();
                self.notice_failures();
                self.weigh_guards();
                self.weigh_dates();
                self.ask();
                self.fire_next(&mut step);
            }
            self.command_components();
            if self.actions.len() == before || self.finished {
                break;
            }
        }
        self.remember_waits();
        self.notice_the_end();
    }

    /// Begins the transition whose turn it is, if there is one.
    fn fire_next(&mut self, step: &mut Step) {
        let Some(id) = self.next_ready().filter(|_| self.may_fire()) else {
            self.next_look = None;
            return;
        };
        if let Some(period) = self.plan.period().filter(|period| !period.is_zero())
            && step.fired().is_empty()
            && !self.is_granted(id)
        {
            let look = *self.next_look.get_or_insert_with(|| next_multiple(self.now, period));
            if self.now < look {
                return;
            }
            self.next_look = None;
        }
        self.begin_transition(id);
        let flights = self.ledger.firings.len();
        if flights > self.plan.limits().firings {
            self.retreat(&format!("{flights} firings in flight at once: the net has no bound"));
        }
        if let Err(endless) = step.count(id) {
            let names = |id: &TransitionId| self.plan.net().transition(*id).name.clone();
            let cycle: Vec<_> = endless.cycle.iter().map(names).collect();
            self.retreat(&format!(
                "{} transitions fired at one moment; these repeat without end: {}",
                endless.bound,
                cycle.join(" ")
            ));
        }
    }

    pub(crate) fn may_fire(&self) -> bool {
        self.ledger.stage == Stage::Playing && !self.stopping
    }

    fn begin_transition(&mut self, id: TransitionId) {
        let sets = match self.plan.sets_of(id, &self.ledger.counters) {
            Ok(sets) => sets,
            Err(why) => return self.retreat(&why),
        };
        let guards = self.guards_after(&sets);
        let named = |(index, value): (usize, i64)| {
            let variable = self.plan.counters()[index].name.clone();
            ValueSet { variable, value }
        };
        let sets = sets.into_iter().map(named).collect();
        let (state, net) = (&self.ledger.state, self.plan.net());
        let transition = net.transition(id);
        let emptied = transition.resets.iter().filter_map(|&place| {
            let taken = transition.inputs.iter().find(|arc| arc.0 == place);
            let rest = state.tokens(place).saturating_sub(taken.map_or(0, |arc| arc.1));
            (rest > 0).then_some((place, rest))
        });
        let from: Vec<_> = transition.inputs.iter().copied().chain(emptied).collect();
        let mut to = transition.outputs.clone();
        // A mission with a period looks so often, and the next look is in time.
        let period = self.plan.period().unwrap_or_default();
        let latest = state.deadline(id).map(|at| at.saturating_add(period));
        let late = latest.map_or(Duration::ZERO, |at| self.now.saturating_sub(at));
        if late > self.plan.limits().overrun
            && let Some(overrun) = self.plan.transition(id).overrun
        {
            to.push((overrun, 1));
        }
        let cause = Cause::Transition(transition.name.clone());
        self.record(Entry::Took {
            firing: self.ledger.last_firing + 1,
            cause,
            from: self.ledger.tokens_named(&from),
            to: self.ledger.tokens_named(&to),
            late_s: late.as_secs_f64(),
            sets,
            guards,
        });
    }

    pub(crate) fn begin(
        &mut self,
        cause: Cause,
        from: &[(PlaceId, u32)],
        to: &[(PlaceId, u32)],
        late: Duration,
    ) {
        self.record(Entry::Took {
            firing: self.ledger.last_firing + 1,
            cause,
            from: self.ledger.tokens_named(from),
            to: self.ledger.tokens_named(to),
            late_s: late.as_secs_f64(),
            sets: Vec::new(),
            guards: Vec::new(),
        });
    }

    /// Gives up every token and firing for the safe place.
    pub(crate) fn retreat(&mut self, why: &str) {
        if self.ledger.stage == Stage::Playing {
            self.record(Entry::Retreated { why: why.to_owned() });
        }
    }

    /// Decides: into the journal and into the ledger.
    pub(crate) fn record(&mut self, entry: Entry) {
        let record = Record { at: self.now, entry };
        self.ledger.apply(&record).expect("whoever decides looks at the ledger first");
        self.host_times.follow(&self.ledger, self.host);
        self.actions.push(Action::Journal(record));
        self.publish();
    }

    pub(crate) fn publish(&mut self) {
        if !self.actions.contains(&Action::Publish) {
            self.actions.push(Action::Publish);
        }
    }

    /// Over, once everything that does not belong to the last place is off.
    fn notice_the_end(&mut self) {
        if self.finished {
            return;
        }
        if self.stopping {
            if self.plan.component_ids().all(|c| self.is_settled_off(c)) {
                self.finish(Outcome::Interrupted);
            }
            return;
        }
        let Stage::Ending(outcome) = self.ledger.stage else { return };
        let rest =
            || self.plan.component_ids().filter(|c| !self.plan.component(*c).places.is_empty());
        if rest().any(|c| self.wants_off(c) && !self.is_settled_off(c)) {
            return;
        }
        let still_running = rest().any(|c| self.wants_off(c) && self.roster.of(c).unstoppable);
        let outcome = if still_running { Outcome::Failed } else { outcome };
        self.record(Entry::Ended { outcome });
        self.finish(outcome);
    }

    fn finish(&mut self, outcome: Outcome) {
        self.finished = true;
        self.publish();
        self.actions.push(Action::Finished(outcome));
    }
}

/// The first multiple of `period` that is not before `now`.
fn next_multiple(now: Duration, period: Duration) -> Duration {
    let (now, period) = (now.as_nanos(), period.as_nanos());
    let at = now.div_ceil(period) * period;
    Duration::from_nanos(u64::try_from(at).unwrap_or(u64::MAX))
}

impl Firing {
    pub(crate) fn is_starting(&self) -> bool {
        self.phase == Phase::Starting
    }
}

impl Doing {
    pub(crate) fn is_at_rest(self) -> bool {
        self == Self::Frozen
    }
}
