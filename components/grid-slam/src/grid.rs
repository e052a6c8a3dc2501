//! The map: an occupancy grid in log-odds that grows in tiles with the area seen. Every cell also
//! knows the mean of the points that fell into it, so that walls are finer than cells.

use crate::pose::{Point, Pose};
use crate::scan::Beam;
use std::collections::HashSet;
use std::sync::Arc;

/// Cells along a side of a tile: 3.2 m at 5 cm, a tile is 32 KiB.
pub const TILE_CELLS: i32 = 64;
/// Most tiles the rectangle around the map may have: 350 m × 350 m at 5 cm, 50 MB as a message.
pub const MAX_TILES: usize = 12_288;

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

#[derive(Clone, Copy, Default)]
struct Cell {
    log_odds: i8,
    /// Mean hit point from the cell's centre, in 1/250 of a cell.
    mean: [i8; 2],
    hits: u8,
    /// Metres the robot had travelled when the cell became a surface.
    born_m: u16,
    /// Scan that touched the cell last: one scan changes a cell once.
    touched: u16,
}

impl Cell {
    /// A beam of a scan went through.
    fn clear(&mut self, scan: u16) {
        if self.touched != scan {
            self.touched = scan;
            self.log_odds = self.log_odds.saturating_add(MISS).max(LEAST);
        }
    }
}

/// A surface point of the map: the mean of what was measured in one occupied cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Where it is, in the map's frame.
    pub point: Point,
    /// Metres the robot had travelled when it was first seen.
    pub born_m: u16,
}

/// A picture of the map at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
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

/// Copies of a map share their tiles until one of them draws there.
type Tile = Arc<[Cell]>;

impl Snapshot {
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

/// The growing occupancy grid. A copy costs a pointer per tile; what is drawn into it afterwards
/// copies the tiles it touches (cf. Eliazar and Parr, *DP-SLAM 2.0*, ICRA 2004).
#[derive(Clone)]
pub struct Grid {
    resolution_m: f64,
    /// Tile coordinates of the first tile.
    first: [i32; 2],
    /// Tiles along x and y.
    size: [i32; 2],
    tiles: Vec<Option<Tile>>,
    scan: u16,
    outside: u64,
}

impl Grid {
    /// Makes an empty map with cells of `resolution_m`.
    pub fn new(resolution_m: f64) -> Self {
        let (first, size, tiles) = ([0, 0], [0, 0], Vec::new());
        Self { resolution_m, first, size, tiles, scan: 0, outside: 0 }
    }

    /// Side of a cell, metres.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Number of beams left out because the map would have grown beyond [`MAX_TILES`].
    pub fn beams_outside(&self) -> u64 {
        self.outside
    }

    /// Draws a scan: cells that beams went through become freer, those they ended in more occupied.
    pub fn insert(
        &mut self,
        world_from_robot: &Pose,
        laser: Point,
        beams: &[Beam],
        travelled_m: f64,
    ) {
        self.scan = self.scan.wrapping_add(1).max(1);
        let born_m = travelled_m.clamp(0.0, f64::from(u16::MAX)) as u16;
        let from = self.cell_of(world_from_robot.apply(laser));
        let ends: Vec<_> = beams.iter().map(|b| (world_from_robot.apply(b.end), b.hit)).collect();
        let fits = |grid: &mut Self, end: Point| grid.cover(from) && grid.cover(grid.cell_of(end));
        let kept: Vec<_> = ends.iter().copied().filter(|&(end, _)| fits(self, end)).collect();
        self.outside += (ends.len() - kept.len()) as u64;
        // Hits first: what this scan saw as a surface, no other beam of it may clear.
        for &(end, _) in kept.iter().filter(|(_, hit)| *hit) {
            self.hit(end, born_m);
        }
        for &(end, _) in &kept {
            self.clear_line(from, self.cell_of(end));
        }
    }

    /// Marks surfaces alone, as of one scan: what lies between them and the robot stays unknown.
    pub fn mark(&mut self, surfaces: &[Point]) {
        self.scan = self.scan.wrapping_add(1).max(1);
        for &point in surfaces {
            if self.cover(self.cell_of(point)) {
                self.hit(point, 0);
            } else {
                self.outside += 1;
            }
        }
    }

    /// Gives the surface point of a cell, if the cell is more likely occupied than not.
    pub fn surface(&self, [x, y]: [i32; 2]) -> Option<Surface> {
        let cell = self.tiles[self.tile_index([x, y])?].as_ref()?[index_in_tile([x, y])];
        (cell.log_odds > 0).then(|| self.surface_of(&cell, [x, y]))
    }

    /// Says whether a beam has ever ended in or gone through a cell.
    pub fn is_known(&self, cell: [i32; 2]) -> bool {
        let tile = self.tile_index(cell).and_then(|index| self.tiles[index].as_ref());
        tile.is_some_and(|tile| tile[index_in_tile(cell)].touched != 0)
    }

    /// Calls `visit` with every surface point in the cells from `low` up to and without `high`.
    pub fn for_each_surface(&self, low: [i32; 2], high: [i32; 2], mut visit: impl FnMut(Surface)) {
        for tile_y in tile_of(low[1])..=tile_of(high[1] - 1) {
            for tile_x in tile_of(low[0])..=tile_of(high[0] - 1) {
                let Some(tile) = self.tile([tile_x, tile_y]) else { continue };
                for (index, cell) in tile.iter().enumerate().filter(|(_, c)| c.log_odds > 0) {
                    let index = index as i32;
                    let x = tile_x * TILE_CELLS + index % TILE_CELLS;
                    let y = tile_y * TILE_CELLS + index / TILE_CELLS;
                    if (low[0]..high[0]).contains(&x) && (low[1]..high[1]).contains(&y) {
                        visit(self.surface_of(cell, [x, y]));
                    }
                }
            }
        }
    }

    /// Coordinates of the cell a point is in.
    pub fn cell_of(&self, point: Point) -> [i32; 2] {
        [point.x_m, point.y_m].map(|metres| (metres / self.resolution_m).floor() as i32)
    }

    /// Takes a picture of the rectangle around all that is known.
    pub fn snapshot(&self) -> Snapshot {
        let [width, height] = self.size.map(|tiles| (tiles * TILE_CELLS) as usize);
        let mut cells = vec![-1; width * height];
        let percents: Vec<i8> = (i8::MIN..=i8::MAX).map(percent).collect();
        let of = |cell: &Cell| percents[(i16::from(cell.log_odds) + 128) as usize];
        for (number, tile) in self.tiles.iter().enumerate() {
            let Some(tile) = tile else { continue };
            let column = number % self.size[0] as usize * TILE_CELLS as usize;
            let row = number / self.size[0] as usize * TILE_CELLS as usize;
            for (y, line) in tile.chunks(TILE_CELLS as usize).enumerate() {
                let start = (row + y) * width + column;
                for (target, cell) in cells[start..].iter_mut().zip(line) {
                    *target = if cell.touched == 0 { -1 } else { of(cell) };
                }
            }
        }
        let corner = |axis: usize| f64::from(self.first[axis] * TILE_CELLS) * self.resolution_m;
        let origin = Pose::new(corner(0), corner(1), 0.0);
        Snapshot { origin, resolution_m: self.resolution_m, width, height, cells }
    }

    fn hit(&mut self, end: Point, born_m: u16) {
        let at = self.cell_of(end);
        let [dx, dy] = self.offset(end, at);
        let scan = self.scan;
        let Some(tile) = self.tile_mut(at) else { return };
        let cell = &mut tile[index_in_tile(at)];
        if cell.log_odds <= 0 {
            (cell.hits, cell.born_m) = (0, born_m);
        }
        if cell.touched != scan {
            cell.log_odds = cell.log_odds.saturating_add(HIT).min(MOST);
        }
        cell.touched = scan;
        cell.hits = (cell.hits + 1).min(MEAN_OVER);
        let towards = |mean: i8, new: f64| {
            let mean = f64::from(mean);
            (mean + (new - mean) / f64::from(cell.hits)).round() as i8
        };
        cell.mean = [towards(cell.mean[0], dx), towards(cell.mean[1], dy)];
    }

    /// Bresenham's line, without its last cell.
    fn clear_line(&mut self, from: [i32; 2], to: [i32; 2]) {
        let (dx, dy) = ((to[0] - from[0]).abs(), -(to[1] - from[1]).abs());
        let step = [(to[0] - from[0]).signum(), (to[1] - from[1]).signum()];
        let (mut at, mut error) = (from, dx + dy);
        let scan = self.scan;
        while at != to {
            // All cells in one tile at once: to find it costs more than to clear a cell.
            let number = at.map(tile_of);
            let mut tile = self.tile_mut(at);
            while at != to && at.map(tile_of) == number {
                if let Some(tile) = &mut tile {
                    tile[index_in_tile(at)].clear(scan);
                }
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
    }

    fn offset(&self, point: Point, [x, y]: [i32; 2]) -> [f64; 2] {
        let along = |metres: f64, cell: i32| {
            ((metres / self.resolution_m - f64::from(cell) - 0.5) * OFFSET_STEPS)
                .clamp(-125.0, 125.0)
        };
        [along(point.x_m, x), along(point.y_m, y)]
    }

    fn surface_of(&self, cell: &Cell, [x, y]: [i32; 2]) -> Surface {
        let along = |cell: i32, mean: i8| {
            (f64::from(cell) + 0.5 + f64::from(mean) / OFFSET_STEPS) * self.resolution_m
        };
        let point = Point { x_m: along(x, cell.mean[0]), y_m: along(y, cell.mean[1]) };
        Surface { point, born_m: cell.born_m }
    }

    fn tile(&self, tile: [i32; 2]) -> Option<&Tile> {
        self.tiles[self.tile_index(tile.map(|t| t * TILE_CELLS))?].as_ref()
    }

    fn tile_index(&self, [x, y]: [i32; 2]) -> Option<usize> {
        let (x, y) = (tile_of(x) - self.first[0], tile_of(y) - self.first[1]);
        let inside = (0..self.size[0]).contains(&x) && (0..self.size[1]).contains(&y);
        inside.then_some((y * self.size[0] + x) as usize)
    }

    /// The tile of a cell to draw into: a copy, if others have it too.
    fn tile_mut(&mut self, at: [i32; 2]) -> Option<&mut [Cell]> {
        let index = self.tile_index(at)?;
        let empty = || vec![Cell::default(); (TILE_CELLS * TILE_CELLS) as usize].into();
        Some(Arc::make_mut(self.tiles[index].get_or_insert_with(empty)))
    }

    /// Grows the rectangle of tiles around a cell; false if it would become too large.
    fn cover(&mut self, at: [i32; 2]) -> bool {
        if self.tile_index(at).is_some() {
            return true;
        }
        let tile = at.map(tile_of);
        let empty = self.tiles.is_empty();
        let axis = |i: usize| {
            let low = if empty { tile[i] } else { tile[i].min(self.first[i]) };
            let high =
                if empty { tile[i] + 1 } else { (tile[i] + 1).max(self.first[i] + self.size[i]) };
            (low, i64::from(high) - i64::from(low))
        };
        let ((left, width), (bottom, height)) = (axis(0), axis(1));
        if width.saturating_mul(height) > MAX_TILES as i64 {
            return false;
        }
        self.move_into([left, bottom], [width as i32, height as i32]);
        true
    }

    fn move_into(&mut self, first: [i32; 2], size: [i32; 2]) {
        let mut tiles: Vec<Option<Tile>> = Vec::new();
        tiles.resize_with((size[0] * size[1]) as usize, || None);
        let old_width = self.size[0].max(1);
        for (number, tile) in self.tiles.drain(..).enumerate() {
            let (x, y) = (number as i32 % old_width, number as i32 / old_width);
            let (x, y) = (x + self.first[0] - first[0], y + self.first[1] - first[1]);
            tiles[(y * size[0] + x) as usize] = tile;
        }
        (self.first, self.size, self.tiles) = (first, size, tiles);
    }
}

/// Counts the tiles of several maps: how many there are in memory, and how many without sharing.
pub(crate) fn shared_tiles<'a>(maps: impl Iterator<Item = &'a Grid>) -> (usize, usize) {
    let (mut found, mut all) = (HashSet::new(), 0);
    for tile in maps.flat_map(|map| map.tiles.iter().flatten()) {
        found.insert(Arc::as_ptr(tile).cast::<Cell>());
        all += 1;
    }
    (found.len(), all)
}

/// Probability of being occupied, in percent.
fn percent(log_odds: i8) -> i8 {
    let odds = (f64::from(log_odds) * LOG_ODDS_STEP).exp();
    (100.0 * odds / (1.0 + odds)).round() as i8
}

fn tile_of(cell: i32) -> i32 {
    cell.div_euclid(TILE_CELLS)
}

fn index_in_tile([x, y]: [i32; 2]) -> usize {
    (y.rem_euclid(TILE_CELLS) * TILE_CELLS + x.rem_euclid(TILE_CELLS)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(x_m: f64, y_m: f64) -> Beam {
        Beam { end: Point { x_m, y_m }, hit: true }
    }

    fn value(snapshot: &Snapshot, x_m: f64, y_m: f64) -> i8 {
        let column = ((x_m - snapshot.origin.x_m) / snapshot.resolution_m).floor() as usize;
        let row = ((y_m - snapshot.origin.y_m) / snapshot.resolution_m).floor() as usize;
        snapshot.cells[row * snapshot.width + column]
    }

    #[test]
    fn beams_make_free_and_occupied_cells_and_leave_the_rest_unknown() {
        let mut grid = Grid::new(0.05);
        for _ in 0..5 {
            grid.insert(
                &Pose::default(),
                Point::default(),
                &[beam(2.01, 0.01), beam(-7.0, -7.0)],
                0.0,
            );
        }
        let snapshot = grid.snapshot();
        assert!(value(&snapshot, 2.01, 0.01) > 90);
        assert!((0..10).contains(&value(&snapshot, 1.0, 0.01)));
        assert_eq!(value(&snapshot, 2.2, 0.01), -1);
        assert!(value(&snapshot, -7.0, -7.0) > 90, "the map grew to the other side");
    }

    #[test]
    fn a_surface_is_the_mean_of_its_points() {
        let mut grid = Grid::new(0.1);
        let from = Pose::default();
        grid.insert(&from, Point::default(), &[beam(1.02, 0.01)], 3.7);
        grid.insert(&from, Point::default(), &[beam(1.08, 0.01)], 9.0);
        let surface = grid.surface([10, 0]).unwrap();
        assert!((surface.point.x_m - 1.05).abs() < 0.001, "{surface:?}");
        assert_eq!(surface.born_m, 3);
    }

    #[test]
    fn what_was_occupied_becomes_free_when_seen_through() {
        let mut grid = Grid::new(0.1);
        let from = Pose::default();
        for _ in 0..10 {
            grid.insert(&from, Point::default(), &[beam(1.05, 0.05)], 0.0);
        }
        assert!(grid.surface([10, 0]).is_some());
        for _ in 0..10 {
            grid.insert(&from, Point::default(), &[beam(3.05, 0.05)], 0.0);
        }
        assert!(grid.surface([10, 0]).is_none());
    }

    #[test]
    fn beams_to_the_end_of_the_world_are_left_out_and_counted() {
        let mut grid = Grid::new(0.05);
        let beams = [beam(1.0, 0.0), beam(5e3, 5e3), beam(1e300, 0.0)];
        grid.insert(&Pose::default(), Point::default(), &beams, 0.0);
        assert_eq!(grid.beams_outside(), 2);
        assert!(grid.snapshot().cells.len() < 100_000);
    }

    #[test]
    fn copies_share_all_tiles_but_those_drawn_since() {
        let mut grid = Grid::new(0.05);
        // Rays to the east and the west: tiles of 3.2 m in both directions.
        let far: Vec<_> = [-9.0, 9.0].map(|x_m| beam(x_m, 0.01)).to_vec();
        grid.insert(&Pose::default(), Point::default(), &far, 0.0);
        let (tiles, _) = shared_tiles(std::iter::once(&grid));
        let mut copies = vec![grid.clone(); 30];
        assert_eq!(shared_tiles(copies.iter()), (tiles, 30 * tiles));
        copies[3].insert(&Pose::default(), Point::default(), &[beam(1.0, 0.01)], 0.0);
        assert_eq!(shared_tiles(copies.iter()), (tiles + 1, 30 * tiles), "one tile was copied");
        let surface = |map: &Grid| map.surface(map.cell_of(Point { x_m: 1.0, y_m: 0.01 }));
        assert!(surface(&copies[3]).is_some() && surface(&copies[2]).is_none());
        copies.truncate(3);
        assert_eq!(shared_tiles(copies.iter()), (tiles, 3 * tiles), "it went with its owner");
    }

    #[test]
    fn pictures_tell_which_tiles_changed() {
        let mut grid = Grid::new(0.05);
        grid.insert(&Pose::default(), Point::default(), &[beam(9.0, 0.01)], 0.0);
        let before = grid.snapshot();
        assert_eq!(before.changed_since(&before), Some(vec![]));
        grid.insert(&Pose::default(), Point::default(), &[beam(1.0, 0.01)], 0.0);
        assert_eq!(grid.snapshot().changed_since(&before), Some(vec![([0, 0], [64, 64])]));
        grid.insert(&Pose::default(), Point::default(), &[beam(-9.0, 0.01)], 0.0);
        assert_eq!(grid.snapshot().changed_since(&before), None, "it has grown");
    }
}
