//! The world as an occupancy raster, for scoring maps against it.
//!
//! The truth at a resolution is what a robot can find out: free cells are those that can be
//! reached from the start without crossing a wall, occupied are the wall cells next to them, and
//! all else (behind walls, inside furniture, outside) is unknown. Map and truth are both in the map
//! frame, so a map that is drawn well but turned or shifted scores badly, as it should.

use armor_grid::{Cell, Geometry, Grid, Occupancy, Point2, traverse};

use crate::world::World;

/// Most cells of a truth raster: 2 cm over 80 m square.
const MAX_CELLS: f64 = 16e6;

/// Why there is no raster of a world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TruthError {
    /// The resolution is zero, negative or not a number.
    #[error("a cell of {0} m has no size; give the resolution in metres, as in 0.05")]
    NoSize(f64),
    /// The raster would be too large.
    #[error("cells of {resolution_m} m make {cells:.0} of them; use larger cells")]
    TooFine {
        /// The resolution asked for, in metres per cell.
        resolution_m: f64,
        /// The number of cells it would take.
        cells: f64,
    },
}

impl World {
    /// The truth as a raster over the extent of the world, in the map frame.
    ///
    /// # Errors
    /// The resolution (metres per cell) is no size, or too fine for the world.
    pub fn free_space(&self, resolution_m: f64) -> Result<Grid<Occupancy>, TruthError> {
        let geometry = raster(self, resolution_m)?;
        let mut walls = Grid::filled(geometry, false);
        for wall in self.segments() {
            let (from, to) = (to_point(wall.from_m), to_point(wall.to_m));
            for cell in traverse(&geometry, from, to) {
                if let Some(is_wall) = walls.get_mut(cell) {
                    *is_wall = true;
                }
            }
        }
        Ok(seen_from_start(&walls))
    }
}

fn to_point((x_m, y_m): (f64, f64)) -> Point2 {
    Point2::new(x_m, y_m)
}

/// A raster around all walls with two cells to spare, its edges on multiples of the resolution.
fn raster(world: &World, resolution_m: f64) -> Result<Geometry, TruthError> {
    if !(resolution_m.is_finite() && resolution_m > 0.0) {
        return Err(TruthError::NoSize(resolution_m));
    }
    let extent = world.extent();
    let first = |min_m: f64| (min_m / resolution_m).floor() - 2.0;
    let count = |min_m: f64, max_m: f64| (max_m / resolution_m).floor() + 3.0 - first(min_m);
    let (columns, rows) =
        (count(extent.min_m.0, extent.max_m.0), count(extent.min_m.1, extent.max_m.1));
    if columns * rows > MAX_CELLS {
        return Err(TruthError::TooFine { resolution_m, cells: columns * rows });
    }
    let origin =
        to_point((first(extent.min_m.0) * resolution_m, first(extent.min_m.1) * resolution_m));
    Ok(Geometry { origin, resolution_m, width: columns as usize, height: rows as usize })
}

/// Floods from the start up to the walls; walls are lines of cells joined at their edges, so
/// nothing leaks through.
fn seen_from_start(walls: &Grid<bool>) -> Grid<Occupancy> {
    let geometry = *walls.geometry();
    let mut truth = Grid::filled(geometry, Occupancy::Unknown);
    let mut next = vec![geometry.cell_at(Point2::default())];
    while let Some(cell) = next.pop() {
        let is_new = truth.get(cell) == Some(&Occupancy::Unknown);
        if !is_new {
            continue;
        }
        if walls[cell] {
            truth[cell] = Occupancy::Occupied;
        } else {
            truth[cell] = Occupancy::Free;
            next.extend(cell.edge_neighbours());
        }
    }
    mark_corners(walls, &mut truth);
    truth
}

/// Wall cells that touch free space with a corner only are seen too.
fn mark_corners(walls: &Grid<bool>, truth: &mut Grid<Occupancy>) {
    let is_corner = |truth: &Grid<Occupancy>, cell: Cell| {
        walls[cell] && cell.neighbours().any(|next| truth.get(next) == Some(&Occupancy::Free))
    };
    for cell in walls.geometry().cells() {
        if is_corner(truth, cell) {
            truth[cell] = Occupancy::Occupied;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> World {
        let rooms = include_bytes!("../tests/two-rooms.svg");
        World::parse("two-rooms.svg", rooms).expect("a readable world")
    }

    fn truth() -> Grid<Occupancy> {
        world().free_space(0.05).expect("a raster")
    }

    /// What is at a point of the sheet (y down), seen from the start at (1.52, 2.02).
    fn at(truth: &Grid<Occupancy>, x: f64, y: f64) -> Occupancy {
        *truth.at(Point2::new(x - 1.52, 2.02 - y)).expect("within the raster")
    }

    #[test]
    fn the_raster_separates_free_walls_and_the_unseen() {
        let truth = truth();
        for (x, y, expected) in [
            (1.51, 2.01, Occupancy::Free),
            (5.5, 3.5, Occupancy::Free), // through the door
            (3.01, 1.01, Occupancy::Occupied),
            (3.01, 2.01, Occupancy::Free),
            (4.5, 1.5, Occupancy::Unknown), // in the table
            (4.01, 1.5, Occupancy::Occupied),
            (1.51, 3.25, Occupancy::Unknown), // a wall that no robot can see
            (-0.08, 2.0, Occupancy::Unknown),
        ] {
            assert_eq!(at(&truth, x, y), expected, "{x} {y}");
        }
        let free = truth.values().iter().filter(|&&cell| cell == Occupancy::Free).count();
        let area_m2 = free as f64 * 0.05 * 0.05;
        // 24 m² less table and cupboard, less the cells of the walls.
        assert!((area_m2 - 22.5).abs() < 1.0, "{area_m2}");
    }

    #[test]
    fn a_raster_needs_a_sensible_resolution() {
        assert!(matches!(world().free_space(0.0), Err(TruthError::NoSize(_))));
        assert!(matches!(world().free_space(f64::NAN), Err(TruthError::NoSize(_))));
        assert!(matches!(world().free_space(1e-5), Err(TruthError::TooFine { .. })));
    }
}
