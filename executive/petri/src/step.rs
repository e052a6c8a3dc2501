//! A step: transitions fire one at a time, without time passing, until none may. A bound catches
//! endless loops.

use crate::net::TransitionId;
use crate::state::NetState;

/// A step with more firings than the bound.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("more than {bound} firings without any time passing: a loop of {} transitions", cycle.len())]
pub struct EndlessStep {
    /// The bound.
    pub bound: usize,
    /// The transitions that repeat, in the order they fire, from the smallest one on.
    pub cycle: Vec<TransitionId>,
}

/// Counts the firings of one step against a bound.
#[derive(Clone, Debug)]
pub struct NetStep {
    bound: usize,
    fired: Vec<TransitionId>,
}

impl NetStep {
    /// Begins a step of at most `bound` firings.
    pub fn new(bound: usize) -> Self {
        Self { bound, fired: Vec::new() }
    }

    /// Counts one firing.
    ///
    /// # Errors
    /// If the bound is exceeded; the error names the loop.
    pub fn count(&mut self, id: TransitionId) -> Result<(), EndlessStep> {
        self.fired.push(id);
        if self.fired.len() <= self.bound {
            return Ok(());
        }
        Err(EndlessStep { bound: self.bound, cycle: repeating_cycle(&self.fired) })
    }

    /// Returns the transitions that have fired, in order.
    pub fn fired(&self) -> &[TransitionId] {
        &self.fired
    }
}

impl NetState {
    /// Fires the first ready transition until none is ready, without letting time pass. A
    /// transition whose outputs would overflow a place ends the step.
    ///
    /// # Errors
    /// If more than `bound` transitions fire; the state is the one after the last of them.
    pub fn step(&mut self, bound: usize) -> Result<Vec<TransitionId>, EndlessStep> {
        let mut step = NetStep::new(bound);
        while let Some(id) = self.first_ready() {
            if self.fire(id).is_err() {
                break;
            }
            step.count(id)?;
        }
        Ok(step.fired)
    }
}

/// Returns the shortest sequence that the end of `fired` repeats; if it never repeats exactly, all
/// transitions that fired.
fn repeating_cycle(fired: &[TransitionId]) -> Vec<TransitionId> {
    let tail = &fired[fired.len() / 2..];
    let period = (1..=tail.len() / 2)
        .find(|&period| tail.iter().zip(&tail[period..]).all(|(left, right)| left == right));
    let Some(period) = period else {
        let mut all = fired.to_vec();
        all.sort_unstable();
        all.dedup();
        return all;
    };
    let mut cycle = tail[..period].to_vec();
    let smallest = (0..period).min_by_key(|&index| cycle[index]).unwrap_or(0);
    cycle.rotate_left(smallest);
    cycle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FireError, FiringClass, FiringInterval, Net};
    use std::sync::Arc;
    use std::time::Duration;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_loop_that_takes_no_time_is_named() {
        let mut net = Net::builder();
        let (a, b, c) = (net.place("a", 1), net.place("b", 0), net.place("c", 0));
        let enter = net.transition("enter").input(a, 1).output(b, 1).id();
        let go = net.transition("go").input(b, 1).output(c, 1).id();
        let back = net.transition("back").input(c, 1).output(b, 1).id();
        let mut state = NetState::new(Arc::new(net.build().unwrap()), Duration::ZERO);
        let endless = state.step(100).unwrap_err();
        assert_eq!(endless.cycle, [go, back]);
        assert!(!endless.cycle.contains(&enter));
    }

    #[test]
    fn conflicts_go_to_safety_then_priority_then_deadline_then_the_file() {
        let mut net = Net::builder();
        let pot = net.place("pot", 5);
        let within = |seconds| FiringInterval {
            earliest: Duration::ZERO,
            latest: Some(Duration::from_secs(seconds)),
        };
        let last = net.transition("last").input(pot, 1).interval(within(9)).id();
        let fourth = net.transition("fourth").input(pot, 1).interval(within(3)).id();
        let third = net.transition("third").input(pot, 1).interval(within(2)).id();
        let second = net.transition("second").input(pot, 1).priority(1).id();
        let safety =
            net.transition("safety").input(pot, 1).class(FiringClass::Safety).priority(-9).id();
        let state = NetState::new(Arc::new(net.build().unwrap()), Duration::ZERO);
        assert_eq!(state.ready().collect::<Vec<_>>(), [safety, second, third, fourth, last]);
    }

    #[test]
    fn a_timeout_counts_from_the_moment_its_place_is_marked() {
        let mut net = Net::builder();
        let (a, b) = (net.place("a", 0), net.place("b", 0));
        let late = net
            .transition("late")
            .input(a, 1)
            .output(b, 1)
            .interval(FiringInterval::exactly(SECOND))
            .id();
        let mut state = NetState::new(Arc::new(net.build().unwrap()), Duration::ZERO);
        state.advance(7 * SECOND);
        state.add(a, 1).unwrap();
        assert_eq!(state.next_firing(), Some(8 * SECOND));
        assert_eq!(state.fire(late), Err(FireError::TooEarly));
        state.advance(10 * SECOND);
        assert_eq!(state.fire(late), Ok(2 * SECOND), "two seconds past its deadline");
        assert_eq!(state.marking(), [0, 1]);
    }

    #[test]
    fn firing_restarts_the_transitions_own_clock_and_no_other() {
        let mut net = Net::builder();
        let (a, b) = (net.place("a", 2), net.place("b", 1));
        let one = net.transition("one").input(a, 1).interval(FiringInterval::exactly(SECOND)).id();
        let two =
            net.transition("two").input(b, 1).interval(FiringInterval::exactly(3 * SECOND)).id();
        let mut state = NetState::new(Arc::new(net.build().unwrap()), Duration::ZERO);
        state.advance(SECOND);
        assert_eq!(state.step(10).unwrap(), [one], "once, although there were two tokens");
        assert_eq!(state.enabled_since(one), Some(SECOND));
        assert_eq!(state.enabled_since(two), Some(Duration::ZERO));
    }

    #[test]
    fn a_place_that_overflows_refuses_and_nothing_has_changed() {
        let mut net = Net::builder();
        let (a, b) = (net.place("a", 1), net.place("b", u32::MAX));
        let put = net.transition("put").input(a, 1).output(b, 1).id();
        let mut state = NetState::new(Arc::new(net.build().unwrap()), Duration::ZERO);
        assert_eq!(state.fire(put), Err(FireError::Overflow(b)));
        assert_eq!(state.marking(), [1, u32::MAX]);
        assert_eq!(state.first_ready(), Some(put));
    }
}
