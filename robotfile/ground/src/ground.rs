//! What a robot may drive over: free cells of the known grid that keep its radius from walls, from what is
//! not known, and from zones.

use armor_geo::{Clearance, MapArea, MapPoint};
use armor_grid::{Cell, Geometry, Grid, Occupancy, Point2, Pose2, distance_transform, traverse};
use armor_robotfile::site_map::{DrawnZone, ZoneKind};
use armor_zones::{Barrier, MapZone, ZoneDuty, ZoneMap};

use crate::path_search::{find_blocked, find_length, find_path, measure_all};

/// Twelfths of a cell in a cell.
const PER_CELL: f64 = 12.0;

/// The known grid of a site, and the borders of its zones.
#[derive(Clone, Debug)]
pub struct SiteGround {
    cells: Grid<Occupancy>,
    map_from_cells: Pose2,
    cells_from_map: Pose2,
    /// The distance of each cell from the nearest one that is not free, in metres.
    room: Grid<f32>,
    zones: ZoneMap,
}

/// What blocks a path at a point of the map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Obstacle {
    /// Where it is.
    pub(crate) at: Point2,
    /// What is there.
    pub(crate) sort: ObstacleSort,
}

/// The sorts of obstacles.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ObstacleSort {
    /// A cell that is occupied.
    Wall,
    /// A cell of which the grid does not know whether it is free.
    Unknown,
    /// A zone, by its name.
    Zone(String),
    /// The boundary of the zone to stay in, by its name.
    Boundary(String),
    /// A free cell that is nearer to an obstacle than the radius of the robot.
    Narrow,
    /// A point that is not on the grid.
    Outside,
}

impl SiteGround {
    /// Of the cells of a grid, whose corner is at (0, 0), their place in the map, and the map's zones.
    /// Zones that cannot be together, which is a finding elsewhere, are left out.
    pub fn new(cells: Grid<Occupancy>, map_from_cells: Pose2, zones: &[DrawnZone]) -> Self {
        let room = distance_transform(&cells.map(|cell| *cell != Occupancy::Free));
        let zones = zones.iter().filter_map(read_zone).collect();
        let zones = ZoneMap::new(zones).unwrap_or_default();
        let cells_from_map = map_from_cells.inverse();
        Self { cells, map_from_cells, cells_from_map, room, zones }
    }

    /// What a robot of this radius may drive over.
    pub(crate) fn open_for(&self, radius: Clearance) -> OpenGround<'_> {
        let radius_m = radius.metres();
        let mut open = self.room.map(|room_m| f64::from(*room_m) > radius_m);
        let geometry = *open.geometry();
        self.close_border(&mut open, radius_m);
        for barrier in self.zones.barriers() {
            let near = self.cells_near(barrier, radius_m, geometry);
            for cell in near {
                if open[cell] && barrier.room_m(self.map_point(cell)) < radius_m {
                    open[cell] = false;
                }
            }
        }
        let labels = label_parts(&open);
        OpenGround { ground: self, radius_m, open, labels }
    }

    /// What is beyond the border is not known.
    fn close_border(&self, open: &mut Grid<bool>, radius_m: f64) {
        let geometry = *open.geometry();
        let band = (radius_m / geometry.resolution_m - 0.5).ceil().max(0.0);
        let band = (band as usize).min(geometry.width.max(geometry.height));
        let (width, height) = (geometry.width, geometry.height);
        for (index, cell) in open.values_mut().iter_mut().enumerate() {
            let (column, row) = (index % width, index / width);
            let inside = column.min(width - 1 - column).min(row).min(height - 1 - row);
            *cell &= inside >= band;
        }
    }

    /// The cells that a barrier may close: those around a no-go zone, or all.
    fn cells_near(
        &self,
        barrier: &Barrier,
        radius_m: f64,
        geometry: Geometry,
    ) -> impl Iterator<Item = Cell> + use<> {
        let zone = self.zones.zones().iter().find(|zone| zone.name == barrier.name());
        let around = zone.filter(|_| !barrier.is_stay_in()).map(|zone| {
            let reach_m = zone.margin.metres() + radius_m + geometry.resolution_m;
            self.surround(&zone.area, reach_m)
        });
        let [low, high] = around.map_or([Cell::new(0, 0), last_cell(geometry)], |points| {
            let cells = points.map(|point| geometry.cell_at(point));
            let columns = cells.map(|cell| cell.column);
            let rows = cells.map(|cell| cell.row);
            let last = last_cell(geometry);
            let least = |of: [i32; 4], last: i32| of.into_iter().min().unwrap_or(0).clamp(0, last);
            let most = |of: [i32; 4], last: i32| of.into_iter().max().unwrap_or(0).clamp(0, last);
            [
                Cell::new(least(columns, last.column), least(rows, last.row)),
                Cell::new(most(columns, last.column), most(rows, last.row)),
            ]
        });
        (low.row..=high.row).flat_map(move |row| {
            (low.column..=high.column).map(move |column| Cell::new(column, row))
        })
    }

    /// The corners of a rectangle around an area of the map, in the frame of the cells.
    fn surround(&self, area: &MapArea, reach_m: f64) -> [Point2; 4] {
        let (points, reach_m): (Vec<MapPoint>, f64) = match area {
            MapArea::Polygon(polygon) => (polygon.corners().to_vec(), reach_m),
            MapArea::Circle(circle) => (vec![circle.centre()], reach_m + circle.radius().metres()),
        };
        let range = |of: fn(MapPoint) -> f64| {
            let values = points.iter().map(|point| of(*point));
            let least = values.clone().fold(f64::INFINITY, f64::min) - reach_m;
            (least, values.fold(f64::NEG_INFINITY, f64::max) + reach_m)
        };
        let (x, y) = (range(MapPoint::x_m), range(MapPoint::y_m));
        [(x.0, y.0), (x.1, y.0), (x.1, y.1), (x.0, y.1)]
            .map(|(x_m, y_m)| self.cells_from_map.apply(Point2::new(x_m, y_m)))
    }

    fn map_point(&self, cell: Cell) -> Point2 {
        self.map_from_cells.apply(self.cells.geometry().centre(cell))
    }

    fn cell_point(&self, point: MapPoint) -> Point2 {
        self.cells_from_map.apply(Point2::new(point.x_m(), point.y_m()))
    }
}

fn last_cell(geometry: Geometry) -> Cell {
    Cell::new(geometry.width as i32 - 1, geometry.height as i32 - 1)
}

/// None of what closes nothing.
fn read_zone(zone: &DrawnZone) -> Option<MapZone> {
    let duty = match zone.kind {
        ZoneKind::NoGo => ZoneDuty::NoGo,
        ZoneKind::StayIn => ZoneDuty::StayIn,
        ZoneKind::Speed | ZoneKind::Observe => return None,
    };
    let (name, margin) = (zone.name.value.clone(), zone.margin);
    Some(MapZone { name, duty, margin, area: zone.area.value.clone() })
}

/// The ground that is open to robots of one radius. Two cells are connected if they have the same label;
/// 0 is closed.
#[derive(Debug)]
pub(crate) struct OpenGround<'a> {
    ground: &'a SiteGround,
    radius_m: f64,
    open: Grid<bool>,
    labels: Grid<u32>,
}

impl OpenGround<'_> {
    /// The cell of a point: if it is closed, an open one next to it, since a cell is only as exact as its
    /// size.
    fn cell_of(&self, point: MapPoint) -> Cell {
        let cell = self.open.geometry().cell_at(self.ground.cell_point(point));
        let is_open = |cell: &Cell| self.open.get(*cell) == Some(&true);
        if is_open(&cell) {
            return cell;
        }
        let mut neighbours = cell.edge_neighbours().chain(cell.neighbours());
        neighbours.find(is_open).unwrap_or(cell)
    }

    /// Whether a path between two points exists.
    pub(crate) fn is_connected(&self, from: MapPoint, to: MapPoint) -> bool {
        let label = |point| self.labels.get(self.cell_of(point)).copied().unwrap_or(0);
        label(from) != 0 && label(from) == label(to)
    }

    /// What blocks the best path between two points, if there is none that is free.
    pub(crate) fn find_obstacle(&self, from: MapPoint, to: MapPoint) -> Option<Obstacle> {
        if self.is_connected(from, to) {
            return None;
        }
        let (start, end) = (self.cell_of(from), self.cell_of(to));
        for (point, cell) in [(from, start), (to, end)] {
            if !self.open.geometry().contains(cell) {
                let at = Point2::new(point.x_m(), point.y_m());
                return Some(Obstacle { at, sort: ObstacleSort::Outside });
            }
        }
        let is_wall =
            |cell| self.ground.room.get(cell).is_none_or(|it| f64::from(*it) <= self.radius_m);
        find_blocked(&self.open, start, end, is_wall).map(|cell| self.describe(cell))
    }

    /// The first closed cell of the straight line between two points.
    pub(crate) fn find_on_line(&self, from: MapPoint, to: MapPoint) -> Option<Obstacle> {
        let geometry = self.open.geometry();
        let (start, end) = (self.ground.cell_point(from), self.ground.cell_point(to));
        // The ends may be in closed cells next to open ones.
        let is_free = |point| self.open.get(self.cell_of(point)) == Some(&true);
        let ends = [(start, is_free(from)), (end, is_free(to))];
        let is_end = |cell: Cell| {
            ends.iter().any(|(point, is_free)| *is_free && geometry.cell_at(*point) == cell)
        };
        let mut cells = traverse(geometry, start, end);
        let closed = cells.find(|cell| self.open.get(*cell) != Some(&true) && !is_end(*cell))?;
        if geometry.contains(closed) {
            return Some(self.describe(closed));
        }
        let at = self.ground.map_from_cells.apply(geometry.centre(closed));
        Some(Obstacle { at, sort: ObstacleSort::Outside })
    }

    /// The length of the shortest path between two points, in metres; none if there is none.
    pub(crate) fn length_m(&self, from: MapPoint, to: MapPoint) -> Option<f64> {
        let length = find_length(&self.open, self.cell_of(from), self.cell_of(to))?;
        Some(self.as_metres(length).max(from.distance_m(to)))
    }

    /// The directions in which the shortest path between two points begins and ends, in radians in the frame
    /// of the map: of the straight lines to the last point that is seen from its begin, and from the first
    /// one that sees its end. None if there is no path.
    pub(crate) fn directions_rad(&self, from: MapPoint, to: MapPoint) -> Option<[f64; 2]> {
        let path = find_path(&self.open, self.cell_of(from), self.cell_of(to))?;
        let (first, last) = (*path.first()?, *path.last()?);
        let seen = path.iter().skip(1).take_while(|cell| self.is_open_between(first, **cell));
        let sees = path.iter().rev().skip(1).take_while(|cell| self.is_open_between(**cell, last));
        let direction = |from: Cell, to: Cell| {
            self.ground.map_point(from).bearing_rad(self.ground.map_point(to))
        };
        Some([direction(first, *seen.last()?), direction(*sees.last()?, last)])
    }

    /// Whether the straight line between the centres of two cells is open.
    fn is_open_between(&self, from: Cell, to: Cell) -> bool {
        let geometry = self.open.geometry();
        let mut cells = traverse(geometry, geometry.centre(from), geometry.centre(to));
        cells.all(|cell| self.open.get(cell) == Some(&true))
    }

    /// The lengths of the shortest paths to a point from everywhere.
    pub(crate) fn measure_to(&self, to: MapPoint) -> Grid<u32> {
        measure_all(&self.open, self.cell_of(to))
    }

    /// The length from a point that was measured, in metres.
    pub(crate) fn measured_m(&self, lengths: &Grid<u32>, from: MapPoint) -> Option<f64> {
        let length =
            lengths.get(self.cell_of(from)).copied().filter(|length| *length < u32::MAX)?;
        Some(self.as_metres(u64::from(length)))
    }

    fn as_metres(&self, length: u64) -> f64 {
        length as f64 / PER_CELL * self.open.geometry().resolution_m
    }

    fn describe(&self, cell: Cell) -> Obstacle {
        let at = self.ground.map_point(cell);
        let barrier = self.ground.zones.barrier_at(at, self.radius_m);
        let sort = match (self.ground.cells.get(cell), barrier) {
            (Some(Occupancy::Occupied), _) => ObstacleSort::Wall,
            (Some(Occupancy::Unknown), _) => ObstacleSort::Unknown,
            (_, Some(barrier)) if barrier.is_stay_in() => {
                ObstacleSort::Boundary(barrier.name().to_owned())
            }
            (_, Some(barrier)) => ObstacleSort::Zone(barrier.name().to_owned()),
            (Some(_), None) => ObstacleSort::Narrow,
            (None, None) => ObstacleSort::Outside,
        };
        Obstacle { at, sort }
    }
}

/// Gives each connected part of the open cells a number from 1.
fn label_parts(open: &Grid<bool>) -> Grid<u32> {
    let mut labels = Grid::filled(*open.geometry(), 0_u32);
    let is_open = |cell: Cell| open.get(cell) == Some(&true);
    let (mut next_label, mut queue) = (0, Vec::new());
    for first in open.geometry().cells() {
        if !is_open(first) || labels[first] != 0 {
            continue;
        }
        next_label += 1;
        labels[first] = next_label;
        queue.push(first);
        // A diagonal step needs both cells next to it, so that four neighbours suffice.
        while let Some(cell) = queue.pop() {
            for next in cell.edge_neighbours() {
                if is_open(next) && labels[next] == 0 {
                    labels[next] = next_label;
                    queue.push(next);
                }
            }
        }
    }
    labels
}
