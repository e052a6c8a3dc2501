//! The point to head for: some distance ahead on the path, as long as it can be seen (the
//! look-ahead point of pure pursuit; Coulter, CMU-RI-TR-92-01, 1992).

use armor_grid::{Point2, Pose2};

/// Where to head and how far it is to the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lead {
    /// The point to head for, on the map.
    pub(crate) target: Point2,
    /// What is left of the path, in metres.
    pub(crate) remaining_m: f64,
}

/// Finds the point `look_m` ahead on the path, nearer where the straight line to it is not open.
///
/// `None` for an empty path.
pub(crate) fn lead_point(
    path: &[Pose2],
    robot: Point2,
    look_m: f64,
    is_open: impl Fn(Point2) -> bool,
) -> Option<Lead> {
    let (nearest, _) = path
        .iter()
        .enumerate()
        .map(|(index, pose)| (index, pose.point().distance_m(robot)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let ahead = &path[nearest..];
    let remaining_m = robot.distance_m(ahead[0].point()) + length_m(ahead);
    // At least a short distance ahead, or a robot that stands off its path would head for its own
    // side.
    let mut target = ahead[0].point();
    for point in ahead.iter().map(|pose| pose.point()) {
        let away_m = robot.distance_m(point);
        if away_m > look_m || (away_m > look_m / 3.0 && !is_open(point)) {
            break;
        }
        target = point;
    }
    Some(Lead { target, remaining_m })
}

fn length_m(path: &[Pose2]) -> f64 {
    path.windows(2).map(|pair| pair[0].point().distance_m(pair[1].point())).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn corner() -> Vec<Pose2> {
        let along = (0..=10).map(|i| Pose2::new(f64::from(i) * 0.1, 0.0, 0.0));
        let up = (1..=10).map(|i| Pose2::new(1.0, f64::from(i) * 0.1, FRAC_PI_2));
        along.chain(up).collect()
    }

    fn check(robot: Point2, open: bool, expected: Point2, remaining_m: f64) {
        let found = lead_point(&corner(), robot, 0.55, |_| open).unwrap();
        assert!(found.target.distance_m(expected) < 1e-9, "{found:?}");
        assert!((found.remaining_m - remaining_m).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn it_looks_ahead_on_the_path() {
        check(Point2::new(0.0, 0.0), true, Point2::new(0.5, 0.0), 2.0);
        check(Point2::new(1.0, 0.9), true, Point2::new(1.0, 1.0), 0.1);
        check(Point2::new(0.8, 0.0), true, Point2::new(1.0, 0.5), 1.2);
    }

    #[test]
    fn it_does_not_cut_a_corner_that_is_closed() {
        check(Point2::new(0.8, 0.0), false, Point2::new(0.9, 0.0), 1.2);
    }

    #[test]
    fn no_path_no_lead() {
        assert_eq!(lead_point(&[], Point2::default(), 0.6, |_| true), None);
    }
}
