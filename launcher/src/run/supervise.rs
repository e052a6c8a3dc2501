//! The loop around the [`Supervisor`]: brings it what happens, does what it says.

use std::collections::VecDeque;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_sdk::directory::{Directory, DirectoryChange};
use armor_wire::control::{Answer, RunState};
use armor_wire::registry::ComponentEntry;
use rustix::process::{Pid, getpgid};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until};

use super::logs::Log;
use super::plan::{LAUNCHER, Plan};
use super::process::{Group, Process};
use super::pulse::Pulse;
use super::supervisor::{Action, ChildId, Event, Exit, Level, Request, Role, Supervisor, Verdict};
use super::undertaker::Undertaker;

/// Longest time between two looks at the clock, so that the supervisor notices when it slept.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How long the last lines of a process that ended are waited for. They are in its pipes, and read
/// as soon as this one gets to it; only what has left its group can keep them open for longer.
const LAST_LINES_WITHIN: Duration = Duration::from_secs(1);
/// Happenings on their way to the loop: several beats of two hundred components.
const MAX_WAITING: usize = 4096;

/// What reaches the loop from threads and tasks.
enum Happening {
    Exited(ChildId, Exit),
    /// A component of this process said something: its state, if that was it.
    Heard(ChildId, Group, Option<RunState>),
    Stuck(ChildId, Group, Duration),
    Registry(DirectoryChange),
}

/// A process that runs.
struct Running {
    group: Group,
    pulse: Option<Pulse>,
}

struct Launcher {
    plan: Plan,
    running: Vec<Option<Running>>,
    undertaker: Undertaker,
    happenings: mpsc::Sender<Happening>,
    /// What could not be started, to be told after the actions in hand.
    failed: VecDeque<Event>,
    watching: bool,
    log: Log,
}

/// Runs the plan to its end, or for `time`.
///
/// # Errors
/// If the system refuses what the launcher itself needs.
pub async fn supervise(plan: Plan, time: Option<Duration>, log: &Log) -> Result<Verdict> {
    let mut supervisor = Supervisor::new(plan.duties.clone());
    let mut signals = Signals::new()?;
    let (sender, mut happenings) = mpsc::channel(MAX_WAITING);
    let mut launcher = Launcher {
        running: plan.duties.iter().map(|_| None).collect(),
        plan,
        undertaker: Undertaker::start()?,
        happenings: sender,
        failed: VecDeque::new(),
        watching: false,
        log: log.clone(),
    };
    let start = Instant::now() - log.elapsed();
    let mut time_up = time.map(|time| start + time);
    let mut event = Some(Event::Tick);
    loop {
        let actions = event.take().map(|event| supervisor.handle(event, log.elapsed()));
        if let Some(verdict) = launcher.perform(actions.unwrap_or_default()) {
            launcher.undertaker.dismiss();
            return Ok(verdict);
        }
        if let Some(failed) = launcher.failed.pop_front() {
            event = Some(failed);
            continue;
        }
        let look = log.elapsed() + LOOK_EVERY;
        let wake = start + supervisor.next_deadline().map_or(look, |deadline| deadline.min(look));
        event = tokio::select! {
            () = sleep_until(wake) => Some(Event::Tick),
            () = sleep_until(time_up.unwrap_or(wake)), if time_up.is_some() => {
                time_up = None;
                Some(Event::Stop(Request::TimeUp))
            }
            name = signals.next() => {
                log.say(LAUNCHER, Level::Info, format!("{name}: stopping; once more to kill"));
                Some(Event::Stop(Request::Interrupt))
            }
            Some(happening) = happenings.recv() => launcher.event(happening),
        };
    }
}

impl Launcher {
    fn perform(&mut self, actions: Vec<Action>) -> Option<Verdict> {
        for action in actions {
            match action {
                Action::Spawn(id) => self.spawn(id),
                Action::Terminate(id) => {
                    if let Some(running) = &self.running[id]
                        && !running.pulse.as_ref().is_some_and(Pulse::terminate)
                    {
                        running.group.terminate();
                    }
                }
                Action::Kill(id) => {
                    if let Some(running) = &self.running[id] {
                        running.group.kill();
                    }
                }
                Action::Say(level, id, text) => {
                    self.log.say(&self.plan.duties[id].name, level, text);
                }
                Action::End(verdict) => return Some(verdict),
            }
        }
        None
    }

    fn spawn(&mut self, id: ChildId) {
        match Process::start(&self.plan.starts[id], &self.log) {
            Ok(process) => {
                let group = process.group();
                self.undertaker.began(group);
                self.running[id] = Some(Running { group, pulse: None });
                let happenings = self.happenings.clone();
                tokio::spawn(async move {
                    let (exit, readers) = process.wait().await;
                    // What it said last comes before the news of its end.
                    let last = async {
                        for reader in readers {
                            let _ = reader.await;
                        }
                    };
                    let _ = tokio::time::timeout(LAST_LINES_WITHIN, last).await;
                    let _ = happenings.send(Happening::Exited(id, exit)).await;
                });
                if self.plan.duties[id].role == Role::Registry && !self.watching {
                    self.watching = true;
                    self.watch_registry();
                }
            }
            Err(error) => self.failed.push_back(Event::SpawnFailed(id, format!("{error:#}"))),
        }
    }

    /// Hears from the registry who comes and goes.
    fn watch_registry(&self) {
        let name = format!("{LAUNCHER}-{}", std::process::id());
        let changes = Directory::observer(&self.plan.registry.to_string(), &name).watch();
        let happenings = self.happenings.clone();
        tokio::task::spawn_blocking(move || {
            while let Ok(change) = changes.recv() {
                if happenings.blocking_send(Happening::Registry(change)).is_err() {
                    return;
                }
            }
        });
    }

    fn event(&mut self, happening: Happening) -> Option<Event> {
        match happening {
            Happening::Exited(id, exit) => {
                if let Some(running) = self.running[id].take() {
                    self.undertaker.ended(running.group);
                }
                Some(Event::Exited(id, exit))
            }
            Happening::Heard(id, group, state) => {
                let current = self.running[id].as_ref()?;
                (current.group == group).then_some(Event::Heard(id, state))
            }
            Happening::Stuck(id, group, call) => {
                let current = self.running[id].as_ref()?;
                (current.group == group).then_some(Event::Stuck(id, call))
            }
            Happening::Registry(DirectoryChange::RegistryFound) => {
                Some(Event::Ready(self.registry()?))
            }
            Happening::Registry(DirectoryChange::RegistryLost) => {
                Some(Event::Vanished(self.registry()?))
            }
            Happening::Registry(DirectoryChange::Appeared(entry)) => self.appeared(entry),
            Happening::Registry(DirectoryChange::Gone(entry)) => {
                Some(Event::Vanished(self.whose(&entry)?))
            }
        }
    }

    fn registry(&self) -> Option<ChildId> {
        self.plan.duties.iter().position(|duty| duty.role == Role::Registry)
    }

    fn appeared(&mut self, entry: ComponentEntry) -> Option<Event> {
        let id = self.whose(&entry)?;
        let running = self.running[id].as_mut()?;
        let connected = running.pulse.as_ref().map(|pulse| pulse.instance) == Some(entry.instance);
        if self.plan.duties[id].role == Role::Component && !connected {
            let (happenings, group) = (self.happenings.clone(), running.group);
            let watchdog = self.plan.duties[id].watchdog;
            running.pulse = Some(Pulse::begin(entry, move |answer| {
                let state = match answer {
                    Answer::State { state, .. } => Some(*state),
                    Answer::Beat { call_s } => {
                        let call = Duration::try_from_secs_f64(*call_s).unwrap_or_default();
                        if watchdog.is_some_and(|watchdog| call > watchdog) {
                            let _ = happenings.try_send(Happening::Stuck(id, group, call));
                        }
                        None
                    }
                    _ => None,
                };
                // A full queue has beats enough.
                let _ = happenings.try_send(Happening::Heard(id, group, state));
            }));
        }
        Some(Event::Ready(id))
    }

    /// Which of our processes that is: by name, and by its group, for it may be the child of a
    /// script.
    fn whose(&self, entry: &ComponentEntry) -> Option<ChildId> {
        let id = self.plan.duties.iter().position(|duty| duty.name == entry.name)?;
        let ours = self.running[id].as_ref()?.group.pid();
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
