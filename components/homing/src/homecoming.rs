//! Decides whether the robot is home: only after it has stayed there, so that driving past does not
//! count.

use armor_grid::Pose2;

/// The robot must be seen at home for this long, in seconds.
const STAY_S: f64 = 0.5;

/// What to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HomingStep {
    /// Drive there.
    Goto(Pose2),
    /// The robot is home.
    Home,
}

/// One return home. Time is passed in: there is no clock.
#[derive(Clone, Copy, Debug)]
pub struct Homecoming {
    home: Pose2,
    tolerance_m: f64,
    robot: Option<Pose2>,
    there_since_s: Option<f64>,
    /// The longest distance from home so far, in metres.
    farthest_m: f64,
}

impl Homecoming {
    /// Home is a pose on the map; within `tolerance_m` of it the robot has arrived.
    pub fn new(home: Pose2, tolerance_m: f64) -> Self {
        Self { home, tolerance_m, robot: None, there_since_s: None, farthest_m: 0.0 }
    }

    /// Takes the robot's pose on the map.
    pub fn pose_seen(&mut self, map_from_robot: Pose2) {
        if map_from_robot.is_finite() {
            self.robot = Some(map_from_robot);
            let distance_m = map_from_robot.point().distance_m(self.home.point());
            self.farthest_m = self.farthest_m.max(distance_m);
        }
    }

    /// Returns the straight distance from the robot to home, in metres, if its pose is known.
    pub fn distance_m(&self) -> Option<f64> {
        self.robot.map(|robot| robot.point().distance_m(self.home.point()))
    }

    /// Returns the share of the return that is done, 0 … 1, if the robot's pose is known: 0 at the
    /// longest distance from home so far, 1 at home.
    pub fn done_share(&self) -> Option<f64> {
        let distance_m = self.distance_m()?;
        Some(if distance_m <= self.tolerance_m { 1.0 } else { 1.0 - distance_m / self.farthest_m })
    }

    /// Decides at time `now_s`.
    pub fn step(&mut self, now_s: f64) -> HomingStep {
        let home = self.home.point();
        let is_there =
            self.robot.is_some_and(|robot| robot.point().distance_m(home) <= self.tolerance_m);
        self.there_since_s = is_there.then(|| self.there_since_s.unwrap_or(now_s));
        match self.there_since_s {
            Some(since_s) if now_s - since_s >= STAY_S => HomingStep::Home,
            _ => HomingStep::Goto(self.home),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Poses on the x axis, one every 0.2 s, and when home is reported.
    fn check(xs_m: &[f64], expected_at: Option<usize>) {
        let mut homecoming = Homecoming::new(Pose2::IDENTITY, 0.25);
        let reported = xs_m.iter().enumerate().position(|(index, x_m)| {
            homecoming.pose_seen(Pose2::new(*x_m, 0.0, 1.0));
            homecoming.step(index as f64 * 0.2) == HomingStep::Home
        });
        assert_eq!(reported, expected_at, "{xs_m:?}");
    }

    #[test]
    fn home_is_where_the_robot_stays() {
        check(&[1.0, 0.5, 0.2, 0.2, 0.2, 0.2], Some(5));
        check(&[0.3, 0.2, 0.0, -0.2, -0.4, -0.6], None);
        check(&[0.2, 0.3, 0.2, 0.1, 0.0, 0.0, 0.0], Some(5));
    }

    #[test]
    fn progress_is_measured_from_the_longest_distance() {
        let mut homecoming = Homecoming::new(Pose2::IDENTITY, 0.25);
        assert_eq!((homecoming.distance_m(), homecoming.done_share()), (None, None));
        for (x_m, share) in [(2.0, 0.0), (4.0, 0.0), (1.0, 0.75), (3.0, 0.25), (0.2, 1.0)] {
            homecoming.pose_seen(Pose2::new(x_m, 0.0, 0.0));
            assert_eq!(
                (homecoming.distance_m(), homecoming.done_share()),
                (Some(x_m), Some(share))
            );
        }
    }

    #[test]
    fn without_a_pose_it_is_not_home() {
        let mut homecoming = Homecoming::new(Pose2::IDENTITY, 0.25);
        assert_eq!(homecoming.step(0.0), HomingStep::Goto(Pose2::IDENTITY));
        assert_eq!(homecoming.step(9.0), HomingStep::Goto(Pose2::IDENTITY));
    }
}
