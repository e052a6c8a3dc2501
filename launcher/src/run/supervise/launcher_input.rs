//! What threads and tasks send to the loop, and the event of the supervisor that it is.

use std::time::Duration;

use armor_sdk::directory::DirectoryChange;
use armor_wire::control::{Answer, RunState};
use armor_wire::registry::ComponentEntry;
use rustix::process::{Pid, getpgid};

use super::Launcher;
use super::running_process::{ProcessHandle, ProcessId};
use crate::run::component_link::ComponentLink;
use crate::run::descriptors::has_free_descriptor;
use crate::run::plan::LAUNCHER;
use crate::run::process::is_suspended;
use crate::run::supervisor::{ChildExit, ChildId, ChildRole, Duty, LogLevel, SupervisorEvent};

/// What threads and tasks send to the loop.
pub(super) enum LauncherInput {
    Exited(ChildId, ChildExit),
    /// A component of this process sent an answer: its state, if it was one.
    Heard(ChildId, ProcessId, Option<RunState>),
    Stuck(ChildId, ProcessId, Duration),
    /// There is no descriptor left to connect to it.
    Unheard(ChildId),
    /// It is on another host, which is cut off.
    CutOff(ChildId, u64),
    /// Its process on another host has ended.
    EndedThere(ChildId, u64, ChildExit),
    Registry(DirectoryChange),
    /// The gate answers the processes of this host, or does not.
    Gate {
        answers: bool,
    },
}

impl Launcher {
    pub(super) fn convert_input(&mut self, input: LauncherInput) -> Option<SupervisorEvent> {
        match input {
            LauncherInput::Exited(id, exit) => {
                self.hanging_calls.forget_component(&self.plan.duties[id].name);
                if let Some(running) = self.running[id].take()
                    && let ProcessHandle::Here(group) = running.process
                {
                    self.group_killers.remove_group(group);
                }
                Some(SupervisorEvent::Exited(id, exit))
            }
            LauncherInput::EndedThere(id, number, exit) => {
                self.expect_process(id, ProcessId::There(number))?;
                self.hanging_calls.forget_component(&self.plan.duties[id].name);
                self.running[id] = None;
                Some(SupervisorEvent::Exited(id, exit))
            }
            LauncherInput::CutOff(id, number) => {
                self.expect_process(id, ProcessId::There(number))?;
                Some(SupervisorEvent::Unheard(id))
            }
            LauncherInput::Heard(id, process, state) => {
                self.expect_process(id, process)?;
                Some(SupervisorEvent::Heard(id, state))
            }
            LauncherInput::Stuck(id, process, call) => {
                self.expect_process(id, process)?;
                Some(SupervisorEvent::Stuck(id, call))
            }
            LauncherInput::Unheard(id) => {
                self.report_shortage();
                Some(SupervisorEvent::Unheard(id))
            }
            LauncherInput::Gate { answers } => {
                let gate = self.plan.duties.iter().position(|it| it.role == ChildRole::Gate)?;
                if answers { Some(SupervisorEvent::Ready(gate)) } else { self.judge_absence(gate) }
            }
            LauncherInput::Registry(DirectoryChange::RegistryFound) => {
                Some(SupervisorEvent::Ready(self.find_registry()?))
            }
            LauncherInput::Registry(DirectoryChange::RegistryLost) => {
                self.judge_absence(self.find_registry()?)
            }
            LauncherInput::Registry(DirectoryChange::Appeared(entry)) => {
                self.handle_appearance(entry)
            }
            LauncherInput::Registry(DirectoryChange::Gone(entry)) => {
                self.judge_absence(self.find_child(&entry)?)
            }
        }
    }

    /// Returns what it means that a process is missing at the registry, or the registry itself.
    fn judge_absence(&mut self, id: ChildId) -> Option<SupervisorEvent> {
        if !has_free_descriptor() {
            self.report_shortage();
            return None;
        }
        self.running[id].as_ref()?;
        // A busy host delays a process, and stops none: that state needs no further wait.
        let is_daemon = self.plan.duties[id].role != ChildRole::Component;
        Some(match is_daemon && self.is_suspended(id) {
            true => SupervisorEvent::Suspended(id),
            false => SupervisorEvent::Vanished(id),
        })
    }

    /// Returns whether a signal or a debugger has stopped the process, or the one that a script
    /// has started as this component.
    pub(super) fn is_suspended(&self, id: ChildId) -> bool {
        let Some(running) = &self.running[id] else { return false };
        // The processes of another host cannot be looked at.
        let ProcessHandle::Here(group) = &running.process else { return false };
        let registered = running.link.as_ref().map(|link| link.pid);
        [Some(group.pid()), registered].into_iter().flatten().any(is_suspended)
    }

    /// Reports once that descriptors are short.
    fn report_shortage(&mut self) {
        if !std::mem::replace(&mut self.is_short, true) {
            let text = "no file descriptor is left, so components cannot be watched; none of them is \
                        taken for hanging (`ulimit -n` shows the limit)";
            self.log.report(LAUNCHER, LogLevel::Error, text);
        }
    }

    fn find_registry(&self) -> Option<ChildId> {
        self.plan.duties.iter().position(|duty| duty.role == ChildRole::Registry)
    }

    fn handle_appearance(&mut self, entry: ComponentEntry) -> Option<SupervisorEvent> {
        let id = self.find_child(&entry)?;
        let running = self.running[id].as_mut()?;
        let connected = running.link.as_ref().map(|link| link.instance) == Some(entry.instance);
        if let Some(kind) = &self.plan.duties[id].kind
            && *kind != entry.kind
            && !connected
        {
            let text = format!(
                "its executable is now the kind {}, and the file says kind=\"{kind}\": put the right \
                 one back and `armor restart {}`, or correct the file",
                entry.kind, entry.name
            );
            self.log.report(&entry.name, LogLevel::Error, text);
        }
        if self.plan.duties[id].role == ChildRole::Component && !connected {
            let (inputs, process) = (self.inputs.clone(), running.process.id());
            let Duty { name, watchdog, .. } = self.plan.duties[id].clone();
            let hanging_calls = self.hanging_calls.clone();
            running.link = Some(ComponentLink::begin(entry, move |answer| {
                let Some(answer) = answer else {
                    let _ = inputs.try_send(LauncherInput::Unheard(id));
                    return;
                };
                let state = match answer {
                    Answer::State { state, .. } => Some(*state),
                    Answer::Beat { call } => {
                        hanging_calls.record_beat(&name, call.as_ref());
                        // A watchdog limits the calls after the start, not the start itself.
                        let limited = call.as_ref().filter(|call| call.function != "new");
                        let call_s = limited.map_or(0.0, |call| call.call_s);
                        let call = Duration::try_from_secs_f64(call_s).unwrap_or_default();
                        if watchdog.is_some_and(|watchdog| call > watchdog) {
                            let _ = inputs.try_send(LauncherInput::Stuck(id, process, call));
                        }
                        None
                    }
                    _ => None,
                };
                // A full queue contains enough beats.
                let _ = inputs.try_send(LauncherInput::Heard(id, process, state));
            }));
        }
        Some(SupervisorEvent::Ready(id))
    }

    /// Returns something if this is still the process of the component.
    fn expect_process(&self, id: ChildId, process: ProcessId) -> Option<()> {
        let current = self.running[id].as_ref()?;
        (current.process.id() == process).then_some(())
    }

    /// Returns our process of that name, if the entry is of its process group: it may be the child
    /// of a script. Another host's processes register only through the gate, which knows the host.
    fn find_child(&self, entry: &ComponentEntry) -> Option<ChildId> {
        let id = self.plan.duties.iter().position(|duty| duty.name == entry.name)?;
        let ours = match &self.running[id].as_ref()?.process {
            ProcessHandle::Here(group) => group.pid(),
            ProcessHandle::There(_) => {
                let is_there = self.plan.duties[id].host.as_ref() == Some(&entry.host);
                return is_there.then_some(id);
            }
        };
        let pid = Pid::from_raw(i32::try_from(entry.pid).ok()?);
        let in_group =
            || getpgid(pid).is_ok_and(|group| group.as_raw_nonzero().get().unsigned_abs() == ours);
        (entry.pid == ours || in_group()).then_some(id)
    }
}
