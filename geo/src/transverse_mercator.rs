//! The transverse Mercator projection by Krüger's series to the sixth order in the third flattening
//! (C. F. F. Karney, *Transverse Mercator with an accuracy of a few nanometers*, Journal of Geodesy
//! 85, 2011). Angles in radians, lengths in units of the rectifying radius.

use crate::ellipsoid::{A_M, E2, N};

/// Newton's iteration for the latitude doubles its digits each round.
const ROUNDS: usize = 6;

const N2: f64 = N * N;
const N3: f64 = N2 * N;
const N4: f64 = N2 * N2;
const N5: f64 = N4 * N;
const N6: f64 = N3 * N3;

/// Karney 2011, equation 35.
const ALPHA: [f64; 6] = [
    1.0 / 2.0 * N - 2.0 / 3.0 * N2 + 5.0 / 16.0 * N3 + 41.0 / 180.0 * N4 - 127.0 / 288.0 * N5
        + 7_891.0 / 37_800.0 * N6,
    13.0 / 48.0 * N2 - 3.0 / 5.0 * N3 + 557.0 / 1_440.0 * N4 + 281.0 / 630.0 * N5
        - 1_983_433.0 / 1_935_360.0 * N6,
    61.0 / 240.0 * N3 - 103.0 / 140.0 * N4 + 15_061.0 / 26_880.0 * N5 + 167_603.0 / 181_440.0 * N6,
    49_561.0 / 161_280.0 * N4 - 179.0 / 168.0 * N5 + 6_601_661.0 / 7_257_600.0 * N6,
    34_729.0 / 80_640.0 * N5 - 3_418_889.0 / 1_995_840.0 * N6,
    212_378_941.0 / 319_334_400.0 * N6,
];

/// Karney 2011, equation 36.
const BETA: [f64; 6] = [
    1.0 / 2.0 * N - 2.0 / 3.0 * N2 + 37.0 / 96.0 * N3 - 1.0 / 360.0 * N4 - 81.0 / 512.0 * N5
        + 96_199.0 / 604_800.0 * N6,
    1.0 / 48.0 * N2 + 1.0 / 15.0 * N3 - 437.0 / 1_440.0 * N4 + 46.0 / 105.0 * N5
        - 1_118_711.0 / 3_870_720.0 * N6,
    17.0 / 480.0 * N3 - 37.0 / 840.0 * N4 - 209.0 / 4_480.0 * N5 + 5_569.0 / 90_720.0 * N6,
    4_397.0 / 161_280.0 * N4 - 11.0 / 504.0 * N5 - 830_251.0 / 7_257_600.0 * N6,
    4_583.0 / 161_280.0 * N5 - 108_847.0 / 3_991_680.0 * N6,
    20_648_693.0 / 638_668_800.0 * N6,
];

/// The radius of the rectifying sphere (Karney 2011, equation 14).
pub(crate) const RECTIFYING_RADIUS_M: f64 =
    A_M / (1.0 + N) * (1.0 + N2 / 4.0 + N4 / 64.0 + N6 / 256.0);

/// A projected point.
pub(crate) struct Projected {
    /// Along the central meridian, from the equator.
    pub(crate) xi: f64,
    /// Across it, to the east.
    pub(crate) eta: f64,
    /// From true north to grid north, clockwise.
    pub(crate) convergence_rad: f64,
    /// Of lengths, relative to the central meridian.
    pub(crate) scale: f64,
}

/// Projects a latitude and a longitude that counts from the central meridian (Karney 2011,
/// equations 7 to 11 and 21 to 26).
pub(crate) fn project(latitude_rad: f64, longitude_rad: f64) -> Projected {
    let tau = latitude_rad.tan();
    let secant = 1.0_f64.hypot(tau);
    let conformal = conformal_tangent(tau);
    let (sin_lon, cos_lon) = longitude_rad.sin_cos();
    let across = conformal.hypot(cos_lon);
    let (xi_sphere, eta_sphere) = (conformal.atan2(cos_lon), (sin_lon / across).asinh());

    let (mut xi, mut eta, mut p, mut q) = (xi_sphere, eta_sphere, 1.0, 0.0);
    for (factor, alpha) in even_factors().zip(ALPHA) {
        let (sin, cos) = (factor * xi_sphere).sin_cos();
        let (sinh, cosh) = sinh_cosh(factor * eta_sphere);
        xi += alpha * sin * cosh;
        eta += alpha * cos * sinh;
        p += factor * alpha * cos * cosh;
        q += factor * alpha * sin * sinh;
    }
    let sphere_convergence = (conformal * sin_lon).atan2(1.0_f64.hypot(conformal) * cos_lon);
    let sin_lat = latitude_rad.sin();
    let sphere_scale = (1.0 - E2 * sin_lat * sin_lat).sqrt() * secant / across;
    Projected {
        xi,
        eta,
        convergence_rad: sphere_convergence + q.atan2(p),
        scale: sphere_scale * RECTIFYING_RADIUS_M / A_M * p.hypot(q),
    }
}

/// The latitude, and the longitude from the central meridian (Karney 2011, equations 15 to 21).
pub(crate) fn unproject(xi: f64, eta: f64) -> (f64, f64) {
    let (mut xi_sphere, mut eta_sphere) = (xi, eta);
    for (factor, beta) in even_factors().zip(BETA) {
        let (sin, cos) = (factor * xi).sin_cos();
        let (sinh, cosh) = sinh_cosh(factor * eta);
        xi_sphere -= beta * sin * cosh;
        eta_sphere -= beta * cos * sinh;
    }
    let (sin, cos) = xi_sphere.sin_cos();
    let across = eta_sphere.sinh();
    let tau = geodetic_tangent(sin / across.hypot(cos));
    (tau.atan(), across.atan2(cos))
}

/// 2, 4, 6 …
fn even_factors() -> impl Iterator<Item = f64> {
    (1..=6_u8).map(|order| 2.0 * f64::from(order))
}

fn sinh_cosh(x: f64) -> (f64, f64) {
    (x.sinh(), x.cosh())
}

/// The tangent of the conformal latitude, from that of the geodetic one.
fn conformal_tangent(tau: f64) -> f64 {
    let eccentricity = E2.sqrt();
    let secant = 1.0_f64.hypot(tau);
    let sigma = (eccentricity * (eccentricity * tau / secant).atanh()).sinh();
    tau * 1.0_f64.hypot(sigma) - sigma * secant
}

/// The inverse of [`conformal_tangent`], by Newton's iteration.
fn geodetic_tangent(conformal: f64) -> f64 {
    let mut tau = conformal / (1.0 - E2);
    for _ in 0..ROUNDS {
        let reached = conformal_tangent(tau);
        let secants = 1.0_f64.hypot(reached) * 1.0_f64.hypot(tau);
        let step = (conformal - reached) * (1.0 + (1.0 - E2) * tau * tau) / ((1.0 - E2) * secants);
        tau += step;
    }
    tau
}
