//! How well a map agrees with another, or with the world that was simulated: what is found of its
//! walls and free space, and what of it is right.

use std::path::Path;

use anyhow::{Context, Result};
use armor_grid_slam::field::{Field, Window};
use armor_grid_slam::grid::Grid as Surfaces;
use armor_grid_slam::pose::{Point, Pose};
use armor_grid_slam::refine::{Expected, refine};
use armor_grid_slam::scan::thin;
use armor_grid_slam::search::{Prior, search};
use armor_simulator::map_server::occupancy;
use armor_simulator::truth::{MapScore, score};
use armor_simulator::world::World;
use nalgebra::Matrix3;

use armor_grid::{Geometry, Grid, Occupancy, Point2};

/// How far two maps may be apart when they are to be laid over each other, metres and radians.
const WINDOW_M: f64 = 3.0;
const WINDOW_RAD: f64 = 0.2;
/// Side of the squares that walls are thinned to for that, and how far a wall is felt, metres.
const COARSE_M: f64 = 0.25;
const BLUR_M: f64 = 0.3;

/// The shares, and how the map was moved for them.
pub struct Agreement {
    pub score: MapScore,
    /// `reference_from_map`.
    pub moved: Pose,
}

/// A map in its own cells, and where they lie.
struct Map {
    cells: Grid<Occupancy>,
    map_from_cells: Pose,
}

/// Compares two maps whose frames are the same, or are brought to be by laying one over the other;
/// what is off by up to the tolerance is right.
///
/// # Errors
/// If a file cannot be read.
pub fn compared(map: &Path, reference: &Path, align: bool, tolerance_m: f64) -> Result<Agreement> {
    let map = read(map)?;
    let is_world = reference.extension().is_some_and(|ending| ending == "svg");
    let reference = if is_world {
        world(reference, map.cells.geometry().resolution_m)?
    } else {
        read(reference)?
    };
    let moved = if align { laid(&map, &reference) } else { Pose::default() };
    let reference_from_cells = reference.map_from_cells.inverse() * moved * map.map_from_cells;
    let laid =
        resampled(&map.cells, &reference_from_cells, reference.cells.geometry().resolution_m);
    let tolerance_cells = tolerance_m / reference.cells.geometry().resolution_m;
    Ok(Agreement { score: score(&laid, &reference.cells, tolerance_cells as f32), moved })
}

fn read(path: &Path) -> Result<Map> {
    let (cells, origin) = occupancy(path).context("cannot compare maps")?;
    let map_from_cells = Pose::new(origin.x_m, origin.y_m, origin.yaw_rad);
    Ok(Map { cells, map_from_cells })
}

/// The world of a drawing: the frame of the map is where the robot starts.
fn world(path: &Path, resolution_m: f64) -> Result<Map> {
    let world = World::read(path).context("cannot compare maps")?;
    let cells = world.free_space(resolution_m)?;
    Ok(Map { cells, map_from_cells: Pose::default() })
}

/// Where the walls of a map lie over those of another best: `reference_from_map`.
fn laid(map: &Map, reference: &Map) -> Pose {
    let points = thin(walls(map), COARSE_M);
    let mut surfaces = Surfaces::new(COARSE_M / 2.0);
    surfaces.mark(&walls(reference).collect::<Vec<_>>());
    let prior = Prior {
        pose: Pose::default(),
        sigma_m: WINDOW_M,
        sigma_rad: WINDOW_RAD,
        window_m: WINDOW_M,
        window_rad: WINDOW_RAD,
    };
    let resolution_m = surfaces.resolution_m();
    let window = Window::around(&points, &prior, resolution_m, 3.0 * BLUR_M);
    let field = Field::draw(&surfaces, window, BLUR_M, 4);
    let Some(found) = search(&field, &points, &prior, resolution_m, None) else {
        return Pose::default();
    };
    let free = Expected { pose: found.pose, information: Matrix3::identity() };
    refine(&surfaces, &points, found.pose, &free).pose
}

fn walls(map: &Map) -> impl Iterator<Item = Point> + '_ {
    let wall = map.cells.iter().filter(|(_, cell)| **cell == Occupancy::Occupied);
    wall.map(|(cell, _)| {
        let Point2 { x_m, y_m } = map.cells.geometry().centre(cell);
        map.map_from_cells.apply(Point { x_m, y_m })
    })
}

/// The map in the frame of another's cells.
fn resampled(map: &Grid<Occupancy>, other_from_map: &Pose, resolution_m: f64) -> Grid<Occupancy> {
    let own = map.geometry();
    let (width_m, height_m) =
        (own.width as f64 * own.resolution_m, own.height as f64 * own.resolution_m);
    let corner = |along: f64, up: f64| {
        let (x_m, y_m) = (own.origin.x_m + along * width_m, own.origin.y_m + up * height_m);
        other_from_map.apply(Point { x_m, y_m })
    };
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
    let low = |of: fn(&Point) -> f64| corners.iter().map(of).fold(f64::MAX, f64::min);
    let high = |of: fn(&Point) -> f64| corners.iter().map(of).fold(f64::MIN, f64::max);
    let floor = |metres: f64| (metres / resolution_m).floor() * resolution_m;
    let origin = Point2::new(floor(low(|p| p.x_m)), floor(low(|p| p.y_m)));
    let count = |from_m: f64, to_m: f64| ((to_m - from_m) / resolution_m).ceil() as usize + 1;
    let (width, height) = (count(origin.x_m, high(|p| p.x_m)), count(origin.y_m, high(|p| p.y_m)));
    let geometry = Geometry { origin, resolution_m, width, height };
    let mut laid = Grid::filled(geometry, Occupancy::Unknown);
    let map_from_other = other_from_map.inverse();
    for cell in geometry.cells() {
        let Point2 { x_m, y_m } = geometry.centre(cell);
        let at = map_from_other.apply(Point { x_m, y_m });
        if let Some(known) = map.at(Point2::new(at.x_m, at.y_m)) {
            laid[cell] = *known;
        }
    }
    laid
}
