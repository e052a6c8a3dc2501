//! Whether the system has taken what was published: every message is with its subscriber, no
//! component is in a call, and none has something left to do.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::{Duration, Instant};

use armor_sdk::control::{
    Answer, Command, ControlConnection, ControlEvent, LinkStatus, OutputStatus, Role, RunState,
    Status,
};
use armor_sdk::directory::Directory;
use armor_sdk::time_link;
use armor_wire::keep::Keep;

/// Time between two looks at which processes there are.
const LIST_EVERY: Duration = Duration::from_millis(500);
/// Within this time the registry answers.
const LISTED_WITHIN: Duration = Duration::from_secs(2);
/// A process that has not answered within this time is pending.
const ANSWER_WITHIN: Duration = Duration::from_millis(200);
/// So many looks in a row may show that something is still going on between components; beyond that,
/// it always is.
const MOST_UNSTEADY_LOOKS: u32 = 20;
/// The process that plays the mission.
const EXECUTIVE: &str = "executive";
/// What the names of links have that are not waited for: those of tools, and those that bring the
/// time.
const TOOL_PREFIX: &str = "tool-";
const TIME_SUFFIX: &str = ":time";
/// How the transport of a link in datagrams begins.
const UDP: &str = "udp";

/// The processes of a system, without the player itself.
pub(crate) struct Followers {
    directory: Directory,
    own: BTreeSet<String>,
    name: String,
    connections: BTreeMap<String, Follower>,
    listed: Option<Instant>,
    request: u64,
    sender: Sender<(String, u64, Status)>,
    answers: Receiver<(String, u64, Status)>,
    check: DeliveryCheck,
}

struct Follower {
    instance: u64,
    connection: ControlConnection,
}

impl Followers {
    /// `own` are the names of the player's processes.
    pub fn new(directory: Directory, name: &str, own: BTreeSet<String>) -> Self {
        let (sender, answers) = mpsc::channel();
        Self {
            directory,
            own,
            name: name.into(),
            connections: BTreeMap::new(),
            listed: None,
            request: 0,
            sender,
            answers,
            check: DeliveryCheck::default(),
        }
    }

    /// Returns what is not taken yet, if something is. `outputs` are the player's, `clock_s` the time
    /// that it has published last.
    pub fn find_pending(&mut self, outputs: &[OutputStatus], clock_s: f64) -> Option<PendingWork> {
        self.list_processes();
        let statuses = self.ask_statuses();
        let is_silent = |name: &&String| !statuses.contains_key(*name) && !self.check.excuses(name);
        let silent = self.connections.keys().find(is_silent);
        let silent = silent.map(|name| PendingWork::new(name, "does not answer"));
        silent.or_else(|| self.check.find_pending(outputs, clock_s, &statuses))
    }

    /// Waits no more for a process, until it has nothing left to do.
    pub fn excuse(&mut self, process: &str) {
        self.check.excuse(process);
    }

    /// Whether the executive plays its mission.
    pub fn plays_mission(&mut self) -> bool {
        self.list_processes();
        let statuses = self.ask_statuses();
        let outputs = statuses.get(EXECUTIVE).into_iter().flat_map(|status| &status.outputs);
        outputs.map(|output| output.published).sum::<u64>() > 0
    }

    /// Whether an executive was there at the last look.
    pub fn has_known_executive(&self) -> bool {
        self.connections.contains_key(EXECUTIVE)
    }

    /// Forgets what was published: time has jumped.
    pub fn forget(&mut self) {
        self.check = DeliveryCheck::default();
    }

    fn list_processes(&mut self) {
        if self.listed.is_some_and(|listed| listed.elapsed() < LIST_EVERY) {
            return;
        }
        // Without the registry the known processes are asked.
        let Ok(listing) = self.directory.fetch_listing(LISTED_WITHIN) else { return };
        self.listed = Some(Instant::now());
        let is_there = |name: &String, follower: &mut Follower| {
            let instance = follower.instance;
            listing.components.iter().any(|it| it.name == *name && it.instance == instance)
        };
        self.connections.retain(is_there);
        for entry in &listing.components {
            // configd serves no control; what it publishes follows nothing.
            let is_followed = entry.kind != "configd"
                && !self.own.contains(&entry.name)
                && !self.connections.contains_key(&entry.name);
            if !is_followed {
                continue;
            }
            let (sender, name) = (self.sender.clone(), entry.name.clone());
            let sink = move |event| {
                if let ControlEvent::Answer(Answer::Status { request, status }) = event {
                    // The player ends before its connections.
                    let _ = sender.send((name.clone(), request, status));
                }
            };
            let connected = ControlConnection::connect(entry, Role::Observer, &self.name, sink);
            if let Ok(connection) = connected {
                let follower = Follower { instance: entry.instance, connection };
                self.connections.insert(entry.name.clone(), follower);
            }
        }
    }

    /// Asks all of them together. A process that does not answer is missing; one that is not waited for
    /// anyway may be.
    fn ask_statuses(&mut self) -> BTreeMap<String, Status> {
        self.request += 1;
        let request = self.request;
        let ask = |_: &String, follower: &mut Follower| {
            follower.connection.send(&Command::Status { request }).is_ok()
        };
        let asked = self.connections.len();
        self.connections.retain(ask);
        if self.connections.len() < asked {
            self.listed = None;
        }
        let deadline = Instant::now() + ANSWER_WITHIN;
        let mut statuses: BTreeMap<String, Status> = BTreeMap::new();
        let is_missing = |name: &&String, statuses: &BTreeMap<String, Status>| {
            !statuses.contains_key(*name) && !self.check.excuses(name)
        };
        while self.connections.keys().any(|name| is_missing(&name, &statuses)) {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.answers.recv_timeout(left) {
                Ok((name, answered, status)) if answered == request => {
                    statuses.insert(name, status);
                }
                Ok(_) => {}
                Err(_) => break,
            }
        }
        statuses
    }
}

/// The outputs that components subscribe to.
pub(crate) fn find_followed(outputs: &[OutputStatus]) -> BTreeSet<String> {
    let is_followed =
        |output: &&OutputStatus| output.links.iter().any(|link| is_of_component(&link.to));
    outputs.iter().filter(is_followed).map(|output| output.data.clone()).collect()
}

fn is_of_component(subscriber: &str) -> bool {
    !subscriber.starts_with(TOOL_PREFIX) && !subscriber.ends_with(TIME_SUFFIX)
}

/// What time waits for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PendingWork {
    /// The process; empty if it is not one alone.
    pub process: String,
    what: String,
}

impl PendingWork {
    pub fn new(process: &str, what: impl Into<String>) -> Self {
        Self { process: process.into(), what: what.into() }
    }
}

impl fmt::Display for PendingWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.process.is_empty() {
            f.write_str(&self.what)
        } else {
            write!(f, "{} {}", self.process, self.what)
        }
    }
}

/// Compares what was published with what has arrived. Pure.
#[derive(Debug, Default)]
pub(crate) struct DeliveryCheck {
    /// Of each link, by its subscriber and data: what was sent and handed over at the same moment.
    bases: BTreeMap<(String, String), DeliveredCount>,
    /// What the components have done, at the last look.
    work: Option<u64>,
    /// And when everything was taken.
    taken_work: Option<u64>,
    unsteady_looks: u32,
    /// Processes that have taken too long.
    excused: BTreeSet<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct DeliveredCount {
    sent: u64,
    handed_over: u64,
}

impl DeliveryCheck {
    /// Whether a process is not waited for.
    pub fn excuses(&self, process: &str) -> bool {
        self.excused.contains(process)
    }

    pub fn excuse(&mut self, process: &str) {
        self.excused.insert(process.into());
    }

    /// Returns what is pending, by the player's outputs, the time it has published, and the statuses of
    /// the others.
    pub fn find_pending(
        &mut self,
        outputs: &[OutputStatus],
        clock_s: f64,
        statuses: &BTreeMap<String, Status>,
    ) -> Option<PendingWork> {
        let mut pending = None;
        // Those of the player, and those between the components.
        let all: Vec<_> =
            statuses.values().flat_map(|status| &status.outputs).chain(outputs).collect();
        for status in statuses.values() {
            let found = self.find_pending_in(status, &all, clock_s);
            if found.is_none() {
                self.excused.remove(&status.name);
            } else if !self.excuses(&status.name) {
                pending = pending.or(found);
            }
        }
        if pending.is_some() {
            return pending;
        }
        // Two looks that show the same: nothing happens between the statuses of two components either.
        let work = count_work(statuses);
        // One is enough that shows what was done when everything was taken last.
        let is_steady = self.work.replace(work) == Some(work) || self.taken_work == Some(work);
        if is_steady || self.unsteady_looks >= MOST_UNSTEADY_LOOKS {
            (self.work, self.unsteady_looks, self.taken_work) = (None, 0, Some(work));
            return None;
        }
        self.unsteady_looks += 1;
        Some(PendingWork::new("", "the components work"))
    }

    fn find_pending_in(
        &mut self,
        status: &Status,
        outputs: &[&OutputStatus],
        clock_s: f64,
    ) -> Option<PendingWork> {
        let name = &status.name;
        let links =
            outputs.iter().flat_map(|output| output.links.iter().map(move |it| (output, it)));
        for (output, link) in links {
            if link.to == time_link(name) && status.time_s < clock_s {
                return Some(PendingWork::new(name, "has an earlier time"));
            }
            if link.to == *name && !self.has_arrived(output, link, status) {
                return Some(PendingWork::new(name, format!("has not taken {}", output.data)));
            }
        }
        if status.busy {
            let what = status.call.as_ref().map_or("is busy".into(), |call| {
                format!("is in {} for {:.1} s", call.function, call.call_s)
            });
            return Some(PendingWork::new(name, what));
        }
        let is_active = status.state == RunState::Active;
        let input = status.inputs.iter().find(|input| is_active && input.waiting > 0)?;
        Some(PendingWork::new(name, format!("has not taken {}", input.data)))
    }

    /// Whether everything that was sent by a link has been handed over or dropped.
    fn has_arrived(&mut self, output: &OutputStatus, link: &LinkStatus, status: &Status) -> bool {
        let key = (status.name.clone(), output.data.clone());
        let mut inputs = status.inputs.iter();
        let input = inputs.find(|input| input.data == output.data && input.connected);
        // A pull takes what it wants, and what a datagram loses does not come.
        let is_counted = link.keep != Keep::Pull && !link.transport.starts_with(UDP);
        let is_taking = is_counted && !link.paused && status.state == RunState::Active;
        let Some(input) = input.filter(|_| is_taking) else {
            self.bases.remove(&key);
            return true;
        };
        let now = DeliveredCount { sent: link.sent, handed_over: input.received + input.dropped };
        let base = *self.bases.entry(key.clone()).or_insert(now);
        if now.sent < base.sent || now.handed_over < base.handed_over {
            // One of them has been restarted.
            self.bases.remove(&key);
            return true;
        }
        now.sent - base.sent <= now.handed_over - base.handed_over
    }
}

/// A number that changes whenever a component does something.
fn count_work(statuses: &BTreeMap<String, Status>) -> u64 {
    let of_status = |status: &Status| {
        let published: u64 = status.outputs.iter().map(|output| output.published).sum();
        let received: u64 = status.inputs.iter().map(|input| input.received).sum();
        status.exec_calls.wrapping_add(published).wrapping_add(received)
    };
    statuses.values().map(of_status).fold(0, u64::wrapping_add)
}
