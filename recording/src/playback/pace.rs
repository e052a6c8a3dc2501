//! How far the time of a recording has come: its speed, pauses, steps. Pure.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;

/// A delay beyond this is not made up for: the rest of the recording is played that much later.
const MOST_DELAY: Duration = Duration::from_millis(20);

/// The speeds that make sense.
const SPEEDS: RangeInclusive<f64> = 0.001..=10_000.0;

/// How many times as fast as recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaybackSpeed {
    /// This many times.
    Times(f64),
    /// As fast as the messages are taken.
    Unlimited,
}

impl PlaybackSpeed {
    /// Reads a factor, of which 0 means as fast as possible.
    ///
    /// # Errors
    /// If it is negative or no number.
    pub fn of_factor(factor: f64) -> Result<Self, String> {
        match factor {
            0.0 => Ok(Self::Unlimited),
            _ if SPEEDS.contains(&factor) => Ok(Self::Times(factor)),
            _ => Err(format!(
                "a speed is a number from {} to {}, or max for as fast as possible",
                SPEEDS.start(),
                SPEEDS.end()
            )),
        }
    }

    /// The factor; 0 for as fast as possible.
    pub fn factor(self) -> f64 {
        match self {
            Self::Times(factor) => factor,
            Self::Unlimited => 0.0,
        }
    }
}

impl Default for PlaybackSpeed {
    fn default() -> Self {
        Self::Times(1.0)
    }
}

impl fmt::Display for PlaybackSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Times(factor) => write!(f, "{factor}"),
            Self::Unlimited => f.write_str("max"),
        }
    }
}

impl FromStr for PlaybackSpeed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Unlimited);
        }
        let number = text.strip_suffix('x').unwrap_or(text).parse().unwrap_or(f64::NAN);
        // 0 is `max` in messages only: a person means that time stands still.
        if number == 0.0 {
            return Err(
                "a speed is above 0: `armor playback pause` or `armor play --paused` lets time \
                        stand still, and max is as fast as possible"
                    .into(),
            );
        }
        Self::of_factor(number)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum PaceState {
    Running,
    Paused,
    /// Until this time of the recording, then paused.
    Stepping(f64),
}

/// Relates the time of the recording to a steady clock.
#[derive(Clone, Debug)]
pub(crate) struct PlaybackPace {
    speed: PlaybackSpeed,
    state: PaceState,
    /// The time of the recording that has been reached, in seconds.
    reached_s: f64,
    /// A moment of the clock and the time of the recording that belongs to it.
    origin: (Duration, f64),
}

impl PlaybackPace {
    /// Begins at `begin_s`, at the moment `now` of the clock.
    pub fn new(begin_s: f64, speed: PlaybackSpeed, is_paused: bool, now: Duration) -> Self {
        let state = if is_paused { PaceState::Paused } else { PaceState::Running };
        Self { speed, state, reached_s: begin_s, origin: (now, begin_s) }
    }

    pub fn speed(&self) -> PlaybackSpeed {
        self.speed
    }

    pub fn is_paused(&self) -> bool {
        self.state == PaceState::Paused
    }

    /// The time of the recording that has been reached.
    pub fn reached_s(&self) -> f64 {
        self.reached_s
    }

    pub fn set_speed(&mut self, speed: PlaybackSpeed, now: Duration) {
        self.speed = speed;
        self.restart(now);
    }

    pub fn pause(&mut self) {
        self.state = PaceState::Paused;
    }

    pub fn resume(&mut self, now: Duration) {
        if self.state != PaceState::Running {
            self.state = PaceState::Running;
            self.restart(now);
        }
    }

    /// Lets time pass until `until_s`, and then pauses.
    pub fn step_until(&mut self, until_s: f64, now: Duration) {
        self.state = PaceState::Stepping(until_s.max(self.reached_s));
        self.restart(now);
    }

    /// Continues at another time.
    pub fn jump(&mut self, to_s: f64, now: Duration) {
        self.reached_s = to_s;
        if let PaceState::Stepping(_) = self.state {
            self.state = PaceState::Paused;
        }
        self.restart(now);
    }

    /// Where the present step ends, if it is one.
    pub fn step_end_s(&self) -> Option<f64> {
        match self.state {
            PaceState::Stepping(until_s) => Some(until_s),
            PaceState::Running | PaceState::Paused => None,
        }
    }

    /// How long it is until the time of the recording is `moment_s`; `None` if it does not come: it is
    /// paused before.
    pub fn time_until(&self, moment_s: f64, now: Duration) -> Option<Duration> {
        match self.state {
            PaceState::Paused => return (moment_s <= self.reached_s).then_some(Duration::ZERO),
            PaceState::Stepping(until_s) if moment_s > until_s => return None,
            PaceState::Running | PaceState::Stepping(_) => {}
        }
        let PlaybackSpeed::Times(factor) = self.speed else { return Some(Duration::ZERO) };
        let (origin, origin_s) = self.origin;
        let due_s = origin.as_secs_f64() + (moment_s - origin_s) / factor;
        let left_s = (due_s - now.as_secs_f64()).max(0.0);
        Some(Duration::try_from_secs_f64(left_s).unwrap_or(Duration::MAX))
    }

    /// Marks that everything up to `moment_s` has been played. What is late stays late.
    pub fn reach(&mut self, moment_s: f64, now: Duration) {
        self.reached_s = self.reached_s.max(moment_s);
        if let PaceState::Stepping(until_s) = self.state
            && self.reached_s >= until_s
        {
            self.state = PaceState::Paused;
        }
        if let PlaybackSpeed::Times(factor) = self.speed {
            let (origin, origin_s) = self.origin;
            let due_s = origin.as_secs_f64() + (self.reached_s - origin_s) / factor;
            if now.as_secs_f64() - due_s > MOST_DELAY.as_secs_f64() {
                self.restart(now);
            }
        }
    }

    fn restart(&mut self, now: Duration) {
        self.origin = (now, self.reached_s);
    }
}
