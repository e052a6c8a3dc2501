//! Simple polygons.

use crate::distance::{compare_side, is_on_segment};
use crate::error::ShapeError;
use crate::map_point::MapPoint;
use crate::segment::MapSegment;

/// The check for crossing edges takes a time that grows with the square of the corners: half a
/// million pairs of edges for these.
pub const MAX_CORNERS: usize = 1_024;

/// Where a point is, seen from an area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointLocation {
    /// Inside.
    Inside,
    /// On the boundary.
    Boundary,
    /// Outside.
    Outside,
}

/// A simple polygon: 3 to [`MAX_CORNERS`] corners, edges that meet only at common corners. The
/// corners may be in either order; the last one is not the first one again.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPolygon {
    corners: Vec<MapPoint>,
}

impl MapPolygon {
    /// The polygon with these corners.
    ///
    /// # Errors
    /// Too few or too many corners, two successive ones that are the same, edges that cross or
    /// touch.
    pub fn new(corners: Vec<MapPoint>) -> Result<Self, ShapeError> {
        check_count(corners.len(), 3)?;
        let polygon = Self { corners };
        let count = polygon.corners.len();
        for (index, edge) in polygon.edges().enumerate() {
            if edge.start() == edge.end() {
                return Err(ShapeError::RepeatedPoint { index: index + 1 });
            }
        }
        let edges: Vec<MapSegment> = polygon.edges().collect();
        for first in 0..count {
            for second in first + 1..count {
                if are_in_conflict(&edges, first, second) {
                    return Err(ShapeError::CrossingEdges { first: first + 1, second: second + 1 });
                }
            }
        }
        Ok(polygon)
    }

    /// The corners, in their order.
    pub fn corners(&self) -> &[MapPoint] {
        &self.corners
    }

    /// The edges: from each corner to the next, and from the last to the first.
    pub fn edges(&self) -> impl Iterator<Item = MapSegment> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(start, end)| MapSegment::new(*start, *end))
    }

    /// Where `point` is. Exact.
    pub fn locate(&self, point: MapPoint) -> PointLocation {
        let mut is_inside = false;
        for edge in self.edges() {
            let (a, b) = (edge.start(), edge.end());
            if is_on_segment(a, b, point) {
                return PointLocation::Boundary;
            }
            // A ray in the direction of x: each edge contains its lower end and not its upper one.
            let (a_below, b_below) = (a.y_m() <= point.y_m(), b.y_m() <= point.y_m());
            if a_below != b_below {
                let side = compare_side(a, b, point);
                is_inside ^= if a_below { side.is_gt() } else { side.is_lt() };
            }
        }
        if is_inside { PointLocation::Inside } else { PointLocation::Outside }
    }
}

pub(crate) fn check_count(found: usize, needed: usize) -> Result<(), ShapeError> {
    if found < needed {
        Err(ShapeError::TooFewPoints { found, needed })
    } else if found > MAX_CORNERS {
        Err(ShapeError::TooManyPoints { found, max: MAX_CORNERS })
    } else {
        Ok(())
    }
}

/// Whether two edges share more than the corner that belongs to both. In a triangle the far end of
/// a neighbour belongs to the third edge, but is on this one only if the corners are on one line.
fn are_in_conflict(edges: &[MapSegment], first: usize, second: usize) -> bool {
    let (one, other) = (edges[first], edges[second]);
    let has = |edge: MapSegment, point: MapPoint| is_on_segment(edge.start(), edge.end(), point);
    let follows = second == first + 1;
    let precedes = first == 0 && second == edges.len() - 1;
    match (follows, precedes) {
        (false, false) => one.touches(other),
        _ => {
            (follows && (has(one, other.end()) || has(other, one.start())))
                || (precedes && (has(one, other.start()) || has(other, one.end())))
        }
    }
}
