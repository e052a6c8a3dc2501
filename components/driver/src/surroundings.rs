//! What is near the robot, as points in its own frame: what the laser sees now and, behind its
//! back, what the map shows.

use std::f64::consts::TAU;

use armor_grid::{Grid, Occupancy, Point2, Pose2, wrap_angle};

/// One laser scan.
#[derive(Clone, Debug, PartialEq)]
pub struct DriverScan {
    /// When it was taken, in seconds.
    pub stamp_s: f64,
    /// Where the laser sits on the robot.
    pub robot_from_laser: Pose2,
    /// Direction of the first beam in the laser's frame, in radians.
    pub first_rad: f64,
    /// Turn from beam to beam, in radians.
    pub step_rad: f64,
    /// Distances, in metres; infinite where nothing is in sight, not a number where the laser is
    /// blind.
    pub ranges_m: Vec<f64>,
}

impl DriverScan {
    /// Returns the points it hit, in the frame of the robot when it was taken.
    fn scan_points(&self) -> impl Iterator<Item = Point2> {
        self.ranges_m.iter().enumerate().filter(|(_, range_m)| range_m.is_finite()).map(
            |(beam, range_m)| {
                let (sin, cos) = (self.first_rad + beam as f64 * self.step_rad).sin_cos();
                self.robot_from_laser.apply(Point2::new(range_m * cos, range_m * sin))
            },
        )
    }

    /// Returns whether any beam was a reading.
    pub(crate) fn has_ranges(&self) -> bool {
        let angles = [self.stamp_s, self.first_rad, self.step_rad];
        angles.iter().all(|value| value.is_finite()) && !self.ranges_m.iter().all(|r| r.is_nan())
    }

    /// Returns whether a point in the robot's frame lies in the sector that the laser looks over.
    fn covers(&self, point: Point2) -> bool {
        let in_laser = self.robot_from_laser.inverse().apply(point);
        let bearing_rad = Point2::default().bearing_rad(in_laser);
        let span_rad = self.step_rad * self.ranges_m.len().saturating_sub(1) as f64;
        let (middle_rad, half_rad) = (self.first_rad + span_rad / 2.0, span_rad.abs() / 2.0);
        wrap_angle(bearing_rad - middle_rad).abs() <= half_rad + self.step_rad.abs()
    }

    fn is_all_round(&self) -> bool {
        self.step_rad.abs() * self.ranges_m.len() as f64 > TAU - 0.1
    }
}

/// Returns everything within `reach_m`, in the robot's frame now.
///
/// `now_from_then` is the frame of the robot when the scan was taken, seen from now.
pub(crate) fn list_obstacles(
    scan: &DriverScan,
    now_from_then: Pose2,
    map: Option<(&Grid<Occupancy>, Pose2)>,
    reach_m: f64,
) -> Vec<Point2> {
    let near = |point: &Point2| point.distance_m(Point2::default()) < reach_m;
    let mut points: Vec<Point2> =
        scan.scan_points().map(|point| now_from_then.apply(point)).filter(near).collect();
    if let Some((map, map_from_robot)) = map.filter(|_| !scan.is_all_round()) {
        let remembered = occupied_near(map, map_from_robot, reach_m);
        points.extend(remembered.into_iter().filter(near).filter(|point| !scan.covers(*point)));
    }
    points
}

fn occupied_near(map: &Grid<Occupancy>, map_from_robot: Pose2, reach_m: f64) -> Vec<Point2> {
    let geometry = map.geometry();
    let robot_from_map = map_from_robot.inverse();
    let middle = geometry.cell_at(map_from_robot.point());
    let reach = (reach_m / geometry.resolution_m).ceil() as i32;
    (-reach..=reach)
        .flat_map(|rows| (-reach..=reach).map(move |columns| middle.offset(columns, rows)))
        .filter(|&cell| map.get(cell) == Some(&Occupancy::Occupied))
        .map(|cell| robot_from_map.apply(geometry.centre(cell)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_grid::{Cell, Geometry};
    use std::f64::consts::{FRAC_PI_2, PI};

    fn half_circle(range_m: f64) -> DriverScan {
        DriverScan {
            stamp_s: 0.0,
            robot_from_laser: Pose2::new(0.1, 0.0, 0.0),
            first_rad: -FRAC_PI_2,
            step_rad: PI / 180.0,
            ranges_m: vec![range_m; 181],
        }
    }

    #[test]
    fn beams_become_points_in_the_robots_frame_now() {
        let mut scan = half_circle(f64::INFINITY);
        scan.ranges_m[90] = 1.0;
        let moved_on = Pose2::new(-0.2, 0.0, 0.0);
        let points = list_obstacles(&scan, moved_on, None, 1.5);
        assert_eq!(points.len(), 1);
        assert!(points[0].distance_m(Point2::new(0.9, 0.0)) < 1e-9, "{points:?}");
    }

    #[test]
    fn the_map_is_used_behind_the_laser_only() {
        let geometry =
            Geometry { origin: Point2::new(-2.0, -2.0), resolution_m: 0.1, width: 40, height: 40 };
        let mut map = Grid::filled(geometry, Occupancy::Free);
        map[Cell::new(10, 20)] = Occupancy::Occupied;
        map[Cell::new(30, 20)] = Occupancy::Occupied;
        let scan = half_circle(f64::INFINITY);
        let points = list_obstacles(&scan, Pose2::IDENTITY, Some((&map, Pose2::IDENTITY)), 1.5);
        assert_eq!(points.len(), 1);
        assert!(points[0].x_m < -0.9, "{points:?}");
    }
}
