//! Which points of a scan lie on bare walls, and how little they measure along them.
//!
//! A laser's beams end anywhere along a bare wall, so that a point there measures how far the wall
//! is, and not how far the robot has come along it. Where the ends are farther apart than what the
//! map compares, it knows them as single marks all the same, and a scan fits it best where the robot
//! has not moved. Between walls of which nothing else can be seen, such as in an aisle, that would
//! hold the pose back. Only scans that are bare as a whole are treated so: in all others enough
//! points measure each direction.

use crate::pose::Point;
use crate::scan::{Beam, ScanPoint};
use nalgebra::{Matrix2, Vector2};

/// Neighbouring beams that have to end on one line.
const BEAMS_IN_LINE: usize = 7;
/// They may be this far from it, metres.
const STRAIGHT_M: f64 = 0.03;
/// The gaps between them change at most by this factor from one to the next.
const EVEN: f64 = 2.5;
/// A scan is bare if a smaller share of its points measures the direction that is measured least.
const BARE_SHARE: f64 = 0.2;
/// In a bare scan points on walls with wider gaps are loose, metres. To the map they are single marks:
/// it compares a point with what is within 0.15 m. With that as the limit the heading was worse in
/// corridors (docs/mapping.md).
const WIDE_GAP_M: f64 = 0.3;
/// The place of a loose point along its wall has a standard deviation of this many gaps.
const SPREAD_GAPS: f64 = 10.0;

/// A wall where a beam hits it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SeenWall {
    /// Its direction, of length 1.
    along: Vector2<f64>,
    /// The larger gap to the neighbouring beams, metres.
    gap_m: f64,
}

/// Returns the points of the beams that hit. If the scan is bare, those on walls that are seen with
/// wide gaps measure next to nothing along them.
pub(crate) fn find_points(beams: &[Beam]) -> Vec<ScanPoint> {
    let hits: Vec<_> = (0..beams.len()).filter(|&at| beams[at].hit).collect();
    let walls: Vec<_> = hits.iter().map(|&at| find_wall(beams, at)).collect();
    let is_bare = is_bare(&walls);
    let point = |(&at, wall): (&usize, &Option<SeenWall>)| match wall {
        Some(SeenWall { along, gap_m }) if is_bare && *gap_m > WIDE_GAP_M => {
            ScanPoint { place: beams[at].end, along_m: along * SPREAD_GAPS * *gap_m }
        }
        _ => ScanPoint::from(beams[at].end),
    };
    hits.iter().zip(&walls).map(point).collect()
}

/// Returns whether few points measure one of the directions. A point on a wall measures the
/// direction across it, every other one all directions.
fn is_bare(walls: &[Option<SeenWall>]) -> bool {
    let count = walls.len() as f64;
    let along: Matrix2<f64> =
        walls.iter().flatten().map(|wall| wall.along * wall.along.transpose()).sum();
    let measured = Matrix2::identity() * count - along;
    measured.symmetric_eigenvalues().min() <= BARE_SHARE * count
}

/// Returns the wall that a beam hits; `None` if it hits none. It may be anywhere among the beams in
/// line, but at the end of them only if nothing was hit beyond: a corner or the edge of a door
/// measures both directions.
fn find_wall(beams: &[Beam], at: usize) -> Option<SeenWall> {
    let is_hit = |number: usize| beams.get(number).is_some_and(|beam| beam.hit);
    let (hit_before, hit_after) = (at > 0 && is_hit(at - 1), is_hit(at + 1));
    let middle = BEAMS_IN_LINE / 2;
    let mut firsts: Vec<_> = (at.saturating_sub(BEAMS_IN_LINE - 1)..=at).collect();
    // The beam in the middle of the line first.
    firsts.sort_by_key(|first| (first + middle).abs_diff(at));
    let fit = |first: usize| {
        let last = first + BEAMS_IN_LINE - 1;
        let is_edge = (first == at && hit_before) || (last == at && hit_after);
        if is_edge || !(first..=last).all(is_hit) {
            return None;
        }
        fit_wall(&beams[first..=last], at - first)
    };
    firsts.into_iter().find_map(fit)
}

/// The line on which the beams end, where the beam `at` does; `None` if they do not, or not evenly.
fn fit_wall(beams: &[Beam], at: usize) -> Option<SeenWall> {
    let ends: Vec<_> = beams.iter().map(|beam| to_vector(beam.end)).collect();
    let mean = ends.iter().sum::<Vector2<f64>>() / ends.len() as f64;
    let scatter: Matrix2<f64> =
        ends.iter().map(|end| (end - mean) * (end - mean).transpose()).sum();
    let angle_rad = 0.5 * (2.0 * scatter.m12).atan2(scatter.m11 - scatter.m22);
    let along = Vector2::new(angle_rad.cos(), angle_rad.sin());
    if ends.iter().any(|end| along.perp(&(end - mean)).abs() > STRAIGHT_M) {
        return None;
    }
    let gaps: Vec<_> = ends.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    if gaps.windows(2).any(|pair| pair[0].max(pair[1]) > EVEN * pair[0].min(pair[1])) {
        return None;
    }
    let gap_m = |number: Option<usize>| number.and_then(|it| gaps.get(it)).copied().unwrap_or(0.0);
    Some(SeenWall { along, gap_m: gap_m(at.checked_sub(1)).max(gap_m(Some(at))) })
}

fn to_vector(point: Point) -> Vector2<f64> {
    Vector2::new(point.x_m, point.y_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The beams that hit one of the walls `|y| = side_m` within 9 m, seen from the middle, and a
    /// wall across at `end_m` if that is nearer.
    fn aisle(side_m: f64, end_m: f64) -> Vec<Beam> {
        let beam = |degrees: i32| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let to_end_m = if cos > 1e-9 { end_m / cos } else { f64::INFINITY };
            let range_m = (side_m / sin.abs().max(1e-9)).min(to_end_m);
            let length_m = range_m.min(9.0);
            let end = Point { x_m: length_m * cos, y_m: length_m * sin };
            Beam { end, hit: range_m < 9.0 }
        };
        (-135..=135).map(beam).collect()
    }

    #[test]
    fn in_an_aisle_far_points_measure_only_the_way_to_its_walls() {
        let points = find_points(&aisle(1.0, f64::INFINITY));
        for point in &points {
            // Beams 1 degree apart: 4 m along the aisle the gap is 0.3 m.
            let is_far = point.place.x_m.abs() > 4.5;
            let is_near = point.place.x_m.abs() < 3.5;
            assert!(!(is_far && point.measures_all()), "{point:?}");
            assert!(!is_near || point.measures_all(), "{point:?}");
            assert!(point.along_m.y.abs() < 1e-6, "{point:?}");
        }
        let farthest_m = points.iter().map(|point| point.along_m.norm()).fold(0.0, f64::max);
        assert!((5.0..20.0).contains(&farthest_m), "ten gaps of 1 m and more: {farthest_m}");
    }

    #[test]
    fn where_the_end_of_the_aisle_is_near_all_points_measure_all() {
        let points = find_points(&aisle(1.0, 0.5));
        assert!(points.iter().all(ScanPoint::measures_all));
        assert!(find_points(&[]).is_empty());
    }

    #[test]
    fn an_edge_and_what_lies_alone_are_no_wall() {
        let beam = |x_m: f64| Beam { end: Point { x_m, y_m: 1.0 }, hit: true };
        let mut beams: Vec<_> = (0..20).map(|number| beam(0.1 * f64::from(number))).collect();
        beams.push(Beam { end: Point { x_m: 2.0, y_m: 0.2 }, hit: true });
        assert_eq!(find_wall(&beams, 20), None, "a pillar");
        assert_eq!(find_wall(&beams, 19), None, "the edge before it");
        let wall = find_wall(&beams, 18).expect("in line with those before it");
        assert!((wall.gap_m - 0.1).abs() < 1e-9 && wall.along.y.abs() < 1e-9, "{wall:?}");
        beams[20].hit = false;
        assert!(find_wall(&beams, 19).is_some(), "the end of what the laser reaches");
        // A step of 10 cm in the wall.
        beams[..10].iter_mut().for_each(|beam| beam.end.y_m = 0.9);
        for at in [9, 10] {
            assert_eq!(find_wall(&beams, at), None, "at the step: {at}");
        }
    }
}
