//! Areas: polygons and circles.

use std::cmp::Ordering;

use crate::clearance::Clearance;
use crate::distance::{ExactLength, compare_point_distance};
use crate::error::ShapeError;
use crate::map_point::MapPoint;
use crate::polygon::{MapPolygon, PointLocation};

/// A circle with its inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapCircle {
    centre: MapPoint,
    radius: Clearance,
}

impl MapCircle {
    /// The circle around `centre`.
    ///
    /// # Errors
    /// A radius of 0.
    pub fn new(centre: MapPoint, radius: Clearance) -> Result<Self, ShapeError> {
        if radius == Clearance::ZERO {
            return Err(ShapeError::Radius);
        }
        Ok(Self { centre, radius })
    }

    /// Its centre.
    pub fn centre(&self) -> MapPoint {
        self.centre
    }

    /// Its radius.
    pub fn radius(&self) -> Clearance {
        self.radius
    }
}

/// An area of the map, with its boundary.
#[derive(Clone, Debug, PartialEq)]
pub enum MapArea {
    /// A polygon.
    Polygon(MapPolygon),
    /// A circle.
    Circle(MapCircle),
}

impl From<MapPolygon> for MapArea {
    fn from(polygon: MapPolygon) -> Self {
        Self::Polygon(polygon)
    }
}

impl From<MapCircle> for MapArea {
    fn from(circle: MapCircle) -> Self {
        Self::Circle(circle)
    }
}

impl MapArea {
    /// Where `point` is. Exact.
    pub fn locate(&self, point: MapPoint) -> PointLocation {
        match self {
            Self::Polygon(polygon) => polygon.locate(point),
            Self::Circle(circle) => {
                let radius = ExactLength::of(circle.radius.metres());
                match compare_point_distance(point, circle.centre, radius) {
                    Ordering::Less => PointLocation::Inside,
                    Ordering::Equal => PointLocation::Boundary,
                    Ordering::Greater => PointLocation::Outside,
                }
            }
        }
    }
}
