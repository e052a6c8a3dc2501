//! What one scan shows of the cells around it: which its beams ended in, and which they went
//! through, a bit each. A scan changes a cell once, however many of its beams touch it.

use crate::tile::{TILE_CELLS, TileRows};

/// A rectangle of tiles, and the cells that were touched there.
pub(crate) struct Sweep {
    first: [i32; 2],
    size: [usize; 2],
    /// Rows of cells by columns of tiles, so that the rows of a tile follow each other.
    ended: Vec<u64>,
    passed: Vec<u64>,
}

impl Sweep {
    /// A sweep over the tiles of these cells, and all between them.
    pub(crate) fn over(cells: impl Iterator<Item = [i32; 2]>) -> Self {
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for cell in cells {
            for axis in 0..2 {
                let tile = cell[axis].div_euclid(TILE_CELLS);
                (low[axis], high[axis]) = (low[axis].min(tile), high[axis].max(tile + 1));
            }
        }
        let size = [0, 1].map(|axis| high[axis].saturating_sub(low[axis]).max(0) as usize);
        let words = size[0] * size[1] * TILE_CELLS as usize;
        Self { first: low, size, ended: vec![0; words], passed: vec![0; words] }
    }

    /// Marks a cell in which a beam ended. Returns whether it was not marked before.
    pub(crate) fn mark_end(&mut self, cell: [i32; 2]) -> bool {
        let (word, bit) = self.bit_of_cell(cell);
        let is_first = self.ended[word] & bit == 0;
        self.ended[word] |= bit;
        is_first
    }

    /// Marks the cells that a beam went through: a line without its last cell (Bresenham).
    pub(crate) fn mark_passed(&mut self, from: [i32; 2], to: [i32; 2]) {
        let (dx, dy) = ((to[0] - from[0]).abs(), -(to[1] - from[1]).abs());
        let step = [(to[0] - from[0]).signum(), (to[1] - from[1]).signum()];
        let (mut at, mut error) = (from, dx + dy);
        while at != to {
            let (word, bit) = self.bit_of_cell(at);
            self.passed[word] |= bit;
            let twice = 2 * error;
            if twice >= dy {
                error += dy;
                at[0] += step[0];
            }
            if twice <= dx {
                error += dx;
                at[1] += step[1];
            }
        }
    }

    /// The tiles that beams went through, and the cells there in which none ended.
    pub(crate) fn passed(&self) -> impl Iterator<Item = ([i32; 2], TileRows)> + '_ {
        let rows = |number: usize| -> TileRows {
            let start = number * TILE_CELLS as usize;
            std::array::from_fn(|row| self.passed[start + row] & !self.ended[start + row])
        };
        let tile = |number: usize| {
            let (x, y) = (number / self.size[1], number % self.size[1]);
            [self.first[0] + x as i32, self.first[1] + y as i32]
        };
        let all = (0..self.size[0] * self.size[1]).map(move |number| (tile(number), rows(number)));
        all.filter(|(_, rows)| rows.iter().any(|&row| row != 0))
    }

    fn bit_of_cell(&self, [x, y]: [i32; 2]) -> (usize, u64) {
        let column = x.div_euclid(TILE_CELLS) - self.first[0];
        let row = y - self.first[1] * TILE_CELLS;
        let height = self.size[1] * TILE_CELLS as usize;
        (column as usize * height + row as usize, 1 << x.rem_euclid(TILE_CELLS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells that are passed by a line and by a beam that ends at its last cell.
    fn passed(from: [i32; 2], to: [i32; 2]) -> Vec<[i32; 2]> {
        let mut sweep = Sweep::over([from, to].into_iter());
        assert!(sweep.mark_end(to) && !sweep.mark_end(to), "the second is not the first");
        sweep.mark_passed(from, to);
        sweep.mark_passed(from, to);
        let mut cells = Vec::new();
        for ([x, y], rows) in sweep.passed() {
            for (row, bits) in rows.iter().enumerate() {
                let columns = (0..TILE_CELLS).filter(|column| bits >> column & 1 == 1);
                cells.extend(columns.map(|c| [x * TILE_CELLS + c, y * TILE_CELLS + row as i32]));
            }
        }
        cells
    }

    #[test]
    fn a_line_goes_from_cell_to_cell_in_all_directions() {
        for to in [[200, 3], [-130, 90], [-70, -70], [5, -300], [0, 0], [1, 1], [-64, 0]] {
            let mut cells = passed([0, 0], to);
            let steps = to.map(i32::abs).into_iter().max().unwrap() as usize;
            assert_eq!(cells.len(), steps, "to {to:?}");
            cells.sort_by_key(|cell| cell.map(i32::abs).into_iter().max());
            for (number, [x, y]) in cells.iter().enumerate() {
                let part = number as f64 / steps as f64;
                let off = (f64::from(*x) - part * f64::from(to[0]))
                    .abs()
                    .max((f64::from(*y) - part * f64::from(to[1])).abs());
                assert!(off <= 1.0, "{x},{y} is not on the way to {to:?}");
            }
        }
    }
}
