//! The one time of the system, as this process estimates it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_wire::clock::{ClockEstimate, ClockFilter, Exchange};
use parking_lot::Mutex;
use rustix::time::{ClockId, clock_gettime};

use crate::timeline::{ClockReading, Passage, Timeline};

/// A monotonic clock with an estimate of the system time's offset from it.
///
/// Until the registry has answered, system time is this host's wall clock as it was at the start; a
/// later jump of the wall clock changes nothing. In a system whose time follows data, system time
/// is the last reading; monotonic time is the host's nevertheless.
#[derive(Debug)]
pub struct SystemClock {
    start_s: f64,
    wall_offset_s: f64,
    offset_bits: AtomicU64,
    filter: Mutex<ClockFilter>,
    /// Whether system time follows data.
    follows: AtomicBool,
    /// The last reading in seconds; NaN before the first one.
    followed_bits: AtomicU64,
    following: Mutex<FollowedTime>,
}

/// The readings so far, for callers that need time and jumps together.
#[derive(Debug, Default)]
struct FollowedTime {
    timeline: Timeline,
    now: Duration,
    jumps: u64,
}

impl Default for SystemClock {
    fn default() -> Self {
        let start_s = monotonic_s();
        let wall = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        Self {
            start_s,
            wall_offset_s: wall - start_s,
            offset_bits: AtomicU64::new((wall - start_s).to_bits()),
            filter: Mutex::default(),
            follows: AtomicBool::new(false),
            followed_bits: AtomicU64::new(f64::NAN.to_bits()),
            following: Mutex::default(),
        }
    }
}

impl SystemClock {
    /// Time since this clock was made.
    pub fn monotonic(&self) -> Duration {
        Duration::from_secs_f64((monotonic_s() - self.start_s).max(0.0))
    }

    /// This host's monotonic clock in seconds: what the registry's time is compared with.
    pub(crate) fn monotonic_s(&self) -> f64 {
        monotonic_s()
    }

    /// System time in seconds since the Unix epoch; 0 if it follows data that have not arrived yet.
    pub fn timestamp(&self) -> f64 {
        if self.follows.load(Ordering::Relaxed) {
            let followed_s = f64::from_bits(self.followed_bits.load(Ordering::Relaxed));
            return if followed_s.is_nan() { 0.0 } else { followed_s };
        }
        self.registry_time_s()
    }

    /// The registry's time in seconds, also where system time follows data.
    pub fn registry_time_s(&self) -> f64 {
        monotonic_s() + f64::from_bits(self.offset_bits.load(Ordering::Relaxed))
    }

    /// Lets system time follow [readings](Self::apply_reading) from now on.
    pub(crate) fn follow_readings(&self) {
        self.follows.store(true, Ordering::Relaxed);
    }

    /// Whether system time is known.
    pub(crate) fn is_known(&self) -> bool {
        let has_reading = || !f64::from_bits(self.followed_bits.load(Ordering::SeqCst)).is_nan();
        !self.follows.load(Ordering::Relaxed) || has_reading()
    }

    /// Applies a reading of the source of the system's time. Returns what it means; `None` if
    /// nothing.
    pub(crate) fn apply_reading(&self, reading: ClockReading) -> Option<Passage> {
        let mut following = self.following.lock();
        let passage = following.timeline.read(reading)?;
        following.now = Duration::try_from_secs_f64(reading.stamp_s).unwrap_or(Duration::MAX);
        following.jumps += u64::from(passage == Passage::Jumps);
        self.followed_bits.store(reading.stamp_s.to_bits(), Ordering::SeqCst);
        Some(passage)
    }

    /// The time that ticks follow, from an arbitrary zero, and the number of its jumps.
    pub(crate) fn tick_time(&self) -> (Duration, u64) {
        if !self.follows.load(Ordering::Relaxed) {
            return (self.monotonic(), 0);
        }
        let following = self.following.lock();
        (following.now, following.jumps)
    }

    /// Whether ticks follow the host's clock, and not readings.
    pub(crate) fn runs_by_itself(&self) -> bool {
        !self.follows.load(Ordering::Relaxed)
    }

    /// System time minus this host's wall clock as it was at the start, in seconds.
    pub fn offset_s(&self) -> f64 {
        f64::from_bits(self.offset_bits.load(Ordering::Relaxed)) - self.wall_offset_s
    }

    /// The best estimate of the registry's clock; `None` before its first answer.
    pub fn estimate(&self) -> Option<ClockEstimate> {
        self.filter.lock().estimate()
    }

    /// Improves the estimate with one exchange of the registry's time.
    pub(crate) fn add_exchange(&self, exchange: Exchange) {
        let mut filter = self.filter.lock();
        filter.add(exchange);
        if let Some(estimate) = filter.estimate() {
            self.offset_bits.store(estimate.offset_s.to_bits(), Ordering::Relaxed);
        }
    }

    /// Discards the estimate: another registry has another clock.
    pub(crate) fn registry_changed(&self) {
        self.filter.lock().clear();
    }
}

/// Reads the clock directly, without `Instant` and `Duration`: it is read for every message.
fn monotonic_s() -> f64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
