//! Shortest paths over a cost map, to one goal (A*) or to everywhere (wavefront), moving to any of
//! the eight neighbours.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use pathfinding::prelude::astar;

use crate::{Cell, CostMap, Grid, Point2};

/// Fixed-point steps per cell length: costs must be integers to be ordered and added exactly.
const STEPS_PER_CELL: f64 = 1000.0;

/// Returns the cheapest path between two open cells, as the centres of its cells, ends included.
///
/// `None` if either end is closed or no path exists. A* (Hart, Nilsson & Raphael 1968).
pub fn shortest_path(map: &CostMap, from: Cell, to: Cell) -> Option<Vec<Point2>> {
    if !map.is_open(from) || !map.is_open(to) {
        return None;
    }
    let straight = |cell: &Cell| (octile_distance(*cell, to) * STEPS_PER_CELL) as u64;
    let (cells, _) = astar(&from, |&cell| list_steps(map, cell), straight, |&cell| cell == to)?;
    Some(cells.into_iter().map(|cell| map.geometry().centre(cell)).collect())
}

/// Returns for each open cell the length of the cheapest path from `from`, in weighted metres;
/// infinite where there is none.
pub fn wavefront(map: &CostMap, from: Cell) -> Grid<f32> {
    let geometry = *map.geometry();
    let mut reached = Grid::filled(geometry, u64::MAX);
    let mut queue = BinaryHeap::new();
    if map.is_open(from) {
        reached[from] = 0;
        queue.push(Reverse((0, from)));
    }
    while let Some(Reverse((cost, cell))) = queue.pop() {
        if cost > reached[cell] {
            continue;
        }
        for (next, step) in list_steps(map, cell) {
            if cost + step < reached[next] {
                reached[next] = cost + step;
                queue.push(Reverse((cost + step, next)));
            }
        }
    }
    let metres_per_step = geometry.resolution_m / STEPS_PER_CELL;
    reached.map(|&cost| {
        if cost == u64::MAX { f32::INFINITY } else { (cost as f64 * metres_per_step) as f32 }
    })
}

/// The open neighbours of an open cell and what it costs to get there.
fn list_steps(map: &CostMap, cell: Cell) -> impl Iterator<Item = (Cell, u64)> + '_ {
    let here = map.factor(cell).unwrap_or(1.0);
    cell.neighbours().filter_map(move |next| {
        let there = map.factor(next)?;
        let factor = f64::from(here + there) / 2.0;
        // Rounded up, so that the straight-line estimate never exceeds the true cost.
        Some((next, (cell.distance(next) * factor * STEPS_PER_CELL).ceil() as u64))
    })
}

/// Length of the shortest path between two cells on an empty grid, in cells.
fn octile_distance(a: Cell, b: Cell) -> f64 {
    let columns = f64::from(a.column.abs_diff(b.column));
    let rows = f64::from(a.row.abs_diff(b.row));
    columns.max(rows) + (2.0_f64.sqrt() - 1.0) * columns.min(rows)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{Geometry, Inflation, Occupancy};
    use proptest::prelude::*;

    /// Reads a map as drawn, top row first: `#` occupied, `.` free, anything else unknown.
    pub(crate) fn ascii_map(resolution_m: f64, rows: &[&str]) -> Grid<Occupancy> {
        let geometry = Geometry {
            origin: Point2::default(),
            resolution_m,
            width: rows[0].len(),
            height: rows.len(),
        };
        let values = rows.iter().rev().flat_map(|row| row.bytes()).map(|byte| match byte {
            b'#' => Occupancy::Occupied,
            b'.' => Occupancy::Free,
            _ => Occupancy::Unknown,
        });
        Grid::from_values(geometry, values.collect()).unwrap()
    }

    fn point_robot(map: &Grid<Occupancy>) -> CostMap {
        let inflation =
            Inflation { radius_m: 0.0, comfort_m: 0.0, weight: 0.0, unknown_weight: None };
        CostMap::new(map, &inflation)
    }

    fn any_map() -> impl Strategy<Value = Grid<Occupancy>> {
        (2..16_usize, 2..16_usize).prop_flat_map(|(width, height)| {
            let geometry = Geometry { origin: Point2::default(), resolution_m: 0.1, width, height };
            let cell = prop::bool::weighted(0.3)
                .prop_map(|wall| if wall { Occupancy::Occupied } else { Occupancy::Free });
            prop::collection::vec(cell, geometry.len())
                .prop_map(move |values| Grid::from_values(geometry, values).unwrap())
        })
    }

    fn length_m(path: &[Point2]) -> f64 {
        path.windows(2).map(|pair| pair[0].distance_m(pair[1])).sum()
    }

    proptest! {
        #[test]
        fn both_searches_agree(map in any_map(), a in 0..256_usize, b in 0..256_usize) {
            let costs = point_robot(&map);
            let geometry = *map.geometry();
            let (from, to) = (geometry.cell(a % geometry.len()), geometry.cell(b % geometry.len()));
            let reached_m = f64::from(wavefront(&costs, from)[to]);
            match shortest_path(&costs, from, to) {
                None => prop_assert!(reached_m.is_infinite()),
                Some(path) => prop_assert!((length_m(&path) - reached_m).abs() < 1e-2),
            }
        }

        #[test]
        fn a_path_is_open_and_connected(map in any_map()) {
            let costs = point_robot(&map);
            let geometry = *map.geometry();
            let (from, to) = (geometry.cell(0), geometry.cell(geometry.len() - 1));
            for pair in shortest_path(&costs, from, to).unwrap_or_default().windows(2) {
                prop_assert!(costs.is_open(geometry.cell_at(pair[1])));
                prop_assert!(pair[0].distance_m(pair[1]) < 0.15);
            }
        }
    }

    #[test]
    fn the_way_leads_through_the_gap() {
        let map = ascii_map(0.1, &["...#...", "...#...", "...#...", "......."]);
        let path = shortest_path(&point_robot(&map), Cell::new(0, 3), Cell::new(6, 3)).unwrap();
        assert!(path.iter().any(|p| map.geometry().cell_at(*p) == Cell::new(3, 0)));
    }

    #[test]
    fn a_robot_too_wide_for_the_gap_finds_no_way() {
        let map = ascii_map(0.1, &["...#...", "...#...", "...#...", "......."]);
        let inflation =
            Inflation { radius_m: 0.15, comfort_m: 0.2, weight: 1.0, unknown_weight: None };
        let costs = CostMap::new(&map, &inflation);
        assert!(shortest_path(&costs, Cell::new(0, 3), Cell::new(6, 3)).is_none());
    }

    #[test]
    fn weight_keeps_the_way_off_the_walls() {
        let rows = ["#########", ".........", ".........", ".........", ".........", "........."];
        let inflation =
            Inflation { radius_m: 0.05, comfort_m: 0.45, weight: 8.0, unknown_weight: None };
        let costs = CostMap::new(&ascii_map(0.1, &rows), &inflation);
        let path = shortest_path(&costs, Cell::new(0, 4), Cell::new(8, 4)).unwrap();
        let farthest_m = path.iter().map(|p| costs.clearance_m(*p)).fold(0.0, f64::max);
        assert!(farthest_m > 0.25, "stays within {farthest_m} m of the wall");
    }
}
