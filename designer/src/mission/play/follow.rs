//! A firing sequence played firing by firing: the counterexample of a proof, or the shortest and
//! the longest trace.

use std::sync::Arc;
use std::time::Duration;

use armor_petri::TransitionId;
use armor_robotfile::FiringTrace;

use super::{Happened, Play, Standing};
use crate::mission::schedule::{Pace, schedule};
use crate::mission::stage::Stage;

/// A firing sequence and how far it has been played.
#[derive(Clone, Debug)]
pub struct Course {
    legs: Vec<Leg>,
    /// Where what can be repeated for ever begins.
    circle: usize,
    done: usize,
    /// Whether the legs have moments.
    pub is_timed: bool,
}

/// One firing of a course.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leg {
    /// Its name, as the finding has it.
    pub name: String,
    /// What it is in the net.
    pub transition: TransitionId,
    /// When it happens, if the times allow the sequence at all.
    pub at: Option<Duration>,
}

impl Course {
    /// The course of a finding's trace.
    ///
    /// # Errors
    /// The name of a firing that this mission does not have (it has changed since).
    pub fn of(stage: &Stage, trace: &FiringTrace) -> Result<Self, String> {
        let names: Vec<_> = trace.firings.iter().chain(&trace.circle).collect();
        let ids: Result<Vec<_>, _> = names
            .iter()
            .map(|name| stage.transition(name).ok_or_else(|| (*name).clone()))
            .collect();
        let ids = ids?;
        let pace = if trace.is_late { Pace::Latest } else { Pace::Earliest };
        let moments = schedule(&stage.net, &ids, pace);
        let leg = |(n, name): (usize, &&String)| Leg {
            name: (*name).clone(),
            transition: ids[n],
            at: moments.as_ref().map(|moments| moments[n]),
        };
        let legs = names.iter().enumerate().map(leg).collect();
        Ok(Self { legs, circle: trace.firings.len(), done: 0, is_timed: moments.is_some() })
    }

    /// All of it.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// How many firings have been played.
    pub fn done(&self) -> usize {
        self.done
    }

    /// The legs from this one on can be repeated for ever; their count if none can.
    pub fn circle(&self) -> usize {
        self.circle
    }

    /// Whether it has been played to its end.
    pub fn is_done(&self) -> bool {
        self.done == self.legs.len()
    }

    pub(super) fn step_back(&mut self) {
        self.done = self.done.saturating_sub(1);
    }
}

impl Play {
    /// Begins again, to be played along a firing sequence at its earliest or latest moments.
    ///
    /// # Errors
    /// The name of a firing that this mission does not have.
    pub fn follow(&mut self, trace: &FiringTrace) -> Result<(), String> {
        let course = Course::of(&self.stage, trace)?;
        *self = Self::new(Arc::clone(&self.stage));
        self.course = Some(course);
        Ok(())
    }

    /// What it follows, if it follows something.
    pub fn course(&self) -> Option<&Course> {
        self.course.as_ref()
    }

    /// Leaves the course; the mission stays where it is.
    pub fn leave_course(&mut self) {
        self.course = None;
    }

    /// Plays the next firing of the course. False at its end, or where the net does not allow it.
    pub fn next_leg(&mut self) -> bool {
        let Some(course) = &self.course else { return false };
        let Some(leg) = course.legs.get(course.done).cloned() else { return false };
        let before = self.now.clone();
        if !self.fire_leg(&leg) {
            self.now = before;
            return false;
        }
        self.remember(before);
        if let Some(course) = &mut self.course {
            course.done += 1;
        }
        true
    }

    fn fire_leg(&mut self, leg: &Leg) -> bool {
        if let Some(at) = leg.at {
            self.now.state.advance(at);
        }
        self.now.world.satisfy(&self.stage, leg.transition);
        self.now.world.open_gates(&self.stage, &mut self.now.state);
        if self.standing(leg.transition) == Standing::Ready {
            return self.fire_now(leg.transition).is_ok();
        }
        self.move_tokens(leg.transition)
    }

    /// Fires by tokens alone: of a sequence that was proven without times, or after a guard's
    /// clock.
    fn move_tokens(&mut self, id: TransitionId) -> bool {
        if !self.has_tokens(id) {
            return false;
        }
        let net = Arc::clone(&self.stage.net);
        let transition = net.transition(id);
        let state = &mut self.now.state;
        let takes = transition.inputs.iter().all(|(place, n)| state.remove(*place, *n).is_ok());
        for place in &transition.resets {
            let left = state.tokens(*place);
            if state.remove(*place, left).is_err() {
                return false;
            }
        }
        if !takes || !transition.outputs.iter().all(|(place, n)| state.add(*place, *n).is_ok()) {
            return false;
        }
        self.now.world.fired(&self.stage, id, self.now.state.marking());
        self.now.world.open_gates(&self.stage, &mut self.now.state);
        self.now.by = Some(Happened::Fired { transition: id, late: Duration::ZERO });
        self.now.firings += 1;
        true
    }
}
