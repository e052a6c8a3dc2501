//! A picture of the map at one moment, and what has changed since another.

use crate::pose::Pose;
use crate::tile::TILE_CELLS;

/// A picture of the map at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct GridSnapshot {
    /// Pose of the lower left corner of cell (0, 0) in the map's frame.
    pub origin: Pose,
    /// Side of a cell, metres.
    pub resolution_m: f64,
    /// Cells along x.
    pub width: usize,
    /// Cells along y.
    pub height: usize,
    /// Row by row from the origin: -1 unknown, else the probability in percent that it is occupied.
    pub cells: Vec<i8>,
}

impl GridSnapshot {
    /// The tiles that differ from an earlier picture, as their first cell and size; `None` if the
    /// two do not lie alike.
    pub fn changed_since(&self, earlier: &Self) -> Option<Vec<([usize; 2], [usize; 2])>> {
        let lies = |s: &Self| (s.origin, s.width, s.height);
        if lies(self) != lies(earlier) {
            return None;
        }
        let side = TILE_CELLS as usize;
        let corners = (0..self.height)
            .step_by(side)
            .flat_map(|y| (0..self.width).step_by(side).map(move |x| [x, y]));
        let tiles = corners
            .map(|[x, y]| ([x, y], [side.min(self.width - x), side.min(self.height - y)]))
            .filter(|&(corner, size)| self.rows(corner, size).ne(earlier.rows(corner, size)));
        Some(tiles.collect())
    }

    /// The rows of a rectangle from its first cell.
    pub fn rows(
        &self,
        [x, y]: [usize; 2],
        [width, height]: [usize; 2],
    ) -> impl Iterator<Item = &[i8]> {
        (y..y + height).map(move |row| &self.cells[row * self.width + x..][..width])
    }
}
