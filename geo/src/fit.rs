//! Fits a map to the world by pairs of points.

use crate::east_north_up::EnuFrame;
use crate::error::FitError;
use crate::map_point::MapPoint;
use crate::placement::MapPlacement;
use crate::position::GeoPosition;

/// With one pair the map could be turned in any way.
pub const MIN_FIT_PAIRS: usize = 2;
/// Points nearer than this to each other fix no direction.
const MIN_SPREAD_M: f64 = 1e-3;
/// The plane touches the Earth at the map's origin, which the fit moves; the second round moves it
/// by less than a micrometre.
const ROUNDS: usize = 4;

/// Whether the scale of the map is fitted too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleChoice {
    /// A metre of the map is a metre in the world.
    Metres,
    /// The scale that fits best, for a picture or a map of unknown scale.
    Fitted,
}

/// A map that is fitted to the world.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedMap {
    /// Where the map is.
    pub placement: MapPlacement,
    /// For each pair, its distance in the world after the fit.
    pub residuals_m: Vec<f64>,
}

impl FittedMap {
    /// The root of the mean square of the residuals.
    pub fn rms_m(&self) -> f64 {
        let squares: f64 = self.residuals_m.iter().map(|residual| residual * residual).sum();
        (squares / self.residuals_m.len().max(1) as f64).sqrt()
    }
}

/// Turns, moves and perhaps scales the map so that the sum of the squares of the residuals is least
/// (S. Umeyama, *Least-squares estimation of transformation parameters between two point patterns*,
/// PAMI 13, 1991, in two dimensions and without reflection).
///
/// # Errors
/// Fewer than two pairs; points that are all the same; pairs that determine no direction; points
/// too far from each other for a plane map.
pub fn fit_map(
    pairs: &[(MapPoint, GeoPosition)],
    scale: ScaleChoice,
) -> Result<FittedMap, FitError> {
    let &[(_, first), _, ..] = pairs else {
        return Err(FitError::TooFewPairs { found: pairs.len() });
    };
    let mean_height_m =
        pairs.iter().map(|(_, position)| position.height_m()).sum::<f64>() / pairs.len() as f64;
    let mut origin = GeoPosition::new(first.latitude_deg(), first.longitude_deg(), mean_height_m)?;
    let mut placement = MapPlacement::new(origin, 0.0, 1.0)?;
    for _ in 0..ROUNDS {
        placement = fit_around(pairs, origin, scale)?;
        origin = placement.origin();
    }
    let residuals_m = pairs
        .iter()
        .map(|(point, position)| {
            let there = placement.map_from_geo(*position)?;
            Ok(there.distance_m(*point) * placement.scale())
        })
        .collect::<Result<_, FitError>>()?;
    Ok(FittedMap { placement, residuals_m })
}

/// The best placement in the plane that touches the Earth at `plane_origin`.
fn fit_around(
    pairs: &[(MapPoint, GeoPosition)],
    plane_origin: GeoPosition,
    choice: ScaleChoice,
) -> Result<MapPlacement, FitError> {
    let frame = EnuFrame::new(plane_origin);
    let flat: Vec<_> = pairs
        .iter()
        .map(|(point, position)| {
            let enu = frame.enu_from_geo(*position);
            [point.x_m(), point.y_m(), enu.east_m, enu.north_m]
        })
        .collect();
    let mut mean = [0.0; 4];
    for row in &flat {
        for (sum, value) in mean.iter_mut().zip(row) {
            *sum += value / flat.len() as f64;
        }
    }
    let (mut map_square, mut world_square, mut along, mut turned) = (0.0, 0.0, 0.0, 0.0);
    for row in &flat {
        let [x, y, east, north]: [f64; 4] = std::array::from_fn(|axis| row[axis] - mean[axis]);
        map_square += x * x + y * y;
        world_square += east * east + north * north;
        along += x * east + y * north;
        turned += x * north - y * east;
    }
    let least = MIN_SPREAD_M * MIN_SPREAD_M;
    if map_square < least || world_square < least {
        return Err(FitError::NoSpread);
    }
    let covariance = along.hypot(turned);
    if covariance < 1e-9 * (map_square * world_square).sqrt() {
        return Err(FitError::NoDirection);
    }
    let scale = match choice {
        ScaleChoice::Metres => 1.0,
        ScaleChoice::Fitted => covariance / map_square,
    };
    let anticlockwise_rad = turned.atan2(along);
    let (sin, cos) = anticlockwise_rad.sin_cos();
    let [x, y, east, north] = mean;
    let in_plane = MapPlacement::new(plane_origin, 0.0, 1.0)?;
    let origin_point =
        MapPoint::new(east - scale * (x * cos - y * sin), north - scale * (x * sin + y * cos));
    let distance_m = east.hypot(north);
    let origin_point = origin_point.map_err(|_| crate::error::GeoError::TooFar { distance_m })?;
    let origin = in_plane.geo_from_map(origin_point)?;
    Ok(MapPlacement::new(origin, -anticlockwise_rad, scale)?)
}
