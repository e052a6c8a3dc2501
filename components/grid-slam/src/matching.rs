//! Places a scan on a map near where the odometry expects it: correlative search, then refinement.

use crate::field::{CellWindow, LikelihoodField};
use crate::grid::SurfaceGrid;
use crate::pose::Pose;
use crate::prior::Prior;
use crate::refine::{
    Expected, Landscape, Refined, move_pose, points_in_front, pose_difference, refine,
};
use crate::scan::ScanPoint;
use crate::search::search;
use crate::wall_directions::WallCompass;

/// Scans with fewer points are not matched.
const FEWEST_POINTS: usize = 8;
/// Below this share of points on surfaces a match is rejected, and odometry alone moves the robot.
pub(crate) const BELIEVED_SUPPORT: f64 = 0.35;
/// Blur of the likelihood field, metres.
const BLUR_M: f64 = 0.1;
/// Levels of maxima above the finest; squares of 8 cells at the top.
const LEVELS: usize = 3;
/// A field is drawn wider than a scan needs it, metres, so that it serves the next ones too.
const WIDER_M: f64 = 1.0;

/// Finds where `points` fit the map. The field is kept between scans that change nothing; `None`
/// when they fit nowhere.
pub(crate) fn place_scan(
    grid: &SurfaceGrid,
    field: &mut Option<LikelihoodField>,
    points: &[ScanPoint],
    expected: &Expected,
    prior: &Prior,
    compass: Option<&WallCompass>,
) -> Option<Refined> {
    if points.len() < FEWEST_POINTS {
        return None;
    }
    let resolution_m = grid.resolution_m();
    let places: Vec<_> = points.iter().map(|point| point.place).collect();
    let window = CellWindow::around(&places, prior, resolution_m, 3.0 * BLUR_M);
    if !field.as_ref().is_some_and(|field| field.window().contains(&window)) {
        let wide = window.widened((WIDER_M / resolution_m) as i32);
        *field = Some(LikelihoodField::draw(grid, wide, BLUR_M, LEVELS));
    }
    let in_front = points_in_front(grid, &places, &prior.pose);
    let searched = if in_front.len() < FEWEST_POINTS { &places } else { &in_front };
    let found = search(field.as_ref()?, searched, prior, resolution_m, None)?;
    let start = if points.iter().all(ScanPoint::measures_all) {
        found.pose
    } else {
        keep_measured(grid, points, &found.pose, expected)
    };
    let wall_heading = compass.and_then(|compass| compass.measure_heading(start.yaw_rad));
    let expected = Expected { wall_heading, ..expected.doubted(&start) };
    let refined = refine(grid, points, start, &expected);
    (refined.support >= BELIEVED_SUPPORT).then_some(refined)
}

/// Returns the pose that the odometry expects, moved only in the directions that the scan measures:
/// in the others the search may have followed marks on bare walls.
fn keep_measured(
    grid: &SurfaceGrid,
    points: &[ScanPoint],
    found: &Pose,
    expected: &Expected,
) -> Pose {
    let scan = Landscape::new(grid, points, found).information(found);
    let motion = pose_difference(found, &expected.pose);
    move_pose(&expected.pose, &(expected.measured_part(&scan) * motion))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::pose::Point;
    use crate::scan::Beam;

    /// Points every 5 cm from one corner to the next.
    fn points_along(corners: &[[f64; 2]]) -> Vec<Point> {
        let mut points = Vec::new();
        for pair in corners.windows(2) {
            let [[from_x, from_y], [to_x, to_y]] = [pair[0], pair[1]];
            let steps = ((to_x - from_x).hypot(to_y - from_y) / 0.05).round() as i32;
            points.extend((0..steps).map(|step| f64::from(step) / f64::from(steps)).map(|part| {
                Point { x_m: from_x + part * (to_x - from_x), y_m: from_y + part * (to_y - from_y) }
            }));
        }
        points
    }

    /// Where a scan of `seen` is placed, taken at `truth`, as the odometry rightly expects; `None`
    /// if it fits nowhere.
    fn place(grid: &SurfaceGrid, seen: &[Point], truth: Pose) -> Option<Pose> {
        let points: Vec<_> =
            seen.iter().map(|point| truth.inverse().apply(*point).into()).collect();
        let motion = Pose::new(0.4, 0.0, 0.0);
        let (expected, prior) =
            Config::default().expect_motion(&(truth * motion.inverse()), &motion);
        place_scan(grid, &mut None, &points, &expected, &prior, None).map(|placed| placed.pose)
    }

    #[test]
    fn a_wall_that_is_known_from_one_side_does_not_place_a_scan_of_the_other() {
        // A wall from x = 0 to 0.1 m, at the end of a room.
        let room = points_along(&[[-4.0, -3.0], [0.0, -3.0], [0.0, 3.0], [-4.0, 3.0]]);
        let from = Pose::new(-2.0, 0.0, 0.0);
        let beam = |point: &Point| Beam { end: from.inverse().apply(*point), hit: true };
        let beams: Vec<_> = room.iter().map(beam).collect();
        let mut grid = SurfaceGrid::new(0.05);
        (0..3).for_each(|_| grid.insert(&from, Point::default(), &beams));

        let here = Pose::new(-2.5, 0.5, 0.2);
        let placed = place(&grid, &room, here).expect("the room is known");
        assert!(placed.distance_m(&here) < 0.02, "{placed:?}");

        let next_room = points_along(&[[0.6, -3.0], [0.1, -3.0], [0.1, 3.0], [0.6, 3.0]]);
        let there = Pose::new(2.0, 0.0, 3.0);
        let placed = place(&grid, &next_room, there);
        assert!(placed.is_none_or(|it| it.distance_m(&there) < 0.03), "{placed:?}");
    }
}
