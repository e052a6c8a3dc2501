//! A trajectory as a line that stays short enough to be drawn in every frame.

use std::collections::VecDeque;

use armor_grid::{Point2, Pose2};

/// Points nearer to the last one than this are left out, in metres.
const STEP_M: f64 = 0.05;
/// Most points; with more every other one of them is left out.
const MAX_POINTS: usize = 20_000;
/// Poses kept for interpolation at earlier times: ten seconds at 100 Hz.
const MAX_RECENT: usize = 1000;

/// A growing trajectory in a frame of its own, and its newest poses by time.
#[derive(Clone, Debug, Default)]
pub struct TrajectoryLine {
    /// `map_from_frame`, once it is known.
    pub map_from_frame: Option<Pose2>,
    points: Vec<Point2>,
    step_m: f64,
    recent: VecDeque<(f64, Pose2)>,
}

impl TrajectoryLine {
    /// Adds a pose of the time `stamp_s`. A pose that is not finite, or earlier than the last one,
    /// is left out; a time far in the past means a restart, and clears the trajectory.
    pub fn push(&mut self, stamp_s: f64, pose: Pose2) {
        if ![stamp_s, pose.x_m, pose.y_m, pose.yaw_rad].into_iter().all(f64::is_finite) {
            return;
        }
        match self.recent.back() {
            Some((last_s, _)) if *last_s - stamp_s > 1.0 => *self = Self::default(),
            Some((last_s, _)) if *last_s >= stamp_s => return,
            _ => {}
        }
        if self.recent.len() == MAX_RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back((stamp_s, pose));
        let point = pose.point();
        let is_far = |last: &Point2| last.distance_m(point) >= self.step_m.max(STEP_M);
        if self.points.last().is_none_or(is_far) {
            self.points.push(point);
        }
        if self.points.len() > MAX_POINTS {
            self.step_m = 2.0 * self.step_m.max(STEP_M);
            let mut is_kept = false;
            self.points.retain(|_| {
                is_kept = !is_kept;
                is_kept
            });
        }
    }

    /// Returns the last pose with its time.
    pub fn last(&self) -> Option<(f64, Pose2)> {
        self.recent.back().copied()
    }

    /// Returns the pose at a time, interpolated. After the newest pose it is the newest; before the
    /// oldest one it is unknown.
    pub fn at(&self, stamp_s: f64) -> Option<Pose2> {
        let next = self.recent.partition_point(|(at_s, _)| *at_s < stamp_s);
        let Some((after_s, after)) = self.recent.get(next) else {
            return self.recent.back().map(|(_, pose)| *pose);
        };
        let Some((before_s, before)) = next.checked_sub(1).and_then(|n| self.recent.get(n)) else {
            return (*after_s == stamp_s).then_some(*after);
        };
        Some(before.toward(*after, (stamp_s - before_s) / (after_s - before_s)))
    }

    /// Returns the kept poses after a time, in its own frame.
    pub fn since(&self, stamp_s: f64) -> impl Iterator<Item = Point2> + '_ {
        let first = self.recent.partition_point(|(at_s, _)| *at_s <= stamp_s);
        self.recent.range(first..).map(|(_, pose)| pose.point())
    }

    /// Returns the trajectory on the map; empty until `map_from_frame` is known.
    pub fn line(&self) -> impl Iterator<Item = Point2> + '_ {
        let newest = self.recent.back().map(|(_, pose)| pose.point());
        let points = self.points.iter().copied().chain(newest);
        self.map_from_frame
            .into_iter()
            .flat_map(move |frame| points.clone().map(move |point| frame.apply(point)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_it_was_is_found_between_poses() {
        let mut track = TrajectoryLine::default();
        track.push(1.0, Pose2::new(0.0, 0.0, 0.0));
        track.push(2.0, Pose2::new(1.0, 0.0, 1.0));
        assert_eq!(track.at(1.5), Some(Pose2::new(0.5, 0.0, 0.5)));
        assert_eq!(track.at(9.0), Some(Pose2::new(1.0, 0.0, 1.0)));
        assert_eq!((track.at(1.0).map(|p| p.x_m), track.at(0.5)), (Some(0.0), None));
    }

    #[test]
    fn a_long_way_is_drawn_with_few_points() {
        let mut track =
            TrajectoryLine { map_from_frame: Some(Pose2::IDENTITY), ..TrajectoryLine::default() };
        for n in 0..100_000 {
            track.push(f64::from(n), Pose2::new(0.06 * f64::from(n), 0.0, 0.0));
        }
        let line: Vec<_> = track.line().collect();
        assert!(line.len() <= MAX_POINTS + 1, "{}", line.len());
        assert_eq!(line.first().map(|p| p.x_m), Some(0.0));
        assert_eq!(line.last().map(|p| p.x_m), Some(0.06 * 99_999.0));
    }

    #[test]
    fn what_is_nowhere_is_left_out_and_a_new_start_begins_a_new_way() {
        let mut track =
            TrajectoryLine { map_from_frame: Some(Pose2::IDENTITY), ..TrajectoryLine::default() };
        track.push(100.0, Pose2::new(5.0, 0.0, 0.0));
        track.push(101.0, Pose2::new(f64::NAN, 0.0, 0.0));
        track.push(100.5, Pose2::new(6.0, f64::INFINITY, 0.0));
        assert_eq!(track.last().map(|(s, _)| s), Some(100.0));
        track.push(2.0, Pose2::new(0.0, 0.0, 0.0));
        assert_eq!((track.last().map(|(s, _)| s), track.map_from_frame), (Some(2.0), None));
    }
}
