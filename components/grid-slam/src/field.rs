//! A likelihood field over a window of the map, with the maxima over squares that a coarse-to-fine
//! search needs as upper bounds.

use crate::grid::SurfaceGrid;
use crate::pose::Point;
use crate::prior::Prior;

/// Likelihoods are kept as 0..=255.
pub const FULL: f64 = 255.0;
/// Positions within a cell that have a kernel of their own, along each axis.
const SUBCELLS: usize = 4;

/// A rectangle of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellWindow {
    /// Its first cell.
    pub low: [i32; 2],
    /// The cell after its last one.
    pub high: [i32; 2],
}

impl CellWindow {
    /// The cells of `resolution_m` that a search for `points` can touch, with a margin.
    pub fn around(points: &[Point], prior: &Prior, resolution_m: f64, margin_m: f64) -> Self {
        // A scan in which nothing was seen can touch no cell.
        if points.is_empty() {
            return Self { low: [0; 2], high: [0; 2] };
        }
        let far_m = points.iter().map(|p| p.x_m.hypot(p.y_m)).fold(0.0, f64::max);
        let margin_m = prior.window_m + far_m * prior.window_rad + margin_m;
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for point in points.iter().map(|p| prior.pose.apply(*p)) {
            for (axis, metres) in [point.x_m, point.y_m].into_iter().enumerate() {
                low[axis] = low[axis].min(metres - margin_m);
                high[axis] = high[axis].max(metres + margin_m);
            }
        }
        let cell = |metres: f64| (metres / resolution_m).floor() as i32;
        Self { low: low.map(cell), high: high.map(|metres| cell(metres) + 1) }
    }

    /// Returns whether all of `inner` lies in it.
    pub fn contains(&self, inner: &Self) -> bool {
        (0..2).all(|i| self.low[i] <= inner.low[i] && inner.high[i] <= self.high[i])
    }

    /// Returns the window widened by `cells` on all sides.
    pub fn widened(&self, cells: i32) -> Self {
        Self { low: self.low.map(|c| c - cells), high: self.high.map(|c| c + cells) }
    }
}

/// How well a point at each cell of a window fits the surfaces near it.
pub struct LikelihoodField {
    window: CellWindow,
    width: usize,
    height: usize,
    /// Level h stores, at every cell, the maximum over the 2^h × 2^h cells from it up and right.
    levels: Vec<Vec<u8>>,
}

impl LikelihoodField {
    /// Draws the surfaces of `grid` in `window`, blurred by `sigma_m`, with `levels` levels of
    /// maxima above the finest.
    pub fn draw(grid: &SurfaceGrid, window: CellWindow, sigma_m: f64, levels: usize) -> Self {
        let width = (window.high[0] - window.low[0]).max(0) as usize;
        let height = (window.high[1] - window.low[1]).max(0) as usize;
        let kernel = Kernel::new(sigma_m / grid.resolution_m());
        let mut base = vec![0; width * height];
        let margin = kernel.radius as i32;
        let (low, high) = (window.low.map(|c| c + margin), window.high.map(|c| c - margin));
        grid.for_each_surface(low, high, |at, point| {
            let x = (at[0] - margin - window.low[0]) as usize;
            let y = (at[1] - margin - window.low[1]) as usize;
            kernel.stamp_kernel(&mut base[y * width + x..], width, subcell_index(grid, point, at));
        });
        let mut field = Self { window, width, height, levels: vec![base] };
        for level in 0..levels {
            let next = field.compute_maxima(level);
            field.levels.push(next);
        }
        field
    }

    /// The cells it covers.
    pub fn window(&self) -> CellWindow {
        self.window
    }

    /// Highest level.
    pub fn top(&self) -> usize {
        self.levels.len() - 1
    }

    /// Upper bound of the likelihood over the 2^level square from a cell; 0 outside the window.
    pub fn at(&self, level: usize, [x, y]: [i32; 2]) -> u8 {
        let (x, y) = ((x - self.window.low[0]) as usize, (y - self.window.low[1]) as usize);
        if x < self.width && y < self.height { self.levels[level][y * self.width + x] } else { 0 }
    }

    fn compute_maxima(&self, level: usize) -> Vec<u8> {
        let (below, step) = (&self.levels[level], 1 << level);
        let mut next = below.clone();
        for (y, row) in next.chunks_mut(self.width.max(1)).enumerate() {
            let mine = &below[y * self.width..][..self.width];
            raise_row(row, mine, step);
            if y + step < self.height {
                let above = &below[(y + step) * self.width..][..self.width];
                raise_row(row, above, 0);
                raise_row(row, above, step);
            }
        }
        next
    }
}

/// Raises every cell of a row to the one `shift` to its right in another.
fn raise_row(row: &mut [u8], other: &[u8], shift: usize) {
    for (cell, &candidate) in row.iter_mut().zip(other.get(shift..).unwrap_or(&[])) {
        *cell = (*cell).max(candidate);
    }
}

fn subcell_index(grid: &SurfaceGrid, point: Point, [x, y]: [i32; 2]) -> usize {
    let part = |metres: f64, cell: i32| {
        let within = metres / grid.resolution_m() - f64::from(cell);
        ((within * SUBCELLS as f64) as usize).min(SUBCELLS - 1)
    };
    part(point.y_m, y) * SUBCELLS + part(point.x_m, x)
}

/// Gaussians on a square of cells, one for each position of the surface within its cell.
struct Kernel {
    radius: usize,
    side: usize,
    values: Vec<Vec<u8>>,
}

impl Kernel {
    fn new(sigma_cells: f64) -> Self {
        let radius = (2.5 * sigma_cells).ceil().clamp(1.0, 20.0) as usize;
        let side = 2 * radius + 1;
        let gaussian = |sub: usize| {
            let offset = |s: usize| (s as f64 + 0.5) / SUBCELLS as f64 - 0.5 + radius as f64;
            let (x, y) = (offset(sub % SUBCELLS), offset(sub / SUBCELLS));
            let value = |i: usize| {
                let squared = ((i % side) as f64 - x).powi(2) + ((i / side) as f64 - y).powi(2);
                (FULL * (-squared / (2.0 * sigma_cells * sigma_cells)).exp()).round() as u8
            };
            (0..side * side).map(value).collect()
        };
        Self { radius, side, values: (0..SUBCELLS * SUBCELLS).map(gaussian).collect() }
    }

    fn stamp_kernel(&self, cells: &mut [u8], width: usize, sub: usize) {
        for (line, values) in cells.chunks_mut(width).zip(self.values[sub].chunks(self.side)) {
            raise_row(line, values, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::scan::Beam;

    fn field() -> LikelihoodField {
        let mut grid = SurfaceGrid::new(0.1);
        let beam = Beam { end: Point { x_m: 2.05, y_m: 0.05 }, hit: true };
        grid.insert(&Pose::default(), Point::default(), &[beam]);
        let window = CellWindow { low: [0, -20], high: [40, 20] };
        LikelihoodField::draw(&grid, window, 0.1, 3)
    }

    #[test]
    fn a_scan_without_points_has_an_empty_window() {
        let prior = Prior {
            pose: Pose::default(),
            sigma_m: 0.1,
            sigma_rad: 0.1,
            window_m: 1.0,
            window_rad: 0.5,
        };
        let window = CellWindow::around(&[], &prior, 0.1, 0.5);
        assert_eq!(window, CellWindow { low: [0; 2], high: [0; 2] });
        let field = LikelihoodField::draw(&SurfaceGrid::new(0.1), window.widened(2), 0.1, 3);
        assert_eq!((field.at(0, [0, 0]), field.at(3, [1, 1])), (0, 0));
        let field = LikelihoodField::draw(&SurfaceGrid::new(0.1), window, 0.1, 3);
        assert_eq!(field.at(3, [0, 0]), 0);
    }

    #[test]
    fn likelihood_falls_with_the_distance_to_the_surface() {
        let field = field();
        let along: Vec<_> = (20..25).map(|x| field.at(0, [x, 0])).collect();
        assert!(along[0] > 240 && along.is_sorted_by(|a, b| a >= b) && along[4] == 0, "{along:?}");
        assert_eq!(field.at(0, [-1, 500]), 0, "outside is nothing");
    }

    #[test]
    fn levels_bound_the_squares_below_them() {
        let field = field();
        for level in 1..=field.top() {
            let side = 1 << level;
            for start in (0..30).map(|i| [i, i - 15]) {
                let square = (0..side * side).map(|i| [start[0] + i % side, start[1] + i / side]);
                let most = square.map(|cell| field.at(0, cell)).max().unwrap();
                assert_eq!(field.at(level, start), most, "level {level} at {start:?}");
            }
        }
    }
}
