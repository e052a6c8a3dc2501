//! The ellipsoid WGS 84 (NIMA TR8350.2, 2000).

/// Semi-major axis.
pub(crate) const A_M: f64 = 6_378_137.0;
/// Flattening.
pub(crate) const F: f64 = 1.0 / 298.257_223_563;
/// Semi-minor axis.
pub(crate) const B_M: f64 = A_M * (1.0 - F);
/// First eccentricity, squared.
pub(crate) const E2: f64 = F * (2.0 - F);
/// Third flattening.
pub(crate) const N: f64 = F / (2.0 - F);
