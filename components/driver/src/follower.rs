//! The point to head for: some way ahead on the path, as long as it can be seen (the look-ahead
//! point of pure pursuit; Coulter, CMU-RI-TR-92-01, 1992).

use armor_grid::Point2;

/// Where to head and how far it is to the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lead {
    /// The point to head for, on the map.
    pub(crate) target: Point2,
    /// What is left of the path, in metres.
    pub(crate) remaining_m: f64,
}

/// Finds the point `look_m` ahead on the path, nearer where the straight line there is not open.
///
/// `None` for an empty path.
pub(crate) fn lead(
    path: &[Point2],
    robot: Point2,
    look_m: f64,
    is_open: impl Fn(Point2, Point2) -> bool,
) -> Option<Lead> {
    let (nearest, _) = path
        .iter()
        .enumerate()
        .map(|(index, point)| (index, point.distance_m(robot)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let ahead = &path[nearest..];
    let remaining_m = robot.distance_m(ahead[0]) + length_m(ahead);
    // At least a short way ahead, or a robot that stands off its path would head for its own side.
    let mut target = ahead[0];
    for &point in ahead {
        let away_m = robot.distance_m(point);
        if away_m > look_m || (away_m > look_m / 3.0 && !is_open(robot, point)) {
            break;
        }
        target = point;
    }
    Some(Lead { target, remaining_m })
}

fn length_m(path: &[Point2]) -> f64 {
    path.windows(2).map(|pair| pair[0].distance_m(pair[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Vec<Point2> {
        let along = (0..=10).map(|i| Point2::new(f64::from(i) * 0.1, 0.0));
        let up = (1..=10).map(|i| Point2::new(1.0, f64::from(i) * 0.1));
        along.chain(up).collect()
    }

    fn check(robot: Point2, open: bool, expected: Point2, remaining_m: f64) {
        let found = lead(&corner(), robot, 0.55, |_, _| open).unwrap();
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
        assert_eq!(lead(&[], Point2::default(), 0.6, |_, _| true), None);
    }
}
