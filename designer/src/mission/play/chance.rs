//! A mission that plays itself: what must fire fires as early as allowed, and what only the world
//! decides is left to chance, from a seed, so that a run can be seen again.

use std::time::Duration;

use armor_petri::TransitionId;

use super::world::number_of;
use super::{Happened, Play, Standing};
use crate::mission::stage::Act;

/// Longest time that is left between two things that chance brings about.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// What may happen at random, and the seed.
#[derive(Clone, Debug)]
pub struct Chance {
    random: fastrand::Rng,
    /// Whether people act: operator's transitions fire, and questions are answered.
    pub people: bool,
    /// Whether components fail to stop, to start and to last.
    pub faults: bool,
}

/// The result of one step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Something happened.
    Happened,
    /// The mission is over.
    Over,
    /// Nothing more can happen in this state.
    StandsStill,
}

impl Chance {
    /// Chances that come from a seed: the same seed, the same run.
    pub fn from_seed(seed: u64) -> Self {
        Self { random: fastrand::Rng::with_seed(seed), people: true, faults: false }
    }

    fn below(&mut self, end: usize) -> usize {
        self.random.usize(..end.max(1))
    }

    fn part_of(&mut self, time: Duration) -> Duration {
        time.mul_f64(self.random.f64())
    }
}

impl Play {
    /// One step by itself.
    pub fn step(&mut self, chance: &mut Chance) -> Step {
        if self.is_over() {
            return Step::Over;
        }
        let next = self.next_automatic();
        if let Some((at, id)) = next.filter(|(at, _)| *at <= self.time()) {
            return self.fires_or_fails(at, id, chance);
        }
        let possible = self.possible(chance);
        // The passing of time is one of the possible outcomes.
        let choice = chance.below(possible.len() + usize::from(next.is_some()));
        match (possible.get(choice), next) {
            (Some(id), _) => {
                let until = next.map_or(MAX_WAIT, |(at, _)| at - self.time()).min(MAX_WAIT);
                let wait = chance.part_of(until);
                self.comes_about(*id, wait)
            }
            (None, Some((at, id))) => self.fires_or_fails(at, id, chance),
            (None, None) => Step::StandsStill,
        }
    }

    /// Sometimes a component does not start or stop as a firing requires.
    fn fires_or_fails(&mut self, at: Duration, id: TransitionId, chance: &mut Chance) -> Step {
        let firing = number_of(&self.stage, id);
        let fails = |other: &TransitionId| {
            *other != id && firing.is_some() && number_of(&self.stage, *other) == firing
        };
        let ways: Vec<_> = self.stage.net.transition_ids().filter(fails).collect();
        if !chance.faults || ways.is_empty() || chance.below(4) > 0 {
            return self.fires(at, id);
        }
        let way = ways[chance.below(ways.len())];
        self.fires(at, way)
    }

    fn fires(&mut self, at: Duration, id: TransitionId) -> Step {
        let before = self.now.clone();
        self.now.state.advance(at);
        match self.fire_now(id) {
            Ok(()) => {
                self.remember(before);
                Step::Happened
            }
            Err(_) => {
                self.now = before;
                Step::StandsStill
            }
        }
    }

    /// What the world might bring about now.
    fn possible(&self, chance: &Chance) -> Vec<TransitionId> {
        let might = |id: &TransitionId| {
            let is_allowed = match self.stage.acts[id.index()] {
                Act::Fires(_) => chance.people || self.stage.is_automatic(*id),
                Act::DoesNotStop(_) | Act::DoesNotStart(_) | Act::Fails(_) => chance.faults,
            };
            let waits_for_world = match self.standing(*id) {
                Standing::Expects => true,
                Standing::Ready => !self.stage.is_automatic(*id),
                Standing::Waits(_) | Standing::Disabled => false,
            };
            is_allowed && waits_for_world
        };
        self.stage.net.transition_ids().filter(might).collect()
    }

    /// After a while the simulated environment provides what a transition waits for.
    fn comes_about(&mut self, id: TransitionId, wait: Duration) -> Step {
        let before = self.now.clone();
        let at = self.time().saturating_add(wait);
        self.now.state.advance(at);
        self.now.world.satisfy(&self.stage, id);
        self.now.world.open_gates(&self.stage, &mut self.now.state);
        if self.standing(id) == Standing::Ready && self.fire_now(id).is_err() {
            self.now = before;
            return Step::StandsStill;
        }
        if self.now.by == before.by && self.now.firings == before.firings {
            let what = format!("{}: condition met", self.stage.name(id));
            self.now.by = Some(Happened::Sensed(what));
        }
        self.remember(before);
        Step::Happened
    }
}
