//! How well a map agrees with another one, or with the true map of a simulated world, whose frame
//! may be another.

use armor_grid::{Geometry, Grid, Occupancy, Point2};
use armor_grid_slam::field::{CellWindow, LikelihoodField};
use armor_grid_slam::grid::SurfaceGrid;
use armor_grid_slam::pose::{Point, Pose};
use armor_grid_slam::prior::Prior;
use armor_grid_slam::refine::{Expected, refine};
use armor_grid_slam::scan::ScanPoint;
use armor_grid_slam::scan::thin;
use armor_grid_slam::search::search;
use nalgebra::Matrix3;

use crate::map_score::{MapScore, score_map};

/// How far two maps may be apart to be aligned, metres and radians.
const SEARCH_M: f64 = 3.0;
const SEARCH_RAD: f64 = 0.2;
/// Side of the squares to which walls are thinned for the search, metres.
const THINNING_M: f64 = 0.25;
/// How far from a wall its likelihood reaches in the search, metres.
const BLUR_M: f64 = 0.3;

/// A map and the pose of its cells in the map frame.
pub struct PlacedMap {
    /// What is free, occupied and unknown.
    pub cells: Grid<Occupancy>,
    /// The pose of the grid's frame in the map frame.
    pub map_from_cells: Pose,
}

/// The score of a map, and the motion that aligned it.
pub struct MapAgreement {
    /// Recall and precision of walls and free space.
    pub score: MapScore,
    /// `reference_from_map`: the identity if the maps were not aligned.
    pub motion: Pose,
}

/// How two maps are brought into one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapAlignment {
    /// Their frames are the same.
    SameFrame,
    /// The map is moved so that its walls lie on those of the reference best.
    Search,
}

/// Compares a map with a reference; what is off by up to the tolerance counts as right.
pub fn compare_maps(
    map: &PlacedMap,
    reference: &PlacedMap,
    alignment: MapAlignment,
    tolerance_m: f64,
) -> MapAgreement {
    let motion = match alignment {
        MapAlignment::SameFrame => Pose::default(),
        MapAlignment::Search => align_walls(map, reference),
    };
    let reference_from_cells = reference.map_from_cells.inverse() * motion * map.map_from_cells;
    let resolution_m = reference.cells.geometry().resolution_m;
    let moved = resample_map(&map.cells, &reference_from_cells, resolution_m);
    let tolerance_cells = tolerance_m / resolution_m;
    MapAgreement { score: score_map(&moved, &reference.cells, tolerance_cells as f32), motion }
}

/// Returns `reference_from_map` for which the walls of the map lie on those of the reference best;
/// the identity if no motion within the search window fits.
fn align_walls(map: &PlacedMap, reference: &PlacedMap) -> Pose {
    let points = thin(list_walls(map), THINNING_M);
    let mut surfaces = SurfaceGrid::new(THINNING_M / 2.0);
    surfaces.mark(&list_walls(reference).collect::<Vec<_>>());
    let prior = Prior {
        pose: Pose::default(),
        sigma_m: SEARCH_M,
        sigma_rad: SEARCH_RAD,
        window_m: SEARCH_M,
        window_rad: SEARCH_RAD,
    };
    let resolution_m = surfaces.resolution_m();
    let window = CellWindow::around(&points, &prior, resolution_m, 3.0 * BLUR_M);
    let field = LikelihoodField::draw(&surfaces, window, BLUR_M, 4);
    let Some(found) = search(&field, &points, &prior, resolution_m, None) else {
        return Pose::default();
    };
    let free = Expected::new(found.pose, Matrix3::identity());
    let points: Vec<_> = points.into_iter().map(ScanPoint::from).collect();
    refine(&surfaces, &points, found.pose, &free).pose
}

/// Returns the centres of occupied cells in the map frame.
fn list_walls(map: &PlacedMap) -> impl Iterator<Item = Point> + '_ {
    let wall = map.cells.iter().filter(|(_, cell)| **cell == Occupancy::Occupied);
    wall.map(|(cell, _)| {
        let Point2 { x_m, y_m } = map.cells.geometry().centre(cell);
        map.map_from_cells.apply(Point { x_m, y_m })
    })
}

/// Returns the map in the frame and with the resolution of another map's cells.
fn resample_map(
    map: &Grid<Occupancy>,
    other_from_map: &Pose,
    resolution_m: f64,
) -> Grid<Occupancy> {
    let own = map.geometry();
    let (width_m, height_m) =
        (own.width as f64 * own.resolution_m, own.height as f64 * own.resolution_m);
    let corner = |along: f64, up: f64| {
        let (x_m, y_m) = (own.origin.x_m + along * width_m, own.origin.y_m + up * height_m);
        other_from_map.apply(Point { x_m, y_m })
    };
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
    let lowest = |of: fn(&Point) -> f64| corners.iter().map(of).fold(f64::MAX, f64::min);
    let highest = |of: fn(&Point) -> f64| corners.iter().map(of).fold(f64::MIN, f64::max);
    let floor = |metres: f64| (metres / resolution_m).floor() * resolution_m;
    let origin = Point2::new(floor(lowest(|p| p.x_m)), floor(lowest(|p| p.y_m)));
    let count = |from_m: f64, to_m: f64| ((to_m - from_m) / resolution_m).ceil() as usize + 1;
    let (width, height) =
        (count(origin.x_m, highest(|p| p.x_m)), count(origin.y_m, highest(|p| p.y_m)));
    let geometry = Geometry { origin, resolution_m, width, height };
    let mut resampled = Grid::filled(geometry, Occupancy::Unknown);
    let map_from_other = other_from_map.inverse();
    for cell in geometry.cells() {
        let Point2 { x_m, y_m } = geometry.centre(cell);
        let at = map_from_other.apply(Point { x_m, y_m });
        if let Some(known) = map.at(Point2::new(at.x_m, at.y_m)) {
            resampled[cell] = *known;
        }
    }
    resampled
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 3 m x 2 m in cells of 10 cm, with a wall across; its lower left corner at a place.
    fn room(corner_m: f64) -> PlacedMap {
        let geometry =
            Geometry { origin: Point2::default(), resolution_m: 0.1, width: 30, height: 20 };
        let mut cells = Grid::filled(geometry, Occupancy::Free);
        for cell in geometry.cells() {
            let is_edge = cell.column % 29 == 0 || cell.row % 19 == 0;
            if is_edge || (cell.column == 12 && cell.row > 5) {
                cells[cell] = Occupancy::Occupied;
            }
        }
        PlacedMap { cells, map_from_cells: Pose::new(corner_m, 0.0, 0.0) }
    }

    #[test]
    fn a_shifted_map_agrees_after_alignment_alone() {
        let (map, reference) = (room(0.0), room(0.5));
        let as_they_are = compare_maps(&map, &reference, MapAlignment::SameFrame, 0.1);
        assert!(as_they_are.score.wall_recall < 0.7, "{:?}", as_they_are.score);
        assert_eq!(as_they_are.motion, Pose::default());
        let aligned = compare_maps(&map, &reference, MapAlignment::Search, 0.1);
        assert!(aligned.score.wall_recall > 0.98, "{:?}", aligned.score);
        assert!((aligned.motion.x_m - 0.5).abs() < 0.05, "{:?}", aligned.motion);
    }
}
