//! Satellite positioning: where the base is on the earth, with noise, with an error that wanders
//! slowly (first-order Gauss-Markov, as of atmosphere and orbits), and with fixes that fail.

use crate::random::{NoiseStream, Random};

/// Where the world lies on the earth, and how good the receiver is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GpsModel {
    /// Latitude of the origin of the drawing, north positive, in radians.
    pub latitude_rad: f64,
    /// Longitude of the origin of the drawing, east positive, in radians.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, in metres.
    pub altitude_m: f64,
    /// Standard deviation of what is new in each fix, east and north, in metres.
    pub sigma_m: f64,
    /// Standard deviation of the wandering error, east and north, in metres.
    pub wander_m: f64,
    /// How long it takes to wander off, in seconds.
    pub wander_time_s: f64,
    /// Share of fixes that fail, 0 to 1.
    pub dropout: f64,
}

impl Default for GpsModel {
    fn default() -> Self {
        Self {
            latitude_rad: 50f64.to_radians(),
            longitude_rad: 10f64.to_radians(),
            altitude_m: 100.0,
            sigma_m: 0.5,
            wander_m: 1.5,
            wander_time_s: 60.0,
            dropout: 0.01,
        }
    }
}

/// A position on the earth (WGS 84).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// North positive, in radians.
    pub latitude_rad: f64,
    /// East positive, in radians.
    pub longitude_rad: f64,
    /// Above the ellipsoid, in metres.
    pub altitude_m: f64,
    /// Variance of east and of north, in square metres.
    pub variance_m2: f64,
}

/// Half the equator's diameter, in metres (WGS 84).
const EQUATOR_M: f64 = 6_378_137.0;
/// First eccentricity squared (WGS 84).
const ECCENTRICITY_2: f64 = 6.694_379_990_14e-3;

/// A receiver and its error now.
#[derive(Clone, Debug)]
pub(crate) struct Gps {
    model: GpsModel,
    random: Random,
    wandered_m: (f64, f64),
}

impl Gps {
    pub(crate) fn new(model: GpsModel, seed: u64) -> Self {
        let mut random = Random::new(seed, NoiseStream::Gps);
        // It has been on for long.
        let wandered_m = (random.normal(model.wander_m), random.normal(model.wander_m));
        Self { model, random, wandered_m }
    }

    /// Measures a place given in metres east and north of the origin, `since_s` seconds after the
    /// fix before; nothing if it fails.
    pub(crate) fn read(&mut self, east_m: f64, north_m: f64, since_s: f64) -> Option<Fix> {
        let GpsModel { sigma_m, wander_m, wander_time_s, dropout, .. } = self.model;
        let kept = libm::exp(-since_s / wander_time_s);
        let fresh_m = wander_m * libm::sqrt(1.0 - kept * kept);
        self.wandered_m.0 = self.wandered_m.0 * kept + self.random.normal(fresh_m);
        self.wandered_m.1 = self.wandered_m.1 * kept + self.random.normal(fresh_m);
        let east_m = east_m + self.wandered_m.0 + self.random.normal(sigma_m);
        let north_m = north_m + self.wandered_m.1 + self.random.normal(sigma_m);
        let has_failed = self.random.uniform() < dropout;
        (!has_failed).then(|| self.model.on_earth(east_m, north_m))
    }
}

impl GpsModel {
    /// Metres on the plane that touches the ellipsoid at the datum, by its radii of curvature along
    /// the meridian and across it.
    fn on_earth(&self, east_m: f64, north_m: f64) -> Fix {
        let (sin, cos) = libm::sincos(self.latitude_rad);
        let flattened = 1.0 - ECCENTRICITY_2 * sin * sin;
        let across_m = EQUATOR_M / libm::sqrt(flattened);
        let along_m = across_m * (1.0 - ECCENTRICITY_2) / flattened;
        Fix {
            latitude_rad: self.latitude_rad + north_m / (along_m + self.altitude_m),
            longitude_rad: self.longitude_rad + east_m / ((across_m + self.altitude_m) * cos),
            altitude_m: self.altitude_m,
            variance_m2: self.sigma_m * self.sigma_m + self.wander_m * self.wander_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: GpsModel = GpsModel {
        latitude_rad: 0.0,
        longitude_rad: 0.0,
        altitude_m: 0.0,
        sigma_m: 0.0,
        wander_m: 0.0,
        wander_time_s: 60.0,
        dropout: 0.0,
    };

    /// Metres per degree, as tables of the ellipsoid have them.
    #[track_caller]
    fn check(latitude_deg: f64, east_m: f64, north_m: f64) {
        let model = GpsModel { latitude_rad: latitude_deg.to_radians(), ..EXACT };
        let fix = Gps::new(model, 1).read(east_m, north_m, 1.0).expect("a fix");
        let degrees = |rad: f64| rad.to_degrees();
        assert!((degrees(fix.longitude_rad) - 1.0).abs() < 1e-5, "{fix:?}");
        assert!((degrees(fix.latitude_rad) - latitude_deg - 1.0).abs() < 1e-5, "{fix:?}");
    }

    #[test]
    fn a_degree_is_as_long_as_on_the_ellipsoid() {
        check(0.0, 111_319.49, 110_574.28);
        check(45.0, 78_846.81, 111_131.78);
        check(60.0, 55_800.0, 111_412.24);
    }

    #[test]
    fn errors_spread_as_they_should_and_wander_slowly() {
        let model = GpsModel { sigma_m: 0.3, wander_m: 2.0, wander_time_s: 10.0, ..EXACT };
        let metres = |fix: Fix| fix.latitude_rad * 110_574.28 / 1f64.to_radians();
        let mut gps = Gps::new(model, 1);
        let errors: Vec<f64> =
            (0..50_000).map(|_| metres(gps.read(0.0, 0.0, 1.0).expect("a fix"))).collect();
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / 50_000.0;
        assert!((variance.sqrt() - (4.0f64 + 0.09).sqrt()).abs() < 0.1, "{variance}");
        let product = |lag: usize| {
            errors.windows(lag + 1).map(|w| w[0] * w[lag]).sum::<f64>() / 50_000.0 / variance
        };
        assert!(product(1) > 0.8 && product(60).abs() < 0.1, "{} {}", product(1), product(60));
    }

    #[test]
    fn fixes_fail_in_their_share() {
        let mut gps = Gps::new(GpsModel { dropout: 0.2, ..EXACT }, 1);
        let failed = (0..10_000).filter(|_| gps.read(0.0, 0.0, 1.0).is_none()).count();
        assert!((1_850..2_150).contains(&failed), "{failed}");
    }
}
