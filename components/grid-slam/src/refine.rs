//! Refines a pose below the size of a cell: Gauss-Newton on the distances of the scan's points to
//! the local distribution of the map's surface points (after Biber and Straßer's NDT, IROS 2003),
//! with the odometry as one more measurement, and another one of the heading where walls give it.

use crate::grid::SurfaceGrid;
use crate::pose::{Point, Pose, wrapped};
use crate::scan::ScanPoint;
use crate::wall_directions::WallHeading;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// Cells around a point whose surfaces it is compared to.
const NEIGHBOUR_CELLS: i32 = 3;
/// Scatter of a surface that comes from the laser and from walls being rough, metres.
const ROUGHNESS_M: f64 = 0.03;
/// Beyond this many sigmas a point loses its weight: it sees something that is not in the map.
const DOUBT_SIGMAS: f64 = 2.0;
/// Share of an independent measurement that a beam is worth: neighbours err together.
pub(crate) const BEAM_WORTH: f64 = 0.15;
/// A surface is seen from behind if the cosine between the view and its normal exceeds this.
const BEHIND: f64 = 0.15;
/// A scan measures a direction if it gives this many times the odometry's information about it.
const MEASURED: f64 = 4.0;
const MOST_STEPS: usize = 12;
const STILL_M: f64 = 2e-4;
const STILL_RAD: f64 = 2e-5;

/// A refined pose and what is known about its error.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The pose.
    pub pose: Pose,
    /// Covariance of x, y (m²) and heading (rad²), with the odometry and without the walls.
    pub covariance: Matrix3<f64>,
    /// Information that the scan alone gives about x, y and heading.
    pub information: Matrix3<f64>,
    /// Share of the points that lie on a surface of the map.
    pub support: f64,
    /// The surfaces that were seen from there.
    pub(crate) landscape: Landscape,
}

/// What is known of a pose before the scan is matched: by odometry, as a Gaussian, and its heading by
/// walls.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The pose by odometry.
    pub pose: Pose,
    /// Its information about x, y and heading.
    pub information: Matrix3<f64>,
    /// The heading that walls measure, if they do.
    pub(crate) wall_heading: Option<WallHeading>,
}

impl Expected {
    /// Makes an expectation without walls.
    pub fn new(pose: Pose, information: Matrix3<f64>) -> Self {
        Self { pose, information, wall_heading: None }
    }

    /// Reduces the weight of the odometry the farther it is from where the scan fits.
    pub fn doubted(&self, found: &Pose) -> Self {
        let error = pose_difference(found, &self.pose);
        let trust = |i: usize| 1.0 / (1.0 + error[i] * error[i] * self.information[(i, i)]);
        let scale = Matrix3::from_diagonal(&Vector3::new(trust(0), trust(1), trust(2)));
        Self { information: self.information * scale, ..*self }
    }

    /// Returns the projection of a motion on the directions that a scan of this information
    /// measures.
    pub(crate) fn measured_part(&self, scan: &Matrix3<f64>) -> Matrix3<f64> {
        // In units of the odometry's standard deviations.
        let per_unit = self.information.diagonal().map(|one| one.max(1e-9).sqrt());
        let unit = Matrix3::from_diagonal(&per_unit.map(f64::recip));
        let eigen = (unit * scan * unit).symmetric_eigen();
        let directions = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let measured = directions.filter(|(information, _)| **information >= MEASURED);
        let inner: Matrix3<f64> = measured.map(|(_, one)| one * one.transpose()).sum();
        unit * inner * Matrix3::from_diagonal(&per_unit)
    }
}

/// Logarithm of the likelihood of a beam that contradicts the map altogether, and of one that ends
/// where the map knows nothing.
const CONTRADICTED: f64 = -0.5 * DOUBT_SIGMAS * DOUBT_SIGMAS;
const UNKNOWN: f64 = 0.5 * CONTRADICTED;

impl Expected {
    /// Logarithm of the likelihood of a pose, up to a constant. The odometry's errors have long tails;
    /// the walls' error is Gaussian.
    pub(crate) fn likelihood(&self, pose: &Pose) -> f64 {
        let error = pose_difference(pose, &self.pose);
        let of = |i: usize| error[i] * error[i] * self.information[(i, i)];
        let walls = self.wall_heading.map_or(0.0, |walls| {
            let off_rad = wrapped(pose.yaw_rad - walls.yaw_rad);
            -0.5 * off_rad * off_rad * walls.information
        });
        walls - (1.0 + of(0) + of(1)).ln() - (1.0 + of(2)).ln()
    }
}

/// The surfaces around a pose, as a scan taken near it sees them: a likelihood that is cheap to ask
/// for many poses.
#[derive(Clone, Debug)]
pub(crate) struct Landscape {
    seen: Vec<(Point, Patch)>,
    /// The likelihood of the points without a surface, which no pose changes.
    elsewhere: f64,
}

impl Landscape {
    pub(crate) fn new(grid: &SurfaceGrid, points: &[ScanPoint], pose: &Pose) -> Self {
        let mut landscape = Self { seen: Vec::with_capacity(points.len()), elsewhere: 0.0 };
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let map_from_robot = Matrix2::new(cos, -sin, sin, cos);
        for ScanPoint { place, along_m } in points {
            let world = pose.apply(*place);
            match read_patch(grid, world, view_direction(pose, world)) {
                Some(patch) => {
                    landscape.seen.push((*place, patch.loosened(&(map_from_robot * along_m))));
                }
                None if grid.is_known(grid.cell_of(world)) => landscape.elsewhere += CONTRADICTED,
                None => landscape.elsewhere += UNKNOWN,
            }
        }
        landscape
    }

    /// Logarithm of the likelihood of the scan at a pose, as if beams erred independently.
    pub(crate) fn likelihood(&self, pose: &Pose) -> f64 {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let of = |(point, patch): &(Point, Patch)| {
            let x_m = pose.x_m + cos * point.x_m - sin * point.y_m;
            let y_m = pose.y_m + sin * point.x_m + cos * point.y_m;
            let residual = Vector2::new(x_m, y_m) - patch.mean;
            let squared = (patch.information * residual).dot(&residual);
            // Geman and McClure's error, as the refinement minimises it.
            -0.5 * squared / (1.0 + squared / (DOUBT_SIGMAS * DOUBT_SIGMAS))
        };
        self.elsewhere + self.seen.iter().map(of).sum::<f64>()
    }

    /// The step to where the scan fits these surfaces better (Gauss-Newton).
    fn newton_step(&self, pose: &Pose, expected: &Expected) -> Option<Vector3<f64>> {
        let system = self.build_system(pose);
        let error = pose_difference(pose, &expected.pose);
        let mut hessian = system.hessian + expected.information;
        let mut gradient = system.gradient + expected.information * error;
        if let Some(walls) = expected.wall_heading {
            hessian.m33 += walls.information;
            gradient.z += walls.information * wrapped(pose.yaw_rad - walls.yaw_rad);
        }
        hessian.cholesky().map(|c| -c.solve(&gradient))
    }

    /// The information that the scan gives about x, y and heading at a pose.
    pub(crate) fn information(&self, pose: &Pose) -> Matrix3<f64> {
        self.build_system(pose).hessian
    }

    fn build_system(&self, pose: &Pose) -> NormalEquations {
        let mut system = NormalEquations {
            hessian: Matrix3::zeros(),
            gradient: Vector3::zeros(),
            supported: 0.0,
        };
        let (sin, cos) = pose.yaw_rad.sin_cos();
        for (point, patch) in &self.seen {
            let (dx, dy) = (cos * point.x_m - sin * point.y_m, sin * point.x_m + cos * point.y_m);
            system.add(Vector2::new(dx, dy), pose, patch);
        }
        system
    }
}

/// The map's surface near a point.
#[derive(Clone, Copy, Debug)]
struct Patch {
    mean: Vector2<f64>,
    information: Matrix2<f64>,
}

impl Patch {
    /// The surface as a point sees it whose own place has this standard deviation along a wall.
    fn loosened(mut self, along_m: &Vector2<f64>) -> Self {
        let weighted = self.information * along_m;
        self.information -= weighted * weighted.transpose() / (1.0 + along_m.dot(&weighted));
        self
    }
}

/// Moves `start` to where `points` fit the surfaces of the map best.
pub fn refine(
    grid: &SurfaceGrid,
    points: &[ScanPoint],
    start: Pose,
    expected: &Expected,
) -> Refined {
    let mut pose = start;
    let mut landscape = Landscape::new(grid, points, &pose);
    // Surfaces are looked up again after every step: where they give no information along a wall,
    // those of the step before would hold the scan back.
    for _ in 0..MOST_STEPS {
        let Some(step) = landscape.newton_step(&pose, expected) else { break };
        pose = move_pose(&pose, &step);
        if step.xy().norm() < STILL_M && step.z.abs() < STILL_RAD {
            break;
        }
        landscape = Landscape::new(grid, points, &pose);
    }
    let system = landscape.build_system(&pose);
    let all = if points.iter().all(ScanPoint::measures_all) {
        system.hessian + expected.information
    } else {
        // As if bare walls measured the way along them: with the larger covariance that they leave,
        // loops would be closed between aisles that look alike.
        let points: Vec<_> = points.iter().map(|point| ScanPoint::from(point.place)).collect();
        let landscape = Landscape::new(grid, &points, &pose);
        landscape.information(&pose) + expected.information
    };
    let covariance = all.cholesky().map_or_else(Matrix3::identity, |c| c.inverse());
    let support = system.supported / points.len().max(1) as f64;
    Refined { pose, covariance, information: system.hessian, support, landscape }
}

pub(crate) fn pose_difference(pose: &Pose, from: &Pose) -> Vector3<f64> {
    Vector3::new(pose.x_m - from.x_m, pose.y_m - from.y_m, wrapped(pose.yaw_rad - from.yaw_rad))
}

pub(crate) fn move_pose(pose: &Pose, by: &Vector3<f64>) -> Pose {
    Pose::new(pose.x_m + by.x, pose.y_m + by.y, wrapped(pose.yaw_rad + by.z))
}

/// The normal equations at one pose.
struct NormalEquations {
    hessian: Matrix3<f64>,
    gradient: Vector3<f64>,
    supported: f64,
}

impl NormalEquations {
    /// Adds a point that lies at `arm` from the robot, in the map's directions.
    fn add(&mut self, arm: Vector2<f64>, pose: &Pose, patch: &Patch) {
        let residual = Vector2::new(pose.x_m, pose.y_m) + arm - patch.mean;
        let squared = (patch.information * residual).dot(&residual);
        // Geman and McClure's weight.
        let trust = (1.0 + squared / (DOUBT_SIGMAS * DOUBT_SIGMAS)).powi(-2);
        self.supported += f64::from(u8::from(squared < DOUBT_SIGMAS * DOUBT_SIGMAS));
        let jacobian = Matrix2x3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x);
        let weighted = jacobian.transpose() * patch.information * (trust * BEAM_WORTH);
        self.hessian += weighted * jacobian;
        self.gradient += weighted * residual;
    }
}

/// e to the power of -x for x up to 8, to a few thousandths: it is asked for all the time.
fn nearness(x: f64) -> f64 {
    let mut power = (1.0 - x / 64.0).max(0.0);
    for _ in 0..6 {
        power *= power;
    }
    power
}

/// The direction in which a robot sees a point.
fn view_direction(pose: &Pose, world: Point) -> [f64; 2] {
    let along = [world.x_m - pose.x_m, world.y_m - pose.y_m];
    let length_m = along[0].hypot(along[1]).max(1e-6);
    along.map(|part| part / length_m)
}

/// Returns whether a surface that faces this way is seen from behind.
fn is_behind(normal: [f64; 2], view: [f64; 2]) -> bool {
    normal[0] * view[0] + normal[1] * view[1] > BEHIND
}

/// Returns the points that may be on surfaces of the map, seen from about `pose`: those near which
/// there is none, or one that is not seen from behind. What is near the back of a wall only is the
/// wall's other side, which the map does not show yet: it would draw the scan across the wall.
pub(crate) fn points_in_front(grid: &SurfaceGrid, points: &[Point], pose: &Pose) -> Vec<Point> {
    let is_in_front = |point: &&Point| {
        let world = pose.apply(**point);
        let view = view_direction(pose, world);
        let [x, y] = grid.cell_of(world);
        let low = [x - NEIGHBOUR_CELLS, y - NEIGHBOUR_CELLS];
        let high = [x + NEIGHBOUR_CELLS + 1, y + NEIGHBOUR_CELLS + 1];
        let (mut front, mut back) = (false, false);
        grid.for_each_facing_surface(low, high, |_, _, normal| {
            if is_behind(normal, view) { back = true } else { front = true }
        });
        front || !back
    };
    points.iter().filter(is_in_front).copied().collect()
}

/// Returns a symmetric matrix whose negative eigenvalues are zero. Points that lie farther apart than a
/// wall that fills the neighbourhood would give less than no information: the farther a scan were from
/// them, the better it would fit, without any limit.
fn clear_negative(matrix: Matrix2<f64>) -> Matrix2<f64> {
    let middle = matrix.trace() / 2.0;
    let spread = (0.5 * (matrix.m11 - matrix.m22)).hypot(matrix.m12);
    let (least, most) = (middle - spread, middle + spread);
    if least >= 0.0 {
        matrix
    } else if most <= 0.0 {
        Matrix2::zeros()
    } else {
        (matrix - Matrix2::identity() * least) * (most / (most - least))
    }
}

/// Weighted mean and scatter of the surface points around `world` that are not seen from behind.
fn read_patch(grid: &SurfaceGrid, world: Point, view: [f64; 2]) -> Option<Patch> {
    let [x, y] = grid.cell_of(world);
    let width_m = 0.5 * f64::from(NEIGHBOUR_CELLS) * grid.resolution_m();
    let scale = 0.5 / (width_m * width_m);
    let (mut weights, mut sum, mut squares) = (0.0, Vector2::zeros(), Matrix2::zeros());
    let low = [x - NEIGHBOUR_CELLS, y - NEIGHBOUR_CELLS];
    let high = [x + NEIGHBOUR_CELLS + 1, y + NEIGHBOUR_CELLS + 1];
    grid.for_each_facing_surface(low, high, |_, point, normal| {
        if is_behind(normal, view) {
            return;
        }
        let offset = Vector2::new(point.x_m - world.x_m, point.y_m - world.y_m);
        let weight = nearness(scale * offset.norm_squared());
        weights += weight;
        sum += offset * weight;
        squares += offset * offset.transpose() * weight;
    });
    if weights < 1e-6 {
        return None;
    }
    let mean = sum / weights;
    let scatter = squares / weights - mean * mean.transpose();
    let roughness = ROUGHNESS_M * ROUGHNESS_M;
    let within = (scatter + Matrix2::identity() * roughness).try_inverse()?;
    // Along a wall that fills the neighbourhood the scatter is the neighbourhood's: it carries no
    // information.
    let information =
        clear_negative(within - Matrix2::identity() / (width_m * width_m + roughness));
    Some(Patch { mean: mean + Vector2::new(world.x_m, world.y_m), information })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Beam;

    #[test]
    fn no_scan_fits_better_than_exactly() {
        // Two posts as far apart as the map compares: their scatter is larger than that of a wall.
        let mut grid = SurfaceGrid::new(0.05);
        let ends = [[1.0, 0.03], [1.0, -0.27], [1.3, 0.03], [1.02, 0.3]];
        let beam = |[x_m, y_m]: [f64; 2]| Beam { end: Point { x_m, y_m }, hit: true };
        let beams: Vec<_> = ends.into_iter().map(beam).collect();
        (0..3).for_each(|_| grid.insert(&Pose::default(), Point::default(), &beams));
        for step in -40..=40 {
            for across in -40..=40 {
                let (x_m, y_m) = (1.1 + 0.01 * f64::from(step), 0.01 * f64::from(across));
                let point = ScanPoint::from(Point { x_m, y_m });
                let landscape = Landscape::new(&grid, &[point], &Pose::default());
                for (_, patch) in &landscape.seen {
                    let least = patch.information.symmetric_eigenvalues().min();
                    assert!(least > -1e-6, "{x_m:.2}, {y_m:.2}: {least}");
                }
                for moved in -20..=20 {
                    let pose = Pose::new(0.05 * f64::from(moved), 0.0, 0.0);
                    let value = landscape.likelihood(&pose);
                    assert!((2.0 * CONTRADICTED..=1e-9).contains(&value), "{value}");
                }
            }
        }
    }

    #[test]
    fn negative_eigenvalues_are_cleared_and_others_kept() {
        let (sin, cos) = 0.7_f64.sin_cos();
        let turned = Matrix2::new(cos, -sin, sin, cos);
        let with = |one: f64, other: f64| {
            turned * Matrix2::from_diagonal(&Vector2::new(one, other)) * turned.transpose()
        };
        for (one, other) in [(3.0, 2.0), (3.0, -2.0), (-3.0, -2.0), (-1.0, 5.0), (0.0, 0.0)] {
            let right = with(f64::max(one, 0.0), f64::max(other, 0.0));
            assert!((clear_negative(with(one, other)) - right).norm() < 1e-9, "{one}, {other}");
        }
    }

    #[test]
    fn walls_turn_a_scan_that_fits_anywhere() {
        let grid = SurfaceGrid::new(0.05);
        let information = Matrix3::from_diagonal(&Vector3::new(1000.0, 1000.0, 3000.0));
        let heading = WallHeading { yaw_rad: 0.04, information: 9000.0 };
        let mut expected = Expected::new(Pose::new(0.1, 0.2, 0.0), information);
        let points = [ScanPoint::from(Point { x_m: 1.0, y_m: 0.0 })];
        let found = |expected: &Expected| refine(&grid, &points, expected.pose, expected).pose;
        assert!(found(&expected).yaw_rad.abs() < 1e-9);
        expected.wall_heading = Some(heading);
        // Three quarters of the information.
        let turned = found(&expected);
        assert!((turned.yaw_rad - 0.03).abs() < 1e-6, "{turned:?}");
        assert!(turned.distance_m(&expected.pose) < 1e-9);
        let at_walls = Pose { yaw_rad: heading.yaw_rad, ..expected.pose };
        assert!(expected.likelihood(&at_walls) > expected.likelihood(&expected.pose));
    }

    #[test]
    fn what_a_scan_does_not_measure_is_taken_from_a_motion() {
        let information = Matrix3::from_diagonal(&Vector3::new(1000.0, 1000.0, 1e5));
        let odometry = Expected::new(Pose::default(), information);
        // A corridor at 30 degrees.
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let (along, across) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        let turn = Vector3::new(0.0, 0.0, 1.0);
        let motion = along * 0.3 + across * 0.2 + turn * 0.01;
        let project = |by_along: f64, by_across: f64| {
            let scan = along * along.transpose() * by_along
                + across * across.transpose() * by_across
                + turn * turn.transpose() * 1e6;
            odometry.measured_part(&scan) * motion
        };
        assert!((project(1.0, 5000.0) - across * 0.2 - turn * 0.01).norm() < 1e-9);
        assert!((project(5000.0, 5000.0) - motion).norm() < 1e-9, "all is measured");
        assert!((project(3900.0, 3900.0) - turn * 0.01).norm() < 1e-9, "less than 4 times");
    }
}
