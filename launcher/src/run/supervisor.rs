//! Which process should run now: starts in order, restarts with backoff, kills what hangs, stops in
//! order. Pure: it takes events and the time since the start of the run, and returns actions.
//!
//! It never starts a process while the system stops, never waits without a deadline, and never ends
//! while a process is alive.

mod child;
mod event;
#[cfg(test)]
mod tests;

use std::time::Duration;

use armor_inspect::run_control::{AbsentComponent, ComponentHistory};
use armor_robotfile::model::Restart;
use armor_wire::control::RunState;

use child::{AfterDeath, Child, ChildState};
pub use event::{
    ChildExit, ChildId, ChildOrder, ChildRole, Duty, HangCause, LogLevel, RunVerdict, StopRequest,
    SupervisorAction, SupervisorEvent,
};

/// How long a process has to end after it was asked to, before it is killed.
pub const GRACE: Duration = Duration::from_secs(5);
/// A gap between two ticks after which silent processes are not suspected: the launcher itself was
/// stopped, or the host suspended.
const NAP: Duration = Duration::from_secs(1);
/// Most absent components that are listed; a reply is one line of bounded length.
const MAX_LISTED: usize = 20;

/// How far the run is.
#[derive(Clone, Debug, PartialEq)]
enum RunStage {
    Running,
    /// The processes of this role and of those before it in [`STOP_ORDER`] are ending.
    Stopping {
        step: usize,
        verdict: RunVerdict,
    },
    Over,
}

/// The executive first, so that it does not see its components end as failures; the registry last,
/// so that every process can end its connections.
const STOP_ORDER: [ChildRole; 5] = [
    ChildRole::Executive,
    ChildRole::Component,
    ChildRole::Gate,
    ChildRole::Configd,
    ChildRole::Registry,
];

/// The state machine.
#[derive(Debug)]
pub struct Supervisor {
    children: Vec<Child>,
    stage: RunStage,
    looked: Duration,
    actions: Vec<SupervisorAction>,
}

impl Supervisor {
    /// Nothing runs yet; the first [`SupervisorEvent::Tick`] starts it.
    pub fn new(duties: Vec<Duty>) -> Self {
        Self {
            children: duties.into_iter().map(Child::new).collect(),
            stage: RunStage::Running,
            looked: Duration::ZERO,
            actions: Vec::new(),
        }
    }

    /// Handles an event at the time `now`, and returns the actions in order.
    pub fn handle(&mut self, event: SupervisorEvent, now: Duration) -> Vec<SupervisorAction> {
        let nap = now.saturating_sub(self.looked);
        if nap > NAP {
            self.children.iter_mut().for_each(|child| child.extend_deadlines(nap));
        }
        self.looked = now;
        match event {
            SupervisorEvent::Tick => {}
            SupervisorEvent::SpawnFailed(id, reason) => self.start_failed(id, &reason, now),
            SupervisorEvent::Ready(id) => self.children[id].became_ready(now),
            SupervisorEvent::Heard(id, state) => {
                self.children[id].record_beat(state, now);
                let is_over = state == Some(RunState::Done) && self.children[id].duty.ends_run;
                if is_over && self.stage == RunStage::Running {
                    self.stop(RunVerdict::RecordingOver {
                        is_unfinished: self.has_mission(),
                        failed: self.failed_components(),
                    });
                }
            }
            SupervisorEvent::Unheard(id) => self.children[id].excuse_silence(now),
            SupervisorEvent::Stuck(id, call) => {
                let watchdog = self.children[id].duty.watchdog.unwrap_or_default();
                self.kill_stuck(id, HangCause::LongCall { call, watchdog });
            }
            SupervisorEvent::Vanished(id) => self.children[id].record_absence(now),
            SupervisorEvent::Suspended(id) => self.kill_stuck(id, HangCause::Suspended),
            SupervisorEvent::Panicked(id, panic) => self.children[id].last_panic = Some(panic),
            SupervisorEvent::Exited(id, exit) => self.exited(id, exit, now),
            SupervisorEvent::Stop(request) => self.asked_to_stop(request),
            SupervisorEvent::Order(id, order) => self.obey_order(id, order, now),
        }
        self.advance(now);
        std::mem::take(&mut self.actions)
    }

    /// Returns the processes that the next event kills as hanging. One that a signal has stopped
    /// should be reported as [`SupervisorEvent::Suspended`] before, for the reason to be complete.
    pub fn list_overdue(&self, now: Duration) -> Vec<ChildId> {
        if now.saturating_sub(self.looked) > NAP {
            // Its deadlines are extended first.
            return Vec::new();
        }
        let children = self.children.iter().enumerate();
        children.filter(|(_, child)| child.is_overdue(now)).map(|(id, _)| id).collect()
    }

    /// When to look again, if nothing happens before.
    pub fn next_deadline(&self) -> Option<Duration> {
        // What is overdue already waits for something else, such as another process.
        self.children.iter().filter_map(Child::deadline).filter(|at| *at > self.looked).min()
    }

    /// While the system stops, nothing is started again and all processes end anyway.
    fn obey_order(&mut self, id: ChildId, order: ChildOrder, now: Duration) {
        if self.stage == RunStage::Running && self.children[id].obey(order, now) {
            self.actions.push(SupervisorAction::Terminate(id));
        }
    }

    /// Returns the components whose processes do not run, or have not registered yet.
    pub fn list_absent(&self) -> Vec<AbsentComponent> {
        let components =
            self.children.iter().filter(|child| child.duty.role == ChildRole::Component);
        let absent = components.filter_map(|child| {
            let state = child.absence()?;
            Some(AbsentComponent {
                component: child.duty.name.clone(),
                host: child.duty.host.clone(),
                state,
                reason: child.describe_absence(),
                starts: child.starts,
                ends: child.ends.iter().cloned().collect(),
            })
        });
        absent.take(MAX_LISTED).collect()
    }

    /// Returns the components that run, or are started without another order.
    pub fn list_owed(&self) -> Vec<String> {
        let owed = self.children.iter().filter(|child| child.duty.role == ChildRole::Component);
        owed.filter(|child| child.is_owed()).map(|child| child.duty.name.clone()).collect()
    }

    /// Returns whether an executive runs or is going to be started.
    pub fn has_executive(&self) -> bool {
        let mut executives =
            self.children.iter().filter(|child| child.duty.role == ChildRole::Executive);
        executives.any(Child::is_owed)
    }

    /// Returns the starts and ends of a component's processes.
    pub fn describe_history(&self, id: ChildId) -> ComponentHistory {
        let child = &self.children[id];
        ComponentHistory {
            state: child.absence().filter(|_| !child.is_alive()),
            starts: child.starts,
            ended: child.ended,
            last_end: child.last_end.clone(),
        }
    }

    /// Kills a process that is known to hang, once.
    fn kill_stuck(&mut self, id: ChildId, cause: HangCause) {
        if self.children[id].is_stuck(cause) {
            let text = cause.describe_kill();
            self.actions.push(SupervisorAction::Log(LogLevel::Warn, id, text));
            self.actions.push(SupervisorAction::Kill(id));
        }
    }

    /// A process could not be started. That is no fault of a component, so it is tried again and
    /// again.
    fn start_failed(&mut self, id: ChildId, reason: &str, now: Duration) {
        let how = format!("cannot be started: {reason}");
        let child = &mut self.children[id];
        if self.stage == RunStage::Running && child.duty.role == ChildRole::Component {
            let delay = child.after_failed_start(now);
            let text = format!("{how}; it is tried again in {:.1} s", delay.as_secs_f64());
            child.last_end.clone_from(&text);
            self.actions.push(SupervisorAction::Log(LogLevel::Warn, id, text));
        } else {
            self.died(id, &how, false, now);
        }
    }

    fn exited(&mut self, id: ChildId, exit: ChildExit, now: Duration) {
        self.children[id].ended += 1;
        if self.stage == RunStage::Running
            && let Some(order) = self.children[id].end_by_order(now)
        {
            let text = match order {
                ChildOrder::Restart => format!("{exit}; an operator has restarted it"),
                ChildOrder::Stop => format!("{exit}; an operator has stopped it"),
            };
            self.children[id].last_end.clone_from(&text);
            self.actions.push(SupervisorAction::Log(LogLevel::Info, id, text));
            return;
        }
        if matches!(self.children[id].state, ChildState::Ending { hung: None, .. }) {
            self.children[id].end_with_system(&exit.to_string());
            return;
        }
        let Duty { role, ends_run, .. } = self.children[id].duty;
        let verdict = match (role, exit) {
            (_, ChildExit::Code(0)) if ends_run => Some(RunVerdict::RecordingOver {
                is_unfinished: self.has_mission(),
                failed: self.failed_components(),
            }),
            (ChildRole::Executive, ChildExit::Code(0)) => Some(RunVerdict::Goal),
            (ChildRole::Executive, ChildExit::Code(3)) => Some(RunVerdict::Safe),
            (ChildRole::Executive, ChildExit::Code(4)) => Some(RunVerdict::Failed),
            _ => None,
        };
        if let Some(verdict) = verdict {
            self.children[id].state = ChildState::Ended;
            self.stop(verdict);
            return;
        }
        let how = self.children[id].describe_exit(exit);
        self.died(id, &how, exit == ChildExit::Code(0), now);
    }

    /// A process ended that was not asked to: start it again, or not.
    fn died(&mut self, id: ChildId, how: &str, in_order: bool, now: Duration) {
        let child = &mut self.children[id];
        if !matches!(self.stage, RunStage::Running) {
            child.end_with_system(how);
            return;
        }
        child.remember_end(how);
        let component = child.duty.role == ChildRole::Component;
        let restarts = !component
            || match child.duty.restart {
                Restart::Always => true,
                Restart::OnFailure => !in_order,
                Restart::Never => false,
            };
        if !restarts {
            child.state = if in_order { ChildState::Ended } else { ChildState::Failed };
            let level = if in_order { LogLevel::Info } else { LogLevel::Error };
            let text = format!("{how}; it is not started again");
            child.last_end.clone_from(&text);
            // A mission that needs it need not wait for its return.
            let why = format!("{} {how}, and is not started again", child.duty.name);
            self.actions.push(SupervisorAction::Log(level, id, text));
            let Duty { name, ends_run, .. } = &self.children[id].duty;
            if *ends_run {
                let name = name.clone();
                self.stop(RunVerdict::Essential(name));
            } else {
                self.actions.push(SupervisorAction::ReportGivenUp(id, why));
            }
            return;
        }
        match child.after_death(now) {
            AfterDeath::Again(delay) => {
                let text = format!("{how}; it starts again in {:.1} s", delay.as_secs_f64());
                child.last_end.clone_from(&text);
                self.actions.push(SupervisorAction::Log(LogLevel::Warn, id, text));
            }
            AfterDeath::GivenUp { starts, within } => {
                let after = format!("after {starts} starts in {:.1} s", within.as_secs_f64());
                let text = format!("{how}; it is given up {after}");
                child.last_end.clone_from(&text);
                let name = child.duty.name.clone();
                self.actions.push(SupervisorAction::Log(LogLevel::Error, id, text));
                if component {
                    let why = format!("{name} was given up {after}: {how}");
                    self.actions.push(SupervisorAction::ReportGivenUp(id, why));
                } else {
                    self.stop(RunVerdict::Essential(name));
                }
            }
        }
    }

    fn asked_to_stop(&mut self, request: StopRequest) {
        match (&self.stage, request) {
            (RunStage::Running, StopRequest::Interrupt) => self.stop(RunVerdict::Interrupted),
            (RunStage::Running, StopRequest::TimeUp) => {
                let failed = self.failing_components();
                self.stop(RunVerdict::TimeUp { failed });
            }
            (RunStage::Running, StopRequest::Ordered) => {
                let is_unfinished = self.has_mission();
                let failed = self.failed_components();
                self.stop(RunVerdict::Stopped { is_unfinished, failed });
            }
            (RunStage::Stopping { .. }, StopRequest::Interrupt | StopRequest::Ordered) => {
                for (id, child) in self.children.iter_mut().enumerate() {
                    if child.is_alive() {
                        child.end_immediately();
                        self.actions.push(SupervisorAction::Kill(id));
                    }
                }
            }
            _ => {}
        }
    }

    fn stop(&mut self, verdict: RunVerdict) {
        self.stage = RunStage::Stopping { step: 0, verdict };
        for child in &mut self.children {
            child.abandon_start();
        }
    }

    /// Does what is due.
    fn advance(&mut self, now: Duration) {
        self.kill_what_hangs(now);
        match self.stage {
            RunStage::Running => self.start_what_may(now),
            RunStage::Stopping { .. } => self.stop_what_must(now),
            RunStage::Over => {}
        }
    }

    fn kill_what_hangs(&mut self, now: Duration) {
        for (id, child) in self.children.iter_mut().enumerate() {
            if let Some(why) = child.take_overdue(now) {
                self.actions.push(SupervisorAction::Log(LogLevel::Warn, id, why));
                self.actions.push(SupervisorAction::Kill(id));
            }
        }
    }

    fn start_what_may(&mut self, now: Duration) {
        let was_ready = |role| {
            move |children: &[Child]| {
                children.iter().filter(|child| child.duty.role == role).all(|child| child.was_ready)
            }
        };
        let registry = was_ready(ChildRole::Registry)(&self.children);
        let daemons = registry && was_ready(ChildRole::Configd)(&self.children);
        for (id, child) in self.children.iter_mut().enumerate() {
            let turn = match child.duty.role {
                ChildRole::Registry => true,
                ChildRole::Configd | ChildRole::Gate => registry,
                ChildRole::Component | ChildRole::Executive => daemons,
            };
            if child.start_if_due(turn, now) {
                self.actions.push(SupervisorAction::Spawn(id));
            }
        }
        let continues = |child: &Child| match child.duty.role {
            ChildRole::Component => !matches!(child.state, ChildState::Ended | ChildState::Failed),
            ChildRole::Executive => true,
            ChildRole::Registry | ChildRole::Configd | ChildRole::Gate => false,
        };
        if !self.children.iter().any(continues) {
            let failed = self.failed_components();
            self.stop(RunVerdict::AllEnded { failed });
            self.stop_what_must(now);
        }
    }

    fn stop_what_must(&mut self, now: Duration) {
        while let RunStage::Stopping { step, verdict } = &mut self.stage {
            let Some(role) = STOP_ORDER.get(*step) else {
                self.actions.push(SupervisorAction::End(verdict.clone()));
                self.stage = RunStage::Over;
                return;
            };
            let mut alive = false;
            // The one that brings the time ends after those who follow it.
            let others = |child: &Child| child.duty.role == *role && !child.duty.ends_run;
            let others_live = self.children.iter().any(|child| others(child) && child.is_alive());
            for (id, child) in self.children.iter_mut().enumerate() {
                if child.duty.role == *role && child.is_alive() {
                    if child.duty.ends_run && others_live {
                        alive = true;
                        continue;
                    }
                    alive = true;
                    if child.ask_to_end(now) {
                        self.actions.push(SupervisorAction::Terminate(id));
                    }
                }
            }
            if alive {
                return;
            }
            *step += 1;
        }
    }

    fn has_mission(&self) -> bool {
        self.children.iter().any(|child| child.duty.role == ChildRole::Executive)
    }

    /// As [`failed_components`](Self::failed_components), with those that have died and have not been
    /// ready since: the time is over before they are given up, as it may be after a slow start.
    fn failing_components(&self) -> Vec<String> {
        let mut names = self.failed_components();
        let failing = self.children.iter().filter(|child| child.is_failing());
        names.extend(failing.map(|child| child.duty.name.clone()));
        names
    }

    fn failed_components(&self) -> Vec<String> {
        // What a mission's components report is for the executive to judge.
        let alone = !self.has_mission();
        let failed = self
            .children
            .iter()
            .filter(|child| child.state == ChildState::Failed || (alone && child.has_failed));
        failed.map(|child| child.duty.name.clone()).collect()
    }
}
