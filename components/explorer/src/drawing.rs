//! Maps drawn as text, for the tests of this crate.

use armor_grid::{Cell, Geometry, Grid, Occupancy, Point2};

/// A drawn map with a robot and the place where a goal is expected.
pub(crate) struct MapDrawing {
    pub(crate) map: Grid<Occupancy>,
    pub(crate) robot: Option<Point2>,
    pub(crate) goal: Option<Point2>,
}

impl MapDrawing {
    /// Reads rows, the top one first: `#` occupied, `?` unknown, `R` robot, `G` goal, `.` free.
    pub(crate) fn read(resolution_m: f64, rows: &[&str]) -> Self {
        let geometry = Geometry {
            origin: Point2::new(-1.0, 2.0),
            resolution_m,
            width: rows[0].len(),
            height: rows.len(),
        };
        let mut map = Grid::filled(geometry, Occupancy::Free);
        let (mut robot, mut goal) = (None, None);
        for (row, text) in rows.iter().rev().enumerate() {
            for (column, letter) in text.chars().enumerate() {
                let cell = Cell::new(column as i32, row as i32);
                match letter {
                    '#' => map[cell] = Occupancy::Occupied,
                    '?' => map[cell] = Occupancy::Unknown,
                    'R' => robot = Some(geometry.centre(cell)),
                    'G' => goal = Some(geometry.centre(cell)),
                    _ => {}
                }
            }
        }
        Self { map, robot, goal }
    }
}
