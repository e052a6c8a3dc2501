//! The points at which shortest paths through a free space may bend.

use crate::area::{MapArea, MapCircle};
use crate::distance::compare_side;
use crate::free_space::FreeSpace;
use crate::map_point::MapPoint;
use crate::polygon::MapPolygon;
use crate::segment::MapSegment;
use crate::visibility::MAX_BENDS;

/// What paths keep in addition: rounding is a small part of it, so that the segment between two bends
/// of one corner is clear.
const ROOM_M: f64 = 0.001;
/// The cosine of the largest turn of a path at one bend around a corner, 46°: a right angle has two.
const LEAST_COSINE: f64 = 0.694_658;
/// The cosine and the sine of 45°, and the cosine of 22.5°.
const HALF_RIGHT: f64 = std::f64::consts::FRAC_1_SQRT_2;
const COSINE_OF_HALF: f64 = 0.923_879_532_511_286_8;
const SINE_OF_HALF: f64 = 0.382_683_432_365_089_8;

/// A direction or an offset.
type Offset = [f64; 2];

/// Returns the bends of a space, in the order of its areas and their corners; none if there are more than
/// [`MAX_BENDS`].
pub(super) fn list_bends(space: &FreeSpace<'_>) -> Option<Vec<MapPoint>> {
    let mut bends = Bends { space, found: Vec::new() };
    for kept in space.kept_out() {
        let away_m = kept.clearance.metres() + ROOM_M;
        match kept.area {
            MapArea::Polygon(polygon) => {
                bends.add_corners(&counterclockwise(polygon), away_m, false)?;
            }
            MapArea::Circle(circle) => bends.add_circle(circle, away_m)?,
        }
    }
    // From one area to stay in to another one, paths lead where both are: at a corner of one of them.
    let overlap = space.kept_in().len() > 1;
    for kept in space.kept_in() {
        let away_m = kept.clearance.metres() + ROOM_M;
        // What must not be entered is outside: on the other side of the edges.
        if let MapArea::Polygon(polygon) = kept.area {
            let mut corners = counterclockwise(polygon);
            corners.reverse();
            bends.add_corners(&corners, away_m, overlap)?;
        }
    }
    Some(bends.found)
}

struct Bends<'a, 'b> {
    space: &'a FreeSpace<'b>,
    found: Vec<MapPoint>,
}

impl Bends<'_, '_> {
    /// Adds the bends around the corners of a polygon whose inside, on the left of its edges, must not be
    /// entered. `is_each`: also where a path does not go around the corner.
    fn add_corners(&mut self, corners: &[MapPoint], away_m: f64, is_each: bool) -> Option<()> {
        let count = corners.len();
        for at in 0..count {
            let (before, corner) = (corners[(at + count - 1) % count], corners[at]);
            let after = corners[(at + 1) % count];
            let normals = (normal_of(before, corner), normal_of(corner, after));
            let (Some(first), Some(last)) = normals else { continue };
            if compare_side(before, corner, after).is_gt() {
                self.add_turn(corner, first, last, away_m)?;
            } else if is_each {
                self.add_between(corner, first, last, away_m)?;
            }
        }
        Some(())
    }

    /// Adds the bends of a turn around a corner, between two directions that lead away from it.
    fn add_turn(&mut self, corner: MapPoint, from: Offset, to: Offset, away_m: f64) -> Option<()> {
        if dot(from, to) >= LEAST_COSINE {
            return self.add_between(corner, from, to, away_m);
        }
        let sum = [from[0] + to[0], from[1] + to[1]];
        // The directions of a needle are opposite, and what is between them is its own.
        let middle = unit(sum).unwrap_or([-from[1], from[0]]);
        self.add_turn(corner, from, middle, away_m)?;
        self.add_turn(corner, middle, to, away_m)
    }

    /// Adds the point at which two lines meet that keep the distance from the corner in two directions.
    fn add_between(
        &mut self,
        corner: MapPoint,
        one: Offset,
        other: Offset,
        away_m: f64,
    ) -> Option<()> {
        let share = away_m / (1.0 + dot(one, other));
        self.add(corner, [(one[0] + other[0]) * share, (one[1] + other[1]) * share])
    }

    /// Adds the corners of an octagon around a circle.
    fn add_circle(&mut self, circle: &MapCircle, away_m: f64) -> Option<()> {
        let reach_m = (circle.radius().metres() + away_m) / COSINE_OF_HALF;
        let mut direction = [COSINE_OF_HALF * reach_m, SINE_OF_HALF * reach_m];
        for _ in 0..8 {
            self.add(circle.centre(), direction)?;
            let [x, y] = direction;
            direction = [(x - y) * HALF_RIGHT, (x + y) * HALF_RIGHT];
        }
        Some(())
    }

    /// Adds a point if a robot may be there.
    fn add(&mut self, centre: MapPoint, offset: Offset) -> Option<()> {
        let Ok(bend) = MapPoint::new(centre.x_m() + offset[0], centre.y_m() + offset[1]) else {
            return Some(());
        };
        if self.space.is_clear(MapSegment::new(bend, bend)) {
            if self.found.len() == MAX_BENDS {
                return None;
            }
            self.found.push(bend);
        }
        Some(())
    }
}

fn counterclockwise(polygon: &MapPolygon) -> Vec<MapPoint> {
    let mut corners = polygon.corners().to_vec();
    let count = corners.len();
    // The lowest corner, of several the leftmost, is convex.
    let key = |at: &usize| (corners[*at].y_m(), corners[*at].x_m());
    let lowest = (0..count).min_by(|one, two| {
        let (one, two) = (key(one), key(two));
        one.0.total_cmp(&two.0).then(one.1.total_cmp(&two.1))
    });
    let at = lowest.unwrap_or_default();
    let (before, after) = (corners[(at + count - 1) % count], corners[(at + 1) % count]);
    if compare_side(before, corners[at], after).is_lt() {
        corners.reverse();
    }
    corners
}

/// The direction to the right of a segment.
fn normal_of(from: MapPoint, to: MapPoint) -> Option<Offset> {
    unit([to.y_m() - from.y_m(), from.x_m() - to.x_m()])
}

fn unit([x, y]: Offset) -> Option<Offset> {
    let length = (x * x + y * y).sqrt();
    (length > 1e-12).then(|| [x / length, y / length])
}

fn dot(one: Offset, other: Offset) -> f64 {
    one[0] * other[0] + one[1] * other[1]
}
