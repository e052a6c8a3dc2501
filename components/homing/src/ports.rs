//! Homing as a component: poses in, goals out.

use armor_grid::Pose2;
use armor_sdk::prelude::*;

use crate::homecoming::{Homecoming, Step};

/// Sends the robot home and reports when it is there.
pub struct Homing {
    armor: Armor,
    home: Pose2,
    tolerance_m: f64,
    homecoming: Homecoming,
}

impl Component for Homing {
    const KIND: &'static str = "homing";
    const SUMMARY: &'static str = "Sends the robot home and reports when it is there.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::number("x", "m").default("0m").doc("home on the map, along x"),
        Parameter::number("y", "m").default("0m").doc("home on the map, along y"),
        Parameter::number("theta", "deg").default("0deg").doc("heading at home"),
        Parameter::number("tolerance", "m")
            .default("0.25m")
            .range(0.02, 10.0)
            .doc("within this of home the robot is there"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is on the map"),
        ("goal", "home, again at every tick until the robot is there"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        for name in ["x", "y", "theta", "tolerance"] {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        let (home, tolerance_m) = (Pose2::IDENTITY, 0.25);
        let homecoming = Homecoming::new(home, tolerance_m);
        Ok(Self { armor, home, tolerance_m, homecoming })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let number = value.number()?;
        match name {
            "x" => self.home.x_m = number,
            "y" => self.home.y_m = number,
            "theta" => self.home.yaw_rad = number,
            "tolerance" => self.tolerance_m = number,
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let pose: PoseWithCovarianceStamped = data.decode()?;
        let Pose2D { x, y, theta } = pose.pose.pose.to_planar();
        self.homecoming.pose_seen(Pose2::new(x, y, theta));
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            self.homecoming = Homecoming::new(self.home, self.tolerance_m);
        }
        if call == Call::Stopping {
            return Ok(Outcome::CarryOn);
        }
        let stamp = self.armor.timestamp();
        match self.homecoming.step(stamp) {
            Step::Home => Ok(Outcome::Done),
            Step::Goto(Pose2 { x_m: x, y_m: y, yaw_rad: theta }) => {
                let pose = Pose::planar(Pose2D { x, y, theta });
                let goal = PoseStamped { stamp, frame: "map".into(), pose };
                self.armor.send_data("goal", &goal)?;
                Ok(Outcome::CarryOn)
            }
        }
    }
}
