//! The arithmetic of time, without a clock: what a reading of the system's clock means after the
//! previous one, and when the next tick is due.

use std::time::Duration;

/// A component with a short period may be late by this without losing a tick: the kernel wakes no
/// more reliably.
const MADE_UP: Duration = Duration::from_millis(10);
/// A tick is not put off for less: the readings of a clock are floating-point seconds since 1970.
const GRAIN: Duration = Duration::from_micros(1);

/// One message of the source of the system's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockReading {
    /// The time, in seconds; finite and not negative.
    pub stamp_s: f64,
    /// The process start that has sent it.
    pub instance: u64,
}

/// What a reading means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passage {
    /// It is the first: time is known from here on.
    Begins,
    /// Time has passed.
    Passes,
    /// Time continues from another value: it went back, or another process start has sent it.
    Jumps,
}

/// The sequence of the readings of one clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timeline {
    last: Option<ClockReading>,
}

impl Timeline {
    /// Adds a reading. Returns `None` if time stands still or the reading is not a time.
    pub fn read(&mut self, reading: ClockReading) -> Option<Passage> {
        if !reading.stamp_s.is_finite() || reading.stamp_s < 0.0 {
            return None;
        }
        let passage = match self.last {
            None => Passage::Begins,
            Some(last) if last == reading => return None,
            Some(last) if last.instance != reading.instance || reading.stamp_s < last.stamp_s => {
                Passage::Jumps
            }
            Some(_) => Passage::Passes,
        };
        self.last = Some(reading);
        Some(passage)
    }
}

/// When a component with a rate is called next, on any clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickSchedule {
    period: Duration,
    next: Duration,
    /// What was missed, beyond the ticks that were counted as skipped.
    missed: Duration,
}

impl TickSchedule {
    pub fn new(period: Duration) -> Self {
        Self { period, next: Duration::ZERO, missed: Duration::ZERO }
    }

    /// Makes the next call due now.
    pub fn start_at(&mut self, now: Duration) {
        (self.next, self.missed) = (now, Duration::ZERO);
    }

    pub fn is_due(&self, now: Duration) -> bool {
        now + GRAIN >= self.next
    }

    /// How long it is until the next call.
    pub fn time_left(&self, now: Duration) -> Duration {
        self.next.saturating_sub(now)
    }

    /// Records a call at `now` and schedules the next one. Returns how many ticks were skipped before
    /// it. A late tick keeps the phase of the others; after a missed one they are counted from `now`.
    /// Only ticks that are closer together than the kernel wakes reliably are all called, late ones
    /// too.
    pub fn record_tick(&mut self, now: Duration) -> u64 {
        let behind = now.saturating_sub(self.next);
        self.next += self.period;
        if behind <= self.period.max(MADE_UP) {
            return 0;
        }
        self.next = now + self.period;
        self.missed += behind;
        let skipped = self.missed.as_nanos() / self.period.as_nanos().max(1);
        let skipped = u64::try_from(skipped).unwrap_or(u64::MAX);
        let counted = self.period.as_nanos().saturating_mul(skipped.into());
        let rest = self.missed.as_nanos().saturating_sub(counted);
        self.missed = Duration::from_nanos(u64::try_from(rest).unwrap_or(0));
        skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passages(readings: &[(f64, u64)]) -> Vec<Option<Passage>> {
        let mut timeline = Timeline::default();
        let read = |(stamp_s, instance): &(f64, u64)| ClockReading {
            stamp_s: *stamp_s,
            instance: *instance,
        };
        readings.iter().map(read).map(|reading| timeline.read(reading)).collect()
    }

    #[test]
    fn time_begins_passes_stands_and_jumps() {
        use Passage::{Begins, Jumps, Passes};
        let readings = [(5.0, 1), (5.1, 1), (5.1, 1), (5.0, 1), (9.0, 2), (9.5, 2)];
        let meant = [Some(Begins), Some(Passes), None, Some(Jumps), Some(Jumps), Some(Passes)];
        assert_eq!(passages(&readings), meant);
    }

    #[test]
    fn what_is_no_time_changes_nothing() {
        let readings = [(f64::NAN, 1), (-1.0, 1), (3.0, 1), (f64::INFINITY, 1), (4.0, 1)];
        let meant = [None, None, Some(Passage::Begins), None, Some(Passage::Passes)];
        assert_eq!(passages(&readings), meant);
    }

    /// At which of the moments a component of 10 Hz is called.
    fn ticks(moments_ms: &[u64]) -> Vec<u64> {
        let mut beat = TickSchedule::new(Duration::from_millis(100));
        beat.start_at(Duration::from_millis(moments_ms[0]));
        let mut called = Vec::new();
        for &moment_ms in moments_ms {
            let now = Duration::from_millis(moment_ms);
            while beat.is_due(now) {
                called.push(moment_ms);
                beat.record_tick(now);
            }
        }
        called
    }

    #[test]
    fn ticks_keep_the_beat_and_late_ones_are_not_made_up_for() {
        assert_eq!(ticks(&[0, 40, 80, 120, 160, 200]), [0, 120, 200]);
        assert_eq!(ticks(&[0, 50, 450, 500, 550, 600]), [0, 450, 550]);
        assert_eq!(ticks(&[0, 1_000_000, 1_000_050, 1_000_100]), [0, 1_000_000, 1_000_100]);
    }

    #[test]
    fn skipped_ticks_are_counted_in_full() {
        let period = Duration::from_millis(100);
        // A call of 250 ms at 10 Hz: 4 calls per second instead of 10.
        let mut beat = TickSchedule::new(period);
        let (mut now, mut called, mut skipped) = (Duration::ZERO, 0, 0);
        while now < Duration::from_secs(100) {
            now += beat.time_left(now);
            (called, skipped) = (called + 1, skipped + beat.record_tick(now));
            now += Duration::from_millis(250);
        }
        assert!((995..=1005).contains(&(called + skipped)), "{called} and {skipped}");
        assert!((300..=600).contains(&called), "{called}");
        // Late by less than a period, or activated again: none is skipped.
        let mut beat = TickSchedule::new(period);
        let late = [0, 190, 290, 390].map(|ms| beat.record_tick(Duration::from_millis(ms)));
        assert_eq!(late, [0; 4]);
        beat.start_at(Duration::from_secs(900));
        assert_eq!(beat.record_tick(Duration::from_secs(900)), 0);
        assert_eq!(beat.record_tick(Duration::from_secs(902)), 19, "stopped for two seconds");
    }

    #[test]
    fn a_clock_of_floating_point_steps_loses_no_tick() {
        let mut beat = TickSchedule::new(Duration::from_millis(100));
        let at =
            |step: u32| Duration::from_secs_f64(1_763_757_274.123_456 + f64::from(step) * 0.01);
        beat.start_at(at(0));
        let mut late = 0;
        for step in 0..100_000 {
            if beat.is_due(at(step)) {
                late += u32::from(step % 10 != 0);
                beat.record_tick(at(step));
            } else {
                late += u32::from(step % 10 == 0);
            }
        }
        assert_eq!(late, 0);
    }
}
