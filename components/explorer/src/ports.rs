//! The explorer as a component: maps and poses in, goals out.

use armor_convert::{build_stamped_pose, read_occupancy, read_robot_pose};
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
    frame: String,
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
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        let parameters = ExplorerParameters::request(&armor)?;
        armor.synchronize()?;
        let exploration = Exploration::new(parameters.settings());
        Ok(Self { armor, parameters, exploration, frame: "map".into() })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.exploration.map_seen(read_occupancy(&map, Thresholds::SEEN)?);
                self.frame = map.frame;
            }
            "pose" => self.exploration.pose_seen(read_robot_pose(&data.decode()?)),
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.exploration = Exploration::new(self.parameters.settings());
        }
        if call == Call::Stopping {
            return Ok(Outcome::CarryOn);
        }
        let now_s = self.armor.timestamp();
        match self.exploration.step(now_s) {
            ExplorerDecision::Wait => Ok(Outcome::CarryOn),
            ExplorerDecision::Done => Ok(Outcome::Done),
            ExplorerDecision::Goto(goal) => {
                self.armor.send_data("goal", &build_stamped_pose(now_s, &self.frame, goal))?;
                Ok(Outcome::CarryOn)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declared_defaults_are_those_of_the_algorithm() {
        assert_eq!(ExplorerParameters::defaults().settings(), ExplorerSettings::default());
    }
}
