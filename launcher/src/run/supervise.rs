//! The loop around the [`Supervisor`]: gives it the events and carries out its actions.

mod launcher_input;
mod operator_requests;
mod process_start;
mod running_process;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_sdk::directory::Directory;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until};

use super::component_link::ComponentLink;
use super::control_group::{ControlGroup, kill_left_groups};
use super::given_up::GivenUpReports;
use super::group_killer::GroupKillers;
use super::hanging_calls::HangingCalls;
use super::logs::RunLog;
use super::plan::{LAUNCHER, ProcessPlan};
use super::requests::RequestSocket;
use super::supervisor::{
    ChildId, LogLevel, RunVerdict, StopRequest, Supervisor, SupervisorAction, SupervisorEvent,
};
use super::survivors::kill_left_processes;
use launcher_input::LauncherInput;
use running_process::RunningProcess;

/// Longest time between two ticks, so that the supervisor notices a suspended host.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Inputs queued for the loop: several beats of two hundred components.
const MAX_QUEUED: usize = 4096;
/// Requests of operators queued for the loop.
const MAX_REQUESTS: usize = 16;

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
    let _socket = match RequestSocket::listen(&identity.system, request_sender, log.clone()) {
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

    fn name_of(&self, id: ChildId) -> &str {
        &self.plan.duties[id].name
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
