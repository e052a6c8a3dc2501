//! A point in a map's plane.

use crate::error::ShapeError;

/// Larger than any UTM northing. The exact predicates cannot overflow within it.
pub const MAX_COORDINATE_M: f64 = 100_000_000.0;
/// Smaller coordinates become zero, so that no product of the exact predicates underflows.
const MIN_COORDINATE_M: f64 = 1e-15;

/// A point in a map's plane, in metres: finite, and at most [`MAX_COORDINATE_M`] from either axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPoint {
    x_m: f64,
    y_m: f64,
}

impl MapPoint {
    /// The point (`x_m`, `y_m`).
    ///
    /// # Errors
    /// A coordinate that is not finite, or too large.
    pub fn new(x_m: f64, y_m: f64) -> Result<Self, ShapeError> {
        Ok(Self { x_m: bounded(x_m)?, y_m: bounded(y_m)? })
    }

    /// Metres along the map's x axis.
    pub fn x_m(self) -> f64 {
        self.x_m
    }

    /// Metres along the map's y axis.
    pub fn y_m(self) -> f64 {
        self.y_m
    }

    /// The distance to another point, rounded.
    pub fn distance_m(self, other: Self) -> f64 {
        (self.x_m - other.x_m).hypot(self.y_m - other.y_m)
    }

    /// The point at a share of the distance to `other`, rounded.
    pub(crate) fn interpolate(self, other: Self, share: f64) -> Self {
        Self {
            x_m: self.x_m + (other.x_m - self.x_m) * share,
            y_m: self.y_m + (other.y_m - self.y_m) * share,
        }
    }

    pub(crate) fn coord(self) -> robust::Coord<f64> {
        robust::Coord { x: self.x_m, y: self.y_m }
    }
}

fn bounded(value: f64) -> Result<f64, ShapeError> {
    // NaN is not at most anything.
    if value.abs() <= MAX_COORDINATE_M {
        Ok(if value.abs() < MIN_COORDINATE_M { 0.0 } else { value })
    } else {
        Err(ShapeError::Coordinate { value })
    }
}
