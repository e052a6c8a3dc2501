//! All cells a straight line passes through, in order (Amanatides & Woo 1987). Nothing is skipped
//! at corners, so a wall one cell thick is always met.

use crate::{Cell, Geometry, Point2};

/// Walks the cells from one point to another, both ends included.
///
/// Cells outside of the grid are reported too: the caller knows best what lies there.
pub fn traverse(geometry: &Geometry, from: Point2, to: Point2) -> Traversal {
    let (first, last) = (geometry.cell_at(from), geometry.cell_at(to));
    let steps = first.column.abs_diff(last.column) + first.row.abs_diff(last.row);
    let axis = |from_m: f64, to_m: f64, origin_m: f64, cell: i32| {
        let direction_m = to_m - from_m;
        let edge = if direction_m > 0.0 { cell + 1 } else { cell };
        let edge_m = origin_m + f64::from(edge) * geometry.resolution_m;
        if direction_m == 0.0 {
            (f64::INFINITY, f64::INFINITY)
        } else {
            ((edge_m - from_m) / direction_m, geometry.resolution_m / direction_m.abs())
        }
    };
    Traversal {
        next: first,
        last,
        remaining: steps + 1,
        column: axis(from.x_m, to.x_m, geometry.origin.x_m, first.column),
        row: axis(from.y_m, to.y_m, geometry.origin.y_m, first.row),
    }
}

/// The iterator made by [`traverse`].
#[derive(Clone, Debug)]
pub struct Traversal {
    next: Cell,
    last: Cell,
    remaining: u32,
    /// Line parameter of the next crossing of a vertical edge, and between two of them.
    column: (f64, f64),
    /// Line parameter of the next crossing of a horizontal edge, and between two of them.
    row: (f64, f64),
}

impl Iterator for Traversal {
    type Item = Cell;

    fn next(&mut self) -> Option<Cell> {
        self.remaining = self.remaining.checked_sub(1)?;
        let here = self.next;
        let columns_left = self.last.column - here.column;
        let rows_left = self.last.row - here.row;
        // An axis that has arrived takes no further step: rounding can put its next crossing
        // before the end of the line.
        if columns_left != 0 && (rows_left == 0 || self.column.0 <= self.row.0) {
            self.next.column += columns_left.signum();
            self.column.0 += self.column.1;
        } else {
            self.next.row += rows_left.signum();
            self.row.0 += self.row.1;
        }
        Some(here)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.remaining as usize, Some(self.remaining as usize))
    }
}

impl ExactSizeIterator for Traversal {}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GEOMETRY: Geometry =
        Geometry { origin: Point2::new(-1.0, -2.0), resolution_m: 0.25, width: 40, height: 40 };

    fn point() -> impl Strategy<Value = Point2> {
        (-3.0..10.0, -3.0..10.0).prop_map(|(x, y)| Point2::new(x, y))
    }

    proptest! {
        #[test]
        fn a_line_is_connected_from_end_to_end(a in point(), b in point()) {
            let cells: Vec<Cell> = traverse(&GEOMETRY, a, b).collect();
            prop_assert_eq!(cells[0], GEOMETRY.cell_at(a));
            prop_assert_eq!(*cells.last().unwrap(), GEOMETRY.cell_at(b));
            for pair in cells.windows(2) {
                prop_assert_eq!(pair[0].distance(pair[1]), 1.0);
            }
        }

        #[test]
        fn every_cell_is_touched_by_the_line(a in point(), b in point()) {
            let half_diagonal_m = GEOMETRY.resolution_m * 0.5_f64.sqrt() + 1e-9;
            let length_m = a.distance_m(b);
            for cell in traverse(&GEOMETRY, a, b) {
                let c = GEOMETRY.centre(cell);
                let along = ((c.x_m - a.x_m) * (b.x_m - a.x_m) + (c.y_m - a.y_m) * (b.y_m - a.y_m))
                    / (length_m * length_m).max(1e-12);
                let nearest = a.toward(b, along.clamp(0.0, 1.0));
                prop_assert!(nearest.distance_m(c) <= half_diagonal_m);
            }
        }
    }

    #[test]
    fn a_point_is_one_cell() {
        let here = Point2::new(0.1, 0.1);
        assert_eq!(traverse(&GEOMETRY, here, here).count(), 1);
    }
}
