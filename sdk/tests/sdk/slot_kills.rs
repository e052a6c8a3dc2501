//! A publisher and its subscribers are killed (SIGKILL) at every step of the slot protocol: no message
//! is torn, old or lost for the others, no memory stays, and the links come back.
//!
//! `ARMOR_FULL=1` kills a thousand times.

use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::fs::MetadataExt;
use std::os::unix::process::ExitStatusExt;
use std::time::{Duration, Instant};

use armor_memory::step::{KILL_VARIABLE, ProtocolStep};
use armor_sdk::prelude::*;
use rustix::process::Signal;

use crate::bench_system::{DEADLINE, System};
use crate::role_process::RoleProcess;

/// Messages after which a subscriber takes an output for one that flows.
const FLOWS_AFTER: u64 = 10;
/// What the subscriber of the newest takes for each message, so that entries are replaced.
const SLOW: Duration = Duration::from_millis(3);
/// Words between those that are compared: a page of memory has several.
const STRIDE: usize = 127;
/// The subscribers: one that must get everything, and a slow one of the newest.
const READERS: [(&str, &str); 2] =
    [("every", ",keep=all,patience=10s,history=4"), ("newest", ",keep=latest")];

/// A message that is full of its number.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(view)]
struct FullBlob {
    /// The process that has published it.
    pid: u64,
    words: Array<u64>,
}

pub struct FullPublisher {
    armor: Armor,
    next: u64,
}

impl Component for FullPublisher {
    const KIND: &'static str = "full-publisher";
    const SUMMARY: &'static str = "Publishes messages that are full of their number.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<FullBlob>("data")?;
        Ok(Self { armor, next: 0 })
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.next += 1;
        // They grow again and again, so that slots are added and removed.
        let len = 3_000 + 1_000 * (self.next as usize % 16);
        let words = vec![self.next; len].into();
        self.armor.send_data("data", &FullBlob { pid: std::process::id().into(), words })?;
        Ok(Outcome::CarryOn)
    }
}

/// Prints `flows PID` when it has had some messages of a publisher, and `bad REASON`.
pub struct FullReader {
    /// It must get every message; otherwise it is slow.
    takes_all: bool,
    publishers: Vec<u64>,
    received: u64,
    last: u64,
}

impl FullReader {
    fn find_fault(&mut self, header: &Header<'_>, pid: u64, number: u64) -> Option<String> {
        if self.publishers.last() != Some(&pid) {
            let is_back = self.publishers.contains(&pid);
            self.publishers.push(pid);
            (self.received, self.last) = (0, 0);
            if is_back {
                return Some(format!("{pid} was succeeded by another process already"));
            }
        } else if number <= self.last {
            return Some(format!("{number} after {}", self.last));
        } else if self.takes_all && number != self.last + 1 {
            return Some(format!("{number} after {}, {} are lost", self.last, header.lost));
        }
        None
    }
}

impl Component for FullReader {
    const KIND: &'static str = "full-reader";
    const SUMMARY: &'static str = "Looks for messages that are not whole or not new.";
    const PARAMETERS: &'static [Parameter] = &[Parameter::flag("takes_all")];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<FullBlob>("data")?;
        armor.get_parameter("takes_all")?;
        armor.synchronize()?;
        Ok(Self { takes_all: false, publishers: Vec::new(), received: 0, last: 0 })
    }

    fn parameter_received(&mut self, _: &str, value: &Value) -> Result<(), Fault> {
        self.takes_all = value.flag()?;
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let FullBlobView { pid, words } = data.view::<FullBlob>()?;
        let number = words.get(0).ok_or("no words")?;
        let is_whole = || {
            let mut places = (0..words.len()).step_by(STRIDE).chain([words.len() - 1]);
            places.all(|place| words.get(place) == Some(number))
        };
        let was_whole = is_whole();
        if let Some(fault) = self.find_fault(header, pid, number) {
            println!("bad {fault}");
        }
        (self.received, self.last) = (self.received + 1, number);
        if self.received == FLOWS_AFTER {
            println!("flows {pid}");
        }
        if !self.takes_all {
            std::thread::sleep(SLOW);
        }
        if !was_whole || !is_whole() {
            println!("bad {number} of {pid} is torn");
        }
        Ok(())
    }
}

fn start_publisher(system: &System, kill_at: Option<&str>) -> RoleProcess {
    let kill_at = kill_at.map(|order| (KILL_VARIABLE, order));
    RoleProcess::start(system, "full-publisher", "publisher", &["--rate", "1000Hz"], kill_at)
}

fn start_reader(system: &System, reader: usize, kill_at: Option<&str>) -> RoleProcess {
    let (name, how) = READERS[reader];
    let link = format!("data={}.data{how}", system.name("publisher"));
    let more = ["--link", &link, "--set", &format!("takes_all={}", reader == 0)];
    let kill_at = kill_at.map(|order| (KILL_VARIABLE, order));
    RoleProcess::start(system, "full-reader", name, &more, kill_at)
}

/// What the test does with the processes.
impl RoleProcess {
    /// Waits until data of a publisher flow; returns the time since that one or this one was started,
    /// whichever was later.
    fn wait_for_flow(&self, publisher: &Self, what: &str) -> Duration {
        let wanted = format!("flows {}", publisher.child.id());
        loop {
            let line = self.lines.recv_timeout(DEADLINE);
            let line = line.unwrap_or_else(|_| panic!("{what}: no data of the new process"));
            assert!(!line.starts_with("bad"), "{what}: {line}");
            if line == wanted {
                return self.started.max(publisher.started).elapsed();
            }
        }
    }

    /// Waits until it has been killed at its step.
    fn wait_for_death(mut self, what: &str) {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(start.elapsed() < DEADLINE, "{what}: it never comes to this step");
            std::thread::sleep(Duration::from_millis(1));
        };
        assert_eq!(status.signal(), Some(Signal::KILL.as_raw()), "{what}: {status}");
        let bad = self.lines.try_iter().find(|line| line.starts_with("bad"));
        assert_eq!(bad, None, "{what}, before its death");
    }

    /// The slots that it has open or mapped, by their inodes.
    fn list_slots(&self) -> BTreeSet<u64> {
        let process = format!("/proc/{}", self.child.id());
        let maps = std::fs::read_to_string(format!("{process}/maps")).unwrap();
        let mapped = maps.lines().filter(|line| line.contains("/memfd:armor-slot"));
        let mut slots: BTreeSet<u64> =
            mapped.filter_map(|line| line.split_whitespace().nth(4)?.parse().ok()).collect();
        for entry in std::fs::read_dir(format!("{process}/fd")).unwrap().flatten() {
            let target = std::fs::read_link(entry.path()).unwrap_or_default();
            if target.to_string_lossy().contains("/memfd:armor-slot") {
                slots.extend(std::fs::metadata(entry.path()).map(|file| file.ino()));
            }
        }
        slots
    }

    /// The files that it, and not this process, has open or mapped in the folders where other programs
    /// leave shared memory.
    fn list_named_memory(&self) -> Vec<String> {
        let inherited = list_temporary_files("self");
        let own = list_temporary_files(&self.child.id().to_string());
        own.difference(&inherited).cloned().collect()
    }
}

/// The files in `/dev/shm` and `/tmp` that a process has open or mapped.
fn list_temporary_files(pid: &str) -> BTreeSet<String> {
    let maps = std::fs::read_to_string(format!("/proc/{pid}/maps")).unwrap();
    let mapped = maps.lines().filter_map(|line| line.split_whitespace().nth(5).map(str::to_owned));
    let files = std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap().flatten();
    let open = files
        .filter_map(|entry| Some(std::fs::read_link(entry.path()).ok()?.display().to_string()));
    let is_temporary = |name: &String| name.starts_with("/dev/shm/") || name.starts_with("/tmp/");
    mapped.chain(open).filter(is_temporary).collect()
}

/// The healthy processes, and how long links took to come back.
struct Trial {
    system: System,
    publisher: RoleProcess,
    readers: Vec<RoleProcess>,
    back: Vec<Duration>,
}

impl Trial {
    fn begin() -> Self {
        let system = System::start();
        let publisher = start_publisher(&system, None);
        let readers = [0, 1].map(|reader| start_reader(&system, reader, None));
        let trial = Self { system, publisher, readers: readers.into(), back: Vec::new() };
        for reader in &trial.readers {
            reader.wait_for_flow(&trial.publisher, "the start");
        }
        trial
    }

    /// A process in the role of a healthy one, which it replaces, dies at its step; a healthy one
    /// follows it.
    fn kill_at(&mut self, step: ProtocolStep, pass: usize, reader: usize) {
        let order = format!("{} {pass}", step.name());
        if step.is_of_publisher() {
            // The old process must be gone before the new one takes its name.
            let _ = self.publisher.child.kill();
            let _ = self.publisher.child.wait();
            start_publisher(&self.system, Some(&order)).wait_for_death(&order);
            self.publisher = start_publisher(&self.system, None);
        } else {
            drop(self.readers.remove(reader));
            start_reader(&self.system, reader, Some(&order)).wait_for_death(&order);
            self.readers.insert(reader, start_reader(&self.system, reader, None));
        }
        for (index, it) in self.readers.iter().enumerate() {
            if step.is_of_publisher() || index == reader {
                self.back.push(it.wait_for_flow(&self.publisher, &order));
            }
            let bad = it.lines.try_iter().find(|line| line.starts_with("bad"));
            assert_eq!(bad, None, "{order}");
        }
    }

    /// Waits until the subscribers have no slot but those that the publisher has now, and that is not
    /// more than they may hold.
    fn check_memory(&self, what: &str) {
        let start = Instant::now();
        loop {
            // Those of the publisher are read before and after, since it adds and removes some.
            let mut known = self.publisher.list_slots();
            let mapped = self.readers.iter().flat_map(RoleProcess::list_slots);
            let mapped: BTreeSet<_> = mapped.collect();
            known.extend(self.publisher.list_slots());
            if mapped.is_subset(&known) && known.len() <= MOST_SLOTS {
                break;
            }
            assert!(start.elapsed() < DEADLINE, "{what}: {mapped:?} are mapped, of {known:?}");
            std::thread::sleep(Duration::from_millis(10));
        }
        for process in self.readers.iter().chain([&self.publisher]) {
            assert_eq!(process.list_named_memory(), [""; 0], "{what}");
        }
    }
}

/// Slots for the link that keeps all, with 8 cells and a history of 4, and for the other one; two of
/// the publisher's own, and what it removes between two looks.
const MOST_SLOTS: usize = (8 + 3 + 7 + 4 + 1) + (1 + 3 + 1) + 2 + 4;

/// How many passes of a step a process makes at least.
fn count_passes(step: ProtocolStep) -> usize {
    match step {
        ProtocolStep::PageMapped => 1,
        ProtocolStep::PageCreated | ProtocolStep::PageOffered => READERS.len(),
        ProtocolStep::SlotCreated
        | ProtocolStep::SlotOffered
        | ProtocolStep::SlotRemoved
        | ProtocolStep::SlotMapped => 2,
        _ => 40,
    }
}

// A release build has no steps at which it can be killed.
#[cfg(debug_assertions)]
#[test]
fn a_process_that_is_killed_at_any_step_of_the_slot_protocol_harms_no_other_one() {
    let rounds = if std::env::var_os("ARMOR_FULL").is_some() {
        1_000_usize.div_ceil(ProtocolStep::ALL.len())
    } else {
        1
    };
    let mut trial = Trial::begin();
    let mut kills = BTreeMap::<&str, usize>::new();
    for round in 0..rounds {
        for (number, step) in ProtocolStep::ALL.iter().enumerate() {
            // Another pass each time, and each reader in turn.
            let pass = 1 + (7 * round + 3 * number) % count_passes(*step);
            trial.kill_at(*step, pass, (round + number) % READERS.len());
            *kills.entry(step.name()).or_default() += 1;
        }
        trial.check_memory(&format!("round {round}"));
    }
    trial.back.sort_unstable();
    let at = |share: f64| trial.back[((trial.back.len() - 1) as f64 * share).round() as usize];
    println!(
        "{} kills at {} steps; from the start of the next process to data, p50 {:?}, p99 {:?}, longest {:?}",
        kills.values().sum::<usize>(),
        kills.len(),
        at(0.5),
        at(0.99),
        at(1.0)
    );
    assert_eq!(kills.len(), ProtocolStep::ALL.len());
}
