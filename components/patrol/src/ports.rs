//! Patrol as a component: poses in, goals out, an event for each waypoint and lap.

use armor_grid::{Point2, Pose2};
use armor_sdk::prelude::*;

use crate::rounds::{Rounds, Settings, Step};
use crate::route;

/// Sends the robot along a route and reports its progress.
pub struct Patrol {
    armor: Armor,
    route: Vec<Point2>,
    settings: Settings,
    rounds: Rounds,
}

impl Component for Patrol {
    const KIND: &'static str = "patrol";
    const SUMMARY: &'static str = "Sends the robot along a route of waypoints, lap after lap.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::text("route").doc("waypoints x,y on the map in metres, such as `4,1 9,1 0,0`"),
        Parameter::integer("laps").default("1").range(0.0, 1e6).doc("how often; 0: without end"),
        Parameter::number("tolerance", "m")
            .default("0.3m")
            .range(0.02, 10.0)
            .doc("within this of a waypoint the robot is there"),
        Parameter::number("stay", "s").default("1s").range(0.0, 86400.0).doc("time at each"),
        Parameter::number("patience", "s")
            .default("20s")
            .range(1.0, 3600.0)
            .doc("a waypoint that the robot comes no nearer to for this long is given up"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is on the map"),
        ("goal", "the next waypoint, again at every tick"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        for name in ["route", "laps", "tolerance", "stay", "patience"] {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        let settings = Settings { laps: 1, tolerance_m: 0.3, stay_s: 1.0, patience_s: 20.0 };
        let rounds = Rounds::new(Vec::new(), settings);
        Ok(Self { armor, route: Vec::new(), settings, rounds })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "route" => self.route = route::parse(value.text()?)?,
            "laps" => self.settings.laps = u32::try_from(value.integer()?)?,
            "tolerance" => self.settings.tolerance_m = value.number()?,
            "stay" => self.settings.stay_s = value.number()?,
            "patience" => self.settings.patience_s = value.number()?,
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let pose: PoseWithCovarianceStamped = data.decode()?;
        let Pose2D { x, y, theta } = pose.pose.pose.to_planar();
        self.rounds.robot_seen(Pose2::new(x, y, theta).point());
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.rounds = Rounds::new(self.route.clone(), self.settings);
        }
        if call == Call::Stopping {
            return Ok(Outcome::CarryOn);
        }
        let stamp = self.armor.timestamp();
        Ok(match self.rounds.step(stamp) {
            Step::Wait => Outcome::CarryOn,
            Step::Reached(number) => Outcome::event("waypoint", number as f64),
            Step::Skipped(number) => Outcome::event("skipped", number as f64),
            Step::Lap(number) => Outcome::event("lap", f64::from(number)),
            Step::Done => Outcome::Done,
            Step::Stuck => Outcome::Failed("not one waypoint of a lap could be reached".into()),
            Step::Goto(Point2 { x_m: x, y_m: y }) => {
                let pose = Pose::planar(Pose2D { x, y, theta: 0.0 });
                let goal = PoseStamped { stamp, frame: "map".into(), pose };
                self.armor.send_data("goal", &goal)?;
                Outcome::CarryOn
            }
        })
    }
}
