//! A straight piece of a path: a leg, or an edge of an area.

use std::cmp::Ordering;

use crate::area::{MapArea, MapCircle};
use crate::clearance::Clearance;
use crate::distance::{
    ExactLength, compare_point_distance, compare_segment_distance, do_segments_touch,
};
use crate::map_point::MapPoint;
use crate::polygon::{MapPolygon, PointLocation};

/// The straight segment between two points, which may be the same.
///
/// A corridor with a half width is a segment that keeps this [`Clearance`]: it touches an area if
/// the segment's distance from the area is at most the half width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapSegment {
    start: MapPoint,
    end: MapPoint,
}

impl MapSegment {
    /// The segment from `start` to `end`.
    pub fn new(start: MapPoint, end: MapPoint) -> Self {
        Self { start, end }
    }

    /// Its start.
    pub fn start(self) -> MapPoint {
        self.start
    }

    /// Its end.
    pub fn end(self) -> MapPoint {
        self.end
    }

    /// Its length, rounded.
    pub fn length_m(self) -> f64 {
        self.start.distance_m(self.end)
    }

    /// The point at a share of its length from its start, 0 to 1, rounded.
    pub fn point_at(self, share: f64) -> MapPoint {
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.start.interpolate(self.end, share)
    }

    /// The distance from `area`, with its inside and boundary, against `clearance`. Exact. A
    /// segment that touches the area has the distance 0.
    pub fn compare_distance(self, area: &MapArea, clearance: Clearance) -> Ordering {
        let touches = match area {
            MapArea::Polygon(polygon) => self.touches_polygon(polygon),
            MapArea::Circle(circle) => {
                let radius = ExactLength::of(circle.radius().metres());
                compare_segment_distance(self.start, self.end, circle.centre(), radius).is_le()
            }
        };
        if touches || clearance == Clearance::ZERO {
            let distance_m: f64 = if touches { 0.0 } else { f64::INFINITY };
            return distance_m.total_cmp(&clearance.metres());
        }
        match area {
            MapArea::Polygon(polygon) => self.compare_boundary(polygon, clearance),
            MapArea::Circle(circle) => {
                let reach =
                    ExactLength { length_m: circle.radius().metres(), more_m: clearance.metres() };
                compare_segment_distance(self.start, self.end, circle.centre(), reach)
            }
        }
    }

    /// Whether the segment touches `area` or is nearer to it than `clearance`. Exact.
    pub fn intrudes(self, area: &MapArea, clearance: Clearance) -> bool {
        self.compare_distance(area, Clearance::ZERO).is_eq()
            || self.compare_distance(area, clearance).is_lt()
    }

    /// Whether the whole segment is inside `area`, does not touch its boundary, and keeps at least
    /// `clearance` from it. Exact.
    pub fn stays_within(self, area: &MapArea, clearance: Clearance) -> bool {
        match area {
            MapArea::Polygon(polygon) => {
                polygon.locate(self.start) == PointLocation::Inside
                    && !polygon.edges().any(|edge| self.touches(edge))
                    && self.compare_boundary(polygon, clearance).is_ge()
            }
            MapArea::Circle(circle) => [self.start, self.end]
                .into_iter()
                .all(|end| is_within_circle(end, circle, clearance)),
        }
    }

    /// Whether the two segments have a point in common. Exact.
    pub fn touches(self, other: Self) -> bool {
        do_segments_touch(self.start, self.end, other.start, other.end)
    }

    /// The distance of `point` from this segment against `clearance`. Exact.
    pub fn compare_distance_of_point(self, point: MapPoint, clearance: Clearance) -> Ordering {
        let length = ExactLength::of(clearance.metres());
        compare_segment_distance(self.start, self.end, point, length)
    }

    /// The share of this segment, 0 to 1, at which it is nearest to `point`, rounded.
    pub fn share_nearest_to(self, point: MapPoint) -> f64 {
        let (x, y) = (self.end.x_m() - self.start.x_m(), self.end.y_m() - self.start.y_m());
        let square = x * x + y * y;
        let along = x * (point.x_m() - self.start.x_m()) + y * (point.y_m() - self.start.y_m());
        if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 }
    }

    fn touches_polygon(self, polygon: &MapPolygon) -> bool {
        polygon.locate(self.start) != PointLocation::Outside
            || polygon.edges().any(|edge| self.touches(edge))
    }

    /// The distance from the polygon's boundary, which the segment does not touch, against
    /// `clearance`. Two segments that do not touch are nearest at an end of one of them.
    fn compare_boundary(self, polygon: &MapPolygon, clearance: Clearance) -> Ordering {
        let length = ExactLength::of(clearance.metres());
        let compare = |edge: Self| {
            let ends = [
                compare_segment_distance(edge.start, edge.end, self.start, length),
                compare_segment_distance(edge.start, edge.end, self.end, length),
                compare_segment_distance(self.start, self.end, edge.start, length),
            ];
            ends.into_iter().min().unwrap_or(Ordering::Greater)
        };
        polygon.edges().map(compare).min().unwrap_or(Ordering::Greater)
    }
}

/// Whether `point` is inside the circle, not on it, and keeps `clearance` from it.
fn is_within_circle(point: MapPoint, circle: &MapCircle, clearance: Clearance) -> bool {
    let left = ExactLength { length_m: circle.radius().metres(), more_m: -clearance.metres() };
    match left.sign() {
        Ordering::Less => false,
        Ordering::Equal if clearance == Clearance::ZERO => false,
        _ => {
            let distance = compare_point_distance(point, circle.centre(), left);
            if clearance == Clearance::ZERO { distance.is_lt() } else { distance.is_le() }
        }
    }
}
