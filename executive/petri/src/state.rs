//! What a net does: tokens, who is enabled since when, and the firing of one transition.
//!
//! Firing is taking and putting, which the caller may do apart, with time between them. What
//! changes costs what is affected: the arcs of the places touched, whatever the net's size.

use crate::agenda::{Agenda, deadline};
use crate::net::{Net, PlaceId, Test, TransitionId};
use std::sync::Arc;
use std::time::Duration;

/// Why a transition did not fire. The state is as before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FireError {
    /// Tokens are missing, an inhibitor holds it, or its gate is shut.
    #[error("the transition is not enabled")]
    NotEnabled,
    /// It is enabled, but not for long enough yet.
    #[error("the transition is enabled but its time has not come")]
    TooEarly,
    /// A place would hold more than 4,294,967,295 tokens.
    #[error("place number {} would hold more tokens than can be counted", .0.0)]
    Overflow(PlaceId),
    /// Fewer tokens are there than were to be taken.
    #[error("place number {} holds fewer tokens than were to be taken", .0.0)]
    TooFewTokens(PlaceId),
}

/// A net at one moment: marking, gates and running clocks.
#[derive(Clone, Debug)]
pub struct State {
    net: Arc<Net>,
    now: Duration,
    marking: Vec<u32>,
    open: Vec<bool>,
    /// Per transition, the tests it fails, a shut gate included; enabled at 0.
    unmet: Vec<u32>,
    agenda: Agenda,
}

impl State {
    /// The initial marking at time `now`, all gates shut.
    pub fn new(net: Arc<Net>, now: Duration) -> Self {
        let marking = net.initial().to_vec();
        Self::with_marking(net, marking, now)
    }

    /// A marking of one's own, one number per place of the net, at time `now`, all gates shut.
    ///
    /// # Panics
    /// If there are not as many numbers as places.
    pub fn with_marking(net: Arc<Net>, marking: Vec<u32>, now: Duration) -> Self {
        assert_eq!(marking.len(), net.places().len(), "one number of tokens per place");
        let mut unmet: Vec<u32> = net.transitions().iter().map(|t| u32::from(t.gated)).collect();
        for (tokens, watchers) in marking.iter().zip(&net.watchers) {
            for (id, test) in watchers {
                unmet[id.index()] += u32::from(!test.passes(*tokens));
            }
        }
        let mut agenda = Agenda::new(unmet.len());
        for id in net.transition_ids().filter(|id| unmet[id.index()] == 0) {
            agenda.enable(&net, id, now);
        }
        Self { open: vec![false; unmet.len()], net, now, marking, unmet, agenda }
    }

    /// The state of another net at the same moment, with a marking of its own and all gates shut;
    /// a hold goes on. Clocks are those of transitions newly enabled: [`State::resume_clock`] is for
    /// those that were enabled before.
    ///
    /// # Panics
    /// If there are not as many numbers as places.
    #[must_use]
    pub fn in_another(&self, net: Arc<Net>, marking: Vec<u32>) -> Self {
        let mut state = Self::with_marking(net, marking, self.now);
        if let Some(since) = self.held_since() {
            state.agenda.hold(&state.net, since);
            for id in state.agenda.stopped().collect::<Vec<_>>() {
                state.agenda.set_since(&state.net, id, since, self.now);
            }
        }
        state
    }

    /// Lets the clock of an enabled transition run since `since`; without effect on one that is not
    /// enabled. It never runs since a moment that has not come.
    pub fn resume_clock(&mut self, id: TransitionId, since: Duration) {
        if self.agenda.since(id).is_some() {
            let net = Arc::clone(&self.net);
            self.agenda.set_since(&net, id, since.min(self.now), self.now);
        }
    }

    /// The net.
    pub fn net(&self) -> &Arc<Net> {
        &self.net
    }

    /// Tokens per place.
    pub fn marking(&self) -> &[u32] {
        &self.marking
    }

    /// Tokens in one place.
    pub fn tokens(&self, place: PlaceId) -> u32 {
        self.marking[place.index()]
    }

    /// When a transition became enabled; `None` while it is not.
    pub fn enabled_since(&self, id: TransitionId) -> Option<Duration> {
        self.agenda.since(id)
    }

    /// When an enabled transition must have fired; `None` if not enabled, or without such a time.
    pub fn deadline(&self, id: TransitionId) -> Option<Duration> {
        let since = self.agenda.since(id)?;
        Some(deadline(&self.net, id, since)).filter(|at| *at != Duration::MAX)
    }

    /// When an enabled transition may fire; `None` while it is not enabled. Of one that is held it
    /// is when it could have fired without the hold.
    pub fn earliest(&self, id: TransitionId) -> Option<Duration> {
        let since = self.agenda.since(id)?;
        Some(since.saturating_add(self.net.transition(id).interval.earliest))
    }

    /// The enabled transitions: those that may fire now in conflict order, then those that wait,
    /// then those that are held.
    pub fn enabled(&self) -> impl Iterator<Item = TransitionId> {
        self.agenda.ready().chain(self.agenda.waiting()).chain(self.agenda.stopped())
    }

    /// Stops the clocks of all but the safety class: held transitions are enabled and disabled as
    /// ever, but none is ready. Without effect during a hold.
    pub fn hold(&mut self) {
        self.agenda.hold(&self.net, self.now);
    }

    /// Ends a hold: each clock goes on where it stood, those of transitions that became enabled
    /// meanwhile from 0. Costs what is enabled.
    pub fn release(&mut self) {
        self.agenda.release(&self.net, self.now);
    }

    /// Whether the clock of an enabled transition is stopped by a hold.
    pub fn is_held(&self, id: TransitionId) -> bool {
        self.agenda.is_stopped(id)
    }

    /// Since when all but the safety class are held, if they are.
    pub fn held_since(&self) -> Option<Duration> {
        self.agenda.held_since()
    }

    /// The transitions that may fire now, in conflict order: safety class, priority, earliest
    /// deadline, order in the file.
    pub fn ready(&self) -> impl Iterator<Item = TransitionId> {
        self.agenda.ready()
    }

    /// Whoever fires next, if anyone may now.
    pub fn first_ready(&self) -> Option<TransitionId> {
        self.agenda.first()
    }

    /// When there is something to fire: now, or when the first waiting clock has run.
    pub fn next_firing(&self) -> Option<Duration> {
        self.agenda.first().map(|_| self.now).or_else(|| self.agenda.next_earliest())
    }

    /// The latest moment it has been told.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Lets time pass; time never goes back, an earlier `now` changes nothing.
    pub fn advance(&mut self, now: Duration) {
        if now > self.now {
            self.now = now;
            self.agenda.advance(&self.net, now);
        }
    }

    /// Opens or shuts the gate of a gated transition; without effect on others.
    pub fn set_gate(&mut self, id: TransitionId, open: bool) {
        let index = id.index();
        if !self.net.transition(id).gated || self.open[index] == open {
            return;
        }
        self.open[index] = open;
        self.settle(id, open);
    }

    /// Whether the gate of a gated transition is open.
    pub fn gate(&self, id: TransitionId) -> bool {
        self.open[id.index()]
    }

    /// Fires: takes, empties and puts in no time. Answers how far its deadline had passed.
    ///
    /// # Errors
    /// As it says; nothing changed then.
    pub fn fire(&mut self, id: TransitionId) -> Result<Duration, FireError> {
        let net = Arc::clone(&self.net);
        let transition = net.transition(id);
        for &(place, weight) in &transition.outputs {
            let kept = if transition.resets.contains(&place) {
                0
            } else {
                let taken = transition.inputs.iter().find(|arc| arc.0 == place);
                self.tokens(place).saturating_sub(taken.map_or(0, |arc| arc.1))
            };
            kept.checked_add(weight).ok_or(FireError::Overflow(place))?;
        }
        let late = self.take(id)?;
        for &(place, weight) in &transition.outputs {
            self.set_tokens(place, self.tokens(place) + weight);
        }
        Ok(late)
    }

    /// The first half of a firing: takes the input tokens and empties the reset places. The
    /// outputs are put later, with [`State::add`]. Answers how far its deadline had passed.
    ///
    /// # Errors
    /// If it may not fire now; nothing changed then.
    pub fn take(&mut self, id: TransitionId) -> Result<Duration, FireError> {
        let since = self.agenda.since(id).ok_or(FireError::NotEnabled)?;
        if !self.agenda.is_ready(&self.net, id) {
            return Err(FireError::TooEarly);
        }
        let late = self.now.saturating_sub(deadline(&self.net, id, since));
        let net = Arc::clone(&self.net);
        for &(place, weight) in &net.transition(id).inputs {
            self.set_tokens(place, self.tokens(place) - weight);
        }
        for &place in &net.transition(id).resets {
            self.set_tokens(place, 0);
        }
        // Whoever fires starts anew, even where enough tokens are left.
        if self.agenda.since(id).is_some() {
            self.agenda.enable(&net, id, self.now);
        }
        Ok(late)
    }

    /// Puts tokens into a place from outside, or as the second half of a firing.
    ///
    /// # Errors
    /// If the place cannot count them; nothing changed then.
    pub fn add(&mut self, place: PlaceId, tokens: u32) -> Result<(), FireError> {
        let sum = self.tokens(place).checked_add(tokens).ok_or(FireError::Overflow(place))?;
        self.set_tokens(place, sum);
        Ok(())
    }

    /// Takes tokens out of a place from outside.
    ///
    /// # Errors
    /// If fewer are there; nothing changed then.
    pub fn remove(&mut self, place: PlaceId, tokens: u32) -> Result<(), FireError> {
        let rest = self.tokens(place).checked_sub(tokens).ok_or(FireError::TooFewTokens(place))?;
        self.set_tokens(place, rest);
        Ok(())
    }

    /// Empties every place.
    pub fn clear(&mut self) {
        for index in 0..self.marking.len() as u32 {
            self.set_tokens(PlaceId(index), 0);
        }
    }

    fn set_tokens(&mut self, place: PlaceId, tokens: u32) {
        let before = std::mem::replace(&mut self.marking[place.index()], tokens);
        if before == tokens {
            return;
        }
        let net = Arc::clone(&self.net);
        for &(id, test) in &net.watchers[place.index()] {
            let passed = |test: Test, tokens| test.passes(tokens);
            match (passed(test, before), passed(test, tokens)) {
                (false, true) => self.settle(id, true),
                (true, false) => self.settle(id, false),
                _ => {}
            }
        }
    }

    /// One of the tests of `id` has changed: for the better or not.
    fn settle(&mut self, id: TransitionId, met: bool) {
        let unmet = &mut self.unmet[id.index()];
        if met {
            *unmet -= 1;
            if *unmet == 0 {
                self.agenda.enable(&self.net, id, self.now);
            }
        } else {
            *unmet += 1;
            if *unmet == 1 {
                self.agenda.disable(&self.net, id);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Class, Interval};

    #[test]
    fn a_held_clock_goes_on_where_it_stood_and_safety_is_not_held() {
        const SECOND: Duration = Duration::from_secs(1);
        let mut net = Net::builder();
        let (a, b) = (net.place("a", 1), net.place("b", 0));
        let five = Interval::exactly(5 * SECOND);
        let late = net.transition("late").input(a, 1).interval(five).id();
        let new = net.transition("new").input(b, 1).interval(five).id();
        let safe = net.transition("safe").input(b, 1).interval(five).class(Class::Safety).id();
        let mut state = State::new(Arc::new(net.build().unwrap()), Duration::ZERO);
        state.advance(2 * SECOND);
        state.hold();
        state.advance(10 * SECOND);
        state.add(b, 1).unwrap();
        state.advance(20 * SECOND);
        assert_eq!(
            (state.fire(late), state.fire(new)),
            (Err(FireError::TooEarly), Err(FireError::TooEarly))
        );
        assert_eq!(state.ready().collect::<Vec<_>>(), [safe]);
        assert_eq!([late, new, safe].map(|id| state.is_held(id)), [true, true, false]);
        assert_eq!(state.fire(safe), Ok(5 * SECOND));
        state.add(b, 1).unwrap();
        state.release();
        assert_eq!(
            (state.earliest(late), state.earliest(new)),
            (Some(23 * SECOND), Some(25 * SECOND))
        );
        state.advance(23 * SECOND);
        assert_eq!(
            (state.fire(late), state.fire(new)),
            (Ok(Duration::ZERO), Err(FireError::TooEarly))
        );
    }
    #[test]
    fn clocks_go_on_in_another_net_and_stand_in_a_hold() {
        const SECOND: Duration = Duration::from_secs(1);
        let net = |after: Duration| {
            let mut net = Net::builder();
            let (a, b) = (net.place("a", 1), net.place("b", 0));
            let late = net.transition("late").input(a, 1).output(b, 1);
            let late = late.interval(Interval::exactly(after)).id();
            let free = net.transition("free").interval(Interval::exactly(SECOND)).id();
            (Arc::new(net.build().unwrap()), late, free)
        };
        let (old, late, _) = net(5 * SECOND);
        let mut state = State::new(old, Duration::ZERO);
        state.advance(2 * SECOND);
        let (new, _, free) = net(9 * SECOND);
        let mut next = state.in_another(Arc::clone(&new), vec![1, 0]);
        next.resume_clock(late, Duration::ZERO);
        assert_eq!(
            (next.earliest(late), next.earliest(free)),
            (Some(9 * SECOND), Some(3 * SECOND))
        );
        state.hold();
        state.advance(20 * SECOND);
        let mut next = state.in_another(new, vec![1, 0]);
        next.resume_clock(late, Duration::ZERO);
        assert!(next.is_held(late) && next.is_held(free));
        next.advance(30 * SECOND);
        next.release();
        let released = (next.earliest(late), next.earliest(free));
        assert_eq!(released, (Some(37 * SECOND), Some(31 * SECOND)));
        next.resume_clock(late, 99 * SECOND);
        assert_eq!(next.earliest(late), Some(39 * SECOND), "not since what has not come");
    }
}
