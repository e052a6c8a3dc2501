//! The current map: the last whole one, with the rectangles that changed since. Blocks carry the
//! number of their last change, so that only changed blocks are repainted.

use std::collections::VecDeque;

use armor_grid::{Point2, Pose2};

/// Side of a block in cells.
pub const BLOCK: usize = 128;
/// Largest map, in cells: 10,000 × 10,000, a square kilometre at 0.1 m.
const MAX_CELLS: usize = 100_000_000;
/// Most changes kept until the map that they belong to arrives.
const MAX_LATER: usize = 256;

/// Why a map or a change of it is not shown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapShapeError {
    /// The numbers contradict each other.
    #[error("{width} × {height} cells are announced and {cells} have come")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Cells in the message.
        cells: usize,
    },
    /// It is larger than can be shown.
    #[error("{width} × {height} cells are more than can be shown")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Its pose is not finite.
    #[error("its cells have a side of {resolution_m} m, its corner is at {corner:?}")]
    Place {
        /// Side of a cell.
        resolution_m: f64,
        /// Where it begins.
        corner: Pose2,
    },
    /// A change that reaches beyond the map.
    #[error("a change reaches beyond the map")]
    Outside,
}

/// Pose and size of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapLayout {
    /// Pose of the corner of the first cell.
    pub corner: Pose2,
    /// Side of a cell in metres.
    pub resolution_m: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl MapLayout {
    fn check(&self, cells: usize) -> Result<(), MapShapeError> {
        let Self { corner, resolution_m, width, height } = *self;
        let (width, height) = (width, height);
        match width.checked_mul(height) {
            Some(all) if all > MAX_CELLS => Err(MapShapeError::TooLarge { width, height }),
            Some(all) if all == cells => Ok(()),
            _ => Err(MapShapeError::Size { width, height, cells }),
        }?;
        let is_somewhere =
            [corner.x_m, corner.y_m, corner.yaw_rad, resolution_m].into_iter().all(f64::is_finite);
        if is_somewhere && resolution_m > 0.0 {
            Ok(())
        } else {
            Err(MapShapeError::Place { resolution_m, corner })
        }
    }

    /// Blocks along x and y.
    pub fn blocks(&self) -> [usize; 2] {
        [self.width.div_ceil(BLOCK), self.height.div_ceil(BLOCK)]
    }

    /// The place of a corner of cells, counted from the first.
    pub fn place(&self, column: f64, row: f64) -> Point2 {
        self.corner.apply(Point2::new(column * self.resolution_m, row * self.resolution_m))
    }
}

/// A rectangle of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct MapChange {
    /// System time in seconds.
    pub stamp_s: f64,
    /// First column and row.
    pub corner: [usize; 2],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Row-major.
    pub cells: Vec<i8>,
}

/// The map.
#[derive(Clone, Debug, Default)]
pub struct OccupancyMap {
    layout: MapLayout,
    cells: Vec<i8>,
    /// Number of the last change of each block.
    revisions: Vec<u64>,
    revision: u64,
    stamp_s: f64,
    /// Changes that may have arrived before the map that they belong to.
    later: VecDeque<MapChange>,
}

impl OccupancyMap {
    /// Returns pose and size.
    pub fn layout(&self) -> &MapLayout {
        &self.layout
    }

    /// Returns an empty map whose later blocks are newer than those of this one.
    pub(crate) fn emptied(self) -> Self {
        Self { revision: self.revision, ..Self::default() }
    }

    /// Returns whether there is no map.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Returns a cell: -1 unknown, 0 free … 100 occupied. What is not on the map is unknown.
    pub fn cell(&self, column: usize, row: usize) -> i8 {
        let is_inside = column < self.layout.width && row < self.layout.height;
        let index = row.saturating_mul(self.layout.width).saturating_add(column);
        self.cells.get(index).copied().filter(|_| is_inside).unwrap_or(-1)
    }

    /// Takes a whole map, row-major: -1 unknown, 0 free … 100 occupied.
    ///
    /// # Errors
    /// If it is inconsistent; the one before stays.
    pub fn replace(
        &mut self,
        stamp_s: f64,
        layout: MapLayout,
        cells: Vec<i8>,
    ) -> Result<(), MapShapeError> {
        layout.check(cells.len())?;
        self.revision += 1;
        let is_same_place = layout == self.layout;
        let before = std::mem::replace(&mut self.cells, cells);
        self.layout = layout;
        if is_same_place {
            self.mark_differences(&before);
        } else {
            let [across, up] = layout.blocks();
            self.revisions = vec![self.revision; across * up];
        }
        if stamp_s < self.stamp_s {
            // Time has gone back: earlier changes are of another run.
            self.later.clear();
        }
        self.stamp_s = stamp_s;
        self.later.retain(|change| change.stamp_s > stamp_s);
        for change in std::mem::take(&mut self.later) {
            // One that does not fit belonged to another map.
            let _ = self.apply(&change);
            self.later.push_back(change);
        }
        Ok(())
    }

    /// Takes a change of the map that was published last.
    ///
    /// # Errors
    /// If it does not fit; nothing is changed then.
    pub fn change(&mut self, change: MapChange) -> Result<(), MapShapeError> {
        if change.stamp_s < self.stamp_s {
            return Ok(());
        }
        let applied = self.apply(&change);
        if self.later.len() == MAX_LATER {
            self.later.pop_front();
        }
        self.later.push_back(change);
        applied
    }

    fn apply(&mut self, change: &MapChange) -> Result<(), MapShapeError> {
        let ([left, bottom], [width, height]) = (change.corner, change.size);
        if width.checked_mul(height) != Some(change.cells.len()) {
            return Err(MapShapeError::Size { width, height, cells: change.cells.len() });
        }
        let fits = |from: usize, size: usize, all: usize| {
            from.checked_add(size).is_some_and(|end| end <= all)
        };
        if !fits(left, width, self.layout.width) || !fits(bottom, height, self.layout.height) {
            return Err(MapShapeError::Outside);
        }
        if change.cells.is_empty() {
            return Ok(());
        }
        for (row, cells) in change.cells.chunks_exact(width).enumerate() {
            let at = (bottom + row) * self.layout.width + left;
            self.cells[at..at + width].copy_from_slice(cells);
        }
        self.revision += 1;
        let [across, _] = self.layout.blocks();
        for up in bottom / BLOCK..=(bottom + height - 1) / BLOCK {
            for along in left / BLOCK..=(left + width - 1) / BLOCK {
                self.revisions[up * across + along] = self.revision;
            }
        }
        Ok(())
    }

    fn mark_differences(&mut self, before: &[i8]) {
        let [across, _] = self.layout.blocks();
        let width = self.layout.width.max(1);
        let rows = self.cells.chunks(width).zip(before.chunks(width));
        for (row, (now, before)) in rows.enumerate().filter(|(_, (now, before))| now != before) {
            for (along, pair) in now.chunks(BLOCK).zip(before.chunks(BLOCK)).enumerate() {
                if pair.0 != pair.1 {
                    self.revisions[row / BLOCK * across + along] = self.revision;
                }
            }
        }
    }

    /// Number of the last change within a square of blocks.
    pub fn revision(&self, corner: [usize; 2], side: usize) -> u64 {
        let [across, up] = self.layout.blocks();
        let rows = corner[1].min(up)..(corner[1] + side).min(up);
        let of_row = |row: usize| {
            let blocks = corner[0].min(across)..(corner[0] + side).min(across);
            self.revisions[row * across..][blocks].iter().copied().max().unwrap_or(0)
        };
        rows.map(of_row).max().unwrap_or(0)
    }

    /// Returns the content of squares of `step` × `step` cells, `size` of them from the cell
    /// `corner` on, row by row: the most occupied of each, so that a thin wall is seen from afar.
    /// What lies outside of the map is unknown.
    pub fn shrunk(&self, corner: [usize; 2], size: [usize; 2], step: usize) -> Vec<i8> {
        let mut shrunk = vec![-1; size[0] * size[1]];
        let right = (corner[0] + size[0] * step).min(self.layout.width);
        let top = (corner[1] + size[1] * step).min(self.layout.height);
        if corner[0] >= right {
            return shrunk;
        }
        for row in corner[1]..top {
            let out = &mut shrunk[(row - corner[1]) / step * size[0]..][..size[0]];
            let cells = &self.cells[row * self.layout.width..][corner[0]..right];
            for (seen, cells) in out.iter_mut().zip(cells.chunks(step)) {
                *seen = cells.iter().copied().fold(*seen, i8::max);
            }
        }
        shrunk
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(width: usize, height: usize) -> MapLayout {
        MapLayout { resolution_m: 0.05, width, height, ..MapLayout::default() }
    }

    fn change(stamp_s: f64, corner: [usize; 2], size: [usize; 2], value: i8) -> MapChange {
        MapChange { stamp_s, corner, size, cells: vec![value; size[0] * size[1]] }
    }

    #[test]
    fn only_the_blocks_that_changed_are_new() {
        let mut map = OccupancyMap::default();
        map.replace(1.0, layout(300, 200), vec![0; 60_000]).unwrap();
        assert_eq!(map.revision([0, 0], 9), 1);
        map.change(change(2.0, [130, 10], [5, 5], 100)).unwrap();
        assert_eq!((map.revision([0, 0], 1), map.revision([1, 0], 1)), (1, 2));
        let mut cells = map.cells.clone();
        cells[199 * 300 + 299] = 50;
        map.replace(3.0, layout(300, 200), cells).unwrap();
        assert_eq!((map.revision([1, 0], 1), map.revision([2, 1], 1)), (2, 3));
    }

    #[test]
    fn a_change_that_overtakes_its_map_is_not_lost_and_an_old_one_is_not_drawn() {
        let mut map = OccupancyMap::default();
        map.replace(1.0, layout(10, 10), vec![0; 100]).unwrap();
        assert_eq!(map.change(change(2.5, [12, 12], [2, 2], 100)), Err(MapShapeError::Outside));
        map.replace(2.0, layout(20, 20), vec![0; 400]).unwrap();
        assert_eq!(map.cells[12 * 20 + 12], 100);
        map.change(change(1.5, [0, 0], [1, 1], 100)).unwrap();
        assert_eq!(map.cells[0], 0, "the map is newer");
    }

    #[test]
    fn what_does_not_fit_is_refused_and_the_rest_stays() {
        let mut map = OccupancyMap::default();
        map.replace(1.0, layout(2, 2), vec![0; 4]).unwrap();
        let size = |width, height, cells| Err(MapShapeError::Size { width, height, cells });
        assert_eq!(map.replace(2.0, layout(3, 3), vec![0; 4]), size(3, 3, 4));
        let huge = layout(usize::MAX, 2);
        assert_eq!(map.replace(2.0, huge, Vec::new()), size(usize::MAX, 2, 0));
        let flat = MapLayout { resolution_m: f64::NAN, ..layout(2, 2) };
        assert!(matches!(map.replace(2.0, flat, vec![0; 4]), Err(MapShapeError::Place { .. })));
        let wide = MapChange { cells: vec![0; 3], ..change(2.0, [0, 0], [2, 2], 0) };
        assert_eq!(map.change(wide), size(2, 2, 3));
        assert_eq!(
            map.change(change(2.0, [usize::MAX, 0], [1, 1], 0)),
            Err(MapShapeError::Outside)
        );
        assert_eq!(map.change(change(2.0, [0, 0], [0, 0], 0)), Ok(()));
        assert_eq!((map.layout.width, map.cells.len()), (2, 4));
    }

    #[test]
    fn a_thin_wall_is_seen_from_afar() {
        let mut map = OccupancyMap::default();
        let mut cells = vec![0; 64];
        cells[3 * 8 + 2] = 100;
        cells[63] = -1;
        map.replace(1.0, layout(8, 8), cells).unwrap();
        assert_eq!(map.shrunk([0, 0], [3, 3], 4), [100, 0, -1, 0, 0, -1, -1, -1, -1]);
        assert_eq!(map.shrunk([6, 6], [2, 2], 1), [0, 0, 0, -1]);
        assert_eq!(map.shrunk([99, 0], [1, 1], 1), [-1]);
    }
}
