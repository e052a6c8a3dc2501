//! Homing as a component: poses in, goals out.

use armor_convert::{build_stamped_pose, read_robot_pose};
use armor_grid::Pose2;
use armor_sdk::prelude::*;

use crate::homecoming::{Homecoming, HomingStep};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct HomingParameters {
    /// home on the map, along x
    #[parameter(unit = "m", default = "0m")]
    x_m: f64,
    /// home on the map, along y
    #[parameter(unit = "m", default = "0m")]
    y_m: f64,
    /// heading at home
    #[parameter(unit = "deg", default = "0deg")]
    theta_rad: f64,
    /// the robot is home within this
    #[parameter(unit = "m", default = "0.25m", range = 0.02..=10.0)]
    tolerance_m: f64,
}

impl HomingParameters {
    fn homecoming(&self) -> Homecoming {
        Homecoming::new(Pose2::new(self.x_m, self.y_m, self.theta_rad), self.tolerance_m)
    }
}

/// Sends the robot home and reports when it has arrived.
pub struct Homing {
    armor: Armor,
    parameters: HomingParameters,
    homecoming: Homecoming,
    pace: ProgressPace,
}

impl Homing {
    fn publish_progress(&mut self, now_s: f64, task: &str) -> Result<(), Fault> {
        let homecoming = &self.homecoming;
        let describe = || {
            let distance = homecoming.distance_m().map(|left_m| format!("{left_m:.1} m to home"));
            (homecoming.done_share(), distance.unwrap_or_else(|| "no pose yet".into()))
        };
        if let Some(progress) = self.pace.next_progress(now_s, task, describe) {
            self.armor.send_data("progress", &progress)?;
        }
        Ok(())
    }
}

impl Component for Homing {
    const KIND: &'static str = "homing";
    const SUMMARY: &'static str = "Sends the robot home and reports when it has arrived.";
    const PARAMETERS: &'static [Parameter] = HomingParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is on the map"),
        ("goal", "home, at every tick until the robot has arrived"),
        ("progress", "the straight distance to home, once per second"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        armor.provide::<Progress>("progress")?;
        let parameters = HomingParameters::request(&armor)?;
        let homecoming = parameters.homecoming();
        Ok(Self { armor, parameters, homecoming, pace: ProgressPace::default() })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.homecoming.pose_seen(read_robot_pose(&data.decode()?));
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.homecoming = self.parameters.homecoming();
        }
        let now_s = self.armor.timestamp();
        if call == Call::Stopping {
            self.publish_progress(now_s, "")?;
            return Ok(Outcome::CarryOn);
        }
        match self.homecoming.step(now_s) {
            HomingStep::Home => {
                self.publish_progress(now_s, "at home")?;
                Ok(Outcome::Done)
            }
            HomingStep::Goto(home) => {
                self.armor.send_data("goal", &build_stamped_pose(now_s, "map", home))?;
                self.publish_progress(now_s, "returning home")?;
                Ok(Outcome::CarryOn)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_convert::build_pose;
    use armor_sdk::testing::{ReportKind, TestError, TestedComponent};

    use super::*;

    const TICK: Duration = Duration::from_millis(100);

    fn seen_at(x_m: f64, y_m: f64) -> PoseWithCovarianceStamped {
        let mut seen = PoseWithCovarianceStamped::default();
        seen.pose.pose = build_pose(Pose2::new(x_m, y_m, 0.0));
        seen
    }

    #[test]
    fn the_goal_is_home_until_the_robot_has_stayed_there() -> Result<(), TestError> {
        let mut homing = TestedComponent::build::<Homing>(&[("x", "2m"), ("y", "50cm")])?;
        homing.start()?;
        homing.send("pose", &seen_at(0.0, 0.0))?;
        homing.tick_after(TICK)?;
        let goal = homing.last_output::<PoseStamped>("goal")?;
        assert_eq!((goal.pose.position.x, goal.pose.position.y), (2.0, 0.5));
        assert_eq!((goal.stamp, goal.frame.as_str()), (homing.timestamp(), "map"));
        homing.send("pose", &seen_at(2.1, 0.4))?;
        homing.tick_after(TICK)?;
        assert_eq!(homing.reports(), [], "it may only be driving past");
        homing.tick_after(TICK * 10)?;
        assert_eq!(homing.reports(), [ReportKind::Done]);
        Ok(())
    }
}
