//! The components as observed, as opposed to what is decided: present or not, running or not, and
//! the command that is not confirmed yet.

use armor_plan::{ComponentId, Plan, PlanLimits};
use std::time::Duration;

/// Whether the executive can talk to a component's process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessPresence {
    /// Not heard of since the executive started; it may be running all the same.
    Unseen,
    /// Its control connection is up.
    Here,
    /// Its control connection is down; the process may still run.
    Lost,
    /// Its process has ended.
    Gone,
}

/// What a component reports that it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// It has not reported yet, or has not confirmed a command.
    Unknown,
    /// It waits for its settings and cannot be activated yet.
    Starting,
    /// It is at rest.
    Frozen,
    /// It runs, or has finished and not yet come to rest.
    Active,
}

/// A command that has not been confirmed yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PendingCommand {
    pub(crate) stop: bool,
    pub(crate) since: Duration,
    pub(crate) tries: u32,
    pub(crate) killed: Option<Duration>,
}

/// One component as observed.
#[derive(Clone, Debug)]
pub(crate) struct ObservedComponent {
    pub(crate) presence: ProcessPresence,
    /// Since when it is present or not.
    pub(crate) since: Duration,
    pub(crate) instance: u64,
    pub(crate) doing: Doing,
    /// The activation it speaks of.
    pub(crate) activation: u64,
    /// The last activation this process start has been commanded.
    pub(crate) commanded: u64,
    pub(crate) controllable: bool,
    pub(crate) order: Option<PendingCommand>,
    /// Not even killing it was confirmed.
    pub(crate) unstoppable: bool,
    /// Why the launcher starts no process of it any more.
    pub(crate) given_up: Option<String>,
    /// Its start was blocked by a component that it excludes, when the last event was settled.
    pub(crate) is_blocked: bool,
    /// Since when its start is not blocked.
    pub(crate) unblocked: Duration,
}

impl ObservedComponent {
    /// Whether it could be running for all that is known.
    pub(crate) fn may_be_active(&self) -> bool {
        match self.presence {
            ProcessPresence::Gone => false,
            ProcessPresence::Unseen | ProcessPresence::Lost => true,
            ProcessPresence::Here => matches!(self.doing, Doing::Unknown | Doing::Active),
        }
    }

    /// Returns why no process of it can be expected, if the launcher has given it up.
    pub(crate) fn why_given_up(&self) -> Option<&String> {
        self.given_up.as_ref().filter(|_| self.presence != ProcessPresence::Here)
    }

    /// Whether it can be given a command.
    pub(crate) fn is_ready(&self) -> bool {
        self.presence == ProcessPresence::Here && !matches!(self.doing, Doing::Starting)
    }

    /// Notes that the newest command has gone to it now: it has its whole time from then on, however long
    /// the journal took before.
    pub(crate) fn note_sent(&mut self, now: Duration, stop_within: Duration) {
        if let Some(order) = &mut self.order {
            let before = stop_within * order.tries.saturating_sub(1);
            order.since = order.since.max(now.saturating_sub(before));
        }
    }

    /// Until when the order under way is given the next push; none if there is nothing to push.
    pub(crate) fn next_push(
        &self,
        limits: &PlanLimits,
        return_within: Duration,
        began: Duration,
    ) -> Option<Duration> {
        let order = self.order.filter(|order| order.stop)?;
        if self.unstoppable {
            return None;
        }
        Some(match (order.killed, self.presence) {
            (Some(killed), _) => killed + limits.kill_within,
            (None, ProcessPresence::Here) => order.since + limits.stop_within * order.tries.max(1),
            (None, ProcessPresence::Unseen) => order.since.max(began + limits.muster),
            (None, _) => order.since.max(self.since + return_within),
        })
    }
}

/// All components as observed.
#[derive(Clone, Debug)]
pub(crate) struct Roster {
    observed: Vec<ObservedComponent>,
    /// When the executive began to look.
    began: Duration,
}

impl Roster {
    pub(crate) fn new(plan: &Plan, now: Duration) -> Self {
        let unseen = |component: &armor_plan::PlannedComponent| ObservedComponent {
            presence: ProcessPresence::Unseen,
            since: now,
            instance: 0,
            doing: Doing::Unknown,
            activation: 0,
            commanded: 0,
            controllable: component.is_controlled(),
            order: None,
            unstoppable: false,
            given_up: None,
            is_blocked: false,
            unblocked: Duration::ZERO,
        };
        Self { observed: plan.components().iter().map(unseen).collect(), began: now }
    }

    /// Returns when the executive began to look.
    pub(crate) fn began(&self) -> Duration {
        self.began
    }

    pub(crate) fn of(&self, component: ComponentId) -> &ObservedComponent {
        &self.observed[component.index()]
    }

    pub(crate) fn of_mut(&mut self, component: ComponentId) -> &mut ObservedComponent {
        &mut self.observed[component.index()]
    }

    pub(crate) fn appeared(&mut self, component: ComponentId, instance: u64, now: Duration) {
        let observed = self.of_mut(component);
        *observed = ObservedComponent {
            presence: ProcessPresence::Here,
            since: now,
            instance,
            doing: Doing::Unknown,
            activation: 0,
            commanded: 0,
            controllable: observed.controllable,
            order: None,
            unstoppable: false,
            given_up: None,
            is_blocked: false,
            unblocked: Duration::ZERO,
        };
    }

    /// Notes that its connection or its process is gone. An order to stop stays: it is about the
    /// component, not about one process of it.
    pub(crate) fn left(
        &mut self,
        component: ComponentId,
        presence: ProcessPresence,
        now: Duration,
    ) {
        let observed = self.of_mut(component);
        (observed.presence, observed.since, observed.doing) = (presence, now, Doing::Unknown);
        if presence == ProcessPresence::Gone {
            observed.unstoppable = false;
            observed.order = None;
        } else {
            observed.order = observed.order.filter(|order| order.stop);
        }
    }

    /// Takes its report of what it does, unless that is about an earlier activation than the one it
    /// was commanded last: such a report was sent before the command arrived.
    pub(crate) fn note_doing(&mut self, component: ComponentId, doing: Doing, activation: u64) {
        let observed = self.of_mut(component);
        if observed.presence != ProcessPresence::Here || activation < observed.commanded {
            return;
        }
        let stopping = observed.order.is_some_and(|order| order.stop);
        (observed.doing, observed.activation) = (doing, activation);
        if stopping != (doing == Doing::Active) {
            observed.order = None;
        }
    }
}

impl Doing {
    pub(crate) fn is_at_rest(self) -> bool {
        self == Self::Frozen
    }
}
