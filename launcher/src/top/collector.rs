//! Observes a running system and makes snapshots of it. Follows the system when it ends and is started
//! again, also at another address.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_inspect::run_control::{AbsentComponent, RunRequest};
use armor_inspect::{CONFIGD, CONFIGURATION, MissionWatch, ObservedSystem};
use armor_sdk::control::Status;
use armor_socket::host_name;
use armor_wire::registry::ComponentEntry;

use super::known_rows::KnownRows;
use super::launcher_link::LauncherLink;
use super::poller::{PolledSystem, StatusPoller};
use super::process_usage::{ProcessUsage, UsageTable};
use super::rates::RateTable;
use super::snapshot::{MissionLine, ProcessRow, TopSnapshot};
use crate::arguments::RunningSystem;
use crate::inspect_cli::select_system;
use crate::system;

/// Time after which a system whose registry does not answer is looked for at another address.
const LOOK_ELSEWHERE_AFTER: Duration = Duration::from_secs(2);

/// What observes a system.
pub struct Collector {
    running: RunningSystem,
    registry: String,
    name: String,
    observed: ObservedSystem,
    poller: StatusPoller,
    mission: MissionWatch,
    launcher: LauncherLink,
    usage: UsageTable,
    rates: RateTable,
    known_rows: KnownRows,
    lost_since: Option<Instant>,
}

impl Collector {
    /// Begins to observe the selected system.
    ///
    /// # Errors
    /// If no system is found, its registry does not answer, or no thread can be started.
    pub fn begin(running: &RunningSystem) -> Result<Self> {
        // The registry answers now, or the reason is reported.
        select_system(running, "top")?.list()?;
        let registry = system::find_registry(running)?.to_string();
        Self::watch_registry(running.clone(), registry)
    }

    fn watch_registry(running: RunningSystem, registry: String) -> Result<Self> {
        let no_thread = "starting a thread for the observation";
        let observed = ObservedSystem::at(&registry, "top");
        let poller = StatusPoller::begin(observed.clone()).context(no_thread)?;
        let mission =
            MissionWatch::begin(observed.directory(), Arc::new(|| {})).context(no_thread)?;
        let launcher = LauncherLink::begin(&running).context(no_thread)?;
        let record = system::find_record(&running).ok();
        let name = record.map_or_else(|| registry.clone(), |record| record.system);
        Ok(Self {
            running,
            registry,
            name,
            observed,
            poller,
            mission,
            launcher,
            usage: UsageTable::default(),
            rates: RateTable::default(),
            known_rows: KnownRows::default(),
            lost_since: None,
        })
    }

    /// Sends a request to the launcher.
    pub fn send(&self, request: RunRequest) {
        self.launcher.send(request);
    }

    /// Returns the results of requests since the last call.
    pub fn take_results(&self) -> Vec<String> {
        self.launcher.take_results()
    }

    /// Returns the present state.
    pub fn look(&mut self) -> TopSnapshot {
        let polled = self.poller.polled();
        if self.follow_elsewhere(&polled) {
            return TopSnapshot { system: self.name.clone(), ..TopSnapshot::default() };
        }
        let is_found = polled.is_found.unwrap_or(false);
        let own_host = host_name();
        let mut components = Vec::new();
        // Without its registry the system has probably ended; what is left of it is not known.
        let entries = if is_found { polled.entries.as_slice() } else { &[] };
        for entry in entries.iter().filter(|entry| !is_second_name(entry, entries)) {
            components.push(self.describe_process(entry, &own_host, &polled));
        }
        let absent = self.launcher.absent();
        let is_shown =
            |it: &&AbsentComponent| components.iter().all(|row| row.name != it.component);
        let without: Vec<_> = absent.iter().filter(is_shown).map(describe_absent).collect();
        components.extend(without);
        // Without its registry the system has probably ended, and the launcher with it.
        let hosts = if is_found { self.launcher.hosts() } else { Vec::new() };
        self.known_rows.mark_cut_off(&mut components, &hosts, Instant::now());
        self.usage.keep(|pid| components.iter().any(|row| row.pid == Some(pid)));
        let is_present = |name: &str, instance: u64| {
            polled.entries.iter().any(|entry| entry.name == name && entry.instance == instance)
        };
        self.rates.keep(is_present);
        TopSnapshot {
            system: self.name.clone(),
            time_s: self.observed.timestamp(),
            is_found,
            components,
            links: if is_found { polled.links } else { Vec::new() },
            hosts,
            mission: self.describe_mission(is_found),
        }
    }

    /// Begins to watch again if the registry does not answer and the system is found elsewhere. Returns
    /// whether it did.
    fn follow_elsewhere(&mut self, polled: &PolledSystem) -> bool {
        if polled.is_found != Some(false) {
            self.lost_since = None;
            return false;
        }
        let since = *self.lost_since.get_or_insert_with(Instant::now);
        if since.elapsed() < LOOK_ELSEWHERE_AFTER {
            return false;
        }
        self.lost_since = None;
        let Ok(registry) = system::find_registry(&self.running) else { return false };
        let registry = registry.to_string();
        if registry == self.registry {
            return false;
        }
        match Self::watch_registry(self.running.clone(), registry) {
            Ok(next) => {
                *self = next;
                true
            }
            Err(_) => false,
        }
    }

    fn describe_process(
        &mut self,
        entry: &ComponentEntry,
        own_host: &str,
        polled: &PolledSystem,
    ) -> ProcessRow {
        let name = &entry.name;
        let usage = match entry.host == own_host {
            true => self.usage.look(entry.pid),
            false => ProcessUsage::default(),
        };
        let answer = polled.answers.get(&(name.clone(), entry.instance));
        let status = answer.and_then(|answer| answer.as_ref().ok());
        let rates = status.and_then(|status| self.rates.update(entry.instance, status));
        let is_into = |to: &str| to.split('.').next() == Some(name);
        let links = polled.links.iter().filter(|link| is_into(&link.to));
        let (state, problem) = describe_state(entry, answer);
        ProcessRow {
            name: name.clone(),
            kind: entry.kind.clone(),
            state,
            host: entry.host.clone(),
            pid: Some(entry.pid),
            cpu_percent: usage.cpu_percent,
            memory_bytes: usage.memory_bytes,
            threads: usage.threads,
            exec_hz: rates.map(|rates| rates.exec_hz),
            output_hz: rates.map(|rates| rates.output_hz),
            output_bytes_per_s: rates.map(|rates| rates.output_bytes_per_s),
            losses: links.map(|link| link.dropped + link.lost).sum(),
            restarts: self.launcher.count_restarts(name, entry.instance),
            problem,
        }
    }

    fn describe_mission(&self, is_found: bool) -> Option<MissionLine> {
        // The marking of a mission that has ended with its system is history.
        if !is_found {
            return None;
        }
        let look = self.mission.look();
        let marking = look.marking.as_ref()?;
        let marked = marking.places.iter().map(|place| match place.tokens {
            1 => place.place.clone(),
            tokens => format!("{} x {tokens}", place.place),
        });
        Some(MissionLine {
            mission: marking.mission.clone(),
            stage: marking.stage.to_string(),
            time_s: look.now_at_s(self.observed.timestamp()),
            marked: marked.collect(),
            paused_by: marking.pause.as_ref().map(|pause| pause.by.clone()).unwrap_or_default(),
        })
    }
}

/// Returns whether this is the name by which configd publishes the state of the file.
fn is_second_name(entry: &ComponentEntry, entries: &[ComponentEntry]) -> bool {
    let configd = entries.iter().find(|entry| entry.name == CONFIGD);
    entry.name == CONFIGURATION
        && configd.is_some_and(|it| (&it.host, it.pid) == (&entry.host, entry.pid))
}

/// Returns the state of a process, and its problem.
fn describe_state(
    entry: &ComponentEntry,
    answer: Option<&Result<Status, String>>,
) -> (String, String) {
    match answer {
        // It serves configuration and no control.
        _ if entry.kind == CONFIGD => ("up".into(), String::new()),
        None => ("unknown".into(), String::new()),
        Some(Ok(status)) => (status.state.to_string(), status.last_error.clone()),
        Some(Err(problem)) => ("suspected".into(), problem.clone()),
    }
}

fn describe_absent(absent: &AbsentComponent) -> ProcessRow {
    ProcessRow {
        name: absent.component.clone(),
        state: absent.state.to_string(),
        host: absent.host.clone().unwrap_or_default(),
        restarts: Some(absent.starts.saturating_sub(1)),
        problem: absent.reason.clone(),
        ..ProcessRow::default()
    }
}
