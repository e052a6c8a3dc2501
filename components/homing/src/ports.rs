//! Homing as a component: poses in, goals out.

use armor_convert::{FrameNews, FrameWatch, build_stamped_pose, read_robot_pose};
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
    frames: FrameWatch,
    /// Whether it was reported, in this activation, that home is in another frame.
    is_reported: bool,
    pace: ProgressPace,
}

/// The frame of home: the coordinates of the file belong to its first epoch.
const FRAME: &str = "map";

/// What it reports to the mission.
#[derive(Debug, Events)]
enum HomingEvent {
    /// the map frame has another origin: where home is in it is unknown, and no goal is sent
    FrameChanged,
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

    const EVENTS: &'static [DeclaredEvent] = HomingEvent::DECLARED;
    const ENDS_BY_ITSELF: bool = true;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        armor.provide::<Progress>("progress")?;
        let parameters = HomingParameters::request(&armor)?;
        let homecoming = parameters.homecoming();
        let (frames, pace) = (FrameWatch::default(), ProgressPace::default());
        Ok(Self { armor, parameters, homecoming, frames, is_reported: false, pace })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let pose: PoseWithCovarianceStamped = data.decode()?;
        if self.frames.frame_seen(&pose.frame) == FrameNews::Changed {
            self.homecoming = self.parameters.homecoming();
        }
        if self.frames.is_usable(FRAME) {
            self.homecoming.pose_seen(read_robot_pose(&pose));
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.homecoming = self.parameters.homecoming();
            self.is_reported = false;
        }
        let now_s = self.armor.timestamp();
        if call == Call::Stopping {
            self.publish_progress(now_s, "")?;
            return Ok(Outcome::CarryOn);
        }
        if !self.frames.is_usable(FRAME) {
            self.publish_progress(now_s, "home is in another map frame")?;
            let is_reported = std::mem::replace(&mut self.is_reported, true);
            return Ok(if is_reported {
                Outcome::CarryOn
            } else {
                HomingEvent::FrameChanged.into()
            });
        }
        match self.homecoming.step(now_s) {
            HomingStep::Home => {
                self.publish_progress(now_s, "at home")?;
                Ok(Outcome::Done)
            }
            HomingStep::Goto(home) => {
                self.armor.send_data("goal", &build_stamped_pose(now_s, FRAME, home))?;
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

    #[test]
    fn in_another_epoch_there_is_no_home() -> Result<(), TestError> {
        let mut homing = TestedComponent::build::<Homing>(&[])?;
        let changed = || ReportKind::Event { name: "frame_changed".into(), value: 1.0 };
        // The origin of the new frame is where the robot stands, not home.
        let seen = PoseWithCovarianceStamped { frame: "map#3f2a".into(), ..seen_at(0.0, 0.0) };
        for activation in 0..2 {
            homing.start()?;
            homing.send("pose", &seen)?;
            for _ in 0..10 {
                homing.tick_after(TICK)?;
            }
            assert_eq!(homing.reports(), vec![changed(); activation + 1], "once in each");
            homing.stop()?;
        }
        let goals = homing.outputs::<PoseStamped>("goal")?;
        assert_eq!(goals.len(), 1, "one before the first pose, which planners refuse");
        Ok(())
    }
}
