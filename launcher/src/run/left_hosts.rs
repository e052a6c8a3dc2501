//! Hosts that have components of an earlier run, and that the file names no longer: their agents are
//! asked to end these. A file in the folder of the run names all hosts that may have some.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_keys::HostKeys;
use armor_keys::connect::{GateClient, GateError};
use armor_socket::random_id;
use armor_wire::backoff::Backoff;
use armor_wire::hello::RefusalCode;
use armor_wire::remote_process::{
    CutOff, HostAddress, ProcessResources, RemoteEvent, RemoteStart, Takeover,
};
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;
use tokio::time::sleep;

use super::logs::RunLog;
use super::plan::LAUNCHER;
use super::supervisor::LogLevel;

/// The file, in the folder of a run.
const FILE: &str = "hosts.json";
/// Wait after the first failed attempt to reach an agent.
const FIRST_DELAY: Duration = Duration::from_millis(200);
/// Longest wait between two attempts.
const MOST_DELAY: Duration = Duration::from_secs(5);

/// The record of the hosts of a system.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct HostRecord {
    /// The system, by whose name the agents know it.
    system: String,
    hosts: Vec<RecordedHost>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecordedHost {
    host: String,
    addresses: Vec<String>,
}

/// The hosts of earlier runs that this one does not have.
#[derive(Debug)]
pub struct LeftHosts {
    left: Vec<HostAddress>,
    record: SharedRecord,
}

/// The record on the disk, from which each host is removed that has nothing any more.
#[derive(Clone, Debug)]
struct SharedRecord {
    path: PathBuf,
    record: Arc<Mutex<HostRecord>>,
}

impl LeftHosts {
    /// Reads what earlier runs of `system` in the folder have recorded, and records the hosts of this
    /// one, too.
    ///
    /// # Errors
    /// If the record cannot be written.
    pub fn find(folder: &Path, system: &str, hosts: &[HostAddress]) -> Result<Self> {
        let path = folder.join(FILE);
        // A record that is damaged names none.
        let earlier = fs::read(&path).ok().and_then(|text| serde_json::from_slice(&text).ok());
        let (record, left) = divide_hosts(earlier, system, hosts);
        let record = SharedRecord { path, record: Arc::new(Mutex::new(record)) };
        record.save().context("the hosts of this run cannot be recorded")?;
        Ok(Self { left, record })
    }

    /// Asks their agents, in the background, until each has answered. Must be called in a runtime.
    pub fn release(self, read_keys: impl Fn() -> Result<HostKeys>, log: &RunLog) {
        for host in self.left {
            let name = host.host.clone();
            let keys = match read_keys() {
                Ok(keys) => keys,
                Err(why) => {
                    let text = format!(
                        "{name} may still run components of an earlier run, and cannot be asked to \
                         end them: {why:#}; give --keys"
                    );
                    log.report(LAUNCHER, LogLevel::Warn, text);
                    continue;
                }
            };
            let gate = GateClient::of_host(&host, keys);
            let start = ask_to_end(&self.record.record.lock().system);
            let (record, log) = (self.record.clone(), log.clone());
            tokio::spawn(async move {
                release_host(&name, &gate, &start, &log).await;
                if let Err(error) = record.remove(&name) {
                    log.report(LAUNCHER, LogLevel::Warn, format!("{error:#}"));
                }
            });
        }
    }
}

impl SharedRecord {
    fn remove(&self, host: &str) -> Result<()> {
        self.record.lock().hosts.retain(|recorded| recorded.host != host);
        self.save()
    }

    fn save(&self) -> Result<()> {
        let record = self.record.lock();
        if record.hosts.is_empty() {
            // Without other hosts there is no record.
            let _ = fs::remove_file(&self.path);
            return Ok(());
        }
        let text = serde_json::to_vec_pretty(&*record)?;
        Ok(armor_files::save_private_file(&self.path, &text)?)
    }
}

/// Returns the new record, and the hosts of the earlier one that are not among `hosts`.
fn divide_hosts(
    earlier: Option<HostRecord>,
    system: &str,
    hosts: &[HostAddress],
) -> (HostRecord, Vec<HostAddress>) {
    let earlier = earlier.filter(|record| record.system == system).unwrap_or_default();
    let is_left = |recorded: &RecordedHost| !hosts.iter().any(|it| it.host == recorded.host);
    let left: Vec<_> = earlier.hosts.into_iter().filter(is_left).collect();
    let now = hosts.iter().cloned();
    let now = now.map(|HostAddress { host, addresses }| RecordedHost { host, addresses });
    let record = HostRecord { system: system.into(), hosts: now.chain(left.clone()).collect() };
    let left = left.into_iter();
    let left = left.map(|RecordedHost { host, addresses }| HostAddress { host, addresses });
    (record, left.collect())
}

/// Returns when the host has nothing of the system any more, or when its agent refuses to answer.
async fn release_host(name: &str, gate: &GateClient, start: &RemoteStart, log: &RunLog) {
    let mut backoff = Backoff::new(FIRST_DELAY, MOST_DELAY, random_id());
    let mut last = None;
    loop {
        let why = match ask_agent(gate, start).await {
            Ok(()) => {
                let text =
                    format!("{name} is not in the file any more; it runs nothing of this system");
                return log.report(LAUNCHER, LogLevel::Info, text);
            }
            Err(GateError::Refused(refusal)) if refusal.code != RefusalCode::Limit => {
                let text = format!(
                    "{name} is not in the file any more, and its agent refuses to end what an \
                     earlier run has left there: {}",
                    refusal.text
                );
                return log.report(LAUNCHER, LogLevel::Warn, text);
            }
            Err(error) => error.to_string(),
        };
        // Each reason once.
        if last.as_ref() != Some(&why) {
            let text = format!(
                "{name} is not in the file any more, and may still run components of an earlier \
                 run; it is asked to end them as soon as it can be reached: {why}"
            );
            log.report(LAUNCHER, LogLevel::Warn, text);
            last = Some(why);
        }
        sleep(backoff.delay()).await;
    }
}

async fn ask_agent(gate: &GateClient, start: &RemoteStart) -> Result<(), GateError> {
    let connection = gate.run(start.clone(), None).await?;
    // Without orders; the sender stays until the end.
    let (_sender, mut orders) = mpsc::channel(1);
    let ended = connection
        .follow(&mut orders, |event| matches!(event, RemoteEvent::Ended { .. }).then_some(()));
    ended.await.map_err(|reason| GateError::Unreachable { gate: "of the agent".into(), reason })
}

fn ask_to_end(system: &str) -> RemoteStart {
    RemoteStart {
        system: system.to_owned(),
        run: random_id(),
        component: String::new(),
        kind: String::new(),
        components: Vec::new(),
        manifest: 0,
        build: String::new(),
        executable_len: 0,
        variables: Vec::new(),
        settings: Vec::new(),
        resources: ProcessResources::default(),
        cut_off: CutOff::default(),
        is_commanded: false,
        hosts: Vec::new(),
        gate_port: 0,
        takeover: Takeover::End,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hosts(names: &[&str]) -> Vec<HostAddress> {
        let host = |name: &&str| HostAddress {
            host: (*name).into(),
            addresses: vec![format!("{name}.local:7410")],
        };
        names.iter().map(host).collect()
    }

    #[test]
    fn hosts_that_a_run_does_not_have_are_recorded_until_they_have_answered() {
        let folder = std::env::temp_dir().join(format!("armor-left-hosts-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        let check = |system: &str, now: &[&str], left: &[&str]| {
            let found = LeftHosts::find(&folder, system, &hosts(now)).expect("it is written");
            assert_eq!(found.left, hosts(left), "{system} {now:?}");
            found
        };
        check("rover", &["arm", "base"], &[]);
        check("rover", &["arm"], &["base"]);
        // It has not answered meanwhile.
        let found = check("rover", &["arm"], &["base"]);
        found.record.remove("base").expect("it is written");
        let found = check("rover", &[], &["arm"]);
        found.record.remove("arm").expect("it is written");
        assert!(!folder.join(FILE).exists());
        check("rover", &["arm"], &[]);
        // Agents know the other system by another name.
        check("other", &[], &[]);
        fs::write(folder.join(FILE), "{").expect("it is written");
        check("rover", &["arm"], &[]);
        let _ = fs::remove_dir_all(&folder);
    }
}
