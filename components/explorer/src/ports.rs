//! The explorer as a component: maps and poses in, goals out.

use armor_grid::{Geometry, Grid, Occupancy, Point2, Pose2, Thresholds};
use armor_sdk::prelude::*;

use crate::exploration::{Decision, Exploration, Settings};

/// Sends the robot to where the known meets the unknown, until nothing is left.
pub struct Explorer {
    armor: Armor,
    settings: Settings,
    exploration: Exploration,
    frame: String,
}

impl Component for Explorer {
    const KIND: &'static str = "explorer";
    const SUMMARY: &'static str =
        "Sends the robot to where the known meets the unknown (frontiers), until nothing is left.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::number("clearance", "m")
            .default("0.25m")
            .range(0.05, 2.0)
            .doc("distance the robot's centre keeps from obstacles"),
        Parameter::number("min_frontier", "m")
            .default("0.8m")
            .range(0.05, 5.0)
            .doc("smaller frontiers are not worth a trip"),
        Parameter::number("patience", "s")
            .default("8s")
            .range(1.0, 600.0)
            .doc("a goal without progress for this long is given up"),
        Parameter::number("confirm", "s")
            .default("1.5s")
            .range(0.0, 60.0)
            .doc("nothing left for this long: done"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "what is known of the world"),
        ("pose", "where the robot is on it"),
        ("goal", "where to drive next, again at every tick while there is something to see"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<OccupancyGrid>("map")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        for parameter in ["clearance", "min_frontier", "patience", "confirm"] {
            armor.get_parameter(parameter)?;
        }
        armor.synchronize()?;
        let settings = Settings::default();
        let exploration = Exploration::new(settings);
        Ok(Self { armor, settings, exploration, frame: "map".into() })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let number = value.number()?;
        match name {
            "clearance" => self.settings.clearance_m = number,
            "min_frontier" => self.settings.min_frontier_m = number,
            "patience" => self.settings.patience_s = number,
            "confirm" => self.settings.confirm_s = number,
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.exploration.map_seen(grid(&map)?);
                self.frame = map.frame;
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                let Pose2D { x, y, theta } = pose.pose.pose.to_planar();
                self.exploration.pose_seen(Pose2::new(x, y, theta));
            }
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.exploration = Exploration::new(self.settings);
        }
        if call == Call::Stopping {
            return Ok(Outcome::CarryOn);
        }
        let now_s = self.armor.timestamp();
        match self.exploration.step(now_s) {
            Decision::Wait => Ok(Outcome::CarryOn),
            Decision::Done => Ok(Outcome::Done),
            Decision::Goto(Pose2 { x_m: x, y_m: y, yaw_rad: theta }) => {
                let pose = Pose::planar(Pose2D { x, y, theta });
                let goal = PoseStamped { stamp: now_s, frame: self.frame.clone(), pose };
                self.armor.send_data("goal", &goal)?;
                Ok(Outcome::CarryOn)
            }
        }
    }
}

fn grid(map: &OccupancyGrid) -> Result<Grid<Occupancy>, Fault> {
    let corner = map.info.origin.to_planar();
    let geometry = Geometry {
        origin: Point2::new(corner.x, corner.y),
        resolution_m: f64::from(map.info.resolution),
        width: map.info.width as usize,
        height: map.info.height as usize,
    };
    Grid::classified_by(Thresholds::SEEN, geometry, &map.data).ok_or_else(|| {
        "the map has not as many cells as its width and height say, or they have no size".into()
    })
}
