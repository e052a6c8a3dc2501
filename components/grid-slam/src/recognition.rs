//! Where a robot is on a map that was stored: near where the odometry expects it, or anywhere on
//! the map, if the place looks like no other. Pure: no clock, no IO.

use crate::config::Config;
use crate::field::{CellWindow, LikelihoodField};
use crate::grid::SurfaceGrid;
use crate::matching::place_scan;
use crate::pose::{Pose, wrapped};
use crate::prior::Prior;
use crate::refine::{Expected, refine};
use crate::scan::{ScanPoint, thin};
use crate::search::search;
use crate::state::SavedPlace;
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// The odometry still counts after this long, seconds: a mapper that is restarted is back earlier,
/// a computer that was without power is not …
const TRUSTED_S: f64 = 20.0;
/// … if it moved no faster than a robot, metres per second, with a margin …
const FASTEST_MPS: f64 = 3.0;
const MARGIN_M: f64 = 0.3;
/// … and did not begin again: it is this near to zero, metres and radians, and was not before.
const ZERO_M: f64 = 0.05;
const ZERO_RAD: f64 = 0.05;
/// Share of the points on surfaces of the map that a place needs to which the odometry does not
/// lead: the map must show nearly all that is seen. Where the odometry leads, it needs as much as
/// any scan that is placed: ahead of an exploring robot much is new.
const SUPPORT_ANYWHERE: f64 = 0.85;
/// Mean likelihood that a place needs if the odometry does not lead there.
const FIT: f64 = 0.6;
/// A place is ambiguous if another one fits this well in comparison …
const RIVAL: f64 = 0.9;
/// … that is this far away, metres, or turned by this much, radians.
const APART_M: f64 = 1.0;
const APART_RAD: f64 = 0.6;
/// Scans in sequence that must find the same place, as the odometry connects them: if the odometry
/// leads there, and if it does not.
const WITNESSES: usize = 2;
const WITNESSES_ANYWHERE: usize = 4;
/// The whole map is searched only every so many scans: it takes longer than one.
const SEARCHED_EVERY: usize = 5;
/// Larger maps are not searched as a whole, metres.
const MOST_WINDOW_M: f64 = 60.0;
/// Cells of the search over the whole map, metres, and their blur.
const COARSE_M: f64 = 0.1;
const BLUR_M: f64 = 0.12;
/// A robot that is not found within this is taken for being elsewhere, seconds.
pub const MOST_S: u32 = 60;
/// Scans with fewer points show no place.
const FEWEST_POINTS: usize = 30;

/// A scan to be recognised.
#[derive(Clone, Copy, Debug)]
pub struct SeenScan<'a> {
    /// When it was taken, seconds.
    pub stamp_s: f64,
    /// The odometry of that moment.
    pub odometry: Pose,
    /// Its points, in the robot's frame.
    pub points: &'a [ScanPoint],
}

/// A place that scans have found.
#[derive(Clone, Copy, Debug)]
struct PlaceGuess {
    robot: Pose,
    odometry: Pose,
    witnesses: usize,
    needed: usize,
}

/// The search for the robot's place.
#[derive(Debug)]
pub struct PlaceSearch {
    last: SavedPlace,
    guess: Option<PlaceGuess>,
    /// Whether the odometry has turned out not to continue the stored one.
    is_astray: bool,
    scans: usize,
    /// Stamp of the first scan, seconds.
    begun_s: Option<f64>,
}

impl PlaceSearch {
    /// Begins at the place where the state was written.
    pub fn new(last: SavedPlace) -> Self {
        Self { last, guess: None, is_astray: false, scans: 0, begun_s: None }
    }

    /// Returns whether the search has lasted too long at the time of a scan.
    pub fn is_over(&self, stamp_s: f64) -> bool {
        // A stamp that goes back is of another time: it does not end the search.
        self.begun_s.is_some_and(|begun_s| stamp_s - begun_s > f64::from(MOST_S))
    }

    /// Looks at one more scan. Returns `map_from_robot` when it is certain.
    pub fn find_place(
        &mut self,
        config: &Config,
        map: &SurfaceGrid,
        scan: &SeenScan<'_>,
    ) -> Option<Pose> {
        self.begun_s.get_or_insert(scan.stamp_s);
        if scan.points.len() < FEWEST_POINTS {
            return None;
        }
        self.scans += 1;
        let guess = match self.guess.take() {
            Some(guess) => follow_guess(config, map, scan, &guess),
            None => self.guess_place(config, map, scan),
        }?;
        self.guess = Some(guess);
        (guess.witnesses >= guess.needed).then_some(guess.robot)
    }

    fn guess_place(
        &mut self,
        config: &Config,
        map: &SurfaceGrid,
        scan: &SeenScan<'_>,
    ) -> Option<PlaceGuess> {
        let odometry = scan.odometry;
        self.is_astray |= !self.continues_odometry(scan);
        if !self.is_astray {
            let SavedPlace { robot, odometry, .. } = self.last;
            let last = PlaceGuess { robot, odometry, witnesses: 0, needed: WITNESSES };
            return follow_guess(config, map, scan, &last);
        }
        if !(self.scans - 1).is_multiple_of(SEARCHED_EVERY) {
            return None;
        }
        let robot = search_map(map, scan.points)?;
        Some(PlaceGuess { robot, odometry, witnesses: 1, needed: WITNESSES_ANYWHERE })
    }

    /// Returns whether the odometry can be that of the robot that was at the stored place.
    fn continues_odometry(&self, scan: &SeenScan<'_>) -> bool {
        let passed_s = scan.stamp_s - self.last.stamp_s;
        let distance_m = self.last.odometry.distance_m(&scan.odometry);
        let is_zero = |pose: &Pose| {
            pose.x_m.hypot(pose.y_m) < ZERO_M && wrapped(pose.yaw_rad).abs() < ZERO_RAD
        };
        let has_begun_again = is_zero(&scan.odometry) && !is_zero(&self.last.odometry);
        (0.0..TRUSTED_S).contains(&passed_s)
            && distance_m <= FASTEST_MPS * passed_s + MARGIN_M
            && !has_begun_again
    }
}

/// Returns the guess as the next scan sees it; `None` if that contradicts it.
fn follow_guess(
    config: &Config,
    map: &SurfaceGrid,
    scan: &SeenScan<'_>,
    guess: &PlaceGuess,
) -> Option<PlaceGuess> {
    let motion = guess.odometry.inverse() * scan.odometry;
    let (expected, prior) = config.expect_motion(&guess.robot, &motion);
    let placed = place_scan(map, &mut None, scan.points, &expected, &prior, None)?;
    let (robot, odometry, witnesses) = (placed.pose, scan.odometry, guess.witnesses + 1);
    Some(PlaceGuess { robot, odometry, witnesses, ..*guess })
}

/// Returns where on the map the points were seen from, if there is one such place only.
fn search_map(map: &SurfaceGrid, points: &[ScanPoint]) -> Option<Pose> {
    let mut surfaces = Vec::new();
    let (low, high) = map.extent()?;
    map.for_each_surface(low, high, |_, point| surfaces.push(point));
    let points = thin(points.iter().map(|point| point.place), 2.0 * COARSE_M);
    let resolution_m = map.resolution_m();
    let along = |cell: i32| f64::from(cell) * resolution_m;
    let middle = [0, 1].map(|axis| (along(low[axis]) + along(high[axis])) / 2.0);
    let half_m = [0, 1].map(|axis| (along(high[axis]) - along(low[axis])) / 2.0);
    let window_m = half_m[0].max(half_m[1]);
    if window_m > MOST_WINDOW_M {
        return None;
    }
    let mut coarse = SurfaceGrid::new(COARSE_M);
    coarse.mark(&surfaces);
    // No place is expected more than another.
    let prior = |yaw_rad: f64, window_rad: f64| Prior {
        pose: Pose::new(middle[0], middle[1], yaw_rad),
        sigma_m: 1e6,
        sigma_rad: 1e6,
        window_m,
        window_rad,
    };
    let everywhere = prior(0.0, PI);
    let levels = ((window_m / COARSE_M).log2() as usize).clamp(2, 6);
    let cells = |metres: f64| (metres / COARSE_M).floor() as i32;
    // A bound over a square must not be lost because the square begins outside.
    let margin = cells(3.0 * BLUR_M) + 1 + (1 << levels);
    let window = CellWindow {
        low: [0, 1].map(|axis| cells(middle[axis] - half_m[axis]) - margin),
        high: [0, 1].map(|axis| cells(middle[axis] + half_m[axis]) + margin),
    };
    let field = LikelihoodField::draw(&coarse, window, BLUR_M, levels);
    let found = search(&field, &points, &everywhere, COARSE_M, None)?;
    if found.fit < FIT {
        return None;
    }
    let is_rival = |prior: &Prior, rival_of: Option<(&Pose, f64)>| {
        let rival = search(&field, &points, prior, COARSE_M, rival_of);
        rival.is_some_and(|rival| rival.fit > RIVAL * found.fit)
    };
    let turned = prior(wrapped(found.pose.yaw_rad + PI), PI - APART_RAD);
    if is_rival(&everywhere, Some((&found.pose, APART_M))) || is_rival(&turned, None) {
        return None;
    }
    let free = Expected::new(found.pose, Matrix3::identity());
    let points: Vec<_> = points.into_iter().map(ScanPoint::from).collect();
    let refined = refine(map, &points, found.pose, &free);
    (refined.support >= SUPPORT_ANYWHERE).then_some(refined.pose)
}
