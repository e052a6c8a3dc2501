//! A peer that is silent for three beats is taken for dead. Times are durations since any fixed
//! moment.

use std::time::Duration;

/// Period with which each end of a quiet connection sends a beat.
pub const BEAT: Duration = Duration::from_millis(500);
/// Beats that may be missed before the other end is taken for dead.
pub const MISSED_BEATS: u32 = 3;
/// Silence after which the other end is taken for dead; `TCP_USER_TIMEOUT` is the same within a host.
pub const SILENCE: Duration = Duration::from_millis(1750);
/// How long another host may leave what it was sent unacknowledged: `TCP_USER_TIMEOUT` between hosts. If
/// only the direction towards it is cut, its frames still arrive for a while. This time begins with the
/// first repetition of the next beat, some 0.2 s after it, so that such a cut is noticed within 2 s.
pub const UNACKNOWLEDGED: Duration = Duration::from_millis(1000);
/// Period with which an end that serves many connections looks after each of them. Together with
/// [`SILENCE`] it bounds the time until a dead peer is noticed: 1.95 s.
pub const LOOK: Duration = Duration::from_millis(200);

/// Longest time from a beat to its first repetition on a network with short delays.
const REPEATED: Duration = Duration::from_millis(400);
const _: () = assert!(
    BEAT.as_millis() + REPEATED.as_millis() + UNACKNOWLEDGED.as_millis() < 2000,
    "a cut in one direction would be noticed too late"
);
const _: () = assert!(LOOK.as_millis() * 2 <= BEAT.as_millis(), "a beat would come too late");

/// Watches one connection.
#[derive(Clone, Copy, Debug)]
pub struct Liveness {
    heard: Duration,
    spoke: Duration,
}

impl Liveness {
    /// A connection that began at `now`.
    pub fn new(now: Duration) -> Self {
        Self { heard: now, spoke: now }
    }

    /// Records that bytes have arrived.
    pub fn heard(&mut self, now: Duration) {
        self.heard = now;
    }

    /// Records that bytes were sent.
    pub fn spoke(&mut self, now: Duration) {
        self.spoke = now;
    }

    /// Whether a beat should be sent.
    pub fn owes_beat(&self, now: Duration) -> bool {
        now.saturating_sub(self.spoke) >= BEAT
    }

    /// How long after `now` a beat is due, or the other end is taken for dead.
    pub fn time_until_due(&self, now: Duration) -> Duration {
        (self.spoke + BEAT).min(self.heard + SILENCE).saturating_sub(now)
    }

    /// Whether the other end is taken for dead.
    pub fn is_silent(&self, now: Duration) -> bool {
        now.saturating_sub(self.heard) >= SILENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quiet_connection_beats_and_a_silent_one_is_dead_after_three_missed_beats() {
        let at = Duration::from_millis;
        let mut watch = Liveness::new(at(1000));
        assert!(!watch.owes_beat(at(1499)) && watch.owes_beat(at(1500)));
        watch.spoke(at(1500));
        assert!(!watch.owes_beat(at(1999)));
        assert_eq!(watch.time_until_due(at(1600)), at(400), "a beat");
        assert!(!watch.is_silent(at(1000) + BEAT * MISSED_BEATS));
        assert!(!watch.is_silent(at(2749)) && watch.is_silent(at(2750)));
        watch.spoke(at(2400));
        assert_eq!(watch.time_until_due(at(2400)), at(350), "the end of the patience");
        watch.heard(at(2750));
        assert!(!watch.is_silent(at(3000)));
        // A moment before the last one is no overflow.
        assert!(!watch.is_silent(at(0)));
    }
}
