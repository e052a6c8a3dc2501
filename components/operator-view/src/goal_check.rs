//! Whether the robot can be sent to a place of the map: asked at the click, before the goal is sent.

use armor_grid::{Occupancy, Point2, Thresholds};

use crate::map::OccupancyMap;

/// Most cells that are searched for a connection, so that a click at a large map delays neither the
/// window nor STOP; a goal beyond is for the planner to judge.
const MAX_SEARCHED: usize = 2_000_000;

/// Why there can be no goal at a place of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GoalRefusal {
    /// The place is not on the map.
    #[error("this place is off the map")]
    OffTheMap,
    /// The map does not know the place.
    #[error("this place is unknown: the robot has not seen it")]
    Unknown,
    /// An obstacle is at the place, or so near that the robot does not fit.
    #[error("there is an obstacle: the robot does not fit there")]
    Obstacle,
    /// Obstacles are all around it, or around the robot.
    #[error("this place cannot be reached: obstacles enclose it")]
    Unreachable,
}

/// Checks a goal at `place` for a robot of `radius_m` at `robot`.
///
/// A place that passes may still have no path: the planner keeps a larger distance to obstacles.
///
/// # Errors
/// If the robot certainly cannot drive there.
pub fn check_goal(
    map: &OccupancyMap,
    robot: Option<Point2>,
    place: Point2,
    radius_m: f64,
) -> Result<(), GoalRefusal> {
    let grid = Grid::of(map);
    let goal = grid.cell_at(place).ok_or(GoalRefusal::OffTheMap)?;
    match grid.occupancy(goal) {
        Occupancy::Unknown => return Err(GoalRefusal::Unknown),
        Occupancy::Occupied => return Err(GoalRefusal::Obstacle),
        Occupancy::Free => {}
    }
    if grid.is_blocked_around(goal, radius_m) {
        return Err(GoalRefusal::Obstacle);
    }
    match robot.and_then(|robot| grid.cell_at(robot)) {
        Some(robot) if !grid.is_connected(robot, goal) => Err(GoalRefusal::Unreachable),
        _ => Ok(()),
    }
}

/// The cells of a map: column and row.
struct Grid<'a> {
    map: &'a OccupancyMap,
    thresholds: Thresholds,
}

impl<'a> Grid<'a> {
    fn of(map: &'a OccupancyMap) -> Self {
        Self { map, thresholds: Thresholds::SEEN }
    }

    fn size(&self) -> [usize; 2] {
        [self.map.layout().width, self.map.layout().height]
    }

    fn cell_at(&self, place: Point2) -> Option<[usize; 2]> {
        let layout = self.map.layout();
        let local = layout.corner.inverse().apply(place);
        let index = |length_m: f64, count: usize| {
            let cell = (length_m / layout.resolution_m).floor();
            (cell >= 0.0 && cell < count as f64).then_some(cell as usize)
        };
        Some([index(local.x_m, layout.width)?, index(local.y_m, layout.height)?])
    }

    fn occupancy(&self, [column, row]: [usize; 2]) -> Occupancy {
        let cell = self.map.cell(column, row);
        self.thresholds.classify(cell)
    }

    /// Whether an obstacle is nearer than the radius.
    fn is_blocked_around(&self, [column, row]: [usize; 2], radius_m: f64) -> bool {
        let reach = (radius_m / self.map.layout().resolution_m).min(1000.0);
        let cells = reach.floor() as usize;
        let [width, height] = self.size();
        let rows = row.saturating_sub(cells)..=(row + cells).min(height - 1);
        rows.into_iter().any(|y| {
            let columns = column.saturating_sub(cells)..=(column + cells).min(width - 1);
            columns.into_iter().any(|x| {
                let away = (x.abs_diff(column) as f64).hypot(y.abs_diff(row) as f64);
                away <= reach && self.occupancy([x, y]) == Occupancy::Occupied
            })
        })
    }

    /// Whether cells without an obstacle connect two cells. Unknown cells count as passable, as for
    /// the planner.
    fn is_connected(&self, from: [usize; 2], to: [usize; 2]) -> bool {
        let [width, height] = self.size();
        let mut is_seen = vec![false; width * height];
        let mut open = vec![from];
        is_seen[from[1] * width + from[0]] = true;
        let mut searched = 0;
        while let Some([column, row]) = open.pop() {
            searched += 1;
            if [column, row] == to || searched > MAX_SEARCHED {
                return true;
            }
            let neighbours = [
                (column > 0).then(|| [column - 1, row]),
                (column + 1 < width).then(|| [column + 1, row]),
                (row > 0).then(|| [column, row - 1]),
                (row + 1 < height).then(|| [column, row + 1]),
            ];
            for next in neighbours.into_iter().flatten() {
                let seen = &mut is_seen[next[1] * width + next[0]];
                if !*seen && self.occupancy(next) != Occupancy::Occupied {
                    *seen = true;
                    open.push(next);
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapLayout;
    use armor_grid::Pose2;

    /// A room of 10 × 10 cells of 0.1 m with a wall at column 5, and unknown cells right of column 8.
    fn room(wall_rows: std::ops::Range<usize>) -> OccupancyMap {
        let mut cells = vec![0; 100];
        for row in 0..10 {
            if wall_rows.contains(&row) {
                cells[row * 10 + 5] = 100;
            }
            cells[row * 10 + 9] = -1;
        }
        let corner = Pose2::new(-1.0, 0.0, 0.0);
        let layout = MapLayout { corner, resolution_m: 0.1, width: 10, height: 10 };
        let mut map = OccupancyMap::default();
        map.replace(1.0, layout, cells).unwrap();
        map
    }

    #[test]
    fn each_place_that_cannot_be_reached_has_its_reason() {
        let robot = Some(Point2::new(-0.85, 0.45));
        let check = |map: &OccupancyMap, x_m: f64, radius_m: f64| {
            check_goal(map, robot, Point2::new(x_m, 0.45), radius_m)
        };
        let open = room(0..8);
        assert_eq!(check(&open, -0.25, 0.1), Ok(()));
        assert_eq!(check(&open, -2.0, 0.1), Err(GoalRefusal::OffTheMap));
        assert_eq!(check(&open, f64::NAN, 0.1), Err(GoalRefusal::OffTheMap));
        assert_eq!(check(&open, -0.05, 0.1), Err(GoalRefusal::Unknown));
        assert_eq!(check(&open, -0.45, 0.1), Err(GoalRefusal::Obstacle));
        assert_eq!(check(&open, -0.65, 0.25), Err(GoalRefusal::Obstacle), "it does not fit");
        assert_eq!(check(&room(0..10), -0.25, 0.1), Err(GoalRefusal::Unreachable));
    }

    #[test]
    fn without_a_place_of_the_robot_only_the_place_itself_is_checked() {
        assert_eq!(check_goal(&room(0..10), None, Point2::new(-0.25, 0.45), 0.1), Ok(()));
    }
}
