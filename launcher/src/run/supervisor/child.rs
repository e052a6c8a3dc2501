//! One supervised process: its state, its deadlines, its record of deaths.

use std::collections::VecDeque;
use std::time::Duration;

use armor_inspect::run_control::AbsentState;
use armor_wire::control::RunState;

use super::{ChildExit, ChildOrder, ChildRole, Duty, GRACE, HangCause};

/// Wait before the first restart.
const FIRST_DELAY: Duration = Duration::from_millis(100);
/// Longest wait before a component's restart.
const MOST_DELAY: Duration = Duration::from_secs(10);
/// Longest wait before a daemon's restart: without it nothing is linked, configured or decided.
const MOST_DAEMON_DELAY: Duration = Duration::from_secs(1);
/// A process that was healthy for this long starts again after the first delay.
const HEALTHY_AFTER: Duration = Duration::from_secs(10);
/// Deaths within [`DEATHS_WITHIN`] after which a component is given up.
pub const MAX_DEATHS: usize = 5;
/// The time in which deaths are counted; a process that lived longer starts with a clean record.
pub const DEATHS_WITHIN: Duration = Duration::from_secs(60);
/// A daemon that was ready for this long did not fail immediately.
const SETTLED_AFTER: Duration = Duration::from_secs(3);
/// How long a daemon may fail immediately, start after start, before it is given up: the cause, such
/// as a full disk or a port that is taken, may pass.
pub const DAEMON_TRIES_FOR: Duration = Duration::from_secs(30);
/// Number of ends that are remembered in words.
const REMEMBERED_ENDS: usize = 3;
/// Longest time until a daemon is ready after its start: a busy host, a cold disk.
const READY_WITHIN: Duration = Duration::from_secs(20);
/// Longest time from a component's registration to its first beat: connecting to two hundred
/// components takes as long.
const FIRST_BEAT_WITHIN: Duration = Duration::from_secs(10);
/// Longest time that a running daemon may be missing at the registry, or the registry be silent.
const MISSING_FOR: Duration = Duration::from_secs(3);

/// What the process is doing.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ChildState {
    /// It waits for its turn, or for the end of its backoff.
    Waiting { until: Duration },
    /// It runs.
    Running { watch: Silence },
    /// It was asked to end, or killed because it hung.
    Ending { kill_at: Option<Duration>, hung: Option<HangCause> },
    /// It ended and stays down.
    Ended,
    /// An operator has stopped it; it stays down until it is restarted.
    Stopped,
    /// It failed for good.
    Failed,
}

/// What the process must send, and its deadline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Silence {
    /// Nothing.
    Nothing,
    /// It has to register.
    Ready { until: Duration },
    /// It has to send its first beat.
    FirstBeat { until: Duration },
    /// It has to send the next beat, within this time of the last one.
    Beat { until: Duration, within: Duration },
    /// It has to be at the registry again.
    Return { until: Duration },
}

/// A process and its record.
#[derive(Clone, Debug)]
pub(super) struct Child {
    pub duty: Duty,
    pub state: ChildState,
    /// It was ready at least once.
    pub was_ready: bool,
    /// Its component has reported a failure, and is in no other state since.
    pub has_failed: bool,
    /// How its last process ended and what follows, in words.
    pub last_end: String,
    /// The panic that its process has printed.
    pub last_panic: Option<String>,
    /// Number of processes that were started.
    pub starts: u32,
    /// Number of processes that have ended.
    pub ended: u32,
    /// How its last processes ended, in words, the newest last.
    pub ends: VecDeque<String>,
    deaths: VecDeque<Death>,
    /// When its process was started.
    started: Duration,
    /// Since when its process is ready.
    healthy_since: Option<Duration>,
    /// The end of the first of the starts in a row that failed immediately.
    failing_since: Option<Duration>,
    delay: Duration,
    /// Carried out when its process has ended.
    order: Option<ChildOrder>,
}

/// The start and the end of a process that died.
#[derive(Clone, Copy, Debug)]
struct Death {
    started: Duration,
    ended: Duration,
}

/// What follows the death of a process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AfterDeath {
    /// It starts again after a wait.
    Again(Duration),
    /// It is given up: its recent starts, and the time that they took.
    GivenUp { starts: usize, within: Duration },
}

impl Child {
    pub fn new(duty: Duty) -> Self {
        Self {
            duty,
            state: ChildState::Waiting { until: Duration::ZERO },
            was_ready: false,
            has_failed: false,
            last_end: String::new(),
            last_panic: None,
            starts: 0,
            ended: 0,
            ends: VecDeque::new(),
            deaths: VecDeque::new(),
            started: Duration::ZERO,
            healthy_since: None,
            failing_since: None,
            delay: FIRST_DELAY,
            order: None,
        }
    }

    /// Takes an operator's order, and returns whether the process must be asked to end.
    pub fn obey(&mut self, order: ChildOrder, now: Duration) -> bool {
        match (&self.state, order) {
            (ChildState::Running { .. } | ChildState::Ending { .. }, _) => {
                self.order = Some(order);
                return self.ask_to_end(now);
            }
            (_, ChildOrder::Restart) => self.begin_again(now),
            (ChildState::Waiting { .. }, ChildOrder::Stop) => self.state = ChildState::Stopped,
            (_, ChildOrder::Stop) => {}
        }
        false
    }

    /// Its process has ended: carries out the order that waits for this, if there is one.
    pub fn end_by_order(&mut self, now: Duration) -> Option<ChildOrder> {
        let order = self.order.take()?;
        match order {
            ChildOrder::Restart => self.begin_again(now),
            ChildOrder::Stop => self.state = ChildState::Stopped,
        }
        Some(order)
    }

    fn begin_again(&mut self, now: Duration) {
        self.deaths.clear();
        self.failing_since = None;
        self.delay = FIRST_DELAY;
        self.has_failed = false;
        self.state = ChildState::Waiting { until: now };
    }

    /// What becomes of it, if its process does not run, or has not registered yet.
    pub fn absence(&self) -> Option<AbsentState> {
        match self.state {
            // It owes nothing before it has registered.
            ChildState::Running { watch: Silence::Nothing } => Some(AbsentState::Starting),
            ChildState::Running { .. } | ChildState::Ending { .. } => None,
            ChildState::Waiting { .. } => Some(AbsentState::Starting),
            ChildState::Ended => Some(AbsentState::Ended),
            ChildState::Stopped => Some(AbsentState::Stopped),
            ChildState::Failed => Some(AbsentState::GivenUp),
        }
    }

    /// Whether it runs, or is started without another order of an operator.
    pub fn is_owed(&self) -> bool {
        let is_down =
            matches!(self.state, ChildState::Ended | ChildState::Stopped | ChildState::Failed);
        !is_down && self.order != Some(ChildOrder::Stop)
    }

    /// Why it takes no part, in words.
    pub fn describe_absence(&self) -> String {
        match self.state {
            ChildState::Running { .. } => "its process runs, but has not registered".into(),
            _ => self.last_end.clone(),
        }
    }

    /// Whether it is a component that has died, and has not been ready since.
    pub fn is_failing(&self) -> bool {
        let is_down = match self.state {
            ChildState::Waiting { .. } => true,
            ChildState::Running { .. } => self.healthy_since.is_none(),
            _ => false,
        };
        self.duty.role == ChildRole::Component && !self.deaths.is_empty() && is_down
    }

    pub fn is_alive(&self) -> bool {
        matches!(self.state, ChildState::Running { .. } | ChildState::Ending { .. })
    }

    /// Returns whether it must be started now; if so, it counts as started.
    pub fn start_if_due(&mut self, turn: bool, now: Duration) -> bool {
        let due = matches!(self.state, ChildState::Waiting { until } if turn && until <= now);
        if due {
            // A component's constructor has no time limit.
            let watch = match self.duty.role {
                ChildRole::Registry | ChildRole::Configd => {
                    Silence::Ready { until: now + READY_WITHIN }
                }
                ChildRole::Component | ChildRole::Executive | ChildRole::Gate => Silence::Nothing,
            };
            self.state = ChildState::Running { watch };
            self.started = now;
            self.starts += 1;
            // A gate is not in the registry; it is healthy for as long as it runs.
            self.healthy_since = (self.duty.role == ChildRole::Gate).then_some(now);
        }
        due
    }

    pub fn became_ready(&mut self, now: Duration) {
        if let ChildState::Running { watch } = &mut self.state {
            self.was_ready = true;
            if self.duty.role != ChildRole::Component {
                self.healthy_since.get_or_insert(now);
            }
            *watch = match self.duty.role {
                ChildRole::Component => Silence::FirstBeat { until: now + FIRST_BEAT_WITHIN },
                _ => Silence::Nothing,
            };
        }
    }

    pub fn record_beat(&mut self, reported: Option<RunState>, now: Duration) {
        if let Some(reported) = reported {
            self.has_failed = reported == RunState::Failed;
        }
        if let ChildState::Running { watch } = &mut self.state {
            self.healthy_since.get_or_insert(now);
            let within = self.duty.silence();
            *watch = Silence::Beat { until: now + within, within };
        }
    }

    /// Handles a process that is known to hang, and returns whether it must be killed; if so, it
    /// counts as killed.
    pub fn is_stuck(&mut self, cause: HangCause) -> bool {
        let running = matches!(self.state, ChildState::Running { .. });
        if running {
            self.state = ChildState::Ending { kill_at: None, hung: Some(cause) };
        }
        running
    }

    /// Returns how its process ended, in words: what the launcher killed it for explains more than
    /// the signal.
    pub fn describe_exit(&mut self, exit: ChildExit) -> String {
        let panic = self.last_panic.take();
        match (&self.state, panic) {
            (ChildState::Ending { hung: Some(cause), .. }, _) => cause.describe_end(),
            // A thread that the component has started may panic without ending it.
            (_, Some(panic)) if exit != ChildExit::Code(0) => panic,
            _ => exit.to_string(),
        }
    }

    /// Returns whether its process runs and owes something that is overdue.
    pub fn is_overdue(&self, now: Duration) -> bool {
        matches!(self.state, ChildState::Running { watch } if watch.find_overdue(now).is_some())
    }

    pub fn record_absence(&mut self, now: Duration) {
        if let ChildState::Running { watch: watch @ Silence::Nothing } = &mut self.state
            && self.duty.role != ChildRole::Component
        {
            *watch = Silence::Return { until: now + MISSING_FOR };
        }
    }

    /// Handles a failure of the launcher to listen to it: the silence until now proves nothing.
    pub fn excuse_silence(&mut self, now: Duration) {
        if let ChildState::Running { watch } = &mut self.state {
            match watch {
                Silence::FirstBeat { until } | Silence::Beat { until, .. } => {
                    *until = (*until).max(now + FIRST_BEAT_WITHIN);
                }
                Silence::Nothing | Silence::Ready { .. } | Silence::Return { .. } => {}
            }
        }
    }

    /// Its process could not even be started, for want of something that the launcher or the host
    /// needs: tried again after a wait, which is returned.
    pub fn after_failed_start(&mut self, now: Duration) -> Duration {
        self.starts = self.starts.saturating_sub(1);
        self.wait_to_start(now)
    }

    /// Extends each deadline by `nap`, during which the launcher itself did not run: it could not
    /// receive a beat, so silence proves nothing.
    pub fn extend_deadlines(&mut self, nap: Duration) {
        match &mut self.state {
            ChildState::Running { watch } => match watch {
                Silence::Nothing => {}
                Silence::Ready { until }
                | Silence::FirstBeat { until }
                | Silence::Beat { until, .. }
                | Silence::Return { until } => *until += nap,
            },
            ChildState::Ending { kill_at: Some(kill_at), .. } => *kill_at += nap,
            _ => {}
        }
    }

    /// Why it must be killed now, in words; it then counts as killed.
    pub fn take_overdue(&mut self, now: Duration) -> Option<String> {
        let (why, hung) = match &self.state {
            ChildState::Running { watch } => {
                let cause = watch.find_overdue(now)?;
                (cause.describe_kill(), Some(cause))
            }
            ChildState::Ending { kill_at: Some(kill_at), hung } if *kill_at <= now => {
                (format!("has not ended within {} s; it is killed", GRACE.as_secs()), *hung)
            }
            _ => return None,
        };
        self.state = ChildState::Ending { kill_at: None, hung };
        Some(why)
    }

    /// Remembers how its process ended.
    pub fn remember_end(&mut self, how: &str) {
        if self.ends.len() == REMEMBERED_ENDS {
            self.ends.pop_front();
        }
        self.ends.push_back(how.to_owned());
    }

    /// Its process has ended while the system stops.
    pub fn end_with_system(&mut self, how: &str) {
        self.last_end = format!("{how}; the system stops");
        self.state = ChildState::Ended;
    }

    /// Takes a death, and returns what follows.
    pub fn after_death(&mut self, now: Duration) -> AfterDeath {
        let healthy_for =
            self.healthy_since.take().map_or(Duration::ZERO, |since| now.saturating_sub(since));
        while self.deaths.front().is_some_and(|death| death.ended + DEATHS_WITHIN < now) {
            self.deaths.pop_front();
        }
        // Not after each good start: for a process that dies soon after it is ready, the delay
        // would never grow.
        if self.deaths.is_empty() || healthy_for >= HEALTHY_AFTER {
            self.delay = FIRST_DELAY;
        }
        if healthy_for >= SETTLED_AFTER {
            self.failing_since = None;
        }
        let failing_since = *self.failing_since.get_or_insert(now);
        self.deaths.push_back(Death { started: self.started, ended: now });
        let component = self.duty.role == ChildRole::Component;
        // The system runs without its gate, so that is tried for ever.
        let has_tried = now.saturating_sub(failing_since) >= DAEMON_TRIES_FOR
            && self.duty.role != ChildRole::Gate;
        if self.deaths.len() >= MAX_DEATHS && (component || has_tried) {
            self.state = ChildState::Failed;
            let first = self.deaths.front().map_or(now, |death| death.started);
            return AfterDeath::GivenUp { starts: self.deaths.len(), within: now - first };
        }
        AfterDeath::Again(self.wait_to_start(now))
    }

    /// Begins the wait before its next start; each is twice as long as the one before.
    pub fn wait_to_start(&mut self, now: Duration) -> Duration {
        let most = match self.duty.role {
            ChildRole::Component => MOST_DELAY,
            _ => MOST_DAEMON_DELAY,
        };
        let delay = self.delay;
        self.delay = (delay * 2).min(most);
        self.state = ChildState::Waiting { until: now + delay };
        delay
    }

    /// Asks it to end; whether that is new to it.
    pub fn ask_to_end(&mut self, now: Duration) -> bool {
        let running = matches!(self.state, ChildState::Running { .. });
        if running {
            self.state = ChildState::Ending { kill_at: Some(now + GRACE), hung: None };
        }
        running
    }

    pub fn end_immediately(&mut self) {
        self.state = ChildState::Ending { kill_at: None, hung: None };
    }

    /// The system stops: what waits will not start, what was killed to be restarted will not be.
    pub fn abandon_start(&mut self) {
        match &mut self.state {
            ChildState::Waiting { .. } => self.state = ChildState::Ended,
            ChildState::Ending { hung, .. } => *hung = None,
            _ => {}
        }
    }

    pub fn deadline(&self) -> Option<Duration> {
        match self.state {
            ChildState::Waiting { until } => Some(until),
            ChildState::Running { watch } => watch.deadline(),
            ChildState::Ending { kill_at, .. } => kill_at,
            ChildState::Ended | ChildState::Stopped | ChildState::Failed => None,
        }
    }
}

impl Silence {
    fn deadline(self) -> Option<Duration> {
        match self {
            Self::Nothing => None,
            Self::Ready { until }
            | Self::FirstBeat { until }
            | Self::Beat { until, .. }
            | Self::Return { until } => Some(until),
        }
    }

    fn find_overdue(self, now: Duration) -> Option<HangCause> {
        if self.deadline().is_none_or(|until| until > now) {
            return None;
        }
        match self {
            Self::Nothing => None,
            Self::Ready { .. } => Some(HangCause::NotReady(READY_WITHIN)),
            Self::FirstBeat { .. } => Some(HangCause::NoFirstBeat(FIRST_BEAT_WITHIN)),
            Self::Beat { within, .. } => Some(HangCause::Silent(within)),
            Self::Return { .. } => Some(HangCause::Missing(MISSING_FOR)),
        }
    }
}
