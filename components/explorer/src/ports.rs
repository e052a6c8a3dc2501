//! The explorer as a component: maps and poses in, goals out.

use armor_convert::{FrameNews, FrameWatch, build_stamped_pose, read_occupancy, read_robot_pose};
use armor_grid::Thresholds;
use armor_sdk::prelude::*;

use crate::exploration::{Exploration, ExplorerDecision, ExplorerSettings};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct ExplorerParameters {
    /// distance the robot's centre keeps from obstacles
    #[parameter(unit = "m", default = "0.25m", range = 0.05..=2.0)]
    clearance_m: f64,
    /// smaller frontiers are not worth a trip
    #[parameter(unit = "m", default = "0.8m", range = 0.05..=5.0)]
    min_frontier_m: f64,
    /// a goal without progress for this long is given up
    #[parameter(unit = "s", default = "8s", range = 1.0..=600.0)]
    patience_s: f64,
    /// nothing left for this long: done
    #[parameter(unit = "s", default = "1.5s", range = 0.0..=60.0)]
    confirm_s: f64,
}

impl ExplorerParameters {
    fn settings(&self) -> ExplorerSettings {
        let Self { clearance_m, min_frontier_m, patience_s, confirm_s } = *self;
        let default = ExplorerSettings::default();
        ExplorerSettings { clearance_m, min_frontier_m, patience_s, confirm_s, ..default }
    }
}

/// Sends the robot to where the known meets the unknown, until nothing is left.
pub struct Explorer {
    armor: Armor,
    parameters: ExplorerParameters,
    exploration: Exploration,
    frames: FrameWatch,
    pace: ProgressPace,
}

/// What it reports to the mission.
#[derive(Debug, Events)]
enum ExplorerEvent {
    /// the map frame has another origin: exploration begins again on the new map
    FrameChanged,
}

impl Explorer {
    /// Takes the frame of a pose or a map; what is known of another epoch is dropped.
    fn frame_seen(&mut self, frame: &str) {
        if self.frames.frame_seen(frame) == FrameNews::Changed {
            self.exploration = Exploration::new(self.parameters.settings());
        }
    }

    fn publish_progress(&mut self, now_s: f64, task: &str) -> Result<(), Fault> {
        let exploration = &self.exploration;
        let describe = || {
            let share = exploration.explored_share();
            (share, describe_progress(share, exploration.goal_distance_m()))
        };
        if let Some(progress) = self.pace.next_progress(now_s, task, describe) {
            self.armor.send_data("progress", &progress)?;
        }
        Ok(())
    }
}

fn describe_progress(share: Option<f64>, goal_distance_m: Option<f64>) -> String {
    // Rounded down, so that 100 % means that nothing is left.
    let explored = share.map(|share| format!("{:.0} % explored", (100.0 * share).floor()));
    let explored = explored.unwrap_or_else(|| "no map yet".into());
    match goal_distance_m {
        Some(distance_m) => format!("{explored}, {distance_m:.1} m to the goal"),
        None => explored,
    }
}

impl Component for Explorer {
    const KIND: &'static str = "explorer";
    const SUMMARY: &'static str =
        "Sends the robot to where the known meets the unknown (frontiers), until nothing is left.";
    const PARAMETERS: &'static [Parameter] = ExplorerParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "the map so far"),
        ("pose", "where the robot is on it"),
        ("goal", "where to drive next, again at every tick while there is something to see"),
        ("progress", "the explored share and the distance to the goal, once per second"),
    ];

    const EVENTS: &'static [DeclaredEvent] = ExplorerEvent::DECLARED;
    const ENDS_BY_ITSELF: bool = true;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        armor.provide::<Progress>("progress")?;
        let parameters = ExplorerParameters::request(&armor)?;
        let exploration = Exploration::new(parameters.settings());
        let (frames, pace) = (FrameWatch::default(), ProgressPace::default());
        Ok(Self { armor, parameters, exploration, frames, pace })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.frame_seen(&map.frame);
                self.exploration.map_seen(read_occupancy(&map, Thresholds::SEEN)?);
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.frame_seen(&pose.frame);
                self.exploration.pose_seen(read_robot_pose(&pose));
            }
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.exploration = Exploration::new(self.parameters.settings());
        }
        let now_s = self.armor.timestamp();
        if call == Call::Stopping {
            self.publish_progress(now_s, "")?;
            return Ok(Outcome::CarryOn);
        }
        if self.frames.take_change() {
            return Ok(ExplorerEvent::FrameChanged.into());
        }
        match self.exploration.step(now_s) {
            ExplorerDecision::Wait => self.publish_progress(now_s, "exploring")?,
            ExplorerDecision::Done => {
                self.publish_progress(now_s, "explored")?;
                return Ok(Outcome::Done);
            }
            ExplorerDecision::Goto(goal) => {
                let frame = self.frames.frame().unwrap_or("map");
                self.armor.send_data("goal", &build_stamped_pose(now_s, frame, goal))?;
                self.publish_progress(now_s, "exploring")?;
            }
        }
        Ok(Outcome::CarryOn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declared_defaults_are_those_of_the_algorithm() {
        assert_eq!(ExplorerParameters::defaults().settings(), ExplorerSettings::default());
    }

    #[test]
    fn all_is_explored_only_when_nothing_is_left() {
        assert_eq!(describe_progress(Some(0.999), Some(3.24)), "99 % explored, 3.2 m to the goal");
        assert_eq!(describe_progress(Some(1.0), None), "100 % explored");
        assert_eq!(describe_progress(None, None), "no map yet");
    }
}
