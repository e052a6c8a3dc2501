//! From an occupancy grid to what driving costs: cells closer to an obstacle than the robot's
//! radius are closed, cells a little further off cost more, open space costs its length.

use crate::{Cell, Geometry, Grid, Point2, distance_transform, traverse};

/// What is known about a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occupancy {
    /// Seen, and empty.
    Free,
    /// Not seen yet, or undecided.
    Unknown,
    /// Seen, and not empty.
    Occupied,
}

/// Where probability turns into knowledge, as in `map_server`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Cells below this probability are free (0..1).
    pub free: f64,
    /// Cells above this probability are occupied (0..1).
    pub occupied: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { free: 0.196, occupied: 0.65 }
    }
}

impl Thresholds {
    /// All that was ever seen and is not occupied counts as free: what an explorer asks, where
    /// the default asks what a planner may rely on.
    pub const SEEN: Self = Self { free: 0.65, occupied: 0.65 };

    /// Classifies a cell of an occupancy grid message: 0..=100 percent, negative for unknown.
    pub fn classify(&self, percent: i8) -> Occupancy {
        let probability = f64::from(percent) / 100.0;
        if percent < 0 {
            Occupancy::Unknown
        } else if probability > self.occupied {
            Occupancy::Occupied
        } else if probability < self.free {
            Occupancy::Free
        } else {
            Occupancy::Unknown
        }
    }
}

impl Grid<Occupancy> {
    /// Classifies the cells of an occupancy grid message, row-major; `None` if their number does
    /// not fit the geometry.
    pub fn classified(geometry: Geometry, percent: &[i8]) -> Option<Self> {
        Self::classified_by(Thresholds::default(), geometry, percent)
    }

    /// Classifies the cells of an occupancy grid message by given thresholds.
    pub fn classified_by(
        thresholds: Thresholds,
        geometry: Geometry,
        percent: &[i8],
    ) -> Option<Self> {
        Self::from_values(geometry, percent.iter().map(|cell| thresholds.classify(*cell)).collect())
    }
}

/// How obstacles are grown for a round robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inflation {
    /// Centres closer than this to an obstacle are closed, in metres.
    pub radius_m: f64,
    /// Centres closer than this to an obstacle cost more, in metres.
    pub comfort_m: f64,
    /// How many times its length a path costs at `radius_m`, on top; falls to 0 at `comfort_m`.
    pub weight: f64,
    /// Times its length a path through unknown cells costs, on top; `None` closes them.
    pub unknown_weight: Option<f64>,
}

/// The cost of driving through each cell, and how far the next obstacle is.
#[derive(Clone, Debug)]
pub struct CostMap {
    /// Cost per metre, at least 1; infinite where closed.
    factor: Grid<f32>,
    clearance_m: Grid<f32>,
}

impl CostMap {
    /// Grows the occupied cells of a map.
    pub fn new(map: &Grid<Occupancy>, inflation: &Inflation) -> Self {
        let clearance_m = distance_transform(&map.map(|&o| o == Occupancy::Occupied));
        let mut factor = Grid::filled(*map.geometry(), f32::INFINITY);
        let inputs = map.values().iter().zip(clearance_m.values());
        for (out, (&occupancy, &clearance_m)) in factor.values_mut().iter_mut().zip(inputs) {
            *out = inflation.factor(occupancy, clearance_m);
        }
        Self { factor, clearance_m }
    }

    /// Changes what the open cells cost: `change` takes each of them and its cost per metre, and
    /// returns the new one, at least 1; infinite closes it.
    pub fn change_open_cells(&mut self, mut change: impl FnMut(Cell, f32) -> f32) {
        let geometry = *self.geometry();
        for (index, factor) in self.factor.values_mut().iter_mut().enumerate() {
            if factor.is_finite() {
                *factor = change(geometry.cell(index), *factor);
            }
        }
    }

    /// Returns where the map lies.
    pub const fn geometry(&self) -> &Geometry {
        self.factor.geometry()
    }

    /// Returns the cost per metre in a cell, at least 1; `None` where closed or outside.
    pub fn factor(&self, cell: Cell) -> Option<f32> {
        self.factor.get(cell).copied().filter(|factor| factor.is_finite())
    }

    /// Returns whether a robot's centre may be in a cell.
    pub fn is_open(&self, cell: Cell) -> bool {
        self.factor(cell).is_some()
    }

    /// Returns the distance from a point's cell to the nearest obstacle, in metres; infinite
    /// outside.
    pub fn clearance_m(&self, point: Point2) -> f64 {
        self.clearance_m.at(point).map_or(f64::INFINITY, |&m| f64::from(m))
    }

    /// Returns the open cell nearest to a point within `reach_m`: the point's own first, then those
    /// straight to which nothing stands, then any.
    pub fn nearest_open(&self, point: Point2, reach_m: f64) -> Option<Cell> {
        let middle = self.geometry().cell_at(point);
        if self.is_open(middle) {
            return Some(middle);
        }
        let reach = (reach_m / self.geometry().resolution_m).ceil() as i32;
        let around = (-reach..=reach)
            .flat_map(|rows| (-reach..=reach).map(move |columns| middle.offset(columns, rows)));
        around
            .filter(|&cell| self.is_open(cell))
            .map(|cell| (cell, self.geometry().centre(cell).distance_m(point)))
            .filter(|&(_, away_m)| away_m <= reach_m)
            .map(|(cell, away_m)| (self.is_walled_off(point, cell), away_m, cell))
            .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
            .map(|(_, _, cell)| cell)
    }
}

impl CostMap {
    /// Whether something stands between a point and a cell.
    fn is_walled_off(&self, from: Point2, to: Cell) -> bool {
        traverse(self.geometry(), from, self.geometry().centre(to))
            .any(|cell| self.clearance_m.get(cell) == Some(&0.0))
    }
}

impl Inflation {
    fn factor(&self, occupancy: Occupancy, clearance_m: f32) -> f32 {
        let clearance_m = f64::from(clearance_m);
        if occupancy == Occupancy::Occupied || clearance_m < self.radius_m {
            return f32::INFINITY;
        }
        let unknown = match (occupancy, self.unknown_weight) {
            (Occupancy::Unknown, None) => return f32::INFINITY,
            (Occupancy::Unknown, Some(weight)) => weight,
            _ => 0.0,
        };
        (1.0 + self.near_factor(clearance_m) + unknown) as f32
    }

    /// Returns how many times its length a path costs on top, this far from something that must not
    /// be touched.
    pub fn near_factor(&self, clearance_m: f64) -> f64 {
        let comfort = (self.comfort_m - clearance_m) / (self.comfort_m - self.radius_m);
        if comfort > 0.0 { self.weight * comfort * comfort } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::tests::ascii_map;

    const INFLATION: Inflation =
        Inflation { radius_m: 0.15, comfort_m: 0.35, weight: 4.0, unknown_weight: None };

    #[test]
    fn thresholds_are_those_of_map_server() {
        let check = |percent, expected| {
            assert_eq!(Thresholds::default().classify(percent), expected, "{percent}");
        };
        check(-1, Occupancy::Unknown);
        check(0, Occupancy::Free);
        check(19, Occupancy::Free);
        check(20, Occupancy::Unknown);
        check(65, Occupancy::Unknown);
        check(66, Occupancy::Occupied);
        check(100, Occupancy::Occupied);
    }

    #[test]
    fn cost_falls_with_the_distance_to_the_wall() {
        let map = CostMap::new(&ascii_map(0.1, &["#......."]), &INFLATION);
        let factors: Vec<_> = (0..8).map(|c| map.factor(Cell::new(c, 0))).collect();
        assert_eq!(factors[..2], [None, None]);
        assert!(factors[2] > factors[3] && factors[3] > factors[4]);
        assert_eq!(factors[4..], [Some(1.0); 4]);
    }

    #[test]
    fn unknown_is_closed_or_dear() {
        let map = ascii_map(0.1, &["..?."]);
        assert!(!CostMap::new(&map, &INFLATION).is_open(Cell::new(2, 0)));
        let costly = Inflation { unknown_weight: Some(3.0), ..INFLATION };
        assert_eq!(CostMap::new(&map, &costly).factor(Cell::new(2, 0)), Some(4.0));
    }

    #[test]
    fn open_cells_become_closed_or_costlier_and_closed_ones_stay() {
        let mut map = CostMap::new(&ascii_map(0.1, &["#......."]), &INFLATION);
        map.change_open_cells(|cell, factor| match cell.column {
            6 => f32::INFINITY,
            7 => factor + 2.0,
            _ => factor,
        });
        let factors: Vec<_> = [1, 5, 6, 7].map(|c| map.factor(Cell::new(c, 0))).into();
        assert_eq!(factors, [None, Some(1.0), None, Some(3.0)]);
    }

    #[test]
    fn the_nearest_open_cell_is_found_within_reach() {
        let map = CostMap::new(&ascii_map(0.1, &["#......."]), &INFLATION);
        let at_wall = Point2::new(0.05, 0.05);
        assert_eq!(map.nearest_open(at_wall, 0.5), Some(Cell::new(2, 0)));
        assert_eq!(map.nearest_open(at_wall, 0.1), None);
        let open = Point2::new(0.55, 0.05);
        assert_eq!(map.nearest_open(open, 0.0), Some(Cell::new(5, 0)));
        // Between two walls, the nearest open cell is behind one of them.
        let rows = ["........", "........", "..#.....", "..#..#..", "..#..#.."];
        let pocket = CostMap::new(&ascii_map(0.1, &rows), &INFLATION);
        assert_eq!(pocket.nearest_open(Point2::new(0.35, 0.05), 0.5), Some(Cell::new(4, 3)));
        // As near to the centre of the cell before it as to that of its own.
        let on_edge = Point2::new(0.5, 0.05);
        assert_eq!(map.nearest_open(on_edge, 0.5), Some(map.geometry().cell_at(on_edge)));
    }
}
