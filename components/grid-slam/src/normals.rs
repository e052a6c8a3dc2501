//! The directions in which the surfaces face that a scan sees. A thin wall has a surface on each
//! side, a few centimetres apart: a scan of one side must not be matched to the other.

use crate::pose::Point;

/// Neighbouring beams that end farther apart are of different surfaces, metres.
const GAP_M: f64 = 0.25;
/// A direction is measured over this length on each side of a point, metres …
const SPAN_M: f64 = 0.15;
/// … and over so many beams at most.
const MOST_BEAMS: usize = 8;
/// Over less than this, metres, noise would decide.
const LEAST_M: f64 = 0.08;

/// Returns for each end of a beam, in the order of the beams, the unit vector out of its surface
/// towards the laser; zero where it is not known. Beams without a hit end none.
pub(crate) fn find_normals(ends: &[(Point, bool)], laser: Point) -> Vec<[f64; 2]> {
    let normal = |at: usize| {
        let (point, hit) = ends[at];
        if !hit {
            return [0.0; 2];
        }
        let next = |number: usize| at.checked_add(number);
        let previous = |number: usize| at.checked_sub(number);
        let (from, to) = (follow_surface(ends, at, previous), follow_surface(ends, at, next));
        let length_m = distance_m(from, to);
        if length_m < LEAST_M {
            return [0.0; 2];
        }
        let out = [(from.y_m - to.y_m) / length_m, (to.x_m - from.x_m) / length_m];
        let to_laser = [laser.x_m - point.x_m, laser.y_m - point.y_m];
        let is_towards = out[0] * to_laser[0] + out[1] * to_laser[1] >= 0.0;
        if is_towards { out } else { out.map(|part| -part) }
    };
    (0..ends.len()).map(normal).collect()
}

/// The last point of the surface around a point in one direction, within reach.
fn follow_surface(
    ends: &[(Point, bool)],
    at: usize,
    step: impl Fn(usize) -> Option<usize>,
) -> Point {
    let first = ends[at].0;
    let mut last = first;
    for number in 1..=MOST_BEAMS {
        let Some(&(point, true)) = step(number).and_then(|next| ends.get(next)) else { break };
        if distance_m(point, last) > GAP_M {
            break;
        }
        last = point;
        if distance_m(point, first) >= SPAN_M {
            break;
        }
    }
    last
}

fn distance_m(one: Point, other: Point) -> f64 {
    (one.x_m - other.x_m).hypot(one.y_m - other.y_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(points: &[(f64, f64)], at: usize, expected: [f64; 2]) {
        let ends: Vec<_> = points.iter().map(|&(x_m, y_m)| (Point { x_m, y_m }, true)).collect();
        let found = find_normals(&ends, Point::default())[at];
        let is_near = (0..2).all(|axis| (found[axis] - expected[axis]).abs() < 1e-6);
        assert!(is_near, "{found:?} instead of {expected:?}");
    }

    #[test]
    fn a_surface_faces_the_laser_that_sees_it() {
        let ahead: Vec<_> = (-5..=5).map(|n| (2.0, 0.05 * f64::from(n))).collect();
        check(&ahead, 5, [-1.0, 0.0]);
        let behind: Vec<_> = ahead.iter().map(|(x_m, y_m)| (-x_m, *y_m)).collect();
        check(&behind, 5, [1.0, 0.0]);
        let along: Vec<_> = (0..9).map(|n| (3.0 + 0.2 * f64::from(n), 0.5)).collect();
        check(&along, 4, [0.0, -1.0]);
    }

    #[test]
    fn a_point_by_itself_faces_nowhere() {
        check(&[(2.0, -1.0), (2.0, 0.0), (2.0, 1.0)], 1, [0.0, 0.0]);
        check(&[(2.0, 0.0)], 0, [0.0, 0.0]);
        check(&[(2.0, -0.02), (2.0, 0.0), (2.0, 0.02)], 1, [0.0, 0.0]);
    }
}
