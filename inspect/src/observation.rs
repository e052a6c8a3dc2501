//! The processes of a running system and what each is doing, as seen from outside. Pure: it
//! receives what happened and when, and returns which processes to connect to and which to ask.

mod process;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::time::Duration;

use armor_sdk::control::Answer;
use armor_sdk::directory::DirectoryChange;
use armor_wire::registry::ComponentEntry;

use crate::links::{Looks, ObservedLink, combine_links};
use crate::observed::{CONFIGD, CONFIGURATION};
use crate::run_control::HostReport;

pub use process::{Condition, ObservedProcess};

use process::ControlLink;

/// Interval between status requests to a process; rates are taken over it.
pub const ASK_EVERY: Duration = Duration::from_secs(1);
/// How long a process may be gone before it counts as dead: the launcher waits at most ten seconds
/// before it restarts one.
pub const DEAD_AFTER: Duration = Duration::from_secs(12);
/// Delay before the next attempt to connect to a process that is registered but does not answer.
const RETRY: Duration = Duration::from_secs(1);
/// A running call of user code is shown once it has taken this long, in seconds.
pub const LONG_CALL_S: f64 = 0.5;
/// A running call of user code counts as a problem once it has taken this long, in seconds.
pub const HANGING_CALL_S: f64 = 2.0;

/// The present state of a running system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SystemPicture {
    /// Whether its registry can be reached.
    pub is_found: bool,
    /// Whether it was ever reached.
    pub was_found: bool,
    /// How many times it was found. A later one may be the registry of another run, at the same
    /// address.
    pub found_count: u32,
    /// Its processes, by name, including those that have ended.
    pub processes: BTreeMap<String, ObservedProcess>,
    /// Its links and what they have lost, as of the last [`SystemPicture::rebuild_links`].
    pub links: Vec<ObservedLink>,
    /// The other hosts, as its launcher reports them; empty if it cannot be asked.
    pub hosts: Vec<HostReport>,
    /// The time of this picture, since the beginning of the watch.
    pub now: Duration,
    asked: Option<Duration>,
    /// `None` if the links are out of date; else whether the system had ended when they were built.
    linked: Option<bool>,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum SystemEvent {
    /// The registry reports that a process has appeared or ended.
    Registry(DirectoryChange),
    /// The control connection to a process start is up.
    Connected(String, u64),
    /// A process start has sent an answer.
    Answered(String, u64, Answer),
    /// The control connection to a process start failed or ended, and why.
    Closed(String, u64, String),
    /// The launcher reports on the other hosts.
    Hosts(Vec<HostReport>),
    /// Time passes.
    Tick,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum ObserverAction {
    /// Connect to the process; an [`SystemEvent::Connected`] or [`SystemEvent::Closed`] follows.
    Connect(ComponentEntry),
    /// Ask the process start for its status.
    Ask(String, u64),
    /// Close the connection to the process start.
    Drop(String, u64),
}

impl SystemPicture {
    /// Handles an event at time `now`; returns whether the picture changed, and what to do.
    pub fn handle_event(
        &mut self,
        event: SystemEvent,
        now: Duration,
    ) -> (bool, Vec<ObserverAction>) {
        self.now = now;
        let mut actions = Vec::new();
        let changed = match event {
            SystemEvent::Registry(change) => self.handle_registry(change, &mut actions),
            SystemEvent::Connected(name, instance) => {
                self.handle_connected(name, instance, &mut actions)
            }
            SystemEvent::Answered(name, instance, answer) => {
                self.handle_answer(&name, instance, answer)
            }
            SystemEvent::Closed(name, instance, reason) => {
                self.handle_closed(&name, instance, reason)
            }
            SystemEvent::Hosts(hosts) => {
                let is_new = self.hosts != hosts;
                self.hosts = hosts;
                is_new
            }
            SystemEvent::Tick => self.handle_tick(&mut actions),
        };
        (changed, actions)
    }

    /// Returns whether all processes have ended, and the registry too.
    pub fn has_ended(&self) -> bool {
        let is_unheard = |process: &ObservedProcess| {
            // Only the registry reports on configd: it has no control connection.
            process.connection == ControlLink::Never || process.condition == Condition::Suspected
        };
        self.was_found && !self.is_found && self.processes.values().all(is_unheard)
    }

    /// Notes that all processes have ended, and the registry too, as the end of their launcher
    /// shows. What another system at the same address does is not shown any more.
    pub fn mark_ended(&mut self) {
        (self.was_found, self.is_found) = (true, false);
        for process in self.processes.values_mut() {
            process.connection = ControlLink::Never;
        }
        self.rebuild_links();
    }

    /// Returns whether this is the second name of a process: configd is also registered under the
    /// name by which it publishes the state of the file.
    pub fn is_second_name(&self, name: &str) -> bool {
        let of = |name: &str| self.processes.get(name).map(|it| (&it.entry.host, it.entry.pid));
        name == CONFIGURATION && of(CONFIGD).is_some_and(|it| of(name) == Some(it))
    }

    /// Returns when the next [`SystemEvent::Tick`] has something to do.
    pub fn next_tick(&self) -> Duration {
        let retries = self.processes.values().filter_map(|process| match process.connection {
            ControlLink::Down { retry } => Some(retry),
            _ => None,
        });
        let deaths = self.processes.values().filter_map(|process| {
            (process.condition == Condition::Restarting).then_some(process.since + DEAD_AFTER)
        });
        let ask = self.asked.map_or(self.now, |asked| asked + ASK_EVERY);
        retries.chain(deaths).fold(ask, Duration::min)
    }

    /// Rebuilds the links from the status of their ends, if any status has changed. The links of an
    /// ended system are those of the last status of all its processes.
    pub fn rebuild_links(&mut self) {
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
        self.links = combine_links(&looks);
    }

    /// Returns the process of that name and start.
    fn process_start(&mut self, name: &str, instance: u64) -> Option<&mut ObservedProcess> {
        self.processes.get_mut(name).filter(|process| process.entry.instance == instance)
    }

    fn handle_registry(
        &mut self,
        change: DirectoryChange,
        actions: &mut Vec<ObserverAction>,
    ) -> bool {
        match change {
            DirectoryChange::RegistryFound => self.mark_registry_found(),
            DirectoryChange::RegistryLost => std::mem::replace(&mut self.is_found, false),
            DirectoryChange::Appeared(entry) => {
                // A restarted registry reports processes again that were already known.
                let found = self.mark_registry_found();
                let known = self.process_start(&entry.name, entry.instance);
                let is_there = known.is_some_and(|process| !process.condition.is_gone());
                found | (!is_there && self.add_process(entry, actions))
            }
            DirectoryChange::Gone(entry) => {
                let now = self.now;
                let Some(process) = self.process_start(&entry.name, entry.instance) else {
                    return false;
                };
                process.mark_gone(now);
                actions.push(ObserverAction::Drop(entry.name, entry.instance));
                self.linked = None;
                true
            }
        }
    }

    fn mark_registry_found(&mut self) -> bool {
        self.was_found = true;
        let is_new = !std::mem::replace(&mut self.is_found, true);
        self.found_count += u32::from(is_new);
        is_new
    }

    fn add_process(&mut self, entry: ComponentEntry, actions: &mut Vec<ObserverAction>) -> bool {
        let serves_control = entry.kind != CONFIGD;
        let before = self.processes.get(&entry.name);
        if let Some(before) = before {
            actions.push(ObserverAction::Drop(entry.name.clone(), before.entry.instance));
        }
        let process = ObservedProcess {
            condition: if serves_control { Condition::Unknown } else { Condition::Active },
            since: self.now,
            call: None,
            status: None,
            problem: String::new(),
            starts: before.map_or(1, |before| before.starts + 1),
            before: None,
            connection: if serves_control { ControlLink::Pending } else { ControlLink::Never },
            entry: entry.clone(),
        };
        self.processes.insert(entry.name.clone(), process);
        if serves_control {
            actions.push(ObserverAction::Connect(entry));
        }
        self.linked = None;
        true
    }

    fn handle_connected(
        &mut self,
        name: String,
        instance: u64,
        actions: &mut Vec<ObserverAction>,
    ) -> bool {
        let pending = |process: &&mut ObservedProcess| process.connection == ControlLink::Pending;
        let Some(process) = self.process_start(&name, instance).filter(pending) else {
            // The connection or the process ended before this event arrived.
            actions.push(ObserverAction::Drop(name, instance));
            return false;
        };
        process.connection = ControlLink::Up;
        process.problem.clear();
        actions.push(ObserverAction::Ask(name, instance));
        true
    }

    fn handle_answer(&mut self, name: &str, instance: u64, answer: Answer) -> bool {
        let now = self.now;
        let Some(process) = self.process_start(name, instance) else { return false };
        match answer {
            Answer::State { state, .. } => process.set_condition(state.into(), now),
            Answer::Status { status, .. } => {
                process.set_condition(status.state.into(), now);
                process.before = process.status.replace(status);
                self.linked = None;
                true
            }
            Answer::Beat { call } => {
                let long = call.filter(|call| call.call_s >= LONG_CALL_S);
                let is_new = process.call != long;
                process.call = long;
                is_new
            }
            Answer::Report { .. } | Answer::Ordered { .. } => false,
        }
    }

    fn handle_closed(&mut self, name: &str, instance: u64, reason: String) -> bool {
        let now = self.now;
        let Some(process) = self.process_start(name, instance) else { return false };
        if process.condition.is_gone() {
            return false;
        }
        process.connection = ControlLink::Down { retry: now + RETRY };
        process.call = None;
        process.problem = reason;
        process.set_condition(Condition::Suspected, now);
        true
    }

    fn handle_tick(&mut self, actions: &mut Vec<ObserverAction>) -> bool {
        let (now, is_found) = (self.now, self.is_found);
        let asks = self.asked.is_none_or(|asked| asked + ASK_EVERY <= now);
        if asks {
            self.asked = Some(now);
        }
        let (mut changed, has_ended) = (false, self.has_ended());
        for (name, process) in &mut self.processes {
            if process.condition == Condition::Restarting && process.since + DEAD_AFTER <= now {
                changed |= process.set_condition(Condition::Dead, now);
            }
            match process.connection {
                ControlLink::Down { retry } if retry <= now => {
                    // Without a registry no event reports its end: judge by the silence.
                    if !is_found && process.since + DEAD_AFTER <= now {
                        process.connection = ControlLink::Never;
                        changed |= process.set_condition(Condition::Dead, now);
                    } else {
                        process.connection = ControlLink::Pending;
                        actions.push(ObserverAction::Connect(process.entry.clone()));
                    }
                }
                ControlLink::Never if has_ended && !process.condition.is_gone() => {
                    changed |= process.set_condition(Condition::Dead, now);
                }
                ControlLink::Up if asks => {
                    actions.push(ObserverAction::Ask(name.clone(), process.entry.instance));
                }
                _ => {}
            }
        }
        changed
    }
}
