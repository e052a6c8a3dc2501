//! Which process should run now: starts in order, restarts with backoff, kills what hangs, stops in
//! order. Pure: it is told events and the time since the start of the run, and says what to do.
//!
//! It never starts a process while the system stops, never waits without a deadline, and never ends
//! while a process is alive.

mod child;
mod event;
#[cfg(test)]
mod tests;

use std::time::Duration;

use armor_robotfile::model::Restart;

use child::{Child, State};
pub use event::{Action, ChildId, Duty, Event, Exit, Level, Request, Role, Verdict};

/// How long a process has to end after it was asked to, before it is killed.
pub const GRACE: Duration = Duration::from_secs(5);
/// A gap between two looks at the clock after which nobody is blamed for silence: the launcher
/// itself was stopped, or the host asleep.
const NAP: Duration = Duration::from_secs(1);

/// How far the run is.
#[derive(Clone, Debug, PartialEq)]
enum Stage {
    Running,
    /// The processes of this role and of those before it in [`STOP_ORDER`] are ending.
    Stopping {
        step: usize,
        verdict: Verdict,
    },
    Over,
}

/// The executive first, so that it does not see its components end as failures; the registry last,
/// so that everybody can say goodbye.
const STOP_ORDER: [Role; 4] = [Role::Executive, Role::Component, Role::Configd, Role::Registry];

/// The state machine.
#[derive(Debug)]
pub struct Supervisor {
    children: Vec<Child>,
    stage: Stage,
    looked: Duration,
    actions: Vec<Action>,
}

impl Supervisor {
    /// Nothing runs yet; the first [`Event::Tick`] starts it.
    pub fn new(duties: Vec<Duty>) -> Self {
        Self {
            children: duties.into_iter().map(Child::new).collect(),
            stage: Stage::Running,
            looked: Duration::ZERO,
            actions: Vec::new(),
        }
    }

    /// Takes in what happened `now` and says what to do, in order.
    pub fn handle(&mut self, event: Event, now: Duration) -> Vec<Action> {
        let nap = now.saturating_sub(self.looked);
        if nap > NAP {
            self.children.iter_mut().for_each(|child| child.forgive(nap));
        }
        self.looked = now;
        match event {
            Event::Tick => {}
            Event::SpawnFailed(id, reason) => {
                self.died(id, &format!("cannot be started: {reason}"), false, now);
            }
            Event::Ready(id) => self.children[id].became_ready(now),
            Event::Heard(id, state) => self.children[id].heard(state, now),
            Event::Stuck(id, call) => {
                if self.children[id].is_stuck() {
                    let why = format!(
                        "one call has taken {:.1} s, longer than its watchdog allows: killed",
                        call.as_secs_f64()
                    );
                    self.actions.push(Action::Say(Level::Warn, id, why));
                    self.actions.push(Action::Kill(id));
                }
            }
            Event::Vanished(id) => self.children[id].vanished(now),
            Event::Exited(id, exit) => self.exited(id, exit, now),
            Event::Stop(request) => self.asked_to_stop(request),
        }
        self.advance(now);
        std::mem::take(&mut self.actions)
    }

    /// When to look again, if nothing happens before.
    pub fn next_deadline(&self) -> Option<Duration> {
        // What is overdue already waits for something else, such as another process.
        self.children.iter().filter_map(Child::deadline).filter(|at| *at > self.looked).min()
    }

    fn exited(&mut self, id: ChildId, exit: Exit, now: Duration) {
        if matches!(self.children[id].state, State::Ending { hung: false, .. }) {
            self.children[id].state = State::Ended;
            return;
        }
        let role = self.children[id].duty.role;
        let verdict = match (role, exit) {
            (Role::Executive, Exit::Code(0)) => Some(Verdict::Goal),
            (Role::Executive, Exit::Code(3)) => Some(Verdict::Safe),
            (Role::Executive, Exit::Code(4)) => Some(Verdict::Failed),
            _ => None,
        };
        if let Some(verdict) = verdict {
            self.children[id].state = State::Ended;
            self.stop(verdict);
            return;
        }
        self.died(id, &exit.to_string(), exit == Exit::Code(0), now);
    }

    /// A process ended that was not asked to: start it again, or not.
    fn died(&mut self, id: ChildId, how: &str, in_order: bool, now: Duration) {
        let child = &mut self.children[id];
        if !matches!(self.stage, Stage::Running) {
            child.state = State::Ended;
            return;
        }
        let component = child.duty.role == Role::Component;
        let restarts = !component
            || match child.duty.restart {
                Restart::Always => true,
                Restart::OnFailure => !in_order,
                Restart::Never => false,
            };
        if !restarts {
            child.state = if in_order { State::Ended } else { State::Failed };
            let level = if in_order { Level::Info } else { Level::Error };
            self.actions.push(Action::Say(level, id, format!("{how}; it is not started again")));
            return;
        }
        match child.after_death(now) {
            Some(delay) => {
                let text = format!("{how}; it starts again in {:.1} s", delay.as_secs_f64());
                self.actions.push(Action::Say(Level::Warn, id, text));
            }
            None => {
                let text = format!(
                    "{how}, {} times within {} s; it is given up",
                    child::MAX_DEATHS,
                    child::DEATHS_WITHIN.as_secs()
                );
                self.actions.push(Action::Say(Level::Error, id, text));
                if !component {
                    let name = self.children[id].duty.name.clone();
                    self.stop(Verdict::Essential(name));
                }
            }
        }
    }

    fn asked_to_stop(&mut self, request: Request) {
        match (&self.stage, request) {
            (Stage::Running, Request::Interrupt) => self.stop(Verdict::Interrupted),
            (Stage::Running, Request::TimeUp) => {
                let failed = self.failed_components();
                self.stop(Verdict::TimeUp { failed });
            }
            (Stage::Stopping { .. }, Request::Interrupt) => {
                for (id, child) in self.children.iter_mut().enumerate() {
                    if child.is_alive() {
                        child.end_at_once();
                        self.actions.push(Action::Kill(id));
                    }
                }
            }
            _ => {}
        }
    }

    fn stop(&mut self, verdict: Verdict) {
        self.stage = Stage::Stopping { step: 0, verdict };
        for child in &mut self.children {
            child.abandon_start();
        }
    }

    /// Does what is due.
    fn advance(&mut self, now: Duration) {
        self.kill_what_hangs(now);
        match self.stage {
            Stage::Running => self.start_what_may(now),
            Stage::Stopping { .. } => self.stop_what_must(now),
            Stage::Over => {}
        }
    }

    fn kill_what_hangs(&mut self, now: Duration) {
        for (id, child) in self.children.iter_mut().enumerate() {
            if let Some(why) = child.overdue(now) {
                self.actions.push(Action::Say(Level::Warn, id, why));
                self.actions.push(Action::Kill(id));
            }
        }
    }

    fn start_what_may(&mut self, now: Duration) {
        let was_ready = |role| {
            move |children: &[Child]| {
                children.iter().filter(|child| child.duty.role == role).all(|child| child.was_ready)
            }
        };
        let registry = was_ready(Role::Registry)(&self.children);
        let daemons = registry && was_ready(Role::Configd)(&self.children);
        for (id, child) in self.children.iter_mut().enumerate() {
            let turn = match child.duty.role {
                Role::Registry => true,
                Role::Configd => registry,
                Role::Component | Role::Executive => daemons,
            };
            if child.start_if_due(turn, now) {
                self.actions.push(Action::Spawn(id));
            }
        }
        let goes_on = |child: &Child| match child.duty.role {
            Role::Component => !matches!(child.state, State::Ended | State::Failed),
            Role::Executive => true,
            Role::Registry | Role::Configd => false,
        };
        if !self.children.iter().any(goes_on) {
            let failed = self.failed_components();
            self.stop(Verdict::AllEnded { failed });
            self.stop_what_must(now);
        }
    }

    fn stop_what_must(&mut self, now: Duration) {
        while let Stage::Stopping { step, verdict } = &mut self.stage {
            let Some(role) = STOP_ORDER.get(*step) else {
                self.actions.push(Action::End(verdict.clone()));
                self.stage = Stage::Over;
                return;
            };
            let mut alive = false;
            for (id, child) in self.children.iter_mut().enumerate() {
                if child.duty.role == *role && child.is_alive() {
                    alive = true;
                    if child.ask_to_end(now) {
                        self.actions.push(Action::Terminate(id));
                    }
                }
            }
            if alive {
                return;
            }
            *step += 1;
        }
    }

    fn failed_components(&self) -> Vec<String> {
        // What a mission's components report is for the executive to judge.
        let alone = !self.children.iter().any(|child| child.duty.role == Role::Executive);
        let failed = self
            .children
            .iter()
            .filter(|child| child.state == State::Failed || (alone && child.has_failed));
        failed.map(|child| child.duty.name.clone()).collect()
    }
}
