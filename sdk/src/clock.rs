//! The one time of the system, as this process knows it.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_wire::clock::{ClockFilter, Estimate, Exchange};
use rustix::time::{ClockId, clock_gettime};

/// A monotonic clock that can say how far the system's time is from it.
///
/// Until the registry has been heard, system time is this host's wall clock as it was at the start;
/// a later jump of the wall clock moves nothing.
#[derive(Debug)]
pub struct Clock {
    start_s: f64,
    wall_offset_s: f64,
    offset_bits: AtomicU64,
    filter: Mutex<ClockFilter>,
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

    /// System time in seconds since the Unix epoch.
    pub fn timestamp(&self) -> f64 {
        monotonic_s() + f64::from_bits(self.offset_bits.load(Ordering::Relaxed))
    }

    /// System time minus this host's wall clock as it was at the start, in seconds.
    pub fn offset_s(&self) -> f64 {
        f64::from_bits(self.offset_bits.load(Ordering::Relaxed)) - self.wall_offset_s
    }

    /// The best estimate of the registry's clock, if it has been heard.
    pub fn estimate(&self) -> Option<Estimate> {
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
