//! A square of the map, which copies of the map share until one of them draws there: its cells, and
//! which of them are surfaces, a bit each, so that they are found without looking at the others.

use std::ops::Range;

/// Cells along a side of a tile: 3.2 m at 5 cm, a tile is 25 KiB.
pub const TILE_CELLS: i32 = 64;
const SIDE: usize = TILE_CELLS as usize;
// A row's surfaces are the bits of a number.
const _: () = assert!(TILE_CELLS == u64::BITS as i32);

/// Log-odds are kept in steps of 1/20.
const LOG_ODDS_STEP: f64 = 0.05;
const HIT: i8 = 18;
const MISS: i8 = -10;
/// Bounds keep the map able to change its mind within a few scans.
const MOST: i8 = 70;
const LEAST: i8 = -60;
/// The mean point of a cell follows slow changes: it is never over more points than this.
const MEAN_OVER: u8 = 24;
const OFFSET_STEPS: f64 = 250.0;
const NORMAL_STEPS: f64 = 100.0;

/// Cells of a tile, a bit each: a number for every row.
pub(crate) type TileRows = [u64; SIDE];

/// Cells row by row.
#[derive(Clone)]
pub(crate) struct MapTile {
    log_odds: [i8; SIDE * SIDE],
    /// Mean hit point from the cell's centre, in 1/250 of a cell, and over how many.
    means: [([i8; 2], u8); SIDE * SIDE],
    /// Mean of the unit vectors out of the surface towards the laser, in 1/100.
    normals: [[i8; 2]; SIDE * SIDE],
    /// Where a beam has ever ended or gone through.
    known: TileRows,
    /// Where there is more likely a surface than not.
    surfaces: TileRows,
}

/// What eight cells lose that are seen through, by the bits of a byte.
static MISSES: [[i8; 8]; 256] = {
    let mut misses = [[0; 8]; 256];
    let mut number = 0;
    while number < 256 * 8 {
        if (number / 8) >> (number % 8) & 1 == 1 {
            misses[number / 8][number % 8] = MISS;
        }
        number += 1;
    }
    misses
};

impl MapTile {
    /// A square of which nothing is known.
    pub(crate) const UNKNOWN: Self = Self {
        log_odds: [0; SIDE * SIDE],
        means: [([0; 2], 0); SIDE * SIDE],
        normals: [[0; 2]; SIDE * SIDE],
        known: [0; SIDE],
        surfaces: [0; SIDE],
    };

    /// A beam ended in a cell, so far from its middle, in cells, on a surface that faces this way;
    /// the first one of its scan or not.
    pub(crate) fn hit(
        &mut self,
        [x, y]: [usize; 2],
        from_middle: [f64; 2],
        normal: [f64; 2],
        is_first: bool,
    ) {
        let normals = &mut self.normals[y * SIDE + x];
        let odds = &mut self.log_odds[y * SIDE + x];
        let (mean, hits) = &mut self.means[y * SIDE + x];
        if *odds <= 0 {
            *hits = 0;
            *normals = [0; 2];
        }
        if is_first {
            *odds = odds.saturating_add(HIT).min(MOST);
        }
        *hits = (*hits + 1).min(MEAN_OVER);
        for (mean, new) in mean.iter_mut().zip(from_middle) {
            let (old, new) = (f64::from(*mean), (new * OFFSET_STEPS).clamp(-125.0, 125.0));
            *mean = (old + (new - old) / f64::from(*hits)).round() as i8;
        }
        if normal != [0.0; 2] {
            for (mean, new) in normals.iter_mut().zip(normal) {
                let (old, new) = (f64::from(*mean), new * NORMAL_STEPS);
                *mean = (old + (new - old) / f64::from(*hits)).round() as i8;
            }
        }
        self.known[y] |= 1 << x;
        if *odds > 0 {
            self.surfaces[y] |= 1 << x;
        }
    }

    /// Beams of a scan went through cells.
    pub(crate) fn clear(&mut self, passed: &TileRows) {
        for (y, &passed) in passed.iter().enumerate().filter(|(_, passed)| **passed != 0) {
            self.known[y] |= passed;
            let row = &mut self.log_odds[y * SIDE..][..SIDE];
            for (cells, part) in row.chunks_exact_mut(8).zip(passed.to_le_bytes()) {
                for (odds, miss) in cells.iter_mut().zip(MISSES[usize::from(part)]) {
                    *odds = odds.saturating_add(miss).max(LEAST);
                }
            }
            let mut doubted = self.surfaces[y] & passed;
            while doubted != 0 {
                let x = doubted.trailing_zeros();
                doubted &= doubted - 1;
                if row[x as usize] <= 0 {
                    self.surfaces[y] &= !(1 << x);
                }
            }
        }
    }

    /// Returns whether a beam has ever ended in or gone through a cell.
    pub(crate) fn is_known(&self, [x, y]: [usize; 2]) -> bool {
        self.known[y] >> x & 1 == 1
    }

    /// Calls `visit` with every surface of some rows and columns: its cell, how far its points' mean
    /// is from the cell's middle, in cells, and which way it faces.
    pub(crate) fn for_each_surface(
        &self,
        columns: Range<usize>,
        rows: Range<usize>,
        mut visit: impl FnMut([usize; 2], [f64; 2], [f64; 2]),
    ) {
        let (below, above) = (u64::MAX << columns.start, u64::MAX >> (SIDE - columns.end));
        for y in rows {
            let mut waiting = self.surfaces[y] & below & above;
            while waiting != 0 {
                let x = waiting.trailing_zeros() as usize;
                waiting &= waiting - 1;
                let (mean, _) = self.means[y * SIDE + x];
                let from_middle = mean.map(|steps| f64::from(steps) * (1.0 / OFFSET_STEPS));
                let normal = self.normals[y * SIDE + x];
                visit(
                    [x, y],
                    from_middle,
                    normal.map(|part| f64::from(part) * (1.0 / NORMAL_STEPS)),
                );
            }
        }
    }

    /// Rows of what is known: -1 unknown, else the probability in percent of being occupied.
    pub(crate) fn percent_rows(&self) -> impl Iterator<Item = impl Iterator<Item = i8>> {
        self.log_odds.chunks(SIDE).zip(self.known).map(|(row, known)| {
            let of = move |(x, odds): (usize, &i8)| {
                if known >> x & 1 == 1 { to_percent(*odds) } else { -1 }
            };
            row.iter().enumerate().map(of)
        })
    }
}

/// The whole number below; the processor's own instruction for it is not there on all.
pub(crate) fn floor(number: f64) -> i32 {
    let whole = number as i32;
    whole.saturating_sub(i32::from(f64::from(whole) > number))
}

/// Probability of being occupied, in percent.
fn to_percent(log_odds: i8) -> i8 {
    /// They are few, and many cells ask.
    static PERCENTS: std::sync::LazyLock<[i8; 256]> = std::sync::LazyLock::new(|| {
        std::array::from_fn(|number| {
            let odds = ((number as f64 - 128.0) * LOG_ODDS_STEP).exp();
            (100.0 * odds / (1.0 + odds)).round() as i8
        })
    });
    PERCENTS[(i16::from(log_odds) + 128) as usize]
}
