//! The loop around the [`Supervisor`]: gives it the events and carries out its actions.

mod operator_requests;
mod running_process;

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use anyhow::{Context, Result};
use armor_sdk::directory::{Directory, DirectoryChange};
use armor_wire::control::{Answer, RunState};
use armor_wire::registry::ComponentEntry;
use armor_wire::remote_process::Takeover;
use rustix::process::{Pid, getpgid};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep, sleep_until};

use super::component_link::ComponentLink;
use super::control_group::{ControlGroup, kill_left_groups};
use super::descriptors::has_free_descriptor;
use super::given_up::GivenUpReports;
use super::group_killer::GroupKillers;
use super::hanging_calls::HangingCalls;
use super::logs::RunLog;
use super::own_run::name_start;
use super::plan::{LAUNCHER, PlannedStart, ProcessPlan};
use super::process::{ChildProcess, is_suspended};
use super::remote::{RemoteNotice, RemotePlan, RemoteProcess};
use super::requests::RequestSocket;
use super::supervisor::{
    ChildExit, ChildId, ChildRole, Duty, LogLevel, RunVerdict, StopRequest, Supervisor,
    SupervisorAction, SupervisorEvent,
};
use super::survivors::kill_left_processes;
use running_process::{ProcessHandle, ProcessId, RunningProcess};

/// Longest time between two ticks, so that the supervisor notices a suspended host.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How long a gate may take from its start to its first answer.
const GATE_STARTS_WITHIN: Duration = Duration::from_secs(10);
/// Period with which a gate that has not answered yet is asked: one that has answered once, and hangs,
/// is noticed earlier.
const LOOK_AT_STARTING_GATE: Duration = Duration::from_millis(50);
/// Longest wait for the last lines of a process that ended. They are in its pipes already; only a
/// process that has left its group can keep the pipes open for longer.
const LAST_LINES_WITHIN: Duration = Duration::from_secs(1);
/// Inputs queued for the loop: several beats of two hundred components.
const MAX_QUEUED: usize = 4096;
/// Requests of operators queued for the loop.
const MAX_REQUESTS: usize = 16;

/// What threads and tasks send to the loop.
enum LauncherInput {
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

/// What distinguishes this run.
pub struct RunIdentity {
    /// Name of the system.
    pub system: String,
    /// The time after which it stops, if it is limited.
    pub time: Option<Duration>,
    /// Whether it continues an earlier run.
    pub resumes: bool,
}

struct Launcher {
    plan: ProcessPlan,
    running: Vec<Option<RunningProcess>>,
    was_started: Vec<bool>,
    /// Continues an earlier run, whose processes on other hosts are taken over.
    resumes: bool,
    restarts: Arc<AtomicU32>,
    hanging_calls: HangingCalls,
    group_killers: GroupKillers,
    /// None where this host allows no control groups.
    control_group: Option<ControlGroup>,
    given_up: GivenUpReports,
    inputs: mpsc::Sender<LauncherInput>,
    /// Failed starts, which the supervisor gets after the current actions.
    failed: VecDeque<SupervisorEvent>,
    /// The registry, once it was started.
    directory: Option<Directory>,
    watches_gate: bool,
    /// A shortage of descriptors was reported.
    is_short: bool,
    log: RunLog,
}

/// Runs the plan to its end, or for `time`; counts the processes that are started again, and records
/// the calls that hang.
///
/// # Errors
/// If the host refuses what the launcher itself needs.
pub async fn supervise(
    plan: ProcessPlan,
    identity: RunIdentity,
    log: &RunLog,
    restarts: Arc<AtomicU32>,
    hanging_calls: HangingCalls,
) -> Result<RunVerdict> {
    let mut supervisor = Supervisor::new(plan.duties.clone());
    let mut signals = Signals::new()?;
    let (sender, mut inputs) = mpsc::channel(MAX_QUEUED);
    let control_group = make_control_group(log);
    let mut launcher = Launcher {
        running: plan.duties.iter().map(|_| None).collect(),
        was_started: vec![false; plan.duties.len()],
        resumes: identity.resumes,
        restarts,
        hanging_calls,
        group_killers: GroupKillers::start(&plan.mark, control_group.as_ref())?,
        control_group,
        plan,
        given_up: GivenUpReports::default(),
        inputs: sender,
        failed: VecDeque::new(),
        directory: None,
        watches_gate: false,
        is_short: false,
        log: log.clone(),
    };
    let start = Instant::now() - log.elapsed();
    let mut time_up = identity.time.map(|time| start + time);
    let (request_sender, mut requests) = mpsc::channel(MAX_REQUESTS);
    // The system runs without it too, such as where its path would be too long for a socket.
    let _socket = match RequestSocket::listen(&identity.system, request_sender) {
        Ok(socket) => Some(socket),
        Err(error) => {
            let text = format!("armor restart and stop cannot reach this run: {error:#}");
            log.report(LAUNCHER, LogLevel::Warn, text);
            None
        }
    };
    let mut event = Some(SupervisorEvent::Tick);
    loop {
        let mut actions = Vec::new();
        // Two hundred components beat four hundred times a second; a beat starts and ends none.
        let is_beat = matches!(event, Some(SupervisorEvent::Heard(..)));
        if let Some(event) = event.take() {
            let now = log.elapsed();
            for id in supervisor.list_overdue(now) {
                if launcher.is_suspended(id) {
                    actions.extend(supervisor.handle(SupervisorEvent::Suspended(id), now));
                }
            }
            if let SupervisorEvent::Exited(id, _) = event
                && let Some(panic) = log.take_panic(launcher.name_of(id))
            {
                actions.extend(supervisor.handle(SupervisorEvent::Panicked(id, panic), now));
            }
            actions.extend(supervisor.handle(event, now));
        }
        if let Some(verdict) = launcher.perform_actions(actions) {
            launcher.group_killers.dismiss();
            return Ok(verdict);
        }
        if let Some(directory) = launcher.directory.as_ref().filter(|_| !is_beat) {
            directory.reserve_names(supervisor.list_owed());
        }
        launcher.replace_group_killers();
        if let Some(failed) = launcher.failed.pop_front() {
            event = Some(failed);
            continue;
        }
        let look = log.elapsed() + LOOK_EVERY;
        let wake = start + supervisor.next_deadline().map_or(look, |deadline| deadline.min(look));
        event = tokio::select! {
            () = sleep_until(wake) => Some(SupervisorEvent::Tick),
            () = sleep_until(time_up.unwrap_or(wake)), if time_up.is_some() => {
                time_up = None;
                Some(SupervisorEvent::Stop(StopRequest::TimeUp))
            }
            name = signals.next() => {
                log.report(LAUNCHER, LogLevel::Info, format!("{name}: stopping; once more to kill"));
                Some(SupervisorEvent::Stop(StopRequest::Interrupt))
            }
            Some(input) = inputs.recv() => launcher.convert_input(input),
            Some(request) = requests.recv() => {
                launcher.convert_request(request, &supervisor)
            }
        };
    }
}

/// Makes the control group of the run, if this host allows one, and kills what launchers that have died
/// have left, in theirs or with their marks.
fn make_control_group(log: &RunLog) -> Option<ControlGroup> {
    let control_group = ControlGroup::make().ok();
    let left = kill_left_groups();
    let marked = kill_left_processes();
    if left + marked > 0 {
        let text = "processes that killed runs of this user have left were ended";
        log.report(LAUNCHER, LogLevel::Warn, text);
    }
    control_group
}

impl Launcher {
    fn replace_group_killers(&mut self) {
        if self.group_killers.replace_ended() > 0 {
            let text = "a group killer has ended; there is a new one";
            self.log.report(LAUNCHER, LogLevel::Warn, text);
        }
    }

    fn perform_actions(&mut self, actions: Vec<SupervisorAction>) -> Option<RunVerdict> {
        for action in actions {
            match action {
                SupervisorAction::Spawn(id) => self.spawn_child(id),
                SupervisorAction::Terminate(id) => {
                    if let Some(running) = &self.running[id]
                        && !running.link.as_ref().is_some_and(ComponentLink::terminate)
                    {
                        running.process.terminate();
                    }
                }
                SupervisorAction::Kill(id) => {
                    if let Some(running) = &self.running[id] {
                        running.process.kill();
                    }
                }
                SupervisorAction::ReportGivenUp(id, why) => {
                    self.given_up.add_component(&self.plan.duties[id].name, why);
                }
                SupervisorAction::Log(level, id, text) => {
                    self.log.report(&self.plan.duties[id].name, level, text);
                }
                SupervisorAction::End(verdict) => return Some(verdict),
            }
        }
        None
    }

    fn spawn_child(&mut self, id: ChildId) {
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

    fn name_of(&self, id: ChildId) -> &str {
        &self.plan.duties[id].name
    }

    fn convert_input(&mut self, input: LauncherInput) -> Option<SupervisorEvent> {
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
    fn is_suspended(&self, id: ChildId) -> bool {
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

/// The signals that end a run.
struct Signals {
    interrupt: Signal,
    terminate: Signal,
    hang_up: Signal,
}

impl Signals {
    fn new() -> Result<Self> {
        let open = |kind| signal(kind).context("signals cannot be caught");
        Ok(Self {
            interrupt: open(SignalKind::interrupt())?,
            terminate: open(SignalKind::terminate())?,
            hang_up: open(SignalKind::hangup())?,
        })
    }

    async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.interrupt.recv() => "interrupted",
            _ = self.terminate.recv() => "asked to end",
            _ = self.hang_up.recv() => "the terminal is gone",
        }
    }
}
