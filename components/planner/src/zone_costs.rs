//! What zones do to the cost of cells: barriers close them, speed zones make them costlier.

use armor_grid::{Cell, CostMap, Geometry, Inflation, Point2};
use armor_zones::{Barrier, ZoneMap};

/// What a metre of path costs within a zone that the robot must leave, on top of its length: enough
/// that no detour inside is cheaper than the shortest way out.
const LEAVE_WEIGHT: f32 = 100.0;
/// Rooms differ by less than this only by rounding, in metres.
const ROUNDING_M: f64 = 1e-9;
/// Cells are looked at in blocks of this many by as many: if a whole block is far from a border, its
/// cells are not looked at one by one.
const BLOCK: usize = 16;

/// Applies the zones to a map on which obstacles are closed already.
#[derive(Debug)]
pub(crate) struct ZoneCosts<'a> {
    pub(crate) zones: &'a ZoneMap,
    pub(crate) inflation: &'a Inflation,
    /// The robot's fastest speed, in metres per second.
    pub(crate) speed_mps: f64,
}

impl ZoneCosts<'_> {
    /// Changes the costs. A robot at `leaving`, which is too near to a barrier or past it, may drive
    /// where that barrier leaves as much room as there, and more, but no less.
    ///
    /// The cells that stay open elsewhere are those from whose centres every point within half a
    /// diagonal keeps the inflation's radius: so does each straight step from one to the next.
    pub(crate) fn apply(&self, costs: &mut CostMap, leaving: Option<Point2>) {
        let geometry = *costs.geometry();
        for barrier in self.zones.barriers() {
            self.close_barrier(costs, barrier, leaving);
        }
        let mut limits = self.zones.speed_limits(Point2::default());
        if limits.all(|(limit_mps, _)| limit_mps >= self.speed_mps) {
            return;
        }
        costs.change_open_cells(|cell, factor| {
            factor + self.lost_time(geometry.centre(cell)) as f32
        });
    }

    /// Returns whether a robot at `robot` is nearer to a barrier than paths are planned.
    pub(crate) fn is_too_near(&self, geometry: &Geometry, robot: Point2) -> bool {
        self.zones.room_m(robot) < self.needed_m(geometry)
    }

    /// The room that the centre of an open cell needs.
    fn needed_m(&self, geometry: &Geometry) -> f64 {
        self.inflation.radius_m + geometry.resolution_m * std::f64::consts::FRAC_1_SQRT_2
    }

    fn close_barrier(&self, costs: &mut CostMap, barrier: &Barrier, leaving: Option<Point2>) {
        let geometry = *costs.geometry();
        let needed_m = self.needed_m(&geometry);
        let robot_room_m = leaving.map_or(needed_m, |robot| barrier.room_m(robot));
        let least_m = needed_m.min(robot_room_m) - ROUNDING_M;
        let blocks = BlockRooms::new(&geometry, barrier, self.inflation.comfort_m.max(needed_m));
        costs.change_open_cells(|cell, factor| {
            if blocks.is_roomy(cell) {
                return factor;
            }
            let room_m = barrier.room_m(geometry.centre(cell));
            if room_m < least_m {
                f32::INFINITY
            } else if room_m < needed_m {
                factor + LEAVE_WEIGHT
            } else {
                factor + self.inflation.near_factor(room_m) as f32
            }
        });
    }

    /// The time that a metre takes at a point, more than at the robot's fastest speed, as a multiple
    /// of that.
    fn lost_time(&self, point: Point2) -> f64 {
        let reach_m = self.inflation.radius_m;
        let inside = self.zones.speed_limits(point).filter(|(_, away_m)| *away_m < reach_m);
        let slowest_mps = inside.map(|(limit_mps, _)| limit_mps).fold(self.speed_mps, f64::min);
        self.speed_mps / slowest_mps - 1.0
    }
}

/// Which blocks of cells are so far from a barrier that it changes nothing there. The room changes by
/// at most a metre per metre, so the room in the middle of a block bounds that of all its cells.
struct BlockRooms {
    columns: usize,
    roomy: Vec<bool>,
}

impl BlockRooms {
    fn new(geometry: &Geometry, barrier: &Barrier, wanted_m: f64) -> Self {
        let (columns, rows) = (geometry.width.div_ceil(BLOCK), geometry.height.div_ceil(BLOCK));
        let side_m = BLOCK as f64 * geometry.resolution_m;
        let half_diagonal_m = side_m * std::f64::consts::FRAC_1_SQRT_2;
        let middle = |index: usize, origin_m: f64| origin_m + (index as f64 + 0.5) * side_m;
        let roomy = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let roomy = roomy.map(|(column, row)| {
            let x_m = middle(column, geometry.origin.x_m);
            let y_m = middle(row, geometry.origin.y_m);
            barrier.room_m(Point2::new(x_m, y_m)) - half_diagonal_m > wanted_m
        });
        Self { columns, roomy: roomy.collect() }
    }

    /// `cell` is one of the map's.
    fn is_roomy(&self, cell: Cell) -> bool {
        let block = |index: i32| index as usize / BLOCK;
        self.roomy[block(cell.row) * self.columns + block(cell.column)]
    }
}
