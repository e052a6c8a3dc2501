//! The map: an occupancy grid in log-odds that grows in tiles with the area seen. Every cell also
//! knows the mean of the points that fell into it, so that walls are finer than cells.

use crate::normals::find_normals;
use crate::pose::{Point, Pose};
use crate::scan::Beam;
use crate::snapshot::GridSnapshot;
use crate::sweep::Sweep;
use crate::tile::{MapTile, TILE_CELLS, floor};
use std::collections::HashSet;
use std::sync::Arc;

/// Most tiles the rectangle around the map may have: 350 m × 350 m at 5 cm, 50 MB as a message.
pub const MAX_TILES: usize = 12_288;

/// The growing occupancy grid. A copy costs a pointer per tile; what is drawn into it afterwards
/// copies the tiles it touches (cf. Eliazar and Parr, *DP-SLAM 2.0*, ICRA 2004).
#[derive(Clone)]
pub struct SurfaceGrid {
    resolution_m: f64,
    /// Tile coordinates of the first tile.
    first: [i32; 2],
    /// Tiles along x and y.
    size: [i32; 2],
    tiles: Vec<Option<Arc<MapTile>>>,
    outside: u64,
}

impl SurfaceGrid {
    /// Makes an empty map with cells of `resolution_m`.
    pub fn new(resolution_m: f64) -> Self {
        let (first, size, tiles) = ([0, 0], [0, 0], Vec::new());
        Self { resolution_m, first, size, tiles, outside: 0 }
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
    pub fn insert(&mut self, world_from_robot: &Pose, laser: Point, beams: &[Beam]) {
        let laser = world_from_robot.apply(laser);
        let from = self.cell_of(laser);
        let ends: Vec<_> = beams.iter().map(|b| (world_from_robot.apply(b.end), b.hit)).collect();
        let mut kept = Vec::with_capacity(ends.len());
        for (&(end, is_hit), normal) in ends.iter().zip(find_normals(&ends, laser)) {
            let cell = self.cell_of(end);
            if self.cover_tile(from) && self.cover_tile(cell) {
                kept.push((cell, end, is_hit.then_some(normal)));
            }
        }
        self.outside += (ends.len() - kept.len()) as u64;
        let mut sweep = Sweep::over(kept.iter().map(|&(cell, ..)| cell).chain([from]));
        for &(cell, end, normal) in &kept {
            if let Some(normal) = normal {
                self.hit(cell, end, normal, sweep.mark_end(cell));
            }
        }
        kept.iter().for_each(|&(cell, ..)| sweep.mark_passed(from, cell));
        // What this scan saw as a surface, no other beam of it may clear.
        for (tile, passed) in sweep.passed() {
            if let Some(tile) = self.tile_mut(tile.map(|t| t * TILE_CELLS)) {
                tile.clear(&passed);
            }
        }
    }

    /// Marks surfaces alone, as of one scan: what lies between them and the robot stays unknown.
    pub fn mark(&mut self, surfaces: &[Point]) {
        let fits = |grid: &mut Self, point: Point| grid.cover_tile(grid.cell_of(point));
        let kept: Vec<_> = surfaces.iter().copied().filter(|&point| fits(self, point)).collect();
        self.outside += (surfaces.len() - kept.len()) as u64;
        let mut sweep = Sweep::over(kept.iter().map(|&point| self.cell_of(point)));
        for point in kept {
            let cell = self.cell_of(point);
            self.hit(cell, point, [0.0; 2], sweep.mark_end(cell));
        }
    }

    /// Returns whether a beam has ever ended in or gone through a cell.
    pub fn is_known(&self, cell: [i32; 2]) -> bool {
        self.tile_at(cell.map(tile_of)).is_some_and(|tile| tile.is_known(within_tile(cell)))
    }

    /// Calls `visit` with every surface in the cells from `low` up to and without `high`: its cell,
    /// and the mean of the points that were measured there.
    pub fn for_each_surface(
        &self,
        low: [i32; 2],
        high: [i32; 2],
        mut visit: impl FnMut([i32; 2], Point),
    ) {
        self.for_each_facing_surface(low, high, |cell, point, _| visit(cell, point));
    }

    /// The same with the direction in which each surface faces: the mean of the unit vectors out of
    /// it towards where it was seen from, short where these differ, zero where it is not known.
    pub(crate) fn for_each_facing_surface(
        &self,
        low: [i32; 2],
        high: [i32; 2],
        mut visit: impl FnMut([i32; 2], Point, [f64; 2]),
    ) {
        for tile_y in tile_of(low[1])..=tile_of(high[1] - 1) {
            for tile_x in tile_of(low[0])..=tile_of(high[0] - 1) {
                let Some(tile) = self.tile_at([tile_x, tile_y]) else { continue };
                let corner = [tile_x * TILE_CELLS, tile_y * TILE_CELLS];
                let part = |axis: usize| {
                    let within = |cell: i32| (cell - corner[axis]).clamp(0, TILE_CELLS) as usize;
                    within(low[axis])..within(high[axis])
                };
                tile.for_each_surface(part(0), part(1), |[x, y], from_middle, normal| {
                    let cell = [corner[0] + x as i32, corner[1] + y as i32];
                    let along = |axis: usize| {
                        (f64::from(cell[axis]) + 0.5 + from_middle[axis]) * self.resolution_m
                    };
                    visit(cell, Point { x_m: along(0), y_m: along(1) }, normal);
                });
            }
        }
    }

    /// Coordinates of the cell a point is in.
    pub fn cell_of(&self, point: Point) -> [i32; 2] {
        [point.x_m, point.y_m].map(|metres| floor(metres / self.resolution_m))
    }

    /// Returns the first cell of the rectangle around all that is known, and the one after its last.
    pub fn extent(&self) -> Option<([i32; 2], [i32; 2])> {
        let cells = |tiles: i32| tiles * TILE_CELLS;
        let high = [0, 1].map(|axis| cells(self.first[axis] + self.size[axis]));
        (!self.tiles.is_empty()).then(|| (self.first.map(cells), high))
    }

    /// Takes a picture of the rectangle around all that is known.
    pub fn snapshot(&self) -> GridSnapshot {
        let [width, height] = self.size.map(|tiles| (tiles * TILE_CELLS) as usize);
        let mut cells = vec![-1; width * height];
        for (number, tile) in self.tiles.iter().enumerate() {
            let Some(tile) = tile else { continue };
            let column = number % self.size[0] as usize * TILE_CELLS as usize;
            let row = number / self.size[0] as usize * TILE_CELLS as usize;
            for (y, line) in tile.percent_rows().enumerate() {
                let start = (row + y) * width + column;
                for (target, percent) in cells[start..].iter_mut().zip(line) {
                    *target = percent;
                }
            }
        }
        let corner = |axis: usize| f64::from(self.first[axis] * TILE_CELLS) * self.resolution_m;
        let origin = Pose::new(corner(0), corner(1), 0.0);
        GridSnapshot { origin, resolution_m: self.resolution_m, width, height, cells }
    }

    fn hit(&mut self, cell: [i32; 2], end: Point, normal: [f64; 2], is_first: bool) {
        let resolution_m = self.resolution_m;
        let from_middle = |metres: f64, cell: i32| metres / resolution_m - f64::from(cell) - 0.5;
        let offset = [from_middle(end.x_m, cell[0]), from_middle(end.y_m, cell[1])];
        if let Some(tile) = self.tile_mut(cell) {
            tile.hit(within_tile(cell), offset, normal, is_first);
        }
    }

    fn tile_at(&self, tile: [i32; 2]) -> Option<&MapTile> {
        self.tiles[self.tile_index(tile.map(|t| t * TILE_CELLS))?].as_deref()
    }

    fn tile_index(&self, [x, y]: [i32; 2]) -> Option<usize> {
        let (x, y) = (tile_of(x) - self.first[0], tile_of(y) - self.first[1]);
        let inside = (0..self.size[0]).contains(&x) && (0..self.size[1]).contains(&y);
        inside.then_some((y * self.size[0] + x) as usize)
    }

    /// The tile of a cell to draw into: a copy, if others have it too.
    fn tile_mut(&mut self, at: [i32; 2]) -> Option<&mut MapTile> {
        let index = self.tile_index(at)?;
        let unknown = || Arc::new(MapTile::UNKNOWN);
        Some(Arc::make_mut(self.tiles[index].get_or_insert_with(unknown)))
    }

    /// Grows the rectangle of tiles around a cell; false if it would become too large.
    fn cover_tile(&mut self, at: [i32; 2]) -> bool {
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
        let mut tiles: Vec<Option<Arc<MapTile>>> = Vec::new();
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
pub(crate) fn shared_tiles<'a>(maps: impl Iterator<Item = &'a SurfaceGrid>) -> (usize, usize) {
    let (mut found, mut all) = (HashSet::new(), 0);
    for tile in maps.flat_map(|map| map.tiles.iter().flatten()) {
        found.insert(Arc::as_ptr(tile));
        all += 1;
    }
    (found.len(), all)
}

fn tile_of(cell: i32) -> i32 {
    cell.div_euclid(TILE_CELLS)
}

fn within_tile(cell: [i32; 2]) -> [usize; 2] {
    cell.map(|along| along.rem_euclid(TILE_CELLS) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(x_m: f64, y_m: f64) -> Beam {
        Beam { end: Point { x_m, y_m }, hit: true }
    }

    fn surface(grid: &SurfaceGrid, x_m: f64, y_m: f64) -> Option<Point> {
        let [x, y] = grid.cell_of(Point { x_m, y_m });
        let mut found = None;
        grid.for_each_surface([x, y], [x + 1, y + 1], |_, point| found = Some(point));
        found
    }

    fn value(snapshot: &GridSnapshot, x_m: f64, y_m: f64) -> i8 {
        let column = ((x_m - snapshot.origin.x_m) / snapshot.resolution_m).floor() as usize;
        let row = ((y_m - snapshot.origin.y_m) / snapshot.resolution_m).floor() as usize;
        snapshot.cells[row * snapshot.width + column]
    }

    #[test]
    fn beams_make_free_and_occupied_cells_and_leave_the_rest_unknown() {
        let mut grid = SurfaceGrid::new(0.05);
        for _ in 0..5 {
            grid.insert(&Pose::default(), Point::default(), &[beam(2.01, 0.01), beam(-7.0, -7.0)]);
        }
        let snapshot = grid.snapshot();
        assert!(value(&snapshot, 2.01, 0.01) > 90);
        assert!((0..10).contains(&value(&snapshot, 1.0, 0.01)));
        assert_eq!(value(&snapshot, 2.2, 0.01), -1);
        assert!(value(&snapshot, -7.0, -7.0) > 90, "the map grew to the other side");
    }

    #[test]
    fn a_surface_is_the_mean_of_its_points() {
        let mut grid = SurfaceGrid::new(0.1);
        let from = Pose::default();
        grid.insert(&from, Point::default(), &[beam(1.02, 0.01)]);
        grid.insert(&from, Point::default(), &[beam(1.08, 0.01)]);
        let surface = surface(&grid, 1.05, 0.05).unwrap();
        assert!((surface.x_m - 1.05).abs() < 0.001, "{surface:?}");
    }

    #[test]
    fn what_was_occupied_becomes_free_when_seen_through() {
        let mut grid = SurfaceGrid::new(0.1);
        let from = Pose::default();
        for _ in 0..10 {
            grid.insert(&from, Point::default(), &[beam(1.05, 0.05)]);
        }
        assert!(surface(&grid, 1.05, 0.05).is_some());
        for _ in 0..10 {
            grid.insert(&from, Point::default(), &[beam(3.05, 0.05)]);
        }
        assert!(surface(&grid, 1.05, 0.05).is_none());
    }

    #[test]
    fn beams_to_the_end_of_the_world_are_left_out_and_counted() {
        let mut grid = SurfaceGrid::new(0.05);
        let beams = [beam(1.0, 0.0), beam(5e3, 5e3), beam(1e300, 0.0)];
        grid.insert(&Pose::default(), Point::default(), &beams);
        assert_eq!(grid.beams_outside(), 2);
        assert!(grid.snapshot().cells.len() < 100_000);
    }

    #[test]
    fn copies_share_all_tiles_but_those_drawn_since() {
        let mut grid = SurfaceGrid::new(0.05);
        // Rays to the east and the west: tiles of 3.2 m in both directions.
        let far: Vec<_> = [-9.0, 9.0].map(|x_m| beam(x_m, 0.01)).to_vec();
        grid.insert(&Pose::default(), Point::default(), &far);
        let (tiles, _) = shared_tiles(std::iter::once(&grid));
        let mut copies = vec![grid.clone(); 30];
        assert_eq!(shared_tiles(copies.iter()), (tiles, 30 * tiles));
        copies[3].insert(&Pose::default(), Point::default(), &[beam(1.0, 0.01)]);
        assert_eq!(shared_tiles(copies.iter()), (tiles + 1, 30 * tiles), "one tile was copied");
        let is_wall = |map: &SurfaceGrid| surface(map, 1.0, 0.01).is_some();
        assert!(is_wall(&copies[3]) && !is_wall(&copies[2]));
        copies.truncate(3);
        assert_eq!(shared_tiles(copies.iter()), (tiles, 3 * tiles), "it went with its owner");
    }

    #[test]
    fn pictures_tell_which_tiles_changed() {
        let mut grid = SurfaceGrid::new(0.05);
        grid.insert(&Pose::default(), Point::default(), &[beam(9.0, 0.01)]);
        let before = grid.snapshot();
        assert_eq!(before.changed_since(&before), Some(vec![]));
        grid.insert(&Pose::default(), Point::default(), &[beam(1.0, 0.01)]);
        assert_eq!(grid.snapshot().changed_since(&before), Some(vec![([0, 0], [64, 64])]));
        grid.insert(&Pose::default(), Point::default(), &[beam(-9.0, 0.01)]);
        assert_eq!(grid.snapshot().changed_since(&before), None, "it has grown");
    }
}
