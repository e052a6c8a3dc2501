//! Where the robot is now: the newest pose on the map, carried on by the odometry since.

use std::collections::VecDeque;

use armor_grid::Pose2;

/// Odometry older than this is forgotten, in seconds; poses later than that are of no use.
const MEMORY_S: f64 = 5.0;

/// The recent odometry and its correction by the map.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseTrack {
    /// Stamps and poses in the odometry frame, oldest first.
    odometry: VecDeque<(f64, Pose2)>,
    /// A pose on the map whose moment the odometry has not reached yet.
    pending: Option<(f64, Pose2)>,
    map_from_odom: Option<Pose2>,
}

impl PoseTrack {
    /// Takes a new odometry pose; one that goes back in time starts a new track.
    pub(crate) fn odometry_seen(&mut self, stamp_s: f64, odom_from_robot: Pose2) {
        if self.odometry.back().is_some_and(|newest| stamp_s < newest.0) {
            *self = Self::default();
        }
        self.odometry.push_back((stamp_s, odom_from_robot));
        while self.odometry.front().is_some_and(|oldest| stamp_s - oldest.0 > MEMORY_S) {
            self.odometry.pop_front();
        }
        self.settle_correction();
    }

    /// Takes a pose on the map, valid at its stamp.
    pub(crate) fn pose_seen(&mut self, stamp_s: f64, map_from_robot: Pose2) {
        self.pending = Some((stamp_s, map_from_robot));
        self.settle_correction();
    }

    /// Forgets how the odometry lies on the map.
    pub(crate) fn forget_map(&mut self) {
        (self.pending, self.map_from_odom) = (None, None);
    }

    /// Returns the odometry pose at a moment: interpolated, or the newest if it is later.
    pub(crate) fn odom_from_robot_at(&self, stamp_s: f64) -> Option<Pose2> {
        let later = self.odometry.partition_point(|entry| entry.0 < stamp_s);
        let Some(&(after_s, after)) = self.odometry.get(later) else {
            return self.odometry.back().map(|entry| entry.1);
        };
        if after_s == stamp_s {
            return Some(after);
        }
        let &(before_s, before) = self.odometry.get(later.checked_sub(1)?)?;
        Some(before.toward(after, (stamp_s - before_s) / (after_s - before_s)))
    }

    /// Returns the newest odometry pose.
    pub(crate) fn odom_from_robot(&self) -> Option<Pose2> {
        self.odometry.back().map(|entry| entry.1)
    }

    /// Returns where the robot is on the map now.
    pub(crate) fn map_from_robot(&self) -> Option<Pose2> {
        Some(self.map_from_odom?.compose(self.odom_from_robot()?))
    }

    /// Fits the odometry frame to the pending pose once the odometry has caught up with it.
    fn settle_correction(&mut self) {
        let Some((stamp_s, map_from_robot)) = self.pending else { return };
        let caught_up = self.odometry.back().is_some_and(|newest| newest.0 >= stamp_s);
        // The very first pose need not wait: roughly right beats not knowing.
        if (caught_up || self.map_from_odom.is_none())
            && let Some(odom_from_robot) = self.odom_from_robot_at(stamp_s)
        {
            self.map_from_odom = Some(map_from_robot.compose(odom_from_robot.inverse()));
            if caught_up {
                self.pending = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(x_m: f64) -> Pose2 {
        Pose2::new(x_m, 0.0, 0.0)
    }

    #[test]
    fn odometry_carries_an_old_pose_on() {
        let mut track = PoseTrack::default();
        for tick in 0..10 {
            track.odometry_seen(f64::from(tick), along(f64::from(tick)));
        }
        assert_eq!(track.map_from_robot(), None);
        // At 4.5 s the robot was at (100, 0.5) looking along y; since then it drove 4.5 m.
        track.pose_seen(4.5, Pose2::new(100.0, 0.5, std::f64::consts::FRAC_PI_2));
        let now = track.map_from_robot().unwrap();
        assert!(now.point().distance_m(armor_grid::Point2::new(100.0, 5.0)) < 1e-9, "{now:?}");
    }

    #[test]
    fn a_pose_ahead_of_the_odometry_waits_for_it() {
        let mut track = PoseTrack::default();
        track.odometry_seen(0.0, along(0.0));
        track.pose_seen(0.0, along(10.0));
        track.pose_seen(1.0, along(12.0));
        assert_eq!(track.map_from_robot(), Some(along(10.0)));
        track.odometry_seen(2.0, along(4.0));
        assert_eq!(track.map_from_robot(), Some(along(14.0)));
    }

    #[test]
    fn time_going_back_starts_a_new_track() {
        let mut track = PoseTrack::default();
        track.odometry_seen(10.0, along(3.0));
        track.pose_seen(10.0, along(3.0));
        track.odometry_seen(1.0, along(0.0));
        assert_eq!(track.map_from_robot(), None);
    }
}
