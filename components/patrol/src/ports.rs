//! Patrol as a component: poses in, goals out, an event for each waypoint and lap.

use armor_convert::{build_stamped_pose, read_robot_pose};
use armor_grid::{Point2, Pose2};
use armor_sdk::prelude::*;

use crate::rounds::{PatrolSettings, PatrolStep, Rounds};
use crate::route::parse_route;

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct PatrolParameters {
    /// waypoints x,y on the map in metres, such as `4,1 9,1 0,0`
    #[parameter(parse = parse_route)]
    route: Vec<Point2>,
    /// number of laps; 0: without end
    #[parameter(default = 1, range = 0.0..=1e6)]
    laps: u32,
    /// a waypoint is reached within this
    #[parameter(unit = "m", default = "0.3m", range = 0.02..=10.0)]
    tolerance_m: f64,
    /// time at each
    #[parameter(unit = "s", default = "1s", range = 0.0..=86400.0)]
    stay_s: f64,
    /// a waypoint that the robot comes no nearer to for this long is given up
    #[parameter(unit = "s", default = "20s", range = 1.0..=3600.0)]
    patience_s: f64,
}

impl PatrolParameters {
    fn settings(&self) -> PatrolSettings {
        let Self { laps, tolerance_m, stay_s, patience_s, .. } = *self;
        PatrolSettings { laps, tolerance_m, stay_s, patience_s }
    }
}

/// Sends the robot along a route and reports its progress.
pub struct Patrol {
    armor: Armor,
    parameters: PatrolParameters,
    rounds: Rounds,
}

impl Component for Patrol {
    const KIND: &'static str = "patrol";
    const SUMMARY: &'static str = "Sends the robot along a route of waypoints, lap after lap.";
    const PARAMETERS: &'static [Parameter] = PatrolParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is on the map"),
        ("goal", "the next waypoint, again at every tick"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        let parameters = PatrolParameters::request(&armor)?;
        armor.synchronize()?;
        let rounds = Rounds::new(Vec::new(), parameters.settings());
        Ok(Self { armor, parameters, rounds })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.rounds.robot_seen(read_robot_pose(&data.decode()?).point());
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            let route = self.parameters.route.clone();
            self.rounds = Rounds::new(route, self.parameters.settings());
        }
        if call == Call::Stopping {
            return Ok(Outcome::CarryOn);
        }
        let now_s = self.armor.timestamp();
        Ok(match self.rounds.step(now_s) {
            PatrolStep::Wait => Outcome::CarryOn,
            PatrolStep::Reached(number) => Outcome::event("waypoint", number as f64),
            PatrolStep::Skipped(number) => Outcome::event("skipped", number as f64),
            PatrolStep::Lap(number) => Outcome::event("lap", f64::from(number)),
            PatrolStep::Done => Outcome::Done,
            PatrolStep::Stuck => {
                Outcome::Failed("not one waypoint of a lap could be reached".into())
            }
            PatrolStep::Goto(Point2 { x_m, y_m }) => {
                let goal = build_stamped_pose(now_s, "map", Pose2::new(x_m, y_m, 0.0));
                self.armor.send_data("goal", &goal)?;
                Outcome::CarryOn
            }
        })
    }
}
