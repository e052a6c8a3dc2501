//! The state of a running net: tokens, enabled transitions with their clocks, and firing.
//!
//! A firing is taking and putting, which the caller may separate, with time in between. A change
//! costs time for the arcs of the affected places only, whatever the size of the net.

use crate::agenda::{Agenda, deadline};
use crate::net::{Net, PlaceId, Test, TransitionId};
use std::sync::Arc;
use std::time::Duration;

/// Why an operation failed. The state is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FireError {
    /// Tokens are missing, an inhibitor arc disables it, or its gate is closed.
    #[error("the transition is not enabled")]
    NotEnabled,
    /// It is enabled, but not for long enough yet.
    #[error("the transition is enabled but its time has not come")]
    TooEarly,
    /// A place would hold more than 4,294,967,295 tokens.
    #[error("place number {} would hold more tokens than can be counted", .0.0)]
    Overflow(PlaceId),
    /// The place holds fewer tokens than were to be taken.
    #[error("place number {} holds fewer tokens than were to be taken", .0.0)]
    TooFewTokens(PlaceId),
}

/// A net at one moment: marking, gates and running clocks.
#[derive(Clone, Debug)]
pub struct NetState {
    net: Arc<Net>,
    now: Duration,
    marking: Vec<u32>,
    open: Vec<bool>,
    /// Per transition, how many of its conditions fail, including a closed gate; enabled at 0.
    unmet: Vec<u32>,
    agenda: Agenda,
}

impl NetState {
    /// Returns the initial marking at time `now`, all gates closed.
    pub fn new(net: Arc<Net>, now: Duration) -> Self {
        let marking = net.initial().to_vec();
        Self::with_marking(net, marking, now)
    }

    /// Returns the given marking, one number per place, at time `now`, all gates closed.
    ///
    /// # Panics
    /// If the numbers are not as many as the places.
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
            agenda.enable_transition(&net, id, now);
        }
        Self { open: vec![false; unmet.len()], net, now, marking, unmet, agenda }
    }

    /// Returns the state of another net at the same moment, with the given marking and all gates
    /// closed; a hold continues. All clocks start at this moment: [`NetState::resume_clock`]
    /// corrects those of transitions that were enabled before.
    ///
    /// # Panics
    /// If the numbers are not as many as the places.
    #[must_use]
    pub fn in_another(&self, net: Arc<Net>, marking: Vec<u32>) -> Self {
        let mut state = Self::with_marking(net, marking, self.now);
        if let Some(since) = self.held_since() {
            state.agenda.begin_hold(&state.net, since);
            for id in state.agenda.stopped_transitions().collect::<Vec<_>>() {
                state.agenda.set_since(&state.net, id, since, self.now);
            }
        }
        state
    }

    /// Sets the start of an enabled transition's clock to `since`, or to now if that is later. Has
    /// no effect if the transition is not enabled.
    pub fn resume_clock(&mut self, id: TransitionId, since: Duration) {
        if self.agenda.enabled_since(id).is_some() {
            let net = Arc::clone(&self.net);
            self.agenda.set_since(&net, id, since.min(self.now), self.now);
        }
    }

    /// Returns the net.
    pub fn net(&self) -> &Arc<Net> {
        &self.net
    }

    /// Returns the marking: tokens per place.
    pub fn marking(&self) -> &[u32] {
        &self.marking
    }

    /// Returns the tokens in one place.
    pub fn tokens(&self, place: PlaceId) -> u32 {
        self.marking[place.index()]
    }

    /// Returns when a transition became enabled; `None` if it is not enabled.
    pub fn enabled_since(&self, id: TransitionId) -> Option<Duration> {
        self.agenda.enabled_since(id)
    }

    /// Returns the latest moment for an enabled transition to fire; `None` if it is not enabled or
    /// has no such moment.
    pub fn deadline(&self, id: TransitionId) -> Option<Duration> {
        let since = self.agenda.enabled_since(id)?;
        Some(deadline(&self.net, id, since)).filter(|at| *at != Duration::MAX)
    }

    /// Returns when an enabled transition may fire; `None` if it is not enabled. For a held one it
    /// is the moment without the hold.
    pub fn earliest(&self, id: TransitionId) -> Option<Duration> {
        let since = self.agenda.enabled_since(id)?;
        Some(since.saturating_add(self.net.transition(id).interval.earliest))
    }

    /// Returns the enabled transitions: those that may fire now, in conflict order, then the
    /// waiting ones, then the held ones.
    pub fn enabled(&self) -> impl Iterator<Item = TransitionId> {
        self.agenda
            .ready_transitions()
            .chain(self.agenda.waiting_transitions())
            .chain(self.agenda.stopped_transitions())
    }

    /// Begins a hold: stops the clocks of the ordinary class. Held transitions are still enabled
    /// and disabled, but never ready. Has no effect during a hold.
    pub fn hold(&mut self) {
        self.agenda.begin_hold(&self.net, self.now);
    }

    /// Ends a hold: each clock continues from its value at the beginning of the hold, or from 0 if
    /// its transition became enabled during it. Costs time for every enabled transition.
    pub fn release(&mut self) {
        self.agenda.end_hold(&self.net, self.now);
    }

    /// Returns whether a hold has stopped the clock of an enabled transition.
    pub fn is_held(&self, id: TransitionId) -> bool {
        self.agenda.is_stopped(id)
    }

    /// Returns when the present hold began; `None` outside of a hold.
    pub fn held_since(&self) -> Option<Duration> {
        self.agenda.held_since()
    }

    /// Returns the transitions that may fire now, in conflict order: safety class, priority,
    /// earliest deadline, order in the file.
    pub fn ready(&self) -> impl Iterator<Item = TransitionId> {
        self.agenda.ready_transitions()
    }

    /// Returns the first transition in conflict order that may fire now.
    pub fn first_ready(&self) -> Option<TransitionId> {
        self.agenda.first_ready()
    }

    /// Returns the next moment at which a transition may fire: now, or when the first waiting clock
    /// reaches its earliest time.
    pub fn next_firing(&self) -> Option<Duration> {
        self.agenda.first_ready().map(|_| self.now).or_else(|| self.agenda.next_earliest())
    }

    /// Returns the present time.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Advances time to `now`; an earlier `now` has no effect.
    pub fn advance(&mut self, now: Duration) {
        if now > self.now {
            self.now = now;
            self.agenda.advance_to(&self.net, now);
        }
    }

    /// Opens or closes the gate of a gated transition; has no effect on others.
    pub fn set_gate(&mut self, id: TransitionId, open: bool) {
        let index = id.index();
        if !self.net.transition(id).gated || self.open[index] == open {
            return;
        }
        self.open[index] = open;
        self.update_enabling(id, open);
    }

    /// Returns whether the gate of a gated transition is open.
    pub fn gate(&self, id: TransitionId) -> bool {
        self.open[id.index()]
    }

    /// Fires a transition: takes, empties and puts at one moment. Returns how late it is after its
    /// deadline.
    ///
    /// # Errors
    /// If it may not fire now, or a place would overflow; the state is unchanged then.
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

    /// Does the first half of a firing: takes the input tokens and empties the reset places. The
    /// caller puts the outputs later, with [`NetState::add`]. Returns how late it is after its
    /// deadline.
    ///
    /// # Errors
    /// If it may not fire now; the state is unchanged then.
    pub fn take(&mut self, id: TransitionId) -> Result<Duration, FireError> {
        let since = self.agenda.enabled_since(id).ok_or(FireError::NotEnabled)?;
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
        // The clock of the fired transition restarts even if enough tokens are left to keep it
        // enabled.
        if self.agenda.enabled_since(id).is_some() {
            self.agenda.enable_transition(&net, id, self.now);
        }
        Ok(late)
    }

    /// Puts tokens into a place from outside, or as the second half of a firing.
    ///
    /// # Errors
    /// If the place would overflow; the state is unchanged then.
    pub fn add(&mut self, place: PlaceId, tokens: u32) -> Result<(), FireError> {
        let sum = self.tokens(place).checked_add(tokens).ok_or(FireError::Overflow(place))?;
        self.set_tokens(place, sum);
        Ok(())
    }

    /// Takes tokens out of a place from outside.
    ///
    /// # Errors
    /// If the place holds fewer; the state is unchanged then.
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
                (false, true) => self.update_enabling(id, true),
                (true, false) => self.update_enabling(id, false),
                _ => {}
            }
        }
    }

    /// Notes that one condition of `id` has changed, and enables or disables the transition.
    fn update_enabling(&mut self, id: TransitionId, met: bool) {
        let unmet = &mut self.unmet[id.index()];
        if met {
            *unmet -= 1;
            if *unmet == 0 {
                self.agenda.enable_transition(&self.net, id, self.now);
            }
        } else {
            *unmet += 1;
            if *unmet == 1 {
                self.agenda.disable_transition(&self.net, id);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FiringClass, FiringInterval};

    #[test]
    fn a_held_clock_continues_after_the_hold_and_safety_is_not_held() {
        const SECOND: Duration = Duration::from_secs(1);
        let mut net = Net::builder();
        let (a, b) = (net.place("a", 1), net.place("b", 0));
        let five = FiringInterval::exactly(5 * SECOND);
        let late = net.transition("late").input(a, 1).interval(five).id();
        let new = net.transition("new").input(b, 1).interval(five).id();
        let safe =
            net.transition("safe").input(b, 1).interval(five).class(FiringClass::Safety).id();
        let mut state = NetState::new(Arc::new(net.build().unwrap()), Duration::ZERO);
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
    fn clocks_continue_in_another_net_and_stop_in_a_hold() {
        const SECOND: Duration = Duration::from_secs(1);
        let net = |after: Duration| {
            let mut net = Net::builder();
            let (a, b) = (net.place("a", 1), net.place("b", 0));
            let late = net.transition("late").input(a, 1).output(b, 1);
            let late = late.interval(FiringInterval::exactly(after)).id();
            let free = net.transition("free").interval(FiringInterval::exactly(SECOND)).id();
            (Arc::new(net.build().unwrap()), late, free)
        };
        let (old, late, _) = net(5 * SECOND);
        let mut state = NetState::new(old, Duration::ZERO);
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
