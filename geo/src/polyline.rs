//! Lines of several points: boundaries, phase lines, routes.

use crate::distance::do_segments_touch;
use crate::error::ShapeError;
use crate::map_point::MapPoint;
use crate::polygon::check_count;
use crate::segment::MapSegment;

/// A line through 2 to [`MAX_CORNERS`](crate::MAX_CORNERS) points; it may cross itself.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPolyline {
    points: Vec<MapPoint>,
}

impl MapPolyline {
    /// The line through these points.
    ///
    /// # Errors
    /// Too few or too many points; two successive ones that are the same.
    pub fn new(points: Vec<MapPoint>) -> Result<Self, ShapeError> {
        check_count(points.len(), 2)?;
        if let Some(index) = points.windows(2).position(|pair| pair[0] == pair[1]) {
            return Err(ShapeError::RepeatedPoint { index: index + 1 });
        }
        Ok(Self { points })
    }

    /// The points, in their order.
    pub fn points(&self) -> &[MapPoint] {
        &self.points
    }

    /// The segments between them.
    pub fn segments(&self) -> impl Iterator<Item = MapSegment> {
        self.points.windows(2).map(|pair| MapSegment::new(pair[0], pair[1]))
    }

    /// Whether `segment` has a point in common with the line. Exact.
    pub fn touches(&self, segment: MapSegment) -> bool {
        let (start, end) = (segment.start(), segment.end());
        self.segments().any(|piece| do_segments_touch(piece.start(), piece.end(), start, end))
    }

    /// The length, rounded.
    pub fn length_m(&self) -> f64 {
        self.segments().map(|piece| piece.length_m()).sum()
    }
}
