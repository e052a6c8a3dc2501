//! Observes a running system and makes snapshots of it. Follows the system when it ends and is started
//! again, also at another address.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_inspect::run_control::{AbsentComponent, RunRequest};
use armor_inspect::{
    CONFIGD, MissionWatch, ObservedProcess, SystemPicture, SystemWatch, WakeCallback,
};
use armor_socket::host_name;

use super::launcher_link::LauncherLink;
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
    watch: SystemWatch,
    mission: MissionWatch,
    launcher: LauncherLink,
    usage: UsageTable,
    rates: RateTable,
    /// How many times the registry had been found when the watch began to show this run.
    found_count: u32,
    lost_since: Option<Instant>,
}

fn no_wakeups() -> WakeCallback {
    Arc::new(|| {})
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
        let watch = SystemWatch::begin(&registry, "top", no_wakeups()).context(no_thread)?;
        let mission = MissionWatch::begin(watch.directory(), no_wakeups()).context(no_thread)?;
        let launcher = LauncherLink::begin(&running).context(no_thread)?;
        let record = system::find_record(&running).ok();
        let name = record.map_or_else(|| registry.clone(), |record| record.system);
        Ok(Self {
            running,
            registry,
            name,
            watch,
            mission,
            launcher,
            usage: UsageTable::default(),
            rates: RateTable::default(),
            found_count: 0,
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
        let picture = self.watch.picture();
        if self.follow(&picture) {
            return TopSnapshot { system: self.name.clone(), ..TopSnapshot::default() };
        }
        let absent = self.launcher.absent();
        let own_host = host_name();
        let mut components = Vec::new();
        for (name, process) in &picture.processes {
            if picture.is_second_name(name)
                || (process.condition.is_gone() && is_listed(&absent, name))
            {
                continue;
            }
            components.push(self.describe_process(name, process, &own_host, &picture));
        }
        let is_shown =
            |it: &&AbsentComponent| components.iter().all(|row| row.name != it.component);
        let without: Vec<_> = absent.iter().filter(is_shown).map(describe_absent).collect();
        components.extend(without);
        self.usage.keep(|pid| components.iter().any(|row| row.pid == Some(pid)));
        self.rates.keep(|name, instance| {
            picture.processes.get(name).is_some_and(|it| it.entry.instance == instance)
        });
        TopSnapshot {
            system: self.name.clone(),
            time_s: self.watch.timestamp(),
            is_found: picture.is_found,
            components,
            links: picture.links.clone(),
            mission: self.describe_mission(&picture),
        }
    }

    /// Begins to watch again if another run has the address, or the system is found elsewhere. Returns
    /// whether it did.
    fn follow(&mut self, picture: &SystemPicture) -> bool {
        if self.found_count == 0 {
            self.found_count = picture.found_count;
        }
        let is_other = picture.found_count > self.found_count && self.found_count > 0;
        if picture.is_found {
            self.lost_since = None;
        } else {
            self.lost_since.get_or_insert_with(Instant::now);
        }
        let is_lost = self.lost_since.is_some_and(|since| since.elapsed() > LOOK_ELSEWHERE_AFTER);
        if !is_other && !is_lost {
            return false;
        }
        self.lost_since = None;
        let Ok(registry) = system::find_registry(&self.running) else { return false };
        let registry = registry.to_string();
        if !is_other && registry == self.registry {
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
        name: &str,
        process: &ObservedProcess,
        own_host: &str,
        picture: &SystemPicture,
    ) -> ProcessRow {
        let entry = &process.entry;
        let is_gone = process.condition.is_gone();
        let usage = match is_gone || entry.host != own_host {
            true => ProcessUsage::default(),
            false => self.usage.look(entry.pid),
        };
        let status = process.status.as_ref().filter(|_| !is_gone);
        let rates = status.and_then(|status| self.rates.update(entry.instance, status));
        let is_into = |to: &str| to.split('.').next() == Some(name);
        let links = picture.links.iter().filter(|link| is_into(&link.to));
        let own_error = status.map(|status| status.last_error.clone()).unwrap_or_default();
        ProcessRow {
            name: name.to_owned(),
            kind: entry.kind.clone(),
            // configd serves configuration and no control.
            state: match entry.kind == CONFIGD && !is_gone {
                true => "up".into(),
                false => process.condition.word().into(),
            },
            host: entry.host.clone(),
            pid: (!is_gone).then_some(entry.pid),
            cpu_percent: usage.cpu_percent,
            memory_bytes: usage.memory_bytes,
            threads: usage.threads,
            exec_hz: rates.map(|rates| rates.exec_hz),
            output_hz: rates.map(|rates| rates.output_hz),
            output_bytes_per_s: rates.map(|rates| rates.output_bytes_per_s),
            losses: links.map(|link| link.dropped + link.lost).sum(),
            restarts: self.launcher.count_restarts(name, entry.instance),
            problem: if process.problem.is_empty() { own_error } else { process.problem.clone() },
        }
    }

    fn describe_mission(&self, picture: &SystemPicture) -> Option<MissionLine> {
        // The marking of a mission that has ended with its system is history.
        if !picture.is_found {
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
            time_s: look.now_at_s(self.watch.timestamp()),
            marked: marked.collect(),
            paused_by: marking.pause.as_ref().map(|pause| pause.by.clone()).unwrap_or_default(),
        })
    }
}

fn is_listed(absent: &[AbsentComponent], name: &str) -> bool {
    absent.iter().any(|absent| absent.component == name)
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
