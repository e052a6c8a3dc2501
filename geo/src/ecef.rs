//! Earth-centred, Earth-fixed coordinates, and back.

use crate::ellipsoid::{A_M, B_M, E2};
use crate::error::GeoError;
use crate::position::{GeoPosition, check_finite};

/// Nearer to the centre a point may have no nearest point on the ellipsoid, or several.
const MIN_RADIUS_M: f64 = 6_200_000.0;
/// Bowring's iteration converges by four digits a round at these radii.
const ROUNDS: usize = 6;

/// A position in the Earth-centred frame: x to 0° N 0° E, y to 0° N 90° E, z to the north pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EcefPosition {
    /// Metres to 0° N 0° E.
    pub x_m: f64,
    /// Metres to 0° N 90° E.
    pub y_m: f64,
    /// Metres to the north pole.
    pub z_m: f64,
}

impl From<GeoPosition> for EcefPosition {
    fn from(position: GeoPosition) -> Self {
        let (sin_lat, cos_lat) = position.latitude_deg().to_radians().sin_cos();
        let (sin_lon, cos_lon) = position.longitude_deg().to_radians().sin_cos();
        let normal_m = A_M / (1.0 - E2 * sin_lat * sin_lat).sqrt();
        let across_m = (normal_m + position.height_m()) * cos_lat;
        Self {
            x_m: across_m * cos_lon,
            y_m: across_m * sin_lon,
            z_m: (normal_m * (1.0 - E2) + position.height_m()) * sin_lat,
        }
    }
}

impl TryFrom<EcefPosition> for GeoPosition {
    type Error = GeoError;

    /// By Bowring's iteration over the parametric latitude (Survey Review 23, 1976).
    ///
    /// # Errors
    /// A number that is not finite; a position less than 6,200 km from the Earth's centre.
    fn try_from(position: EcefPosition) -> Result<Self, GeoError> {
        let EcefPosition { x_m, y_m, z_m } = position;
        for (what, value) in [("x", x_m), ("y", y_m), ("z", z_m)] {
            check_finite(what, value)?;
        }
        let across_m = x_m.hypot(y_m);
        let distance_m = across_m.hypot(z_m);
        if distance_m < MIN_RADIUS_M {
            return Err(GeoError::TooDeep { distance_m });
        }
        let second_e2 = E2 / (1.0 - E2);
        // The tangent of the parametric latitude, as sine and cosine, so that poles are no special
        // case.
        let (mut sin_beta, mut cos_beta) = unit(z_m * A_M, across_m * B_M);
        let (mut sin_lat, mut cos_lat) = (0.0, 1.0);
        for _ in 0..ROUNDS {
            (sin_lat, cos_lat) = unit(
                z_m + second_e2 * B_M * sin_beta.powi(3),
                across_m - E2 * A_M * cos_beta.powi(3),
            );
            (sin_beta, cos_beta) = unit((B_M / A_M) * sin_lat, cos_lat);
        }
        let normal_m = A_M / (1.0 - E2 * sin_lat * sin_lat).sqrt();
        // This form of the height loses no digits near the poles.
        let height_m = across_m * cos_lat + z_m * sin_lat - A_M * A_M / normal_m;
        let latitude_deg = sin_lat.atan2(cos_lat).to_degrees().clamp(-90.0, 90.0);
        Self::new(latitude_deg, y_m.atan2(x_m).to_degrees(), height_m)
    }
}

/// The sine and cosine of the direction (`along`, `up`).
fn unit(up: f64, along: f64) -> (f64, f64) {
    let length = up.hypot(along);
    (up / length, along / length)
}
