//! Patrol as a component: poses in, goals out, an event for each waypoint and lap.

use armor_convert::{FrameWatch, build_stamped_pose, read_robot_pose};
use armor_grid::{Point2, Pose2};
use armor_sdk::prelude::*;

use crate::rounds::{PatrolProgress, PatrolSettings, PatrolStep, Rounds};

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct PatrolParameters {
    /// waypoints x,y on the map in metres, such as `4,1 9,1 0,0`
    #[parameter(format = "points")]
    route: Vec<[f64; 2]>,
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

/// What it reports to the mission.
#[derive(Debug, Events)]
enum PatrolEvent {
    /// a waypoint is reached; its value is the waypoint's number
    Waypoint(usize),
    /// a waypoint is given up; its value is the waypoint's number
    Skipped(usize),
    /// a lap is over; its value is the number of laps so far
    Lap(u32),
    /// the map frame has another origin: where the route is in it is unknown, and no goal is sent
    FrameChanged,
}

/// The frame of the route: the coordinates of the file belong to its first epoch.
const FRAME: &str = "map";

/// Sends the robot along a route and reports its progress.
pub struct Patrol {
    armor: Armor,
    parameters: PatrolParameters,
    rounds: Rounds,
    frames: FrameWatch,
    /// Whether it was reported, in this activation, that the route is in another frame.
    is_reported: bool,
    pace: ProgressPace,
}

impl Patrol {
    /// Publishes the progress if it is due. Each waypoint is a task of its own, so that it is
    /// published immediately when the next one begins.
    fn publish_progress(&mut self, now_s: f64) -> Result<(), Fault> {
        let Some(patrol) = self.rounds.progress() else { return Ok(()) };
        let (number, all) = patrol.waypoint;
        let task = format!("waypoint {number} of {all}");
        let describe = || (patrol.done_share, describe_progress(&patrol));
        if let Some(progress) = self.pace.next_progress(now_s, &task, describe) {
            self.armor.send_data("progress", &progress)?;
        }
        Ok(())
    }

    fn publish_goal(&mut self, now_s: f64, Point2 { x_m, y_m }: Point2) -> Result<(), Fault> {
        let goal = build_stamped_pose(now_s, FRAME, Pose2::new(x_m, y_m, 0.0));
        self.armor.send_data("goal", &goal)?;
        Ok(())
    }

    fn end_progress(&mut self, now_s: f64) -> Result<(), Fault> {
        if let Some(progress) = self.pace.end(now_s) {
            self.armor.send_data("progress", &progress)?;
        }
        Ok(())
    }
}

fn describe_progress(patrol: &PatrolProgress) -> String {
    let lap = match patrol.lap {
        (number, 0) => format!("lap {number}"),
        (number, all) => format!("lap {number} of {all}"),
    };
    match patrol.distance_m {
        Some(distance_m) => format!("{lap}, {distance_m:.1} m to the waypoint"),
        None => format!("{lap}, no pose yet"),
    }
}

impl Component for Patrol {
    const KIND: &'static str = "patrol";
    const SUMMARY: &'static str = "Sends the robot along a route of waypoints, lap after lap.";
    const PARAMETERS: &'static [Parameter] = PatrolParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("pose", "where the robot is on the map"),
        ("goal", "the next waypoint: with the first pose, and again at every tick"),
        ("progress", "waypoint, lap and the straight distance to the waypoint, once per second"),
    ];

    const EVENTS: &'static [DeclaredEvent] = PatrolEvent::DECLARED;
    const VALUE_EFFECTS: &'static [(&'static str, ParameterEffect)] = &[
        ("laps", ParameterEffect::NeverDone("0")),
        ("stay", ParameterEffect::DelaysDoneTimes(&["laps", "route"])),
        ("patience", ParameterEffect::GivesUp),
    ];
    const ENDS_BY_ITSELF: bool = true;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("goal")?;
        armor.provide::<Progress>("progress")?;
        let parameters = PatrolParameters::request(&armor)?;
        let rounds = Rounds::new(Vec::new(), parameters.settings());
        let (frames, pace) = (FrameWatch::default(), ProgressPace::default());
        Ok(Self { armor, parameters, rounds, frames, is_reported: false, pace })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let pose: PoseWithCovarianceStamped = data.decode()?;
        self.frames.frame_seen(&pose.frame);
        if self.frames.is_usable(FRAME) {
            let is_first = !self.rounds.is_robot_known();
            self.rounds.robot_seen(read_robot_pose(&pose).point());
            // The robot need not wait for the next tick.
            if let Some(waypoint) = self.rounds.waypoint().filter(|_| is_first) {
                self.publish_goal(self.armor.timestamp(), waypoint)?;
            }
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Started {
            let route = self.parameters.route.iter().map(|[x_m, y_m]| Point2::new(*x_m, *y_m));
            self.rounds = Rounds::new(route.collect(), self.parameters.settings());
            self.is_reported = false;
        }
        let now_s = self.armor.timestamp();
        if call == Call::Stopping {
            self.end_progress(now_s)?;
            return Ok(Outcome::CarryOn);
        }
        if !self.frames.is_usable(FRAME) {
            self.end_progress(now_s)?;
            let is_reported = std::mem::replace(&mut self.is_reported, true);
            return Ok(if is_reported {
                Outcome::CarryOn
            } else {
                PatrolEvent::FrameChanged.into()
            });
        }
        let step = self.rounds.step(now_s);
        if matches!(step, PatrolStep::Done | PatrolStep::Stuck) {
            self.end_progress(now_s)?;
        } else {
            self.publish_progress(now_s)?;
        }
        Ok(match step {
            PatrolStep::Wait => Outcome::CarryOn,
            PatrolStep::Reached(number) => PatrolEvent::Waypoint(number).into(),
            PatrolStep::Skipped(number) => PatrolEvent::Skipped(number).into(),
            PatrolStep::Lap(number) => PatrolEvent::Lap(number).into(),
            PatrolStep::Done => Outcome::Done,
            PatrolStep::Stuck => {
                Outcome::Failed("not one waypoint of a lap could be reached".into())
            }
            PatrolStep::Goto(waypoint) => {
                self.publish_goal(now_s, waypoint)?;
                Outcome::CarryOn
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_sdk::testing::{ReportKind, RunState, TestError, TestedComponent};

    use super::*;

    #[test]
    fn each_waypoint_and_lap_is_an_event() -> Result<(), TestError> {
        let parameters = [("route", "2,1 0,1"), ("laps", "1"), ("stay", "0s")];
        let mut patrol = TestedComponent::build::<Patrol>(&parameters)?;
        patrol.start()?;
        patrol.send("pose", &PoseWithCovarianceStamped::default())?;
        let mut goals = Vec::new();
        for _ in 0..20 {
            patrol.tick_after(Duration::from_secs(1))?;
            if patrol.state() == RunState::Done {
                break;
            }
            // The robot is where it was sent to.
            let goal = patrol.last_output::<PoseStamped>("goal")?;
            goals.push((goal.pose.position.x, goal.pose.position.y));
            let mut seen = PoseWithCovarianceStamped::default();
            seen.pose.pose = goal.pose;
            patrol.send("pose", &seen)?;
        }
        goals.dedup();
        assert_eq!(goals, [(2.0, 1.0), (0.0, 1.0)]);
        let event = |name: &str, value| ReportKind::Event { name: name.into(), value };
        let expected =
            [event("waypoint", 1.0), event("waypoint", 2.0), event("lap", 1.0), ReportKind::Done];
        assert_eq!(patrol.reports(), expected);
        Ok(())
    }

    #[test]
    fn the_first_goal_of_an_activation_follows_the_first_pose() -> Result<(), TestError> {
        let mut patrol = TestedComponent::build::<Patrol>(&[("route", "2,1")])?;
        for activation in 1..=2 {
            patrol.start()?;
            assert_eq!(patrol.outputs::<PoseStamped>("goal")?.len(), activation - 1);
            for _ in 0..3 {
                patrol.send("pose", &PoseWithCovarianceStamped::default())?;
            }
            let goals = patrol.outputs::<PoseStamped>("goal")?;
            assert_eq!(goals.len(), activation, "the others wait for the tick");
            assert_eq!(goals.last().map(|goal| goal.pose.position.x), Some(2.0));
            patrol.stop()?;
        }
        Ok(())
    }

    #[test]
    fn in_another_epoch_no_waypoint_is_driven_to() -> Result<(), TestError> {
        let mut patrol = TestedComponent::build::<Patrol>(&[("route", "2,1 0,1")])?;
        patrol.start()?;
        let frame = "map#3f2a".into();
        patrol.send("pose", &PoseWithCovarianceStamped { frame, ..Default::default() })?;
        for _ in 0..40 {
            patrol.tick_after(Duration::from_secs(1))?;
        }
        let changed = ReportKind::Event { name: "frame_changed".into(), value: 1.0 };
        assert_eq!(patrol.reports(), [changed], "once, and nothing is given up");
        assert!(patrol.last_output::<PoseStamped>("goal").is_err(), "no goal was sent");
        Ok(())
    }

    #[test]
    fn a_route_is_required() {
        let built = TestedComponent::build::<Patrol>(&[]).map(|_| ());
        let error = built.expect_err("there is no route").to_string();
        assert!(error.contains("`route`") && error.contains("has no default"), "{error}");
    }

    #[test]
    fn the_details_name_lap_and_distance() {
        let mut patrol = PatrolProgress {
            waypoint: (2, 5),
            lap: (1, 2),
            distance_m: Some(3.24),
            done_share: Some(0.1),
        };
        assert_eq!(describe_progress(&patrol), "lap 1 of 2, 3.2 m to the waypoint");
        patrol = PatrolProgress { lap: (7, 0), distance_m: None, ..patrol };
        assert_eq!(describe_progress(&patrol), "lap 7, no pose yet");
    }
}
