//! Who is enabled, since when, and who fires first.

use crate::net::{Net, TransitionId};
use std::collections::BTreeSet;
use std::time::Duration;

/// The conflict order: class and priority, earliest deadline, order in the file.
type Turn = (u32, Duration, TransitionId);

/// The enabled transitions: those whose time has come, and those whose time will.
#[derive(Clone, Debug)]
pub(crate) struct Agenda {
    /// Per transition, when it became enabled.
    since: Vec<Option<Duration>>,
    ready: BTreeSet<Turn>,
    waiting: BTreeSet<(Duration, TransitionId)>,
}

impl Agenda {
    pub(crate) fn new(transitions: usize) -> Self {
        Self { since: vec![None; transitions], ready: BTreeSet::new(), waiting: BTreeSet::new() }
    }

    pub(crate) fn since(&self, id: TransitionId) -> Option<Duration> {
        self.since[id.index()]
    }

    /// Starts the clock of `id`, from 0 if it was running.
    pub(crate) fn enable(&mut self, net: &Net, id: TransitionId, now: Duration) {
        self.disable(net, id);
        self.since[id.index()] = Some(now);
        let earliest = earliest(net, id, now);
        if earliest <= now {
            self.ready.insert(turn(net, id, now));
        } else {
            self.waiting.insert((earliest, id));
        }
    }

    pub(crate) fn disable(&mut self, net: &Net, id: TransitionId) {
        if let Some(since) = self.since[id.index()].take()
            && !self.ready.remove(&turn(net, id, since))
        {
            self.waiting.remove(&(earliest(net, id, since), id));
        }
    }

    pub(crate) fn advance(&mut self, net: &Net, now: Duration) {
        while let Some(&(earliest, id)) = self.waiting.first()
            && earliest <= now
        {
            self.waiting.pop_first();
            let since = self.since[id.index()].expect("whoever waits has a running clock");
            self.ready.insert(turn(net, id, since));
        }
    }

    pub(crate) fn is_ready(&self, net: &Net, id: TransitionId) -> bool {
        self.since(id).is_some_and(|since| self.ready.contains(&turn(net, id, since)))
    }

    pub(crate) fn first(&self) -> Option<TransitionId> {
        self.ready.first().map(|turn| turn.2)
    }

    pub(crate) fn ready(&self) -> impl Iterator<Item = TransitionId> {
        self.ready.iter().map(|turn| turn.2)
    }

    pub(crate) fn waiting(&self) -> impl Iterator<Item = TransitionId> {
        self.waiting.iter().map(|entry| entry.1)
    }

    pub(crate) fn next_earliest(&self) -> Option<Duration> {
        self.waiting.first().map(|entry| entry.0)
    }
}

/// When an enabled transition must have fired; `Duration::MAX` is never.
pub(crate) fn deadline(net: &Net, id: TransitionId, since: Duration) -> Duration {
    net.transition(id).interval.latest.map_or(Duration::MAX, |latest| since.saturating_add(latest))
}

fn earliest(net: &Net, id: TransitionId, since: Duration) -> Duration {
    since.saturating_add(net.transition(id).interval.earliest)
}

fn turn(net: &Net, id: TransitionId, since: Duration) -> Turn {
    (net.ranks[id.index()], deadline(net, id, since), id)
}
