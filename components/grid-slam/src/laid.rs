//! One trajectory laid over another, scan by scan or by time: absolute errors.

use crate::evaluation::{EvaluationError, Trajectory};
use crate::pose::{Point, Pose};

/// Stamps of one scan differ by less, seconds.
const SAME_S: f64 = 1e-3;
/// A reference says nothing between two of its poses that are farther apart, seconds.
const GAP_S: f64 = 1.0;

/// A trajectory laid over a reference so that the squared distances are least (Horn 1987, in the
/// plane): for each scan of both its stamp, the laid pose and the reference's. Scans of one number
/// are the same where their stamps are; else the reference is another clock's, as a simulator's
/// truth, and its poses are taken at the scans' stamps.
///
/// # Errors
/// If they have no scan in common, nor any time.
pub fn laid_over(
    trajectory: &Trajectory,
    reference: &Trajectory,
) -> Result<Vec<(f64, Pose, Pose)>, EvaluationError> {
    let pairs = paired(trajectory, reference);
    if pairs.is_empty() {
        return Err(EvaluationError::Nothing);
    }
    let middle = |of: &dyn Fn(&(f64, Pose, Pose)) -> Pose| {
        let count = pairs.len() as f64;
        let sum = |axis: &dyn Fn(Pose) -> f64| pairs.iter().map(|p| axis(of(p))).sum::<f64>();
        Point { x_m: sum(&|pose| pose.x_m) / count, y_m: sum(&|pose| pose.y_m) / count }
    };
    let (own, other) = (middle(&|pair| pair.1), middle(&|pair| pair.2));
    let (mut along, mut across) = (0.0, 0.0);
    for (_, pose, reference) in &pairs {
        let (ax, ay) = (pose.x_m - own.x_m, pose.y_m - own.y_m);
        let (bx, by) = (reference.x_m - other.x_m, reference.y_m - other.y_m);
        along += ax * bx + ay * by;
        across += ax * by - ay * bx;
    }
    let to_other = Pose::new(other.x_m, other.y_m, f64::atan2(across, along));
    let laid = to_other * Pose::new(-own.x_m, -own.y_m, 0.0);
    Ok(pairs.into_iter().map(|(stamp_s, pose, other)| (stamp_s, laid * pose, other)).collect())
}

/// Stamp, pose and reference pose of each scan that both have.
fn paired(trajectory: &Trajectory, reference: &Trajectory) -> Vec<(f64, Pose, Pose)> {
    let common = trajectory.iter().filter_map(|(scan, (stamp_s, pose))| {
        reference.get(scan).map(|(other_s, other)| (stamp_s - other_s, (*stamp_s, *pose, *other)))
    });
    let common: Vec<_> = common.collect();
    let same = common.iter().filter(|(apart_s, _)| apart_s.abs() < SAME_S).count();
    if 2 * same > common.len() {
        return common.into_iter().map(|(_, pair)| pair).collect();
    }
    let mut by_time: Vec<(f64, Pose)> = reference.values().copied().collect();
    by_time.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = trajectory.values();
    all.filter_map(|&(stamp_s, pose)| Some((stamp_s, pose, at(&by_time, stamp_s)?))).collect()
}

/// The pose of a moment, between the two around it.
fn at(by_time: &[(f64, Pose)], stamp_s: f64) -> Option<Pose> {
    let after = by_time.partition_point(|(other_s, _)| *other_s < stamp_s);
    let &(after_s, after_pose) = by_time.get(after)?;
    if after_s - stamp_s < SAME_S {
        return Some(after_pose);
    }
    let (before_s, before) = by_time[after.checked_sub(1)?];
    let part = (stamp_s - before_s) / (after_s - before_s);
    (after_s - before_s <= GAP_S).then(|| before.towards(&after_pose, part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::wrapped;

    fn circle(stamps_s: impl Iterator<Item = f64>) -> Trajectory {
        let pose = |stamp_s: f64| {
            let angle = 0.1 * stamp_s;
            (stamp_s, Pose::new(5.0 * angle.cos(), 5.0 * angle.sin(), wrapped(angle)))
        };
        stamps_s.map(pose).enumerate().collect()
    }

    fn moved(trajectory: &Trajectory) -> Trajectory {
        let by = Pose::new(3.0, -7.0, 2.1);
        trajectory.iter().map(|(&i, &(stamp_s, pose))| (i, (stamp_s, by * pose))).collect()
    }

    fn check(found: &Trajectory, reference: &Trajectory, count: usize, most_m: f64) {
        let laid = laid_over(found, reference).unwrap();
        assert_eq!(laid.len(), count);
        for (stamp_s, laid, reference) in laid {
            assert!(laid.distance_m(&reference) < most_m, "{stamp_s}: {laid:?}, not {reference:?}");
            assert!(wrapped(laid.yaw_rad - reference.yaw_rad).abs() < most_m);
        }
    }

    #[test]
    fn a_moved_and_turned_trajectory_lies_on_its_reference() {
        let truth = circle((0..40).map(f64::from));
        check(&moved(&truth), &truth, 40, 1e-9);
    }

    #[test]
    fn another_clock_is_followed_by_time() {
        let found = circle((0..40).map(|i| f64::from(i) * 0.5 + 0.25));
        let truth = circle((0..200).map(|i| f64::from(i) * 0.1));
        check(&moved(&found), &truth, 40, 1e-3);
        let gap: Trajectory = truth.into_iter().filter(|(i, _)| !(50..150).contains(i)).collect();
        check(&found, &gap, 20, 1e-3);
    }

    #[test]
    fn two_of_different_days_have_nothing_in_common() {
        let (found, other) =
            (circle((0..9).map(f64::from)), circle((0..9).map(|i| 1e6 + f64::from(i))));
        assert_eq!(laid_over(&found, &other), Err(EvaluationError::Nothing));
        assert_eq!(laid_over(&found, &Trajectory::new()), Err(EvaluationError::Nothing));
    }
}
