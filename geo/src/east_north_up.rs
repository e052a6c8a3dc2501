//! A local frame: east, north and up at an origin.

use crate::ecef::EcefPosition;
use crate::error::GeoError;
use crate::position::GeoPosition;

/// A position in an [`EnuFrame`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnuPosition {
    /// Metres to the east.
    pub east_m: f64,
    /// Metres to the north.
    pub north_m: f64,
    /// Metres up, along the ellipsoid's normal at the origin.
    pub up_m: f64,
}

/// The plane that touches the ellipsoid's normal at an origin, with the axes east, north and up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnuFrame {
    origin: GeoPosition,
    ecef: EcefPosition,
    east: [f64; 3],
    north: [f64; 3],
    up: [f64; 3],
}

impl EnuFrame {
    /// The frame at `origin`.
    pub fn new(origin: GeoPosition) -> Self {
        let (sin_lat, cos_lat) = origin.latitude_deg().to_radians().sin_cos();
        let (sin_lon, cos_lon) = origin.longitude_deg().to_radians().sin_cos();
        Self {
            origin,
            ecef: origin.into(),
            east: [-sin_lon, cos_lon, 0.0],
            north: [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            up: [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
        }
    }

    /// The frame's origin.
    pub fn origin(&self) -> GeoPosition {
        self.origin
    }

    /// `position` in this frame.
    pub fn enu_from_geo(&self, position: GeoPosition) -> EnuPosition {
        let there = EcefPosition::from(position);
        let offset =
            [there.x_m - self.ecef.x_m, there.y_m - self.ecef.y_m, there.z_m - self.ecef.z_m];
        EnuPosition {
            east_m: dot(self.east, offset),
            north_m: dot(self.north, offset),
            up_m: dot(self.up, offset),
        }
    }

    /// The position on the Earth.
    ///
    /// # Errors
    /// A number that is not finite; a position less than 6,200 km from the Earth's centre.
    pub fn geo_from_enu(&self, position: EnuPosition) -> Result<GeoPosition, GeoError> {
        let along = |axis: usize| {
            self.east[axis] * position.east_m
                + self.north[axis] * position.north_m
                + self.up[axis] * position.up_m
        };
        GeoPosition::try_from(EcefPosition {
            x_m: self.ecef.x_m + along(0),
            y_m: self.ecef.y_m + along(1),
            z_m: self.ecef.z_m + along(2),
        })
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
