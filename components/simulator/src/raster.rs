//! A world of square cells, as maps are: rays walk from cell to cell (Amanatides & Woo, "A Fast
//! Voxel Traversal Algorithm for Ray Tracing", 1987) and end exactly on the edge of the first solid
//! one. All beyond the picture is solid.

use armor_drawn_world::{MAX_SEGMENTS, Segment};
use armor_grid::{Cell, Geometry, Grid, Point2, traverse};
use armor_map_file::{MapFileError, MapFileFault};

use crate::pose::{Portable, Pose2};

/// Solid and free cells, and where they lie in the map.
#[derive(Clone)]
pub(crate) struct Raster {
    solid: Grid<bool>,
    map_from_cells: Pose2,
    cells_from_map: Pose2,
}

impl Raster {
    /// Lays cells into the map; refuses more outlines than a drawing may have.
    pub(crate) fn new(map: SolidCells, map_from_cells: Pose2) -> Result<Self, MapFileError> {
        let SolidCells { file, solid } = map;
        let raster = Self { solid, map_from_cells, cells_from_map: map_from_cells.inverted() };
        let fault = match raster.outlines().len() {
            0 => MapFileFault::NothingFree,
            count if count > MAX_SEGMENTS => MapFileFault::TooRagged(count),
            _ => return Ok(raster),
        };
        Err(MapFileError { file, line: 0, fault })
    }

    fn is_solid(&self, cell: Cell) -> bool {
        self.solid.get(cell).copied().unwrap_or(true)
    }

    /// Whether a point of the map lies in something solid.
    pub(crate) fn is_solid_at(&self, x_m: f64, y_m: f64) -> bool {
        let (x_m, y_m) = self.cells_from_map.point_from(x_m, y_m);
        self.is_solid(self.solid.geometry().cell_at(Point2::new(x_m, y_m)))
    }

    /// The distance from a pose along its heading to the first solid cell nearer than
    /// `max_range_m`; 0 from within one.
    pub(crate) fn range_m(&self, from: Pose2, max_range_m: f64) -> Option<f64> {
        let from = self.cells_from_map.then(from);
        let (sin, cos) = libm::sincos(from.yaw_rad);
        let geometry = self.solid.geometry();
        // Beyond the picture all is solid: no ray needs to be longer than across it.
        let across_m = geometry.resolution_m * (geometry.width + geometry.height + 2) as f64;
        let reach_m = max_range_m.min(across_m);
        let to = Point2::new(from.x_m + cos * reach_m, from.y_m + sin * reach_m);
        let hit = traverse(geometry, from.point(), to).find(|&cell| self.is_solid(cell))?;
        let range_m = entry_m(geometry, hit, from.point(), (cos, sin));
        (range_m < max_range_m).then_some(range_m)
    }

    /// The edges between solid and free, in the map frame: straight runs of them as one segment.
    pub(crate) fn outlines(&self) -> Vec<Segment> {
        let Geometry { origin, resolution_m, width, height } = *self.solid.geometry();
        let corner = |column: i32, row: i32| {
            let x_m = origin.x_m + f64::from(column) * resolution_m;
            let y_m = origin.y_m + f64::from(row) * resolution_m;
            self.map_from_cells.point_from(x_m, y_m)
        };
        let (columns, rows) = (width as i32, height as i32);
        let mut segments = Vec::new();
        for row in 0..=rows {
            let is_edge = |column: i32| {
                self.is_solid(Cell::new(column, row - 1)) != self.is_solid(Cell::new(column, row))
            };
            segments.extend(
                straight_runs(columns, is_edge)
                    .map(|(from, to)| Segment { from_m: corner(from, row), to_m: corner(to, row) }),
            );
        }
        for column in 0..=columns {
            let is_edge = |row: i32| {
                self.is_solid(Cell::new(column - 1, row)) != self.is_solid(Cell::new(column, row))
            };
            segments.extend(straight_runs(rows, is_edge).map(|(from, to)| Segment {
                from_m: corner(column, from),
                to_m: corner(column, to),
            }));
        }
        segments
    }
}

/// Cells and the file they are from.
pub(crate) struct SolidCells {
    pub(crate) file: String,
    pub(crate) solid: Grid<bool>,
}

/// Returns the runs of consecutive numbers below `count` that match, ends excluded.
fn straight_runs(count: i32, is_match: impl Fn(i32) -> bool) -> impl Iterator<Item = (i32, i32)> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let from = (next..count).find(|&i| is_match(i))?;
        let to = (from..count).find(|&i| !is_match(i)).unwrap_or(count);
        next = to;
        Some((from, to))
    })
}

/// How far along a ray it enters a cell's square: the later of where it crosses the two edges that
/// it meets first (the slab method).
fn entry_m(geometry: &Geometry, cell: Cell, from: Point2, (cos, sin): (f64, f64)) -> f64 {
    let slab = |at_m: f64, along: f64, origin_m: f64, index: i32| {
        let edge = if along > 0.0 { index } else { index + 1 };
        let edge_m = origin_m + f64::from(edge) * geometry.resolution_m;
        // A ray along the edges is within them all the way.
        if along == 0.0 { f64::NEG_INFINITY } else { (edge_m - at_m) / along }
    };
    let by_column = slab(from.x_m, cos, geometry.origin.x_m, cell.column);
    let by_row = slab(from.y_m, sin, geometry.origin.y_m, cell.row);
    by_column.max(by_row).max(0.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_4, PI};

    use super::*;
    use crate::walls::Walls;

    /// Rows of `#` and `.`, the top one first, with cells of half a metre from (−1, −2) on.
    fn raster(rows: &[&str], map_from_cells: Pose2) -> Raster {
        let geometry = Geometry {
            origin: Point2::new(-1.0, -2.0),
            resolution_m: 0.5,
            width: rows[0].len(),
            height: rows.len(),
        };
        let cells = rows.iter().rev().flat_map(|row| row.bytes().map(|letter| letter == b'#'));
        let solid = Grid::from_values(geometry, cells.collect()).expect("a rectangle");
        let cells = SolidCells { file: "map.yaml".to_owned(), solid };
        Raster::new(cells, map_from_cells).expect("something free")
    }

    const ROOM: [&str; 6] =
        ["########", "#......#", "#..##..#", "#......#", "#......#", "########"];

    #[test]
    fn rays_end_on_the_edges_of_cells() {
        let room = raster(&ROOM, Pose2::default());
        // The room is x −0.5..2.5, y −1.5..0.5; a block at x 0.5..1.5, y −0.5..0.
        let from = |x_m, y_m, degrees: f64| Pose2::new(x_m, y_m, degrees.to_radians());
        for (pose, expected_m) in [
            (from(0.0, -1.0, 0.0), 2.5),
            (from(0.0, -1.0, 180.0), 0.5),
            (from(1.0, -1.0, 90.0), 0.5),
            (from(0.0, -1.0, 45.0), 0.5 * 2f64.sqrt()),
            (from(1.0, 0.2, -90.0), 0.2),
        ] {
            let range_m = room.range_m(pose, 10.0).expect("a wall");
            assert!((range_m - expected_m).abs() < 1e-9, "{pose:?}: {range_m}");
        }
        assert_eq!(room.range_m(from(0.0, -1.0, 0.0), 2.4), None, "out of range");
        assert!(room.is_solid_at(1.0, -0.25) && !room.is_solid_at(1.0, 0.25));
    }

    #[test]
    fn all_beyond_the_picture_is_solid() {
        let open = raster(&["...", "...", "..."], Pose2::default());
        let range_m = open.range_m(Pose2::new(0.0, -1.5, 0.0), 100.0).expect("the edge");
        assert!((range_m - 0.5).abs() < 1e-9, "{range_m}");
        assert_eq!(open.outlines().len(), 4);
    }

    #[test]
    fn a_picture_without_room_is_refused() {
        let geometry =
            Geometry { origin: Point2::default(), resolution_m: 0.1, width: 2, height: 2 };
        let cells = SolidCells { file: "m".to_owned(), solid: Grid::filled(geometry, true) };
        let error = Raster::new(cells, Pose2::default()).err().expect("no room");
        assert_eq!(error.fault, MapFileFault::NothingFree);
    }

    proptest! {
        /// Walking over cells finds what the tree of their outlines finds, however the map is
        /// turned.
        #[test]
        fn rays_agree_with_those_to_the_outlines(
            cells in proptest::collection::vec(proptest::bool::weighted(0.2), 100),
            yaw_rad in -PI..PI,
            turned_rad in -PI..PI,
            x in 0.01..0.99f64,
            y in 0.01..0.99f64,
        ) {
            let geometry = Geometry {
                origin: Point2::new(0.3, -0.2), resolution_m: 0.25, width: 10, height: 10,
            };
            let mut solid = Grid::from_values(geometry, cells).expect("a rectangle");
            solid[Cell::new(4, 5)] = false;
            let cells = SolidCells { file: "m".to_owned(), solid };
            let map_from_cells = Pose2::new(2.0, -1.0, turned_rad);
            let raster = Raster::new(cells, map_from_cells).expect("a free cell");
            // Off the diagonal corners, where two solid cells touch and outlines let a ray through.
            prop_assume!((yaw_rad.rem_euclid(FRAC_PI_4)) > 1e-3);
            let inside = Pose2::new(0.3 + (4.0 + x) * 0.25, -0.2 + (5.0 + y) * 0.25, yaw_rad);
            let from = map_from_cells.then(inside);
            let walked = raster.range_m(from, 50.0).expect("the edge at least");
            let found = Walls::new(raster.outlines()).range_m(from, 50.0).expect("an outline");
            prop_assert!((walked - found).abs() < 1e-5, "{} {}", walked, found);
        }
    }
}
