//! Where a map is in the world.

use crate::east_north_up::{EnuFrame, EnuPosition};
use crate::error::GeoError;
use crate::map_point::MapPoint;
use crate::position::{GeoPosition, check_finite};

/// A plane map is not meant for more: at this distance the tangent plane is 80 km above the ground.
pub const MAX_MAP_REACH_M: f64 = 1_000_000.0;
const SCALES: std::ops::RangeInclusive<f64> = 0.001..=1_000.0;
/// The height converges by more than three digits a round within [`MAX_MAP_REACH_M`].
const ROUNDS: usize = 8;

/// Where a map's frame is in the world: the position of its origin, and how it is turned.
///
/// The map's plane touches the ellipsoid's normal at the origin. A position belongs to the point of
/// the plane below or above it, along that normal, whatever its height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPlacement {
    frame: EnuFrame,
    heading_rad: f64,
    scale: f64,
}

impl MapPlacement {
    /// A map whose origin is at `origin`, and whose y axis points to `heading_rad`: clockwise from
    /// north, so that x points east and y north at 0. `scale` is the number of metres in the world
    /// for one metre of the map, 1 for a map in metres.
    ///
    /// # Errors
    /// A heading that is not finite; a scale that is not between 0.001 and 1000.
    pub fn new(origin: GeoPosition, heading_rad: f64, scale: f64) -> Result<Self, GeoError> {
        check_finite("heading", heading_rad)?;
        if !SCALES.contains(&scale) {
            return Err(GeoError::Scale { scale });
        }
        Ok(Self { frame: EnuFrame::new(origin), heading_rad, scale })
    }

    /// The position of the map's origin.
    pub fn origin(&self) -> GeoPosition {
        self.frame.origin()
    }

    /// The direction of the map's y axis, clockwise from north.
    pub fn heading_rad(&self) -> f64 {
        self.heading_rad
    }

    /// Metres in the world for one metre of the map.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The point of the map at a position.
    ///
    /// # Errors
    /// A position more than [`MAX_MAP_REACH_M`] from the origin.
    pub fn map_from_geo(&self, position: GeoPosition) -> Result<MapPoint, GeoError> {
        let enu = self.frame.enu_from_geo(position);
        let distance_m = enu.east_m.hypot(enu.north_m).hypot(enu.up_m);
        if distance_m > MAX_MAP_REACH_M {
            return Err(GeoError::TooFar { distance_m });
        }
        let (sin, cos) = self.heading_rad.sin_cos();
        let x_m = (enu.east_m * cos - enu.north_m * sin) / self.scale;
        let y_m = (enu.east_m * sin + enu.north_m * cos) / self.scale;
        // A thousand kilometres at the smallest scale are more than a map has.
        MapPoint::new(x_m, y_m).map_err(|_| GeoError::TooFar { distance_m })
    }

    /// The position of a point of the map, at the height of the origin.
    ///
    /// # Errors
    /// A point more than [`MAX_MAP_REACH_M`] from the origin.
    pub fn geo_from_map(&self, point: MapPoint) -> Result<GeoPosition, GeoError> {
        self.geo_from_map_at(point, self.origin().height_m())
    }

    /// The position of a point of the map at a height above the ellipsoid.
    ///
    /// # Errors
    /// A point more than [`MAX_MAP_REACH_M`] from the origin; a height that does not exist.
    pub fn geo_from_map_at(&self, point: MapPoint, height_m: f64) -> Result<GeoPosition, GeoError> {
        let (x_m, y_m) = (point.x_m() * self.scale, point.y_m() * self.scale);
        let distance_m = x_m.hypot(y_m);
        if distance_m > MAX_MAP_REACH_M {
            return Err(GeoError::TooFar { distance_m });
        }
        let (sin, cos) = self.heading_rad.sin_cos();
        let mut enu = EnuPosition {
            east_m: x_m * cos + y_m * sin,
            north_m: y_m * cos - x_m * sin,
            up_m: height_m - self.origin().height_m(),
        };
        let mut position = self.frame.geo_from_enu(enu)?;
        for _ in 0..ROUNDS {
            enu.up_m -= position.height_m() - height_m;
            position = self.frame.geo_from_enu(enu)?;
        }
        GeoPosition::new(position.latitude_deg(), position.longitude_deg(), height_m)
    }
}
