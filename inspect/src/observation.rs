//! Who is there and what each is doing, as far as it can be told from outside. Pure: it is told what
//! happened and when, and says whom to connect to and whom to ask.

mod process;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::time::Duration;

use armor_sdk::control::Answer;
use armor_sdk::directory::Change;
use armor_wire::registry::ComponentEntry;

use crate::links::{Edge, Looks, links};
use crate::observed::{CONFIGD, CONFIGURATION};

pub use process::{Condition, Process};

use process::Connection;

/// How often each process is asked for its status: rates are taken over this time.
pub const ASK_EVERY: Duration = Duration::from_secs(1);
/// How long a process may be gone before it counts as dead: a launcher waits ten seconds at most
/// before it starts one again.
pub const DEAD_AFTER: Duration = Duration::from_secs(12);
/// How long to wait before connecting again to a process that is registered and does not answer.
const RETRY: Duration = Duration::from_secs(1);
/// A call of user code that has taken this long is worth showing while it runs.
pub const LONG_CALL_S: f64 = 0.5;

/// A running system, as it looks now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Whether its registry can be reached.
    pub is_found: bool,
    /// Whether it was ever reached.
    pub was_found: bool,
    /// Its processes, by name, also those that have gone.
    pub processes: BTreeMap<String, Process>,
    /// Its links and what they have lost, as of the last [`Picture::link`].
    pub links: Vec<Edge>,
    /// The time of this look, after the beginning of the watch.
    pub now: Duration,
    asked: Option<Duration>,
    /// Whether the links fit what is known of their ends, and whether the system had ended then.
    linked: Option<bool>,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The registry says who comes and goes.
    Registry(Change),
    /// The control connection to a process start is up.
    Connected(String, u64),
    /// A process start says something.
    Said(String, u64, Answer),
    /// The control connection to a process start could not be made, or has ended, and why.
    Closed(String, u64, String),
    /// Time passes.
    Tick,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Connect to the process; a [`Event::Connected`] or [`Event::Closed`] follows.
    Connect(ComponentEntry),
    /// Ask the process start for its status.
    Ask(String, u64),
    /// Let the connection to the process start go.
    Drop(String, u64),
}

impl Picture {
    /// Takes in what happened `now`; whether that changed what there is to see, and what to do.
    pub fn handle(&mut self, event: Event, now: Duration) -> (bool, Vec<Action>) {
        self.now = now;
        let mut actions = Vec::new();
        let changed = match event {
            Event::Registry(change) => self.registry(change, &mut actions),
            Event::Connected(name, instance) => self.connected(name, instance, &mut actions),
            Event::Said(name, instance, answer) => self.said(&name, instance, answer),
            Event::Closed(name, instance, reason) => self.closed(&name, instance, reason),
            Event::Tick => self.tick(&mut actions),
        };
        (changed, actions)
    }

    /// Whether everything that was there has gone, and the registry with it.
    pub fn has_ended(&self) -> bool {
        let is_unheard = |process: &Process| {
            // Of configd only the registry could tell.
            process.connection == Connection::Never || process.condition == Condition::Suspected
        };
        self.was_found && !self.is_found && self.processes.values().all(is_unheard)
    }

    /// Whether a process of this name is one that is there under another name already: configd, as
    /// it publishes what becomes of the file.
    pub fn is_second_name(&self, name: &str) -> bool {
        let of = |name: &str| self.processes.get(name).map(|it| (&it.entry.host, it.entry.pid));
        name == CONFIGURATION && of(CONFIGD).is_some_and(|it| of(name) == Some(it))
    }

    /// When the next [`Event::Tick`] has something to do.
    pub fn next_tick(&self) -> Duration {
        let retries = self.processes.values().filter_map(|process| match process.connection {
            Connection::Down { retry } => Some(retry),
            _ => None,
        });
        let deaths = self.processes.values().filter_map(|process| {
            (process.condition == Condition::Restarting).then_some(process.since + DEAD_AFTER)
        });
        let ask = self.asked.map_or(self.now, |asked| asked + ASK_EVERY);
        retries.chain(deaths).fold(ask, Duration::min)
    }

    /// Puts the links together again from what is known of their ends, if that has changed. Those of
    /// a system that has ended are what all its processes said last.
    pub fn link(&mut self) {
        let has_ended = self.has_ended();
        if self.linked.replace(has_ended) == Some(has_ended) {
            return;
        }
        let there =
            self.processes.values().filter(|process| has_ended || !process.condition.is_gone());
        let looks: Vec<_> = there
            .filter_map(|process| {
                Some(Looks { before: process.before.as_ref(), now: process.status.as_ref()? })
            })
            .collect();
        self.links = links(&looks);
    }

    /// The process of that name and start.
    fn of(&mut self, name: &str, instance: u64) -> Option<&mut Process> {
        self.processes.get_mut(name).filter(|process| process.entry.instance == instance)
    }

    fn registry(&mut self, change: Change, actions: &mut Vec<Action>) -> bool {
        match change {
            Change::RegistryFound => self.found(),
            Change::RegistryLost => std::mem::replace(&mut self.is_found, false),
            Change::Appeared(entry) => {
                // Told after a restart of the registry too, of those that were there.
                let found = self.found();
                let known = self.of(&entry.name, entry.instance);
                let is_there = known.is_some_and(|process| !process.condition.is_gone());
                found | (!is_there && self.appeared(entry, actions))
            }
            Change::Gone(entry) => {
                let now = self.now;
                let Some(process) = self.of(&entry.name, entry.instance) else { return false };
                process.go(now);
                actions.push(Action::Drop(entry.name, entry.instance));
                self.linked = None;
                true
            }
        }
    }

    fn found(&mut self) -> bool {
        self.was_found = true;
        !std::mem::replace(&mut self.is_found, true)
    }

    fn appeared(&mut self, entry: ComponentEntry, actions: &mut Vec<Action>) -> bool {
        let serves_control = entry.kind != CONFIGD;
        let before = self.processes.get(&entry.name);
        if let Some(before) = before {
            actions.push(Action::Drop(entry.name.clone(), before.entry.instance));
        }
        let process = Process {
            condition: if serves_control { Condition::Unknown } else { Condition::Active },
            since: self.now,
            call_s: None,
            status: None,
            problem: String::new(),
            starts: before.map_or(1, |before| before.starts + 1),
            before: None,
            connection: if serves_control { Connection::Pending } else { Connection::Never },
            entry: entry.clone(),
        };
        self.processes.insert(entry.name.clone(), process);
        if serves_control {
            actions.push(Action::Connect(entry));
        }
        self.linked = None;
        true
    }

    fn connected(&mut self, name: String, instance: u64, actions: &mut Vec<Action>) -> bool {
        let pending = |process: &&mut Process| process.connection == Connection::Pending;
        let Some(process) = self.of(&name, instance).filter(pending) else {
            // It has ended again, or the process has, before this was told.
            actions.push(Action::Drop(name, instance));
            return false;
        };
        process.connection = Connection::Up;
        process.problem.clear();
        actions.push(Action::Ask(name, instance));
        true
    }

    fn said(&mut self, name: &str, instance: u64, answer: Answer) -> bool {
        let now = self.now;
        let Some(process) = self.of(name, instance) else { return false };
        match answer {
            Answer::State { state, .. } => process.is(state.into(), now),
            Answer::Status { status, .. } => {
                process.is(status.state.into(), now);
                process.before = process.status.replace(status);
                self.linked = None;
                true
            }
            Answer::Beat { call_s } => {
                let long = Some(call_s).filter(|call_s| *call_s >= LONG_CALL_S);
                std::mem::replace(&mut process.call_s, long) != long
            }
            Answer::Report { .. } | Answer::Ordered { .. } => false,
        }
    }

    fn closed(&mut self, name: &str, instance: u64, reason: String) -> bool {
        let now = self.now;
        let Some(process) = self.of(name, instance) else { return false };
        if process.condition.is_gone() {
            return false;
        }
        process.connection = Connection::Down { retry: now + RETRY };
        process.call_s = None;
        process.problem = reason;
        process.is(Condition::Suspected, now);
        true
    }

    fn tick(&mut self, actions: &mut Vec<Action>) -> bool {
        let (now, is_found) = (self.now, self.is_found);
        let asks = self.asked.is_none_or(|asked| asked + ASK_EVERY <= now);
        if asks {
            self.asked = Some(now);
        }
        let (mut changed, has_ended) = (false, self.has_ended());
        for (name, process) in &mut self.processes {
            if process.condition == Condition::Restarting && process.since + DEAD_AFTER <= now {
                changed |= process.is(Condition::Dead, now);
            }
            match process.connection {
                Connection::Down { retry } if retry <= now => {
                    // Nobody says any more that it has gone: the silence must do.
                    if !is_found && process.since + DEAD_AFTER <= now {
                        process.connection = Connection::Never;
                        changed |= process.is(Condition::Dead, now);
                    } else {
                        process.connection = Connection::Pending;
                        actions.push(Action::Connect(process.entry.clone()));
                    }
                }
                Connection::Never if has_ended && !process.condition.is_gone() => {
                    changed |= process.is(Condition::Dead, now);
                }
                Connection::Up if asks => {
                    actions.push(Action::Ask(name.clone(), process.entry.instance));
                }
                _ => {}
            }
        }
        changed
    }
}
