//! The enabled transitions with their clocks, and the order in which they fire.

use crate::net::{FiringClass, Net, TransitionId};
use std::collections::BTreeSet;
use std::time::Duration;

/// The conflict order: class and priority, earliest deadline, order in the file.
type FiringTurn = (u32, Duration, TransitionId);

/// The enabled transitions: those that may fire now, and those that wait for their earliest time.
#[derive(Clone, Debug)]
pub(crate) struct Agenda {
    /// Per transition, when it became enabled.
    since: Vec<Option<Duration>>,
    ready: BTreeSet<FiringTurn>,
    waiting: BTreeSet<(Duration, TransitionId)>,
    hold: Option<Hold>,
}

/// A hold, during which only the clocks of the safety class run.
#[derive(Clone, Debug)]
struct Hold {
    since: Duration,
    /// The enabled transitions of the ordinary class; their clocks keep their value of `since`.
    stopped: BTreeSet<TransitionId>,
}

impl Agenda {
    pub(crate) fn new(transitions: usize) -> Self {
        let since = vec![None; transitions];
        Self { since, ready: BTreeSet::new(), waiting: BTreeSet::new(), hold: None }
    }

    pub(crate) fn enabled_since(&self, id: TransitionId) -> Option<Duration> {
        self.since[id.index()]
    }

    /// Enables `id` and starts its clock from 0, even if it was running.
    pub(crate) fn enable_transition(&mut self, net: &Net, id: TransitionId, now: Duration) {
        self.disable_transition(net, id);
        match &mut self.hold {
            Some(hold) if is_ordinary(net, id) => {
                // Started at the beginning of the hold, the clock is at 0 when the hold ends.
                self.since[id.index()] = Some(hold.since);
                hold.stopped.insert(id);
            }
            _ => self.run_clock(net, id, now, now),
        }
    }

    /// Sets the start of an enabled transition's clock to a moment in the past; during a hold, to
    /// one no later than the beginning of the hold.
    pub(crate) fn set_since(
        &mut self,
        net: &Net,
        id: TransitionId,
        since: Duration,
        now: Duration,
    ) {
        self.disable_transition(net, id);
        match &mut self.hold {
            Some(hold) if is_ordinary(net, id) => {
                self.since[id.index()] = Some(since.min(hold.since));
                hold.stopped.insert(id);
            }
            _ => self.run_clock(net, id, since, now),
        }
    }

    pub(crate) fn disable_transition(&mut self, net: &Net, id: TransitionId) {
        if let Some(since) = self.since[id.index()].take()
            && !self.hold.as_mut().is_some_and(|hold| hold.stopped.remove(&id))
            && !self.ready.remove(&firing_turn(net, id, since))
        {
            self.waiting.remove(&(earliest_moment(net, id, since), id));
        }
    }

    /// Stops the clocks of the ordinary class.
    pub(crate) fn begin_hold(&mut self, net: &Net, now: Duration) {
        if self.hold.is_some() {
            return;
        }
        let enabled = self.ready_transitions().chain(self.waiting_transitions());
        let stopped: BTreeSet<_> = enabled.filter(|id| is_ordinary(net, *id)).collect();
        self.ready.retain(|turn| !stopped.contains(&turn.2));
        self.waiting.retain(|entry| !stopped.contains(&entry.1));
        self.hold = Some(Hold { since: now, stopped });
    }

    /// Continues the stopped clocks from the values they have.
    pub(crate) fn end_hold(&mut self, net: &Net, now: Duration) {
        let Some(hold) = self.hold.take() else { return };
        let duration = now.saturating_sub(hold.since);
        for id in hold.stopped {
            let since = self.since[id.index()].expect("a stopped transition is enabled") + duration;
            self.run_clock(net, id, since, now);
        }
    }

    pub(crate) fn held_since(&self) -> Option<Duration> {
        self.hold.as_ref().map(|hold| hold.since)
    }

    /// Returns the transitions whose clocks are stopped, in the order of the file.
    pub(crate) fn stopped_transitions(&self) -> impl Iterator<Item = TransitionId> {
        self.hold.iter().flat_map(|hold| hold.stopped.iter().copied())
    }

    pub(crate) fn is_stopped(&self, id: TransitionId) -> bool {
        self.hold.as_ref().is_some_and(|hold| hold.stopped.contains(&id))
    }

    /// Runs the clock of `id` since `since`.
    fn run_clock(&mut self, net: &Net, id: TransitionId, since: Duration, now: Duration) {
        self.since[id.index()] = Some(since);
        let earliest = earliest_moment(net, id, since);
        if earliest <= now {
            self.ready.insert(firing_turn(net, id, since));
        } else {
            self.waiting.insert((earliest, id));
        }
    }

    pub(crate) fn advance_to(&mut self, net: &Net, now: Duration) {
        while let Some(&(earliest, id)) = self.waiting.first()
            && earliest <= now
        {
            self.waiting.pop_first();
            let since = self.since[id.index()].expect("a waiting transition has a running clock");
            self.ready.insert(firing_turn(net, id, since));
        }
    }

    pub(crate) fn is_ready(&self, net: &Net, id: TransitionId) -> bool {
        self.enabled_since(id)
            .is_some_and(|since| self.ready.contains(&firing_turn(net, id, since)))
    }

    pub(crate) fn first_ready(&self) -> Option<TransitionId> {
        self.ready.first().map(|turn| turn.2)
    }

    pub(crate) fn ready_transitions(&self) -> impl Iterator<Item = TransitionId> {
        self.ready.iter().map(|turn| turn.2)
    }

    pub(crate) fn waiting_transitions(&self) -> impl Iterator<Item = TransitionId> {
        self.waiting.iter().map(|entry| entry.1)
    }

    pub(crate) fn next_earliest(&self) -> Option<Duration> {
        self.waiting.first().map(|entry| entry.0)
    }
}

/// Returns the latest moment for an enabled transition to fire; `Duration::MAX` if there is none.
pub(crate) fn deadline(net: &Net, id: TransitionId, since: Duration) -> Duration {
    net.transition(id).interval.latest.map_or(Duration::MAX, |latest| since.saturating_add(latest))
}

fn is_ordinary(net: &Net, id: TransitionId) -> bool {
    net.transition(id).class == FiringClass::Ordinary
}

fn earliest_moment(net: &Net, id: TransitionId, since: Duration) -> Duration {
    since.saturating_add(net.transition(id).interval.earliest)
}

fn firing_turn(net: &Net, id: TransitionId, since: Duration) -> FiringTurn {
    (net.ranks[id.index()], deadline(net, id, since), id)
}
