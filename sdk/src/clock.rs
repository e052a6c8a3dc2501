//! The one time of the system, as this process knows it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_wire::clock::{ClockEstimate, ClockFilter, Exchange};
use rustix::time::{ClockId, clock_gettime};

use crate::timeline::{Passage, Reading, Timeline};

/// A monotonic clock that can say how far the system's time is from it.
///
/// Until the registry has been heard, system time is this host's wall clock as it was at the start;
/// a later jump of the wall clock moves nothing. In a system whose time follows data, system time is
/// what was read last; monotonic time is the host's all the same.
#[derive(Debug)]
pub struct Clock {
    start_s: f64,
    wall_offset_s: f64,
    offset_bits: AtomicU64,
    filter: Mutex<ClockFilter>,
    /// Whether system time follows data.
    follows: AtomicBool,
    /// The time read last; NaN before the first reading.
    followed_bits: AtomicU64,
    following: Mutex<Following>,
}

/// What was read of the system's time, for who must see all of it at once.
#[derive(Debug, Default)]
struct Following {
    timeline: Timeline,
    now: Duration,
    jumps: u64,
}

impl Default for Clock {
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

impl Clock {
    /// Time since this clock was made.
    pub fn monotonic(&self) -> Duration {
        Duration::from_secs_f64((monotonic_s() - self.start_s).max(0.0))
    }

    /// This host's monotonic clock in seconds: what the registry's time is compared with.
    pub(crate) fn monotonic_s(&self) -> f64 {
        monotonic_s()
    }

    /// System time in seconds since the Unix epoch. If it follows data that has not been heard yet, 0.
    pub fn timestamp(&self) -> f64 {
        if self.follows.load(Ordering::Relaxed) {
            let followed_s = f64::from_bits(self.followed_bits.load(Ordering::Relaxed));
            return if followed_s.is_nan() { 0.0 } else { followed_s };
        }
        monotonic_s() + f64::from_bits(self.offset_bits.load(Ordering::Relaxed))
    }

    /// From now on system time is what is [read](Self::read).
    pub(crate) fn follow(&self) {
        self.follows.store(true, Ordering::Relaxed);
    }

    /// Whether system time can be told.
    pub(crate) fn is_known(&self) -> bool {
        let is_heard = || !f64::from_bits(self.followed_bits.load(Ordering::SeqCst)).is_nan();
        !self.follows.load(Ordering::Relaxed) || is_heard()
    }

    /// Takes in what the source of the system's time says; what it means, if anything.
    pub(crate) fn read(&self, reading: Reading) -> Option<Passage> {
        let mut following = self.following.lock().unwrap_or_else(PoisonError::into_inner);
        let passage = following.timeline.read(reading)?;
        following.now = Duration::try_from_secs_f64(reading.stamp_s).unwrap_or(Duration::MAX);
        following.jumps += u64::from(passage == Passage::Jumps);
        self.followed_bits.store(reading.stamp_s.to_bits(), Ordering::SeqCst);
        Some(passage)
    }

    /// The time that ticks follow, from any zero, and how often it has jumped.
    pub(crate) fn ticking(&self) -> (Duration, u64) {
        if !self.follows.load(Ordering::Relaxed) {
            return (self.monotonic(), 0);
        }
        let following = self.following.lock().unwrap_or_else(PoisonError::into_inner);
        (following.now, following.jumps)
    }

    /// Whether ticks come by themselves, and not by what is read.
    pub(crate) fn runs_by_itself(&self) -> bool {
        !self.follows.load(Ordering::Relaxed)
    }

    /// System time minus this host's wall clock as it was at the start, in seconds.
    pub fn offset_s(&self) -> f64 {
        f64::from_bits(self.offset_bits.load(Ordering::Relaxed)) - self.wall_offset_s
    }

    /// The best estimate of the registry's clock, if it has been heard.
    pub fn estimate(&self) -> Option<ClockEstimate> {
        self.filter.lock().ok()?.estimate()
    }

    /// Takes in what the registry answered.
    pub(crate) fn add(&self, exchange: Exchange) {
        if let Ok(mut filter) = self.filter.lock() {
            filter.add(exchange);
            if let Some(estimate) = filter.estimate() {
                self.offset_bits.store(estimate.offset_s.to_bits(), Ordering::Relaxed);
            }
        }
    }

    /// Forgets what an earlier registry said.
    pub(crate) fn registry_changed(&self) {
        if let Ok(mut filter) = self.filter.lock() {
            filter.clear();
        }
    }
}

/// Read for every message, so without the detour over `Instant` and `Duration`.
fn monotonic_s() -> f64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
