//! Universal Transverse Mercator: 60 zones with eastings and northings.

use crate::error::GeoError;
use crate::position::{GeoPosition, check_finite, wrap_longitude};
use crate::transverse_mercator::{RECTIFYING_RADIUS_M, project, unproject};

const CENTRAL_SCALE: f64 = 0.9996;
const FALSE_EASTING_M: f64 = 500_000.0;
const FALSE_NORTHING_SOUTH_M: f64 = 10_000_000.0;
const LATITUDES_DEG: std::ops::RangeInclusive<f64> = -80.0..=84.0;
/// Within it the series is exact to nanometres; a zone is at most 12° wide.
const MAX_FROM_MERIDIAN_DEG: f64 = 30.0;
/// The same as lengths, for positions that are not known yet.
const MAX_EASTING_OFFSET_M: f64 = 3_500_000.0;
const MAX_NORTHING_M: f64 = 9_400_000.0;

/// A zone of the grid, with its hemisphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct UtmZone {
    number: u8,
    north: bool,
}

/// A position in a zone of the grid, with its height above the ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UtmPosition {
    /// The zone.
    pub zone: UtmZone,
    /// Metres to the east, 500,000 on the central meridian.
    pub easting_m: f64,
    /// Metres to the north, from the equator, or from 10,000 km south of it.
    pub northing_m: f64,
    /// Metres above the ellipsoid.
    pub height_m: f64,
    /// From true north to grid north, clockwise.
    pub convergence_rad: f64,
    /// Metres of the grid for one metre on the ellipsoid.
    pub scale: f64,
}

impl UtmZone {
    /// The zone with this number.
    ///
    /// # Errors
    /// A number that is not 1 to 60.
    pub fn new(number: u8, north: bool) -> Result<Self, GeoError> {
        if (1..=60).contains(&number) {
            Ok(Self { number, north })
        } else {
            Err(GeoError::UtmZoneNumber { number })
        }
    }

    /// The zone of a position, with the exceptions in Norway and Svalbard.
    ///
    /// # Errors
    /// A latitude below -80° or above 84°.
    pub fn of(position: GeoPosition) -> Result<Self, GeoError> {
        let (latitude_deg, longitude_deg) = (position.latitude_deg(), position.longitude_deg());
        if !LATITUDES_DEG.contains(&latitude_deg) {
            return Err(GeoError::OutsideUtm { latitude_deg });
        }
        // From 1 to 60: the longitude is at least -180 and below 180.
        let regular = ((longitude_deg + 180.0) / 6.0).floor() as u8 + 1;
        let number = match (latitude_deg, longitude_deg) {
            (56.0..64.0, 3.0..12.0) => 32,
            (72.0.., 0.0..9.0) => 31,
            (72.0.., 9.0..21.0) => 33,
            (72.0.., 21.0..33.0) => 35,
            (72.0.., 33.0..42.0) => 37,
            _ => regular.min(60),
        };
        Ok(Self { number, north: latitude_deg >= 0.0 })
    }

    /// 1 to 60.
    pub fn number(self) -> u8 {
        self.number
    }

    /// Whether northings count from the equator; else from 10,000 km south of it.
    pub fn is_north(self) -> bool {
        self.north
    }

    fn meridian_deg(self) -> f64 {
        f64::from(self.number) * 6.0 - 183.0
    }

    fn false_northing_m(self) -> f64 {
        if self.north { 0.0 } else { FALSE_NORTHING_SOUTH_M }
    }

    /// `position` in this zone, which may be a neighbour of its own.
    ///
    /// # Errors
    /// A latitude that UTM does not cover; a position more than 30° from the central meridian.
    pub fn utm_from_geo(self, position: GeoPosition) -> Result<UtmPosition, GeoError> {
        let (latitude_deg, height_m) = (position.latitude_deg(), position.height_m());
        if !LATITUDES_DEG.contains(&latitude_deg) {
            return Err(GeoError::OutsideUtm { latitude_deg });
        }
        let from_meridian_deg = wrap_longitude(position.longitude_deg() - self.meridian_deg());
        let point = project(latitude_deg.to_radians(), from_meridian_deg.to_radians());
        let unit_m = CENTRAL_SCALE * RECTIFYING_RADIUS_M;
        let easting_m = FALSE_EASTING_M + unit_m * point.eta;
        let northing_m = self.false_northing_m() + unit_m * point.xi;
        if from_meridian_deg.abs() > MAX_FROM_MERIDIAN_DEG {
            return Err(GeoError::FarFromUtmZone { easting_m, northing_m, number: self.number });
        }
        Ok(UtmPosition {
            zone: self,
            easting_m,
            northing_m,
            height_m,
            convergence_rad: point.convergence_rad,
            scale: CENTRAL_SCALE * point.scale,
        })
    }

    /// The position at an easting, a northing and a height.
    ///
    /// # Errors
    /// A number that is not finite; a place more than about 30° from the central meridian, or
    /// beyond the latitudes that UTM covers.
    pub fn geo_from_utm(
        self,
        easting_m: f64,
        northing_m: f64,
        height_m: f64,
    ) -> Result<GeoPosition, GeoError> {
        check_finite("easting", easting_m)?;
        check_finite("northing", northing_m)?;
        let (across_m, along_m) =
            (easting_m - FALSE_EASTING_M, northing_m - self.false_northing_m());
        if across_m.abs() > MAX_EASTING_OFFSET_M || along_m.abs() > MAX_NORTHING_M {
            return Err(GeoError::FarFromUtmZone { easting_m, northing_m, number: self.number });
        }
        let unit_m = CENTRAL_SCALE * RECTIFYING_RADIUS_M;
        let (latitude_rad, from_meridian_rad) = unproject(along_m / unit_m, across_m / unit_m);
        let longitude_deg = wrap_longitude(self.meridian_deg() + from_meridian_rad.to_degrees());
        GeoPosition::new(latitude_rad.to_degrees(), longitude_deg, height_m)
    }
}

impl std::fmt::Display for UtmZone {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", self.number, if self.north { 'n' } else { 's' })
    }
}
