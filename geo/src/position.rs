//! A position on the Earth as latitude, longitude and height.

use crate::error::GeoError;

const MIN_HEIGHT_M: f64 = -100_000.0;
const MAX_HEIGHT_M: f64 = 100_000_000.0;

/// A position on the Earth: geodetic latitude and longitude (WGS 84), height above the ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeoPosition {
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
}

impl GeoPosition {
    /// A position from degrees and metres. The longitude is brought to -180° (included) to 180°.
    ///
    /// # Errors
    /// A number that is not finite, a latitude beyond a pole, a longitude of more than one turn, a
    /// height below -100 km or above 100,000 km.
    pub fn new(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Result<Self, GeoError> {
        for (what, value) in
            [("latitude", latitude_deg), ("longitude", longitude_deg), ("height", height_m)]
        {
            check_finite(what, value)?;
        }
        if latitude_deg.abs() > 90.0 {
            return Err(GeoError::Latitude { latitude_deg });
        }
        if longitude_deg.abs() > 360.0 {
            return Err(GeoError::Longitude { longitude_deg });
        }
        if !(MIN_HEIGHT_M..=MAX_HEIGHT_M).contains(&height_m) {
            return Err(GeoError::Height { height_m });
        }
        Ok(Self { latitude_deg, longitude_deg: wrap_longitude(longitude_deg), height_m })
    }

    /// Degrees, north is positive.
    pub fn latitude_deg(self) -> f64 {
        self.latitude_deg
    }

    /// Degrees from -180 (included) to 180, east is positive.
    pub fn longitude_deg(self) -> f64 {
        self.longitude_deg
    }

    /// Metres above the ellipsoid; not above the sea.
    pub fn height_m(self) -> f64 {
        self.height_m
    }
}

/// `longitude_deg`, within two turns, as -180 (included) to 180.
pub(crate) fn wrap_longitude(longitude_deg: f64) -> f64 {
    if longitude_deg >= 180.0 {
        longitude_deg - 360.0
    } else if longitude_deg < -180.0 {
        longitude_deg + 360.0
    } else {
        longitude_deg
    }
}

pub(crate) fn check_finite(what: &'static str, value: f64) -> Result<(), GeoError> {
    if value.is_finite() { Ok(()) } else { Err(GeoError::NotFinite { what, value }) }
}
