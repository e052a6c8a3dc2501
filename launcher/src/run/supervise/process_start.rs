//! The start of a process, here or on another host, and what observes it from then on: the tasks that
//! wait for its end, and those that watch the registry and the gate.

use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use armor_sdk::directory::Directory;
use armor_wire::remote_process::Takeover;
use tokio::time::{Instant, sleep};

use super::launcher_input::LauncherInput;
use super::running_process::{ProcessHandle, RunningProcess};
use super::{LOOK_EVERY, Launcher};
use crate::run::own_run::name_start;
use crate::run::plan::{LAUNCHER, PlannedStart};
use crate::run::process::ChildProcess;
use crate::run::remote::{RemoteNotice, RemotePlan, RemoteProcess};
use crate::run::supervisor::{ChildId, ChildRole, SupervisorEvent};

/// How long a gate may take from its start to its first answer.
const GATE_STARTS_WITHIN: Duration = Duration::from_secs(10);
/// Period with which a gate that has not answered yet is asked: one that has answered once, and hangs,
/// is noticed earlier.
const LOOK_AT_STARTING_GATE: Duration = Duration::from_millis(50);
/// Longest wait for the last lines of a process that ended. They are in its pipes already; only a
/// process that has left its group can keep the pipes open for longer.
const LAST_LINES_WITHIN: Duration = Duration::from_secs(1);

impl Launcher {
    pub(super) fn spawn_child(&mut self, id: ChildId) {
        let is_first = !std::mem::replace(&mut self.was_started[id], true);
        if !is_first {
            self.restarts.fetch_add(1, Ordering::Relaxed);
        }
        // What a resumed run continues was started before.
        let of_run = name_start(is_first && !self.resumes);
        let start = match &self.plan.starts[id] {
            PlannedStart::Here(start) => start,
            PlannedStart::Remote(plan) => {
                let takeover =
                    if is_first && self.resumes { Takeover::Any } else { Takeover::Never };
                let process = self.start_remote(id, plan, (takeover, of_run));
                self.given_up.remove_component(&self.plan.duties[id].name);
                let process = ProcessHandle::There(process);
                self.running[id] = Some(RunningProcess { process, link: None });
                return;
            }
        };
        match ChildProcess::start(start, of_run, self.control_group.as_ref(), &self.log) {
            Ok(mut process) => {
                let group = process.group();
                self.given_up.remove_component(&self.plan.duties[id].name);
                if let Some(pipe) = process.take_reports() {
                    self.given_up.connect_executive(pipe);
                }
                self.group_killers.add_group(group);
                let handle = ProcessHandle::Here(group);
                self.running[id] = Some(RunningProcess { process: handle, link: None });
                let inputs = self.inputs.clone();
                tokio::spawn(async move {
                    let (exit, readers) = process.wait().await;
                    // Its last lines come before the report of its end.
                    let last = async {
                        for reader in readers {
                            let _ = reader.await;
                        }
                    };
                    let _ = tokio::time::timeout(LAST_LINES_WITHIN, last).await;
                    let _ = inputs.send(LauncherInput::Exited(id, exit)).await;
                });
                if self.plan.duties[id].role == ChildRole::Gate && !self.watches_gate {
                    self.watches_gate = true;
                    self.watch_gate();
                }
                if self.plan.duties[id].role == ChildRole::Registry && self.directory.is_none() {
                    self.watch_registry();
                }
            }
            Err(error) => {
                self.failed.push_back(SupervisorEvent::SpawnFailed(id, format!("{error:#}")));
            }
        }
    }

    fn start_remote(&self, id: ChildId, plan: &RemotePlan, how: (Takeover, &str)) -> RemoteProcess {
        let (inputs, number) = (self.inputs.clone(), Arc::new(OnceLock::new()));
        let known = Arc::clone(&number);
        let process = RemoteProcess::begin(plan, how, &self.log, move |notice| {
            let number = known.get().copied().unwrap_or_default();
            let input = match notice {
                RemoteNotice::CutOff => LauncherInput::CutOff(id, number),
                RemoteNotice::Ended(exit) => {
                    let inputs = inputs.clone();
                    // Must not be lost, and this is called within a task.
                    tokio::spawn(async move {
                        let ended = LauncherInput::EndedThere(id, number, exit);
                        let _ = inputs.send(ended).await;
                    });
                    return;
                }
            };
            let _ = inputs.try_send(input);
        });
        let _ = number.set(process.id);
        process
    }

    /// Watches the gate, by which components of other hosts are heard: one that hangs would make them
    /// look as if they did. Without other hosts the system runs without it.
    fn watch_gate(&self) {
        let Some(router) = self.plan.router else { return };
        let inputs = self.inputs.clone();
        tokio::spawn(async move {
            let (mut answered, mut since) = (false, Instant::now());
            loop {
                sleep(if answered { LOOK_EVERY } else { LOOK_AT_STARTING_GATE }).await;
                let answers = armor_keys::routes::answers(router).await;
                // One that starts has more time until its first answer.
                let is_news = match answers {
                    true => !answered,
                    false => answered || since.elapsed() >= GATE_STARTS_WITHIN,
                };
                if answers || is_news {
                    (answered, since) = (answers, Instant::now());
                }
                if is_news && inputs.send(LauncherInput::Gate { answers }).await.is_err() {
                    return;
                }
            }
        });
    }

    /// Watches the registry for processes that appear and go.
    fn watch_registry(&mut self) {
        let name = format!("{LAUNCHER}-{}", std::process::id());
        let directory = Directory::observer(&self.plan.registry.to_string(), &name);
        let changes = directory.watch_changes();
        self.directory = Some(directory);
        let inputs = self.inputs.clone();
        tokio::task::spawn_blocking(move || {
            while let Ok(change) = changes.recv() {
                if inputs.blocking_send(LauncherInput::Registry(change)).is_err() {
                    return;
                }
            }
        });
    }
}
