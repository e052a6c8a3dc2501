//! The two clocks of a mission, without a clock. Mission time is what the file speaks of: timeouts,
//! intervals, periods, answers, the journal; it follows the system's `<clock>` where there is one.
//! Host time is for what is asked of real processes and people: confirmations, starts, returns,
//! the lease. Without a `<clock>` both are one.

use crate::journal::Anchor;
use crate::ledger::{Ledger, Phase};
use armor_sdk::{ClockReading, Passage};
use std::collections::BTreeMap;
use std::time::Duration;

/// What time it is, on both clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockReadings {
    /// Mission time.
    pub mission: Duration,
    /// Host time, from any zero.
    pub host: Duration,
}

impl From<Duration> for ClockReadings {
    /// Both clocks are one.
    fn from(now: Duration) -> Self {
        Self { mission: now, host: now }
    }
}

/// When something is due if nothing else happens, on each clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Deadlines {
    /// In mission time.
    pub mission: Option<Duration>,
    /// In host time.
    pub host: Option<Duration>,
}

impl Deadlines {
    /// Whether one of them has come.
    pub fn are_due(&self, now: ClockReadings) -> bool {
        let has_come = |due: Option<Duration>, now| due.is_some_and(|due| due <= now);
        has_come(self.mission, now.mission) || has_come(self.host, now.host)
    }
}

/// Mission time that follows data.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FollowedTime {
    now: Duration,
    anchor: Option<Anchor>,
}

impl FollowedTime {
    /// Continues from `now`, and from where the journal ties it to the data if that still applies.
    pub(crate) fn new(now: Duration, anchor: Option<Anchor>) -> Self {
        Self { now, anchor }
    }

    pub(crate) fn now(&self) -> Duration {
        self.now
    }

    /// Takes in a reading. Where the data jumps, or comes from another process start, no time
    /// passes; the new anchor is to be written down then.
    pub(crate) fn read(&mut self, reading: ClockReading, passage: Passage) -> Option<Anchor> {
        let holds = self
            .anchor
            .filter(|anchor| anchor.instance == reading.instance && passage != Passage::Jumps);
        let passed = holds.and_then(|anchor| {
            let since = Duration::try_from_secs_f64(reading.stamp_s - anchor.stamp_s).ok()?;
            Some(Duration::from_nanos(anchor.at_ns).saturating_add(since))
        });
        if let Some(now) = passed.filter(|now| *now >= self.now) {
            self.now = now;
            return None;
        }
        let at_ns = u64::try_from(self.now.as_nanos()).unwrap_or(u64::MAX);
        self.anchor = Some(Anchor { instance: reading.instance, stamp_s: reading.stamp_s, at_ns });
        self.anchor
    }
}

/// The parts of a firing that restart its waiting when they change.
type Step = (Duration, Phase, bool);

/// When, in host time, the ledger came to be where it is: the journal knows mission time alone.
#[derive(Clone, Debug, Default)]
pub(crate) struct HostTimes {
    firings: BTreeMap<u64, (Step, Duration)>,
    resumed: (Duration, Duration),
    changed: (Duration, Duration),
}

impl HostTimes {
    /// Notes what has changed by the last record.
    pub(crate) fn follow(&mut self, ledger: &Ledger, host: Duration) {
        self.firings.retain(|number, _| ledger.firings().contains_key(number));
        for (number, firing) in ledger.firings() {
            let step = (firing.since, firing.phase, firing.redirected);
            let known = self.firings.entry(*number).or_insert((step, host));
            if known.0 != step {
                *known = (step, host);
            }
        }
        if self.resumed.0 != ledger.authority().resumed_at() {
            self.resumed = (ledger.authority().resumed_at(), host);
        }
        if self.changed.0 != ledger.version_since() {
            self.changed = (ledger.version_since(), host);
        }
    }

    /// Since when a firing is where it is.
    pub(crate) fn since(&self, firing: u64) -> Duration {
        self.firings.get(&firing).map_or(Duration::ZERO, |known| known.1)
    }

    /// When the last pause ended.
    pub(crate) fn resumed(&self) -> Duration {
        self.resumed.1
    }

    /// When the version of the file was taken.
    pub(crate) fn changed(&self) -> Duration {
        self.changed.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn reading(stamp_s: f64, instance: u64) -> ClockReading {
        ClockReading { stamp_s, instance }
    }

    #[test]
    fn mission_time_passes_as_the_data_does_and_not_where_it_jumps() {
        let mut time = FollowedTime::new(Duration::ZERO, None);
        let begun = time.read(reading(1000.0, 7), Passage::Begins).expect("an anchor");
        assert_eq!((begun.at_ns, time.now()), (0, Duration::ZERO));
        assert_eq!(time.read(reading(1002.0, 7), Passage::Passes), None);
        assert_eq!(time.now(), 2 * SECOND);
        assert!(time.read(reading(5.0, 7), Passage::Jumps).is_some());
        assert!(time.read(reading(9000.0, 8), Passage::Jumps).is_some());
        assert_eq!(time.now(), 2 * SECOND, "a restarted simulator takes no time");
        assert_eq!(time.read(reading(9001.0, 8), Passage::Passes), None);
        assert_eq!(time.now(), 3 * SECOND);
    }

    #[test]
    fn a_restarted_executive_continues_with_the_data_if_its_source_is_the_same() {
        let anchor = Anchor { instance: 7, stamp_s: 1000.0, at_ns: 1_000_000_000 };
        let mut same = FollowedTime::new(3 * SECOND, Some(anchor));
        assert_eq!(same.read(reading(1010.0, 7), Passage::Begins), None);
        assert_eq!(same.now(), 11 * SECOND, "time has passed while no executive ran");
        let mut other = FollowedTime::new(3 * SECOND, Some(anchor));
        assert!(other.read(reading(1010.0, 8), Passage::Begins).is_some());
        assert_eq!(other.now(), 3 * SECOND, "the journal's last record is all that is known");
    }
}
