//! Measurements that the roles of both sides make in the same way: round trips, and rate and
//! processor time over a window.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// Time before the window in which rate and processor time are counted.
const RUN_UP: Duration = Duration::from_millis(300);
/// How long a publisher continues after its window: the windows of its subscribers begin a little
/// later and must be full too.
pub const RUN_OUT: Duration = Duration::from_millis(300);
/// Most round trips of one measurement.
pub const MOST_ROUND_TRIPS: usize = 400_000;

fn clock_ns(clock: ClockId) -> u64 {
    let time = clock_gettime(clock);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// The current time on the clock that all processes of a machine share.
pub fn monotonic_ns() -> u64 {
    clock_ns(ClockId::Monotonic)
}

/// How long a publisher publishes for a window.
pub fn publishing_time(window: Duration) -> Duration {
    RUN_UP + window + RUN_OUT
}

/// Prints `round p50_us=… p99_us=…`.
pub fn print_round_trips(times_ns: &mut [u64]) {
    times_ns.sort_unstable();
    let at = |share: f64| times_ns[((times_ns.len() - 1) as f64 * share) as usize] as f64 / 1e3;
    println!("round n={} p50_us={:.3} p99_us={:.3}", times_ns.len(), at(0.5), at(0.99));
}

/// The value below which a share of the times lies, in µs; 0 if there are none.
pub fn percentile_us(times_ns: &mut [u64], share: f64) -> f64 {
    times_ns.sort_unstable();
    let last = times_ns.len().saturating_sub(1);
    times_ns.get((last as f64 * share).round() as usize).map_or(0.0, |time| *time as f64 / 1e3)
}

/// Counts messages. A thread of its own prints `window rate_hz=… cpu_ns=…` (per message) after a
/// run-up and a window.
pub fn watch_window(window: Duration) -> Arc<AtomicU64> {
    let count = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&count);
    std::thread::spawn(move || {
        let look =
            || (count.load(Ordering::Relaxed), Instant::now(), clock_ns(ClockId::ProcessCPUTime));
        std::thread::sleep(RUN_UP);
        let (count_a, time_a, cpu_a) = look();
        std::thread::sleep(window);
        let (count_b, time_b, cpu_b) = look();
        let messages = (count_b - count_a) as f64;
        let rate_hz = messages / (time_b - time_a).as_secs_f64();
        println!(
            "window rate_hz={rate_hz:.2} cpu_ns={:.2}",
            (cpu_b - cpu_a) as f64 / messages.max(1.0)
        );
    });
    counted
}
