//! A mission played without a robot: by hand, by itself, or along a firing sequence that a proof
//! found; every step can be undone.
//!
//! Time is that of the mission and passes only when the user lets it pass. The user takes the part
//! of reports, guards and people: a transition that waits for one of them fires when the user fires
//! it.

pub mod chance;
pub mod follow;
pub mod refusal;
pub mod world;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use armor_petri::{NetState, TransitionId};
use armor_robotfile::guard::Scalar;

use super::schedule::is_enabled;
use super::stage::{Act, Stage};
use follow::Course;
use refusal::NotNow;
use world::World;

/// Moments that can be gone back to; older ones are forgotten.
const MAX_PAST: usize = 10_000;

/// A mission being played.
#[derive(Debug)]
pub struct Play {
    stage: Arc<Stage>,
    now: Moment,
    past: VecDeque<Moment>,
    course: Option<Course>,
}

/// All that changes while it is played.
#[derive(Clone, Debug)]
struct Moment {
    state: NetState,
    world: World,
    /// What led here: nothing at the start.
    by: Option<Happened>,
    /// How many firings there were.
    firings: usize,
}

/// One step of a play.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Happened {
    /// A transition fired.
    Fired {
        /// Which one.
        transition: TransitionId,
        /// How far its deadline had passed.
        late: Duration,
    },
    /// Something was reported, or a value changed.
    Sensed(String),
    /// Time passed.
    Waited(Duration),
}

/// How a transition stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It may fire now.
    Ready,
    /// Its clock runs; it may fire at this moment.
    Waits(Duration),
    /// Tokens are there; it waits for a report, a guard or a date.
    Expects,
    /// Tokens are missing, or there are too many of them.
    Disabled,
}

/// The result of firing a transition by hand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It fired.
    Fired,
    /// Its conditions are met; its clock runs until this moment.
    Clock(Duration),
}

impl Play {
    /// Begins at the initial marking.
    pub fn new(stage: Arc<Stage>) -> Self {
        let state = NetState::new(Arc::clone(&stage.net), Duration::ZERO);
        let world = World::at_start(&stage);
        let mut now = Moment { state, world, by: None, firings: 0 };
        now.world.open_gates(&stage, &mut now.state);
        Self { stage, now, past: VecDeque::new(), course: None }
    }

    /// What is played.
    pub fn stage(&self) -> &Arc<Stage> {
        &self.stage
    }

    /// Tokens per place of the flattened mission.
    pub fn marking(&self) -> &[u32] {
        self.now.state.marking()
    }

    /// The mission's time.
    pub fn time(&self) -> Duration {
        self.now.state.now()
    }

    /// How many firings led here.
    pub fn firings(&self) -> usize {
        self.now.firings
    }

    /// What the last step was.
    pub fn last(&self) -> Option<&Happened> {
        self.now.by.as_ref()
    }

    /// What happened so far, the latest first, each with the moment it happened at.
    pub fn story(&self) -> impl Iterator<Item = (Duration, &Happened)> {
        let moments = std::iter::once(&self.now).chain(self.past.iter().rev());
        moments.filter_map(|moment| Some((moment.state.now(), moment.by.as_ref()?)))
    }

    /// Whether the mission is at its end: the goal or the safe place is marked.
    pub fn is_over(&self) -> bool {
        self.stage.is_over(self.marking())
    }

    /// Whether nothing can ever fire any longer although the mission is not over.
    pub fn stands_still(&self) -> bool {
        !self.is_over() && !self.stage.net.transition_ids().any(|id| self.has_tokens(id))
    }

    /// How a transition stands.
    pub fn standing(&self, id: TransitionId) -> Standing {
        match self.now.state.earliest(id) {
            Some(at) if at <= self.time() => Standing::Ready,
            Some(at) => Standing::Waits(at),
            None if self.has_tokens(id) => Standing::Expects,
            None => Standing::Disabled,
        }
    }

    /// How much of its time an enabled transition has waited, from 0 to 1; none without a clock
    /// that runs.
    pub fn progress(&self, id: TransitionId) -> Option<f32> {
        let since = self.now.state.enabled_since(id)?;
        let wait = self.stage.net.transition(id).interval.earliest;
        let gone = self.time().saturating_sub(since).min(wait);
        (!wait.is_zero()).then(|| gone.as_secs_f32() / wait.as_secs_f32())
    }

    /// Undoes one step. False at the start.
    pub fn back(&mut self) -> bool {
        let Some(before) = self.past.pop_back() else { return false };
        if let (Some(course), Some(Happened::Fired { .. })) = (&mut self.course, &self.now.by) {
            course.step_back();
        }
        self.now = before;
        true
    }

    /// Whether there is a step to undo.
    pub fn can_go_back(&self) -> bool {
        !self.past.is_empty()
    }

    /// Begins again, by hand.
    pub fn restart(&mut self) {
        let world = self.now.world.values_only(&self.stage);
        *self = Self::new(Arc::clone(&self.stage));
        self.now.world = world;
        self.now.world.open_gates(&self.stage, &mut self.now.state);
    }

    /// Fires a transition by hand: its report arrives, its guard becomes true, its operator agrees,
    /// and time passes as far as necessary.
    ///
    /// # Errors
    /// If it has no tokens, or another one must fire before its time comes. Nothing changed then.
    pub fn fire_by_hand(&mut self, id: TransitionId) -> Result<Outcome, NotNow> {
        if !self.has_tokens(id) {
            return Err(self.lacks(id));
        }
        let before = self.now.clone();
        self.now.world.satisfy(&self.stage, id);
        self.now.world.open_gates(&self.stage, &mut self.now.state);
        let Some(at) = self.now.state.earliest(id) else {
            self.now = before;
            return Err(self.lacks(id));
        };
        let had_clock = before.state.enabled_since(id).is_some();
        if at > self.time() && !had_clock {
            let what = format!("{}: condition met", self.stage.name(id));
            self.now.by = Some(Happened::Sensed(what));
            self.remember(before);
            return Ok(Outcome::Clock(at));
        }
        if let Err(why) = self.may_wait_until(id, at) {
            self.now = before;
            return Err(why);
        }
        self.now.state.advance(at);
        match self.fire_now(id) {
            Ok(()) => {
                self.remember(before);
                Ok(Outcome::Fired)
            }
            Err(why) => {
                self.now = before;
                Err(why)
            }
        }
    }

    /// Lets time pass; what must fire meanwhile, as a run would fire it, fires.
    pub fn wait(&mut self, time: Duration) {
        let until = self.time().saturating_add(time);
        // As many firings as a step may have; an endless loop does not end here either.
        for _ in 0..1000 {
            let next = self.next_automatic();
            match next.filter(|(at, _)| *at <= until) {
                Some((at, id)) => {
                    let before = self.now.clone();
                    self.now.state.advance(at);
                    if self.fire_now(id).is_err() {
                        break;
                    }
                    self.remember(before);
                }
                None => break,
            }
        }
        if until > self.time() {
            let before = self.now.clone();
            let waited = until - self.time();
            self.now.state.advance(until);
            self.now.by = Some(Happened::Waited(waited));
            self.remember(before);
        }
    }

    /// The next transition that fires by itself, and when.
    pub fn next_automatic(&self) -> Option<(Duration, TransitionId)> {
        let state = &self.now.state;
        let automatic = |id: &TransitionId| self.stage.is_automatic(*id);
        if let Some(ready) = state.ready().find(automatic) {
            return Some((self.time(), ready));
        }
        let waiting = state.enabled().filter(automatic);
        waiting.filter_map(|id| Some((state.earliest(id)?, id))).min_by_key(|(at, _)| *at)
    }

    /// A value that guards look at: a text as in a file, such as `30%`. Without one, it is not
    /// known.
    pub fn set_value(&mut self, name: &str, value: Option<Scalar>) {
        let before = self.now.clone();
        let what = match &value {
            Some(value) => format!("{name} is {}", world::shown(value)),
            None => format!("{name} is unknown"),
        };
        self.now.world.set_value(name, value);
        self.now.world.open_gates(&self.stage, &mut self.now.state);
        self.now.by = Some(Happened::Sensed(what));
        self.remember(before);
    }

    /// The state of the environment.
    pub fn world(&self) -> &World {
        &self.now.world
    }

    fn remember(&mut self, before: Moment) {
        if self.past.len() == MAX_PAST {
            self.past.pop_front();
        }
        self.past.push_back(before);
    }

    fn fire_now(&mut self, id: TransitionId) -> Result<(), NotNow> {
        let name = || self.stage.name(id).to_owned();
        let late = self.now.state.fire(id).map_err(|_| NotNow::Overflow(name()))?;
        self.now.world.fired(&self.stage, id, self.now.state.marking());
        self.now.world.open_gates(&self.stage, &mut self.now.state);
        self.now.by = Some(Happened::Fired { transition: id, late });
        self.now.firings += 1;
        Ok(())
    }

    fn has_tokens(&self, id: TransitionId) -> bool {
        is_enabled(self.stage.net.transition(id), self.marking())
    }
}

/// The name of an act in a list: `late`, `late, but a component does not stop`.
pub fn act_words(stage: &Stage, id: TransitionId) -> String {
    let name = |number: usize| &stage.mission.transitions[number].name.value;
    match stage.acts[id.index()] {
        Act::Fires(number) => name(number).clone(),
        Act::DoesNotStop(number) => format!("{}, but a component does not stop", name(number)),
        Act::DoesNotStart(number) => format!("{}, but a component does not start", name(number)),
        Act::Fails(number) => {
            format!("a component of {} fails", stage.mission.places[number].name.value)
        }
    }
}

#[cfg(test)]
mod tests;
