//! A rectangle of square cells laid over the plane: which cell a point falls into, and what is
//! stored there. Rows grow with y, as in an occupancy grid message.

use std::ops::{Index, IndexMut};

use crate::Point2;

/// The place of a cell, counted from the origin; may lie outside of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell {
    /// Cells along x from the origin.
    pub column: i32,
    /// Cells along y from the origin.
    pub row: i32,
}

impl Cell {
    /// Makes a cell from its column and row.
    pub const fn new(column: i32, row: i32) -> Self {
        Self { column, row }
    }

    /// Returns the cell some columns and rows further.
    #[must_use]
    pub const fn offset(self, columns: i32, rows: i32) -> Self {
        Self::new(self.column + columns, self.row + rows)
    }

    /// Returns the four cells that share an edge with this one.
    pub fn edge_neighbours(self) -> impl Iterator<Item = Self> {
        [(1, 0), (0, 1), (-1, 0), (0, -1)].into_iter().map(move |(c, r)| self.offset(c, r))
    }

    /// Returns the eight cells around this one.
    pub fn neighbours(self) -> impl Iterator<Item = Self> {
        [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
            .into_iter()
            .map(move |(c, r)| self.offset(c, r))
    }

    /// Returns the distance between the centres of two cells, in cells.
    pub fn distance(self, other: Self) -> f64 {
        f64::from(self.column - other.column).hypot(f64::from(self.row - other.row))
    }
}

/// Where a grid lies and how fine it is, without what is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// The outer corner of cell (0, 0), in metres.
    pub origin: Point2,
    /// Edge length of a cell, in metres; positive.
    pub resolution_m: f64,
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Geometry {
    /// Returns the number of cells.
    pub const fn len(&self) -> usize {
        self.width * self.height
    }

    /// Returns whether there is no cell at all.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether the cells have a size, of a millimetre at least, and a place: with less, a
    /// metre would be cells without end.
    pub fn is_sound(&self) -> bool {
        let Point2 { x_m, y_m } = self.origin;
        self.resolution_m >= 1e-3 && [self.resolution_m, x_m, y_m].iter().all(|v| v.is_finite())
    }

    /// Returns the cell a point falls into, which may be outside.
    pub fn cell_at(&self, point: Point2) -> Cell {
        let column = ((point.x_m - self.origin.x_m) / self.resolution_m).floor();
        let row = ((point.y_m - self.origin.y_m) / self.resolution_m).floor();
        Cell::new(column as i32, row as i32)
    }

    /// Returns the middle of a cell, in metres.
    pub fn centre(&self, cell: Cell) -> Point2 {
        Point2::new(
            self.origin.x_m + (f64::from(cell.column) + 0.5) * self.resolution_m,
            self.origin.y_m + (f64::from(cell.row) + 0.5) * self.resolution_m,
        )
    }

    /// Returns whether a cell lies within the grid.
    pub fn contains(&self, cell: Cell) -> bool {
        self.index(cell).is_some()
    }

    /// Returns the position of a cell in row-major order, if it lies within the grid.
    pub fn index(&self, cell: Cell) -> Option<usize> {
        let column = usize::try_from(cell.column).ok().filter(|&c| c < self.width)?;
        let row = usize::try_from(cell.row).ok().filter(|&r| r < self.height)?;
        Some(row * self.width + column)
    }

    /// Returns the cell at a position in row-major order.
    pub fn cell(&self, index: usize) -> Cell {
        Cell::new((index % self.width) as i32, (index / self.width) as i32)
    }

    /// Returns all cells in row-major order.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + use<> {
        let geometry = *self;
        (0..geometry.len()).map(move |index| geometry.cell(index))
    }
}

/// One value per cell, row-major from the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    geometry: Geometry,
    values: Vec<T>,
}

impl<T> Grid<T> {
    /// Fills a new grid with one value.
    pub fn filled(geometry: Geometry, value: T) -> Self
    where
        T: Clone,
    {
        Self { geometry, values: vec![value; geometry.len()] }
    }

    /// Takes row-major values; `None` if their number does not fit the geometry, or that is not
    /// sound.
    pub fn from_values(geometry: Geometry, values: Vec<T>) -> Option<Self> {
        let fits = geometry.is_sound() && values.len() == geometry.len();
        fits.then_some(Self { geometry, values })
    }

    /// Makes a grid of the same geometry with each value passed through `change`.
    pub fn map<U>(&self, change: impl FnMut(&T) -> U) -> Grid<U> {
        Grid { geometry: self.geometry, values: self.values.iter().map(change).collect() }
    }

    /// Returns where the grid lies.
    pub const fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Returns all values, row-major.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Returns all values for change, row-major.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Returns the value of a cell, if it lies within the grid.
    pub fn get(&self, cell: Cell) -> Option<&T> {
        self.geometry.index(cell).map(|index| &self.values[index])
    }

    /// Returns the value of a cell for change, if it lies within the grid.
    pub fn get_mut(&mut self, cell: Cell) -> Option<&mut T> {
        self.geometry.index(cell).map(|index| &mut self.values[index])
    }

    /// Returns the value under a point, if it lies within the grid.
    pub fn at(&self, point: Point2) -> Option<&T> {
        self.get(self.geometry.cell_at(point))
    }

    /// Returns all cells with their values, row-major.
    pub fn iter(&self) -> impl Iterator<Item = (Cell, &T)> {
        self.geometry.cells().zip(&self.values)
    }
}

impl<T> Index<Cell> for Grid<T> {
    type Output = T;

    /// # Panics
    /// If the cell is outside.
    fn index(&self, cell: Cell) -> &T {
        self.get(cell).expect("the cell lies within the grid")
    }
}

impl<T> IndexMut<Cell> for Grid<T> {
    fn index_mut(&mut self, cell: Cell) -> &mut T {
        self.get_mut(cell).expect("the cell lies within the grid")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn geometry() -> impl Strategy<Value = Geometry> {
        (-20.0..20.0, -20.0..20.0, 0.01..1.0, 1..40_usize, 1..40_usize).prop_map(
            |(x, y, resolution_m, width, height)| Geometry {
                origin: Point2::new(x, y),
                resolution_m,
                width,
                height,
            },
        )
    }

    proptest! {
        #[test]
        fn the_centre_of_a_cell_falls_into_it(g in geometry(), column in -50..50, row in -50..50) {
            let cell = Cell::new(column, row);
            prop_assert_eq!(g.cell_at(g.centre(cell)), cell);
        }

        #[test]
        fn a_cell_and_its_index_name_each_other(g in geometry()) {
            for (index, cell) in g.cells().enumerate() {
                prop_assert_eq!(g.index(cell), Some(index));
            }
            prop_assert_eq!(g.cells().count(), g.len());
        }

        #[test]
        fn points_outside_have_no_value(g in geometry(), beyond_m in 0.001..5.0_f64) {
            let grid = Grid::filled(g, 0_u8);
            let far = Point2::new(g.origin.x_m + g.width as f64 * g.resolution_m + beyond_m, g.origin.y_m);
            prop_assert_eq!(grid.at(far), None);
            prop_assert_eq!(grid.at(Point2::new(g.origin.x_m - beyond_m, g.origin.y_m)), None);
        }
    }

    #[test]
    fn values_must_fit_the_geometry() {
        let g = Geometry { origin: Point2::default(), resolution_m: 0.1, width: 3, height: 2 };
        assert!(Grid::from_values(g, vec![0_u8; 5]).is_none());
        let grid = Grid::from_values(g, vec![1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!(grid[Cell::new(2, 1)], 6);
        assert_eq!(grid.at(Point2::new(0.05, 0.15)), Some(&4));
    }

    #[test]
    fn cells_without_a_size_make_no_grid() {
        let geometry =
            Geometry { origin: Point2::default(), resolution_m: 0.0, width: 1, height: 1 };
        for resolution_m in [0.0, 1e-9, -1.0, f64::NAN, f64::INFINITY] {
            let geometry = Geometry { resolution_m, ..geometry };
            assert!(Grid::from_values(geometry, vec![0]).is_none(), "{resolution_m}");
        }
        assert!(Grid::from_values(Geometry { resolution_m: 0.05, ..geometry }, vec![0]).is_some());
    }
}
