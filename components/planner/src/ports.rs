//! The planner as a component: map, pose and goals in, paths out.

use armor_convert::{build_path, read_occupancy, read_pose, read_robot_pose};
use armor_grid::Thresholds;
use armor_sdk::prelude::*;

use crate::planning::{PlannerSettings, Planning, Rank};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct PlannerParameters {
    /// circle around the robot's centre that encloses it
    #[parameter(unit = "m", default = "0.18m", range = 0.02..=5.0)]
    radius_m: f64,
    /// kept free around it
    #[parameter(unit = "m", default = "0.05m", range = 0.0..=1.0)]
    margin_m: f64,
    /// a goal older than this is ignored
    #[parameter(unit = "s", default = "0.5s", range = 0.05..=10.0)]
    timeout_s: f64,
}

impl PlannerParameters {
    fn settings(&self) -> PlannerSettings {
        let Self { radius_m, margin_m, timeout_s } = *self;
        PlannerSettings { radius_m, margin_m, timeout_s }
    }
}

impl Default for PlannerSettings {
    fn default() -> Self {
        PlannerParameters::defaults().settings()
    }
}

/// Plans a path over the map to the goal that has priority.
pub struct Planner {
    armor: Armor,
    parameters: PlannerParameters,
    planning: Planning,
    frame: String,
}

impl Component for Planner {
    const KIND: &'static str = "planner";
    const SUMMARY: &'static str = "Plans a path over the map to the goal that has priority.";
    const REPORTS_DONE: bool = false;
    const STALE_AFTER: &'static [(&'static str, &'static str)] =
        &[("goal", "timeout"), ("override", "timeout"), ("operator", "timeout")];
    const PARAMETERS: &'static [Parameter] = PlannerParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "the map on which the path is planned"),
        ("pose", "where the robot is on it"),
        ("goal", "where to drive; must be sent again within the timeout"),
        ("override", "a goal that has priority over the other one while it is fresh"),
        ("operator", "a person's goal; has priority over both while it is fresh"),
        (
            "path",
            "the path to the goal, at every tick while one is fresh: from where the robot was \
             when it was planned to the goal's heading; empty if no path exists, and once when the \
             goal ends",
        ),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.subscribe::<Optional<PoseStamped>>("goal")?;
        armor.subscribe::<Optional<PoseStamped>>("override")?;
        armor.subscribe::<Optional<PoseStamped>>("operator")?;
        armor.provide::<Path>("path")?;
        let parameters = PlannerParameters::request(&armor)?;
        let planning = Planning::new(parameters.settings());
        Ok(Self { armor, parameters, planning, frame: "map".into() })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let rank = match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.planning.map_seen(read_occupancy(&map, Thresholds::default())?);
                self.frame = map.frame;
                return Ok(());
            }
            "pose" => {
                self.planning.pose_seen(read_robot_pose(&data.decode()?));
                return Ok(());
            }
            "goal" => Rank::Task,
            "override" => Rank::Override,
            _ => Rank::Operator,
        };
        let goal: PoseStamped = data.decode()?;
        self.planning.goal_seen(self.armor.timestamp(), rank, read_pose(&goal.pose));
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => self.planning.reset_state(self.parameters.settings()),
            Call::Stopping => self.planning.forget_goals(),
            _ => {}
        }
        let now_s = self.armor.timestamp();
        if let Some(poses) = self.planning.step(now_s) {
            self.armor.send_data("path", &build_path(now_s, &self.frame, poses))?;
        }
        Ok(Outcome::CarryOn)
    }
}
