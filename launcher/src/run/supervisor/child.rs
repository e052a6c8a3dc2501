//! One process under supervision: its state, its deadlines, its record of deaths.

use std::collections::VecDeque;
use std::time::Duration;

use armor_wire::control::RunState;
use armor_wire::liveness::SILENCE;

use super::{Duty, GRACE, Role};

/// Wait before the first restart.
const FIRST_DELAY: Duration = Duration::from_millis(100);
/// Longest wait before a restart.
const MOST_DELAY: Duration = Duration::from_secs(10);
/// So many deaths within [`DEATHS_WITHIN`] and the process is given up.
pub const MAX_DEATHS: usize = 5;
/// The time that deaths are counted in; who lived longer starts with a clean record.
pub const DEATHS_WITHIN: Duration = Duration::from_secs(60);
/// How long a daemon has to get ready after its start: a busy host, a cold disk.
const READY_WITHIN: Duration = Duration::from_secs(20);
/// How long a component has from its registration to the first beat: as long as a crowd of two
/// hundred takes to be connected to.
const FIRST_BEAT_WITHIN: Duration = Duration::from_secs(10);
/// How long a daemon may be missing at the registry (or the registry silent) while it still runs.
const MISSING_FOR: Duration = Duration::from_secs(3);

/// What the process is doing.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum State {
    /// It waits for its turn, or for the end of its backoff.
    Waiting { until: Duration },
    /// It runs.
    Running { watch: Watch },
    /// It was asked to end, or killed because it hung.
    Ending { kill_at: Option<Duration>, hung: bool },
    /// It ended and stays down.
    Ended,
    /// It failed for good.
    Failed,
}

/// What the process has to say, until when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Watch {
    /// Nothing.
    Nothing,
    /// It has to register.
    Ready { until: Duration },
    /// It has to say its first beat.
    FirstBeat { until: Duration },
    /// It has to say the next beat.
    Beat { until: Duration },
    /// It has to be at the registry again.
    Return { until: Duration },
}

/// A process and its record.
#[derive(Clone, Debug)]
pub(super) struct Child {
    pub duty: Duty,
    pub state: State,
    /// It was ready at least once.
    pub was_ready: bool,
    /// Its component has reported a failure, and is in no other state since.
    pub has_failed: bool,
    deaths: VecDeque<Duration>,
    delay: Duration,
}

impl Child {
    pub fn new(duty: Duty) -> Self {
        Self {
            duty,
            state: State::Waiting { until: Duration::ZERO },
            was_ready: false,
            has_failed: false,
            deaths: VecDeque::new(),
            delay: FIRST_DELAY,
        }
    }

    pub fn is_alive(&self) -> bool {
        matches!(self.state, State::Running { .. } | State::Ending { .. })
    }

    /// Whether it is to be started now; if so, it counts as started.
    pub fn start_if_due(&mut self, turn: bool, now: Duration) -> bool {
        let due = matches!(self.state, State::Waiting { until } if turn && until <= now);
        if due {
            // A component's constructor may take as long as it likes.
            let watch = match self.duty.role {
                Role::Registry | Role::Configd => Watch::Ready { until: now + READY_WITHIN },
                Role::Component | Role::Executive => Watch::Nothing,
            };
            self.state = State::Running { watch };
        }
        due
    }

    pub fn became_ready(&mut self, now: Duration) {
        if let State::Running { watch } = &mut self.state {
            self.was_ready = true;
            *watch = match self.duty.role {
                Role::Component => Watch::FirstBeat { until: now + FIRST_BEAT_WITHIN },
                _ => Watch::Nothing,
            };
        }
    }

    pub fn heard(&mut self, said: Option<RunState>, now: Duration) {
        if let Some(said) = said {
            self.has_failed = said == RunState::Failed;
        }
        if let State::Running { watch } = &mut self.state {
            *watch = Watch::Beat { until: now + SILENCE };
        }
    }

    /// One call takes too long: whether it is to be killed for that; if so, it counts as killed.
    pub fn is_stuck(&mut self) -> bool {
        let running = matches!(self.state, State::Running { .. });
        if running {
            self.state = State::Ending { kill_at: None, hung: true };
        }
        running
    }

    pub fn vanished(&mut self, now: Duration) {
        if let State::Running { watch: watch @ Watch::Nothing } = &mut self.state
            && self.duty.role != Role::Component
        {
            *watch = Watch::Return { until: now + MISSING_FOR };
        }
    }

    /// Nobody listened for the time of `nap`.
    pub fn forgive(&mut self, nap: Duration) {
        match &mut self.state {
            State::Running { watch } => match watch {
                Watch::Nothing => {}
                Watch::Ready { until }
                | Watch::FirstBeat { until }
                | Watch::Beat { until }
                | Watch::Return { until } => *until += nap,
            },
            State::Ending { kill_at: Some(kill_at), .. } => *kill_at += nap,
            _ => {}
        }
    }

    /// Why it must be killed now, in words; it then counts as killed.
    pub fn overdue(&mut self, now: Duration) -> Option<String> {
        let (why, hung) = match &self.state {
            State::Running { watch } => (watch.overdue(now)?, true),
            State::Ending { kill_at: Some(kill_at), hung } if *kill_at <= now => {
                (format!("has not ended within {} s; it is killed", GRACE.as_secs()), *hung)
            }
            _ => return None,
        };
        self.state = State::Ending { kill_at: None, hung };
        Some(why)
    }

    /// After a death: the wait before the next start, or nothing if it is given up.
    pub fn after_death(&mut self, now: Duration) -> Option<Duration> {
        while self.deaths.front().is_some_and(|death| *death + DEATHS_WITHIN < now) {
            self.deaths.pop_front();
        }
        if self.deaths.is_empty() {
            self.delay = FIRST_DELAY;
        }
        self.deaths.push_back(now);
        if self.deaths.len() >= MAX_DEATHS {
            self.state = State::Failed;
            return None;
        }
        let delay = self.delay;
        self.delay = (delay * 2).min(MOST_DELAY);
        self.state = State::Waiting { until: now + delay };
        Some(delay)
    }

    /// Asks it to end; whether that is new to it.
    pub fn ask_to_end(&mut self, now: Duration) -> bool {
        let running = matches!(self.state, State::Running { .. });
        if running {
            self.state = State::Ending { kill_at: Some(now + GRACE), hung: false };
        }
        running
    }

    pub fn end_at_once(&mut self) {
        self.state = State::Ending { kill_at: None, hung: false };
    }

    /// The system stops: what waits will not start, what was killed to be restarted will not be.
    pub fn abandon_start(&mut self) {
        match &mut self.state {
            State::Waiting { .. } => self.state = State::Ended,
            State::Ending { hung, .. } => *hung = false,
            _ => {}
        }
    }

    pub fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Waiting { until } => Some(until),
            State::Running { watch } => watch.deadline(),
            State::Ending { kill_at, .. } => kill_at,
            State::Ended | State::Failed => None,
        }
    }
}

impl Watch {
    fn deadline(self) -> Option<Duration> {
        match self {
            Self::Nothing => None,
            Self::Ready { until }
            | Self::FirstBeat { until }
            | Self::Beat { until }
            | Self::Return { until } => Some(until),
        }
    }

    fn overdue(self, now: Duration) -> Option<String> {
        if self.deadline().is_none_or(|until| until > now) {
            return None;
        }
        let why = match self {
            Self::Nothing => return None,
            Self::Ready { .. } => format!("is not ready after {} s", READY_WITHIN.as_secs()),
            Self::FirstBeat { .. } => {
                format!("has not answered within {} s", FIRST_BEAT_WITHIN.as_secs())
            }
            Self::Beat { .. } => format!("has been silent for {} s", SILENCE.as_secs_f64()),
            Self::Return { .. } => {
                format!("has not answered for {} s", MISSING_FOR.as_secs())
            }
        };
        Some(format!("{why}: suspected of hanging and killed"))
    }
}
