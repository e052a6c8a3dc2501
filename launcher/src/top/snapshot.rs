//! One look at a system: a row per component, its links and its mission.

use std::cmp::Ordering;

use armor_inspect::ObservedLink;
use armor_inspect::run_control::{HostLink, HostReport};
use armor_inspect::words::{format_bytes, format_duration};
use clap::ValueEnum;
use serde::Serialize;

use crate::print::{Table, flatten_text};

/// The state of a row that shows what was known of a component before its host was cut off.
pub const CUT_OFF: &str = HostLink::CutOff.word();

/// What is known about a system now.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TopSnapshot {
    /// Name of the system; its registry, if no run of this user has it.
    pub system: String,
    /// System time in seconds.
    pub time_s: f64,
    /// Whether its registry answers.
    pub is_found: bool,
    pub components: Vec<ProcessRow>,
    pub links: Vec<ObservedLink>,
    /// The other hosts, as the launcher sees them; none if it cannot be asked.
    pub hosts: Vec<HostReport>,
    pub mission: Option<MissionLine>,
}

/// A component or daemon.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ProcessRow {
    pub name: String,
    pub kind: String,
    /// What it does; why it does not run, if it does not; [`CUT_OFF`] if its host is.
    pub state: String,
    pub host: String,
    /// None if its process does not run.
    pub pid: Option<u32>,
    /// Of one processor; none for a process on another host, and at its first look.
    pub cpu_percent: Option<f64>,
    /// Resident memory; none for a process on another host.
    pub memory_bytes: Option<u64>,
    pub threads: Option<u64>,
    /// Calls of `exec` per second.
    pub exec_hz: Option<f64>,
    /// Messages per second on all outputs.
    pub output_hz: Option<f64>,
    /// Their bytes per second; a message without a link is not counted.
    pub output_bytes_per_s: Option<f64>,
    /// Data lost or dropped on the links to its inputs.
    pub losses: u64,
    /// Starts after the first one; none if the launcher does not report it.
    pub restarts: Option<u32>,
    /// Why it does not answer or does not run, and its last error; empty if there is none.
    pub problem: String,
}

/// The mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MissionLine {
    pub mission: String,
    pub stage: String,
    /// Mission time in seconds.
    pub time_s: f64,
    /// The marked places, such as `explore` or `explore x 2`.
    pub marked: Vec<String>,
    /// Who has paused it; empty if it is not paused.
    pub paused_by: String,
}

/// The columns by which components are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SortKey {
    #[default]
    Cpu,
    Memory,
    Threads,
    Exec,
    Output,
    Messages,
    Losses,
    Restarts,
    Name,
    Host,
}

impl SortKey {
    /// All of them, in the order of the columns.
    pub const ALL: [Self; 10] = [
        Self::Name,
        Self::Cpu,
        Self::Memory,
        Self::Threads,
        Self::Exec,
        Self::Messages,
        Self::Output,
        Self::Losses,
        Self::Restarts,
        Self::Host,
    ];

    /// Returns the next column.
    pub fn next(self) -> Self {
        let at = Self::ALL.iter().position(|key| *key == self).unwrap_or(0);
        Self::ALL[(at + 1) % Self::ALL.len()]
    }

    /// Returns the heading of the column.
    pub fn heading(self) -> &'static str {
        match self {
            Self::Name => "NAME",
            Self::Cpu => "CPU %",
            Self::Memory => "MEMORY",
            Self::Threads => "THR",
            Self::Exec => "EXEC/s",
            Self::Messages => "MSG/s",
            Self::Output => "OUTPUT/s",
            Self::Losses => "LOST",
            Self::Restarts => "RST",
            Self::Host => "HOST",
        }
    }

    /// The largest first, but names from A to Z.
    fn compare(self, a: &ProcessRow, b: &ProcessRow) -> Ordering {
        let largest = |of: fn(&ProcessRow) -> Option<f64>| {
            let value = |row| of(row).unwrap_or(f64::NEG_INFINITY);
            value(b).total_cmp(&value(a))
        };
        match self {
            Self::Name => Ordering::Equal,
            Self::Host => a.host.cmp(&b.host),
            Self::Cpu => largest(|row| row.cpu_percent),
            Self::Memory => b.memory_bytes.cmp(&a.memory_bytes),
            Self::Threads => b.threads.cmp(&a.threads),
            Self::Exec => largest(|row| row.exec_hz),
            Self::Messages => largest(|row| row.output_hz),
            Self::Output => largest(|row| row.output_bytes_per_s),
            Self::Losses => b.losses.cmp(&a.losses),
            Self::Restarts => b.restarts.cmp(&a.restarts),
        }
    }
}

impl TopSnapshot {
    /// Sorts the components; equal ones by name.
    pub fn sort_by(&mut self, key: SortKey, is_reversed: bool) {
        self.components.sort_by(|a, b| {
            let order = key.compare(a, b);
            let by_name = a.name.cmp(&b.name);
            match (key, is_reversed) {
                (SortKey::Name, true) => by_name.reverse(),
                (_, true) => order.reverse().then(by_name),
                (_, false) => order.then(by_name),
            }
        });
    }

    /// Returns whether every component that runs has answered often enough for its rates.
    pub fn has_all_rates(&self) -> bool {
        let has_rates = |row: &ProcessRow| {
            row.pid.is_none() || row.exec_hz.is_some() || row.state == "up" || row.state == CUT_OFF
        };
        self.is_found && !self.components.is_empty() && self.components.iter().all(has_rates)
    }

    /// Returns whether components run on several hosts.
    pub fn has_several_hosts(&self) -> bool {
        let mut hosts = self.components.iter().map(|row| &row.host).filter(|host| !host.is_empty());
        let first = hosts.next();
        !self.hosts.is_empty() || hosts.any(|host| Some(host) != first)
    }

    /// Returns a line for each other host.
    pub fn describe_hosts(&self) -> Vec<String> {
        let describe = |report: &HostReport| format!("host {}", flatten_text(&report.describe()));
        self.hosts.iter().map(describe).collect()
    }

    /// Returns the line about the whole system.
    pub fn describe_system(&self) -> String {
        let is_running = |row: &&ProcessRow| row.pid.is_some() && row.state != CUT_OFF;
        let running = self.components.iter().filter(is_running).count();
        let cpu: f64 = self.components.iter().filter_map(|row| row.cpu_percent).sum();
        let memory: u64 = self.components.iter().filter_map(|row| row.memory_bytes).sum();
        let losses: u64 = self.components.iter().map(|row| row.losses).sum();
        let problem = if self.is_found { "" } else { "  its registry does not answer" };
        format!(
            "{}: {running} processes, {} links, cpu {cpu:.1} %, memory {}, lost {losses}{problem}",
            self.system,
            self.links.len(),
            format_bytes(memory as f64)
        )
    }

    /// Returns the line about the mission.
    pub fn describe_mission(&self) -> String {
        let Some(mission) = &self.mission else { return "no mission".into() };
        let MissionLine { mission: name, stage, time_s, marked, paused_by } = mission;
        let marked = if marked.is_empty() { "nothing".into() } else { marked.join(", ") };
        let paused =
            if paused_by.is_empty() { String::new() } else { format!(", paused by {paused_by}") };
        format!("mission {name}: {stage}, {}{paused}; marked: {marked}", format_duration(*time_s))
    }

    /// Returns the whole as text.
    pub fn format(&self, width: Option<usize>) -> String {
        let mut headings: Vec<&str> = SortKey::ALL.iter().map(|key| key.heading()).collect();
        headings.insert(1, "STATE");
        headings.push("PROBLEM");
        let is_spread = self.has_several_hosts();
        let rows = self.components.iter().map(|row| {
            let mut cells = row.format_cells();
            if !is_spread {
                cells[HOST_CELL].clear();
            }
            cells.push(row.problem.clone());
            cells
        });
        let rows = rows.collect();
        let mut table_headings = headings;
        if !is_spread {
            table_headings[HOST_CELL] = "";
        }
        let table = Table::new(&table_headings, rows);
        let table = table.dispensable(&["THR", "RST", "EXEC/s", "OUTPUT/s"]).format(width);
        let mut head = vec![self.describe_system(), self.describe_mission()];
        head.extend(self.describe_hosts());
        format!("{}\n\n{table}", head.join("\n"))
    }
}

/// Where the host is among the cells of a row.
pub const HOST_CELL: usize = 10;

impl ProcessRow {
    /// Returns the cells of its row: name, state, and the columns of [`SortKey::ALL`] after the name.
    pub fn format_cells(&self) -> Vec<String> {
        let rate = |rate: Option<f64>| rate.map_or("-".into(), |rate| format!("{rate:.1}"));
        let bytes = |bytes: Option<f64>| bytes.map_or("-".into(), format_bytes);
        vec![
            self.name.clone(),
            self.state.clone(),
            rate(self.cpu_percent),
            bytes(self.memory_bytes.map(|bytes| bytes as f64)),
            self.threads.map_or("-".into(), |threads| threads.to_string()),
            rate(self.exec_hz),
            rate(self.output_hz),
            bytes(self.output_bytes_per_s),
            self.losses.to_string(),
            self.restarts.map_or("-".into(), |restarts| restarts.to_string()),
            self.host.clone(),
        ]
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A component with such a use of the processor and so many losses.
    pub fn row(name: &str, cpu_percent: f64, losses: u64) -> ProcessRow {
        ProcessRow {
            name: name.into(),
            kind: "probe".into(),
            state: "active".into(),
            host: "robot".into(),
            pid: Some(7),
            cpu_percent: Some(cpu_percent),
            memory_bytes: Some(12_345_678),
            threads: Some(5),
            exec_hz: Some(50.0),
            output_hz: Some(50.0),
            output_bytes_per_s: Some(50_800.0),
            losses,
            restarts: Some(0),
            problem: String::new(),
        }
    }

    /// A host whose link has been so for three seconds.
    pub fn report(host: &str, link: HostLink) -> HostReport {
        HostReport {
            host: host.into(),
            link,
            reason: "it has fallen silent".into(),
            for_s: 3.0,
            clock_offset_s: None,
            clock_error_s: None,
        }
    }

    /// Three components and a mission.
    pub fn snapshot() -> TopSnapshot {
        TopSnapshot {
            system: "probes".into(),
            time_s: 1.0,
            is_found: true,
            components: vec![row("north", 1.5, 0), row("watcher", 20.25, 4), row("arm", 1.5, 9)],
            links: Vec::new(),
            hosts: Vec::new(),
            mission: Some(MissionLine {
                mission: "work".into(),
                stage: "playing".into(),
                time_s: 75.0,
                marked: vec!["working".into()],
                paused_by: String::new(),
            }),
        }
    }

    #[test]
    fn the_largest_is_first_and_equals_are_in_the_order_of_their_names() {
        let sorted = |key, is_reversed| {
            let mut snapshot = snapshot();
            snapshot.sort_by(key, is_reversed);
            snapshot.components.into_iter().map(|row| row.name).collect::<Vec<_>>()
        };
        assert_eq!(sorted(SortKey::Cpu, false), ["watcher", "arm", "north"]);
        assert_eq!(sorted(SortKey::Cpu, true), ["arm", "north", "watcher"]);
        assert_eq!(sorted(SortKey::Losses, false), ["arm", "watcher", "north"]);
        assert_eq!(sorted(SortKey::Name, false), ["arm", "north", "watcher"]);
        assert_eq!(sorted(SortKey::Name, true), ["watcher", "north", "arm"]);
        let mut key = SortKey::Name;
        for _ in SortKey::ALL {
            key = key.next();
        }
        assert_eq!(key, SortKey::Name, "all columns come in turn");
    }

    #[test]
    fn the_text_has_the_system_the_mission_and_a_row_per_component() {
        let mut shown = snapshot();
        let text = shown.format(Some(80));
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines[0], "probes: 3 processes, 0 links, cpu 23.2 %, memory 37.0 MB, lost 13");
        assert_eq!(lines[1], "mission work: playing, 1 min 15 s; marked: working");
        assert!(lines[3].starts_with("NAME") && !lines[3].contains("HOST"), "{text}");
        assert!(lines.iter().all(|line| line.len() <= 80), "{text}");
        shown.components[0].host = "arm".into();
        assert!(shown.format(None).contains("HOST"));
        shown.hosts = vec![report("arm", HostLink::CutOff)];
        shown.components[0].state = CUT_OFF.into();
        let text = shown.format(None);
        assert!(text.contains("\nhost arm: cut off for 3.0 s (it has fallen silent)\n"), "{text}");
        assert!(text.starts_with("probes: 2 processes"), "{text}");
        shown.hosts.clear();
        shown.mission = None;
        assert!(shown.format(None).contains("\nno mission\n"));
    }
}
