//! The planner as a component: map, pose and goals in, paths out.

use armor_grid::{Geometry, Grid, Occupancy, Pose2};
use armor_sdk::prelude::*;

use crate::planning::{Planning, Rank, Settings};

/// Finds the way over the map to the goal that holds.
pub struct Planner {
    armor: Armor,
    settings: Settings,
    planning: Planning,
    frame: String,
}

impl Component for Planner {
    const KIND: &'static str = "planner";
    const SUMMARY: &'static str = "Finds the way over the map to the goal that holds.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::number("radius", "m")
            .default("0.18m")
            .range(0.02, 5.0)
            .doc("circle around the robot's centre that holds all of it"),
        Parameter::number("margin", "m")
            .default("0.05m")
            .range(0.0, 1.0)
            .doc("kept free around it"),
        Parameter::number("timeout", "s")
            .default("0.5s")
            .range(0.05, 10.0)
            .doc("a goal older than this does not count"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("map", "what is known of the world; the way is planned on it"),
        ("pose", "where the robot is on it"),
        ("goal", "where to drive; must be said again within the timeout"),
        ("override", "a goal that holds before the other one while it is fresh"),
        ("operator", "a person's goal; holds before both while it is fresh"),
        (
            "path",
            "the way to the goal, again at every tick while there is one: from where the robot was \
             when it was planned to the goal's heading; empty if there is no way, and once when the \
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
        for parameter in ["radius", "margin", "timeout"] {
            armor.get_parameter(parameter)?;
        }
        armor.synchronize()?;
        let settings = Settings::default();
        Ok(Self { armor, settings, planning: Planning::new(settings), frame: "map".into() })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let number = value.number()?;
        match name {
            "radius" => self.settings.radius_m = number,
            "margin" => self.settings.margin_m = number,
            "timeout" => self.settings.timeout_s = number,
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let rank = match header.id() {
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.planning.map_seen(grid(&map)?);
                self.frame = map.frame;
                return Ok(());
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.planning.pose_seen(planar(&pose.pose.pose));
                return Ok(());
            }
            "goal" => Rank::Task,
            "override" => Rank::Override,
            _ => Rank::Operator,
        };
        let goal: PoseStamped = data.decode()?;
        self.planning.goal_seen(self.armor.timestamp(), rank, planar(&goal.pose));
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => self.planning.begin_anew(self.settings),
            Call::Stopping => self.planning.stop(),
            _ => {}
        }
        let now_s = self.armor.timestamp();
        if let Some(poses) = self.planning.step(now_s) {
            self.armor.send_data("path", &path(now_s, &self.frame, poses))?;
        }
        Ok(Outcome::CarryOn)
    }
}

fn planar(pose: &Pose) -> Pose2 {
    let Pose2D { x, y, theta } = pose.to_planar();
    Pose2::new(x, y, theta)
}

fn grid(map: &OccupancyGrid) -> Result<Grid<Occupancy>, Fault> {
    let geometry = Geometry {
        origin: planar(&map.info.origin).point(),
        resolution_m: f64::from(map.info.resolution),
        width: map.info.width as usize,
        height: map.info.height as usize,
    };
    Grid::classified(geometry, &map.data).ok_or_else(|| {
        "the map has not as many cells as its width and height say, or they have no size".into()
    })
}

fn path(stamp: f64, frame: &str, poses: &[Pose2]) -> Path {
    let stamped = |&Pose2 { x_m: x, y_m: y, yaw_rad: theta }: &Pose2| PoseStamped {
        stamp,
        frame: frame.into(),
        pose: Pose::planar(Pose2D { x, y, theta }),
    };
    Path { stamp, frame: frame.into(), poses: poses.iter().map(stamped).collect() }
}
