//! Poses as they come: lines of text waiting to be written, and a thinned line to be drawn. Both
//! cost the same for the millionth pose as for the first.

use std::collections::VecDeque;
use std::fmt::Write;

use armor_grid::{Point2, Pose2};

/// The first line of `trajectory.csv`.
pub(crate) const HEADER: &str = "scan,timestamp_s,x_m,y_m,theta_rad\n";
/// Poses closer together than this are drawn as one, in metres.
const THIN_M: f64 = 0.05;

/// Poses newer than a correction are kept, so that it does not lose them; so many at most.
const MOST_SINCE: usize = 100_000;

/// Everywhere the robot has been.
#[derive(Debug, Default)]
pub(crate) struct WrittenTrajectory {
    count: u64,
    /// Poses since the last correction.
    since: VecDeque<(f64, Pose2)>,
    corrected_s: Option<f64>,
    corrected: u64,
    /// The next write replaces the file, because the lines in it are outdated.
    starts_over: bool,
    newest_s: Option<f64>,
    newest: Option<Point2>,
    line: Vec<Point2>,
    unwritten: String,
}

impl WrittenTrajectory {
    /// Replaces all poses up to a stamp by corrected ones; newer poses are kept as they arrived.
    pub(crate) fn correct_poses(
        &mut self,
        stamp_s: f64,
        poses: impl Iterator<Item = (f64, Pose2)>,
    ) {
        // Compare by order of arrival: the stamps of a recording can jump backwards.
        let last = self.since.iter().rposition(|(own_s, _)| *own_s == stamp_s);
        let covered = last.map_or(0, |last| last + 1);
        let is_newer = |(own_s, _): &(f64, Pose2)| last.is_some() || *own_s > stamp_s;
        let newer: Vec<_> = self.since.drain(..).skip(covered).filter(is_newer).collect();
        *self = Self { starts_over: true, corrected_s: Some(stamp_s), ..Self::default() };
        poses.for_each(|(stamp_s, pose)| self.line_of(stamp_s, pose));
        self.corrected = self.count;
        newer.into_iter().for_each(|(stamp_s, pose)| self.push(stamp_s, pose));
    }

    /// Adds the pose at a stamp, unless a correction has brought it already.
    pub(crate) fn push(&mut self, stamp_s: f64, pose: Pose2) {
        if self.corrected_s.is_some_and(|corrected_s| stamp_s <= corrected_s) {
            return;
        }
        self.since.push_back((stamp_s, pose));
        if self.since.len() > MOST_SINCE {
            self.since.pop_front();
        }
        self.line_of(stamp_s, pose);
    }

    fn line_of(&mut self, stamp_s: f64, pose: Pose2) {
        let Pose2 { x_m, y_m, yaw_rad } = pose;
        // Micrometres and microseconds: as exact as any sensor, and short.
        writeln!(self.unwritten, "{},{stamp_s:.6},{x_m:.6},{y_m:.6},{yaw_rad:.6}", self.count)
            .expect("writing to a string cannot fail");
        self.count += 1;
        self.newest_s = Some(stamp_s);
        self.newest = Some(pose.point());
        if self.line.last().is_none_or(|last| last.distance_m(pose.point()) >= THIN_M) {
            self.line.push(pose.point());
        }
    }

    /// Up to which stamp the poses are corrected, in seconds; `None` if corrections never came.
    pub(crate) fn corrected_s(&self) -> Option<f64> {
        self.corrected_s
    }

    /// Number of poses that are corrected.
    pub(crate) fn count_corrected(&self) -> u64 {
        self.corrected
    }

    /// Returns whether the unwritten lines replace the file instead of being appended to it.
    pub(crate) fn starts_over(&self) -> bool {
        self.starts_over
    }

    /// Returns the number of poses.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Returns the stamp of the newest pose, in seconds.
    pub(crate) fn newest_s(&self) -> Option<f64> {
        self.newest_s
    }

    /// Returns the line to draw, ending at the newest pose.
    pub(crate) fn line(&self) -> impl Iterator<Item = Point2> + Clone + '_ {
        self.line.iter().copied().chain(self.newest)
    }

    /// Returns the lines of text that were not written yet.
    pub(crate) fn unwritten_lines(&self) -> &str {
        &self.unwritten
    }

    /// Makes the next write replace the file, which may hold the poses of another run.
    pub(crate) fn start_over(&mut self) {
        self.starts_over = true;
    }

    /// Forgets the lines: the file now holds them.
    pub(crate) fn mark_written(&mut self) {
        self.unwritten.clear();
        self.starts_over = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pose_is_a_line_of_text() {
        let mut trajectory = WrittenTrajectory::default();
        trajectory.push(32.9068, Pose2::new(0.600266, -0.0320327, -0.354665));
        trajectory.push(35.1051, Pose2::new(0.68231, -0.100086, -0.938803));
        let expected = "0,32.906800,0.600266,-0.032033,-0.354665\n\
                        1,35.105100,0.682310,-0.100086,-0.938803\n";
        assert_eq!(trajectory.unwritten_lines(), expected);
        trajectory.mark_written();
        trajectory.push(36.0, Pose2::IDENTITY);
        assert_eq!(trajectory.unwritten_lines(), "2,36.000000,0.000000,0.000000,0.000000\n");
    }

    #[test]
    fn standing_still_adds_nothing_to_draw() {
        let mut trajectory = WrittenTrajectory::default();
        for scan in 0..1000 {
            trajectory.push(f64::from(scan), Pose2::new(1.0, 2.0, 0.0));
        }
        assert_eq!(trajectory.count(), 1000);
        assert_eq!(trajectory.line().count(), 2);
    }

    #[test]
    fn a_correction_replaces_the_old_poses_and_keeps_the_new() {
        let mut trajectory = WrittenTrajectory::default();
        for stamp_s in [1.0, 2.0, 3.0] {
            trajectory.push(stamp_s, Pose2::new(stamp_s, 0.0, 0.0));
        }
        trajectory.mark_written();
        let corrected = [1.0, 2.0].map(|stamp_s| (stamp_s, Pose2::new(stamp_s, 0.5, 0.0)));
        trajectory.correct_poses(2.0, corrected.into_iter());
        let expected = "0,1.000000,1.000000,0.500000,0.000000\n\
                        1,2.000000,2.000000,0.500000,0.000000\n\
                        2,3.000000,3.000000,0.000000,0.000000\n";
        assert_eq!(trajectory.unwritten_lines(), expected);
        assert!(trajectory.starts_over() && trajectory.count() == 3);
        trajectory.push(1.5, Pose2::IDENTITY);
        assert_eq!(trajectory.count(), 3, "what comes late is in the correction already");
        assert_eq!(trajectory.count_corrected(), 2);
    }

    #[test]
    fn stamps_that_go_back_leave_no_pose_twice() {
        let mut trajectory = WrittenTrajectory::default();
        let stamps_s = [1.0, 3.0, 2.0, 2.5];
        stamps_s.iter().for_each(|&stamp_s| trajectory.push(stamp_s, Pose2::IDENTITY));
        trajectory
            .correct_poses(2.0, stamps_s[..3].iter().map(|&stamp_s| (stamp_s, Pose2::IDENTITY)));
        assert_eq!((trajectory.count(), trajectory.count_corrected()), (4, 3));
    }
}
