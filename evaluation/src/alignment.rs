//! A trajectory aligned with a reference, and its absolute errors.

use armor_grid_slam::pose::{Point, Pose};

use crate::error::EvaluationError;
use crate::statistics::{Spread, measure_spread};
use crate::trajectory::ScanTrajectory;

/// Stamps of one scan differ by less, seconds.
const SAME_STAMP_S: f64 = 1e-3;
/// A reference is not interpolated between two of its poses that are farther apart, seconds.
const LARGEST_GAP_S: f64 = 1.0;

/// A pose of the trajectory after alignment, and the reference pose of the same moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignedPose {
    /// Stamp of the trajectory's scan, seconds.
    pub stamp_s: f64,
    /// The trajectory's pose in the frame of the reference.
    pub pose: Pose,
    /// The pose of the reference.
    pub reference: Pose,
}

impl AlignedPose {
    /// Returns the distance between pose and reference, metres.
    pub fn distance_m(&self) -> f64 {
        self.pose.distance_m(&self.reference)
    }
}

/// Distances to the reference, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsoluteErrors {
    /// Root of the mean square.
    pub rms_m: f64,
    /// Mean and standard deviation.
    pub spread: Spread,
    /// The largest.
    pub max_m: f64,
}

/// Returns the distances of aligned poses to their references; none if there are no poses.
pub fn measure_absolute_errors(aligned: &[AlignedPose]) -> Option<AbsoluteErrors> {
    let distances = aligned.iter().map(AlignedPose::distance_m);
    let spread = measure_spread(distances.clone());
    let rms_m = spread.mean.hypot(spread.deviation);
    let max_m = distances.fold(0.0, f64::max);
    (!aligned.is_empty()).then_some(AbsoluteErrors { rms_m, spread, max_m })
}

/// Aligns a trajectory with a reference so that the sum of the squared distances is least (Horn
/// 1987, in the plane), and returns the poses that both have. Scans are matched by number if most
/// of their stamps agree. Otherwise the reference has another clock or other scans, as a
/// simulator's truth, and is interpolated at the stamps of the trajectory.
///
/// # Errors
/// If they have no scan and no time in common.
pub fn align_to_reference(
    trajectory: &ScanTrajectory,
    reference: &ScanTrajectory,
) -> Result<Vec<AlignedPose>, EvaluationError> {
    let pairs = pair_poses(trajectory, reference);
    if pairs.is_empty() {
        return Err(EvaluationError::NothingInCommon);
    }
    let centroid = |of: &dyn Fn(&AlignedPose) -> Pose| {
        let count = pairs.len() as f64;
        let sum = |axis: &dyn Fn(Pose) -> f64| pairs.iter().map(|p| axis(of(p))).sum::<f64>();
        Point { x_m: sum(&|pose| pose.x_m) / count, y_m: sum(&|pose| pose.y_m) / count }
    };
    let (own, other) = (centroid(&|pair| pair.pose), centroid(&|pair| pair.reference));
    // The sums of the dot and cross products of the centred positions; their angle is the rotation.
    let (mut dot, mut cross) = (0.0, 0.0);
    for AlignedPose { pose, reference, .. } in &pairs {
        let (ax, ay) = (pose.x_m - own.x_m, pose.y_m - own.y_m);
        let (bx, by) = (reference.x_m - other.x_m, reference.y_m - other.y_m);
        dot += ax * bx + ay * by;
        cross += ax * by - ay * bx;
    }
    let reference_from_centroid = Pose::new(other.x_m, other.y_m, f64::atan2(cross, dot));
    let reference_from_own = reference_from_centroid * Pose::new(-own.x_m, -own.y_m, 0.0);
    let align = |pair: AlignedPose| AlignedPose { pose: reference_from_own * pair.pose, ..pair };
    Ok(pairs.into_iter().map(align).collect())
}

/// Returns the poses that both have, not yet aligned.
fn pair_poses(trajectory: &ScanTrajectory, reference: &ScanTrajectory) -> Vec<AlignedPose> {
    let common = trajectory.iter().filter_map(|(scan, &(stamp_s, pose))| {
        let &(reference_s, reference) = reference.get(scan)?;
        Some((stamp_s - reference_s, AlignedPose { stamp_s, pose, reference }))
    });
    let common: Vec<_> = common.collect();
    let same = common.iter().filter(|(apart_s, _)| apart_s.abs() < SAME_STAMP_S).count();
    if 2 * same > common.len() {
        return common.into_iter().map(|(_, pair)| pair).collect();
    }
    let mut by_time: Vec<(f64, Pose)> = reference.values().copied().collect();
    by_time.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pair = |&(stamp_s, pose): &(f64, Pose)| {
        Some(AlignedPose { stamp_s, pose, reference: interpolate_pose(&by_time, stamp_s)? })
    };
    trajectory.values().filter_map(pair).collect()
}

/// Returns the pose of a moment, interpolated between the two around it.
fn interpolate_pose(by_time: &[(f64, Pose)], stamp_s: f64) -> Option<Pose> {
    let after = by_time.partition_point(|(other_s, _)| *other_s < stamp_s);
    let &(after_s, after_pose) = by_time.get(after)?;
    if after_s - stamp_s < SAME_STAMP_S {
        return Some(after_pose);
    }
    let (before_s, before) = by_time[after.checked_sub(1)?];
    let part = (stamp_s - before_s) / (after_s - before_s);
    (after_s - before_s <= LARGEST_GAP_S).then(|| before.towards(&after_pose, part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_grid_slam::pose::wrapped;

    fn circle(stamps_s: impl Iterator<Item = f64>) -> ScanTrajectory {
        let pose = |stamp_s: f64| {
            let angle = 0.1 * stamp_s;
            (stamp_s, Pose::new(5.0 * angle.cos(), 5.0 * angle.sin(), wrapped(angle)))
        };
        stamps_s.map(pose).enumerate().collect()
    }

    fn moved(trajectory: &ScanTrajectory) -> ScanTrajectory {
        let by = Pose::new(3.0, -7.0, 2.1);
        trajectory.iter().map(|(&i, &(stamp_s, pose))| (i, (stamp_s, by * pose))).collect()
    }

    fn check(found: &ScanTrajectory, reference: &ScanTrajectory, count: usize, most_m: f64) {
        let aligned = align_to_reference(found, reference).unwrap();
        assert_eq!(aligned.len(), count);
        for AlignedPose { stamp_s, pose, reference } in aligned {
            assert!(pose.distance_m(&reference) < most_m, "{stamp_s}: {pose:?}, not {reference:?}");
            assert!(wrapped(pose.yaw_rad - reference.yaw_rad).abs() < most_m);
        }
    }

    #[test]
    fn a_moved_and_turned_trajectory_is_aligned_with_its_reference() {
        let truth = circle((0..40).map(f64::from));
        check(&moved(&truth), &truth, 40, 1e-9);
    }

    #[test]
    fn a_reference_with_another_clock_is_matched_by_time() {
        let found = circle((0..40).map(|i| f64::from(i) * 0.5 + 0.25));
        let truth = circle((0..200).map(|i| f64::from(i) * 0.1));
        check(&moved(&found), &truth, 40, 1e-3);
        let gap: ScanTrajectory =
            truth.into_iter().filter(|(i, _)| !(50..150).contains(i)).collect();
        check(&found, &gap, 20, 1e-3);
    }

    #[test]
    fn trajectories_of_different_days_have_nothing_in_common() {
        let (found, other) =
            (circle((0..9).map(f64::from)), circle((0..9).map(|i| 1e6 + f64::from(i))));
        assert_eq!(align_to_reference(&found, &other), Err(EvaluationError::NothingInCommon));
        assert_eq!(
            align_to_reference(&found, &ScanTrajectory::new()),
            Err(EvaluationError::NothingInCommon)
        );
    }
}
