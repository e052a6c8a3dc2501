//! Brings scans and odometry together by their stamps: a scan waits for an odometry that is not
//! older, and gets the pose interpolated at its own moment. Pure.

use std::collections::VecDeque;

use crate::pose::{Pose, wrapped};
use crate::scan::Scan;

/// Most scans that wait; a minute of a fast laser. Beyond it the oldest is dropped and counted.
pub const MAX_WAITING: usize = 2_400;
/// Odometry is remembered for so many readings: half a minute of a fast base.
const MAX_ODOMETRY: usize = 3_000;
/// Stamps that go back by more than this begin anew, seconds; recorders' stamps go back by less.
const ANEW_S: f64 = 5.0;

/// The scans and odometry that have not met yet.
#[derive(Debug, Default)]
pub struct Pairing {
    scans: VecDeque<Scan>,
    odometry: VecDeque<(f64, Pose)>,
    /// Stamp of the reading that a scan of the same moment has got, the first in `odometry` of it.
    taken_s: Option<f64>,
    dropped: u64,
}

impl Pairing {
    /// Takes `odom_from_robot` at a stamp in seconds. Much
    /// older than the newest: time has begun anew; a little: stamps came out of order.
    pub fn odometry_seen(&mut self, stamp_s: f64, odom_from_robot: Pose) {
        if !odom_from_robot.is_finite() || !stamp_s.is_finite() {
            return;
        }
        if self.odometry.back().is_some_and(|(newest_s, _)| stamp_s < *newest_s - ANEW_S) {
            self.odometry.clear();
            self.taken_s = None;
        }
        let place = self.odometry.partition_point(|(earlier_s, _)| *earlier_s <= stamp_s);
        self.odometry.insert(place, (stamp_s, odom_from_robot));
        if self.odometry.len() > MAX_ODOMETRY {
            self.odometry.pop_front();
        }
    }

    /// Takes a scan.
    pub fn scan_seen(&mut self, scan: Scan) {
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

    /// The next scan whose odometry is known, oldest first. Of several scans with one stamp, as coarse
    /// clocks give, each gets a reading of its own.
    pub fn next_pair(&mut self) -> Option<(Pose, Scan)> {
        let stamp_s = self.scans.front()?.stamp_s;
        let first = self.odometry.iter().position(|(odometry_s, _)| *odometry_s >= stamp_s)?;
        let is_taken = self.taken_s == Some(stamp_s) && self.odometry[first].0 == stamp_s;
        let later = first + usize::from(is_taken);
        if later == self.odometry.len() {
            return None;
        }
        let (after_s, after) = self.odometry[later];
        let pose = match later.checked_sub(1).map(|earlier| self.odometry[earlier]) {
            Some((before_s, before)) if after_s > before_s => {
                between(&before, &after, (stamp_s - before_s) / (after_s - before_s))
            }
            _ => after,
        };
        // What is older than this pair is of no more use, but for the reading just before it.
        self.odometry.drain(..later.saturating_sub(1));
        if after_s == stamp_s {
            if is_taken {
                self.odometry.pop_front();
            }
            self.taken_s = Some(stamp_s);
        }
        self.scans.pop_front().map(|scan| (pose, scan))
    }
}

/// The pose at `part` of the way (0 … 1), turning the short way round.
fn between(before: &Pose, after: &Pose, part: f64) -> Pose {
    Pose::new(
        before.x_m + part * (after.x_m - before.x_m),
        before.y_m + part * (after.y_m - before.y_m),
        wrapped(before.yaw_rad + part * wrapped(after.yaw_rad - before.yaw_rad)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(stamp_s: f64) -> Scan {
        Scan { stamp_s, ..Scan::default() }
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
