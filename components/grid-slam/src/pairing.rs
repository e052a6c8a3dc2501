//! Brings scans and odometry together by their stamps: a scan waits for an odometry that is not
//! older, and gets the pose interpolated at its own moment. What is paired with what depends on the
//! order within each of the two streams, never on which of them is ahead. Pure.

use std::collections::VecDeque;

use crate::pose::Pose;
use crate::scan::MapperScan;

/// Most scans that wait; a minute of a fast laser. Beyond it the oldest is dropped and counted.
pub const MAX_WAITING: usize = 2_400;
/// Odometry is remembered for so many readings: half a minute of a fast base.
const MAX_ODOMETRY: usize = 3_000;
/// Odometry whose stamps go back by more than this restarts, seconds; recorders' go back by less.
const ANEW_S: f64 = 5.0;
/// A scan whose stamp went back waits for odometry that does too until that is so far ahead,
/// seconds.
const PATIENCE_S: f64 = 2.0;

/// The scans and odometry that have not met yet.
#[derive(Debug, Default)]
pub struct Pairing {
    scans: VecDeque<MapperScan>,
    /// As it came.
    odometry: VecDeque<(f64, Pose)>,
    /// The reading in `odometry` that the last scan got, or the one after its moment.
    used: usize,
    /// Stamp of the last scan that met its odometry.
    last_s: Option<f64>,
    dropped: u64,
}

impl Pairing {
    /// Takes `odom_from_robot` at a stamp in seconds.
    pub fn odometry_seen(&mut self, stamp_s: f64, odom_from_robot: Pose) {
        if !odom_from_robot.is_finite() || !stamp_s.is_finite() {
            return;
        }
        self.odometry.push_back((stamp_s, odom_from_robot));
        if self.odometry.len() > MAX_ODOMETRY {
            self.odometry.pop_front();
            self.used = self.used.saturating_sub(1);
        }
    }

    /// Takes a scan.
    pub fn scan_seen(&mut self, scan: MapperScan) {
        if !scan.stamp_s.is_finite() {
            return;
        }
        self.scans.push_back(scan);
        if self.scans.len() > MAX_WAITING {
            self.scans.pop_front();
            self.dropped += 1;
        }
    }

    /// Scans dropped because no odometry came for them.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The next scan whose odometry is known, in the order they came. Of several scans with one
    /// stamp, as coarse clocks give, each gets a reading of its own.
    pub fn next_pair(&mut self) -> Option<(Pose, MapperScan)> {
        let (stamp_s, found) = loop {
            let stamp_s = self.scans.front()?.stamp_s;
            let found = match self.last_s {
                Some(last_s) if stamp_s < last_s => self.back_at(stamp_s, last_s)?,
                Some(last_s) if stamp_s == last_s => self.another_at(stamp_s)?,
                _ => self.on_from(self.used, stamp_s)?,
            };
            if stamp_s <= self.odometry[found].0 + PATIENCE_S {
                break (stamp_s, found);
            }
            // The odometry has restarted, and nothing of this scan's time is left to come.
            self.scans.pop_front();
            self.dropped += 1;
        };
        let (after_s, after) = self.odometry[found];
        let pose = match found.checked_sub(1).map(|earlier| self.odometry[earlier]) {
            Some((before_s, before)) if (before_s..after_s).contains(&stamp_s) => {
                before.towards(&after, (stamp_s - before_s) / (after_s - before_s))
            }
            _ => after,
        };
        (self.used, self.last_s) = (found, Some(stamp_s));
        self.forget_before(stamp_s);
        self.scans.pop_front().map(|scan| (pose, scan))
    }

    /// The first reading from one on that is not older than a stamp, or the last before time
    /// restarted; `None` if that is still to come.
    fn on_from(&self, first: usize, stamp_s: f64) -> Option<usize> {
        let readings = self.odometry.iter().enumerate().skip(first);
        let mut last_s = f64::NEG_INFINITY;
        for (number, &(odometry_s, _)) in readings {
            if odometry_s >= stamp_s {
                return Some(number);
            }
            if odometry_s < last_s - ANEW_S {
                return Some(number - 1);
            }
            last_s = odometry_s;
        }
        None
    }

    /// A second scan of the same moment: the next reading, if that is of this moment too.
    fn another_at(&self, stamp_s: f64) -> Option<usize> {
        if self.odometry[self.used].0 != stamp_s {
            return Some(self.used);
        }
        let (next_s, _) = self.odometry.get(self.used + 1)?;
        Some(self.used + usize::from(*next_s == stamp_s))
    }

    /// The scans' stamps went back from `last_s`: the odometry's do too, or those that were seen
    /// before remain valid if they continue without.
    fn back_at(&self, stamp_s: f64, last_s: f64) -> Option<usize> {
        let went_on = last_s.max(self.odometry[self.used].0) + PATIENCE_S;
        for number in self.used + 1..self.odometry.len() {
            let (before_s, now_s) = (self.odometry[number - 1].0, self.odometry[number].0);
            if (now_s < before_s && now_s <= stamp_s) || now_s < before_s - ANEW_S {
                return self.on_from(number, stamp_s);
            }
            if now_s > went_on {
                let is_here = |&n: &usize| self.odometry[n - 1].0 < stamp_s;
                return Some((1..=self.used).rev().find(is_here).unwrap_or(0));
            }
        }
        None
    }

    /// Forgets what no later scan asks for: all before the reading in use, but for as long as a
    /// scan out of order may look back.
    fn forget_before(&mut self, stamp_s: f64) {
        let is_old =
            |(odometry_s, _): &(f64, Pose)| !(0.0..ANEW_S).contains(&(stamp_s - odometry_s));
        while self.used > 1 && is_old(&self.odometry[0]) {
            self.odometry.pop_front();
            self.used -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(stamp_s: f64) -> MapperScan {
        MapperScan { stamp_s, ..MapperScan::default() }
    }

    /// Odometry at x = 10 * stamp for the given stamps, and what the scans are paired with.
    fn check(odometry_s: &[f64], scans_s: &[f64], expected: &[(f64, f64)]) {
        let mut pairing = Pairing::default();
        for stamp_s in scans_s {
            pairing.scan_seen(scan(*stamp_s));
        }
        for stamp_s in odometry_s {
            pairing.odometry_seen(*stamp_s, Pose::new(10.0 * stamp_s, 0.0, 0.0));
        }
        let pairs: Vec<_> = std::iter::from_fn(|| pairing.next_pair())
            .map(|(pose, scan)| (scan.stamp_s, pose.x_m))
            .collect();
        assert_eq!(pairs, expected, "odometry {odometry_s:?}, scans {scans_s:?}");
    }

    #[test]
    fn a_scan_gets_the_odometry_of_its_own_moment() {
        check(&[1.0, 2.0], &[1.0, 1.5, 2.0], &[(1.0, 10.0), (1.5, 15.0), (2.0, 20.0)]);
        check(&[1.0, 1.0, 2.0], &[1.0, 1.0], &[(1.0, 10.0), (1.0, 10.0)]);
    }

    #[test]
    fn a_scan_waits_for_odometry_that_is_not_older() {
        check(&[1.0], &[1.5], &[]);
        check(&[1.0, 2.0], &[1.5, 2.5], &[(1.5, 15.0)]);
        check(&[], &[1.0], &[]);
    }

    #[test]
    fn a_scan_before_all_odometry_gets_the_first() {
        check(&[2.0], &[1.0], &[(1.0, 20.0)]);
    }

    #[test]
    fn stamps_that_go_back_a_little_lose_nothing_however_scans_lag() {
        let stamps_s = [1.0, 2.0, 3.0, 2.9, 4.0];
        for lag in 0..=stamps_s.len() {
            let (mut pairing, mut found) = (Pairing::default(), Vec::new());
            for number in 0..stamps_s.len() + lag {
                if let Some(&stamp_s) = stamps_s.get(number) {
                    pairing.odometry_seen(stamp_s, Pose::new(10.0 * stamp_s, 0.0, 0.0));
                }
                if let Some(late) = number.checked_sub(lag).and_then(|i| stamps_s.get(i)) {
                    pairing.scan_seen(scan(*late));
                }
                found.extend(std::iter::from_fn(|| pairing.next_pair()).map(|(p, _)| p.x_m));
            }
            assert_eq!(found, [10.0, 20.0, 30.0, 29.0, 40.0], "scans {lag} behind");
        }
    }

    /// What the scans are paired with if so many readings come before the first scan, and so many
    /// more of one than of the other at a time.
    fn paired(stream: &[(f64, f64)], scans_s: &[f64], ahead: usize, turns: [usize; 2]) -> Vec<f64> {
        let (mut pairing, mut found) = (Pairing::default(), Vec::new());
        let (mut readings, mut scans) = (stream.iter(), scans_s.iter());
        let mut due = ahead + turns[0];
        while !(readings.as_slice().is_empty() && scans.as_slice().is_empty()) {
            for (stamp_s, x_m) in readings.by_ref().take(due) {
                pairing.odometry_seen(*stamp_s, Pose::new(*x_m, 0.0, 0.0));
                found.extend(std::iter::from_fn(|| pairing.next_pair()).map(|(p, _)| p.x_m));
            }
            for stamp_s in scans.by_ref().take(turns[1]) {
                pairing.scan_seen(scan(*stamp_s));
                found.extend(std::iter::from_fn(|| pairing.next_pair()).map(|(p, _)| p.x_m));
            }
            due = turns[0];
        }
        found
    }

    /// The same pairs, whichever of both streams is ahead and by how much.
    fn check_order(stream: &[(f64, f64)], scans_s: &[f64], expected: &[f64]) {
        for ahead in 0..=stream.len() {
            for turns in [[1, 1], [1, 3], [3, 1], [2, 1], [1, 100], [100, 1]] {
                let found = paired(stream, scans_s, ahead, turns);
                assert_eq!(found, expected, "{ahead} readings ahead, {turns:?} at a time");
            }
        }
    }

    #[test]
    fn pairs_do_not_depend_on_which_stream_is_ahead() {
        // Stamps of a real log: back by 0.9 s, twice the same, back again.
        let stamps_s = [1.0, 2.0, 3.0, 2.1, 4.0, 4.0, 4.0, 3.9, 3.95, 7.0];
        let stream: Vec<_> = (0..).map(f64::from).zip(stamps_s).map(|(x, s)| (s, x)).collect();
        let own: Vec<_> = stream.iter().map(|(_, x_m)| *x_m).collect();
        check_order(&stream, &stamps_s, &own);
    }

    #[test]
    fn odometry_that_does_not_go_back_is_looked_for_behind() {
        let stream: Vec<_> = (0..100).map(|i| f64::from(i) * 0.1).map(|s| (s, s)).collect();
        check_order(&stream, &[1.05, 2.05, 1.95, 2.15], &[1.05, 2.05, 1.95, 2.15]);
    }

    #[test]
    fn odometry_that_goes_back_alone_is_passed_over() {
        let stamps_s = [1.0, 2.0, 1.8, 2.2, 3.0];
        let stream: Vec<_> = stamps_s.map(|stamp_s| (stamp_s, 10.0 * stamp_s)).to_vec();
        check_order(&stream, &[1.5, 2.1, 2.6], &[15.0, 21.0, 26.0]);
    }

    #[test]
    fn time_that_restarts_takes_both_along() {
        let stream = [(98.0, 1.0), (99.0, 2.0), (100.0, 3.0), (0.5, 4.0), (1.5, 6.0), (2.5, 7.0)];
        check_order(&stream, &[98.0, 100.4, 0.4, 1.0, 2.5], &[1.0, 3.0, 4.0, 5.0, 7.0]);
        let mut pairing = Pairing::default();
        for (stamp_s, x_m) in stream {
            pairing.odometry_seen(stamp_s, Pose::new(x_m, 0.0, 0.0));
        }
        pairing.scan_seen(scan(150.0));
        assert!(pairing.next_pair().is_none() && pairing.dropped() == 1, "of another time");
    }

    #[test]
    fn scans_of_one_stamp_get_a_reading_each_whatever_comes_first() {
        let readings = [(1.0, 10.0), (1.0, 11.0), (1.0, 12.0), (2.0, 20.0)];
        for known in 0..=readings.len() {
            let (mut pairing, mut found) = (Pairing::default(), Vec::new());
            let mut see = |pairing: &mut Pairing, readings: &[(f64, f64)]| {
                for (stamp_s, x_m) in readings {
                    pairing.odometry_seen(*stamp_s, Pose::new(*x_m, 0.0, 0.0));
                    found.extend(std::iter::from_fn(|| pairing.next_pair()).map(|(p, _)| p.x_m));
                }
            };
            see(&mut pairing, &readings[..known]);
            for stamp_s in [1.0, 1.0, 1.0, 1.0, 1.5] {
                pairing.scan_seen(scan(stamp_s));
            }
            see(&mut pairing, &readings[known..]);
            found.extend(std::iter::from_fn(|| pairing.next_pair()).map(|(p, _)| p.x_m));
            assert_eq!(found, [10.0, 11.0, 12.0, 12.0, 16.0], "{known} were known before");
        }
    }

    #[test]
    fn turning_goes_the_short_way() {
        let mut pairing = Pairing::default();
        pairing.odometry_seen(0.0, Pose::new(0.0, 0.0, 3.0));
        pairing.odometry_seen(1.0, Pose::new(0.0, 0.0, -3.0));
        pairing.scan_seen(scan(0.5));
        let yaw_rad = pairing.next_pair().unwrap().0.yaw_rad;
        assert!((yaw_rad.abs() - std::f64::consts::PI).abs() < 1e-9, "{yaw_rad}");
    }

    #[test]
    fn scans_without_odometry_are_bounded_and_counted() {
        let mut pairing = Pairing::default();
        for index in 0..MAX_WAITING + 5 {
            pairing.scan_seen(scan(index as f64));
        }
        assert_eq!(pairing.dropped(), 5);
        pairing.odometry_seen(1e9, Pose::default());
        assert_eq!(pairing.next_pair().unwrap().1.stamp_s, 5.0, "the oldest were dropped");
    }
}
