//! Everything that the screen shows and the operator has ordered, as plain data. Inputs fill it and
//! the window shows it; tests need neither.

use std::collections::BTreeSet;

use armor_convert::FrameNews;

use armor_grid::Point2;

use crate::alerts::AlertList;
use crate::connection::{CUT, RunEnd, SystemConnection};
use crate::goal_check::check_goal;
use crate::links::{ClockTimes, Freshness, InputLink, SequenceNumber};
use crate::mission::{MissionState, describe_cause};
use crate::orders::{OperatorEvent, OperatorOrder, OperatorOrders, RobotCommand};
use crate::readings::{BatteryReading, Readings, TaskReading};
use crate::scene::{RobotScene, SceneError};
use crate::stop_delivery::{StopDelivery, StopStatus};

/// What the operator sees and has ordered.
#[derive(Clone, Debug, Default)]
pub struct Console {
    /// The robot and its surroundings.
    pub scene: RobotScene,
    /// What the panels keep of their own inputs.
    pub readings: Readings,
    /// The linked inputs.
    pub links: Vec<InputLink>,
    /// The active orders.
    pub orders: OperatorOrders,
    /// The outputs whose last order reached no subscriber.
    pub unheard: BTreeSet<&'static str>,
    /// The buttons of the mission.
    pub buttons: Vec<String>,
    /// Radius of the circle that is drawn for the robot, in metres.
    pub robot_radius_m: f64,
    /// Whether the screen should close.
    pub is_over: bool,
    /// Name of the robot: that of its system.
    pub robot_name: String,
    /// What the screen is connected to.
    pub connection: SystemConnection,
    /// When the connection was lost, by the host's clock, in seconds.
    pub lost_s: f64,
    /// Whether the theme is the light one.
    pub is_light: bool,
    /// The state of the mission, if there is one.
    pub mission: Option<MissionState>,
    /// What has gone wrong.
    pub alerts: AlertList,
    /// The places of the mission when its last button was pressed.
    pub pressed_from: String,
    /// How far STOP or its release has come.
    pub stop: StopDelivery,
    /// The goal that was reached last, and when by the host's clock.
    pub arrival: Option<(Point2, f64)>,
    /// The goal that was refused last.
    pub refusal: Option<OrderRefusal>,
}

/// How long a refusal, or the arrival at a goal, is shown, in seconds.
const REFUSAL_SHOWN_S: f64 = 6.0;

/// A lost connection is an alert after this time, in seconds: a component that is restarted returns
/// sooner.
const CUT_ALERT_S: f64 = 2.0;
/// Slower than this the robot is at rest: in m/s, and in rad/s.
const REST: (f64, f64) = (0.02, 0.03);
/// Progress older than this shows nothing, in seconds: it is published once per second.
const PROGRESS_VALID_S: f64 = 3.0;

/// A goal that was refused.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderRefusal {
    /// The place on the map.
    pub place: Point2,
    /// The reason.
    pub why: String,
    /// When, by the host's clock, in seconds.
    pub at_s: f64,
}

impl Console {
    /// Returns the link of an input, if it is linked.
    pub fn link(&self, input: &str) -> Option<&InputLink> {
        self.links.iter().find(|link| link.input == input)
    }

    /// Returns whether an input is linked.
    pub fn is_linked(&self, input: &str) -> bool {
        self.link(input).is_some()
    }

    /// Records the arrival of data at an input, and the result of showing them.
    pub fn record_arrival(
        &mut self,
        input: &str,
        now: ClockTimes,
        stamp_s: f64,
        number: SequenceNumber,
        outcome: Result<(), SceneError>,
    ) {
        if let Some(link) = self.links.iter_mut().find(|link| link.input == input) {
            link.record_arrival(now, stamp_s, number);
            link.problem = outcome.err().map(|error| error.to_string());
        }
        if input == "path"
            && let Some(end) = self.scene.path.last()
        {
            self.orders.check_path(*end, now.host_s);
        }
        if let Some(robot) = self.scene.robot()
            && let Some(place) = self.orders.check_arrival(robot)
        {
            self.arrival = Some((place, now.host_s));
        }
    }

    /// Takes the frame of a pose or a map: if it has another origin than before, the scene is
    /// cleared and the goal deleted.
    pub fn frame_seen(&mut self, frame: &str) {
        match self.scene.frame_seen(frame) {
            FrameNews::Same => {}
            FrameNews::First => self.orders.set_frame(frame),
            FrameNews::Changed => {
                self.orders.change_frame(frame);
                // Their places were on the map before.
                (self.arrival, self.refusal) = (None, None);
            }
        }
    }

    /// Returns whether data in `frame` belong on the map.
    ///
    /// # Errors
    /// If they are of another epoch.
    pub fn check_frame(&self, frame: &str) -> Result<(), SceneError> {
        let is_usable = self.scene.frames.is_usable(frame);
        if is_usable { Ok(()) } else { Err(SceneError::Frame { frame: frame.into() }) }
    }

    /// Carries out an order of the operator, and returns the commands to send.
    pub fn handle_order(&mut self, order: OperatorOrder, now: ClockTimes) -> Vec<RobotCommand> {
        if let Err(why) = self.check_order(&order) {
            // Of the others the panels show why they reach no robot.
            if let OperatorOrder::Goal { place, .. } = &order {
                self.refusal = Some(OrderRefusal { place: place.point(), why, at_s: now.host_s });
            }
            // What is held must be let go also where nothing can be ordered.
            return self.orders.handle_order(OperatorOrder::LetGo, now.host_s);
        }
        match order {
            // Repeated in each frame while a hand drives: the reason would not be seen.
            OperatorOrder::LetGo | OperatorOrder::Drive { .. } => {}
            OperatorOrder::AcknowledgeAlerts => self.alerts.acknowledge_all(),
            _ => self.refusal = None,
        }
        match order {
            OperatorOrder::Press(_) => {
                let mission = self.mission.as_ref();
                self.pressed_from = mission.map(|it| it.places.join(" and ")).unwrap_or_default();
            }
            OperatorOrder::Stop => self.stop.order(true, now.host_s),
            OperatorOrder::Release if self.orders.is_stopped() => {
                self.stop.order(false, now.host_s);
            }
            _ => {}
        }
        self.orders.handle_order(order, now.host_s)
    }

    /// Checks whether an order can be carried out.
    fn check_order(&self, order: &OperatorOrder) -> Result<(), String> {
        match order {
            OperatorOrder::LetGo | OperatorOrder::Cancel | OperatorOrder::AcknowledgeAlerts => {
                Ok(())
            }
            // Of a run that has ended there is nothing to go on with.
            OperatorOrder::Acknowledge if !self.connection.has_ended() => Ok(()),
            // It is remembered, and is the first that is sent when the connection returns.
            OperatorOrder::Stop if self.connection.is_cut() => Ok(()),
            OperatorOrder::Goal { place, .. } => {
                self.connection.check_orders()?;
                self.check_goal(place.point())
            }
            _ => self.connection.check_orders(),
        }
    }

    /// Checks a goal at the click.
    fn check_goal(&self, place: Point2) -> Result<(), String> {
        if self.orders.is_stopped() {
            return Err("STOP is active: click Release first".into());
        }
        if self.orders.is_frame_new() {
            return Err("the map has a new origin: click Acknowledge first".into());
        }
        if !self.is_linked("map") {
            return Ok(());
        }
        if self.scene.map.is_empty() {
            return Err("there is no map yet".into());
        }
        let robot = self.scene.robot().map(armor_grid::Pose2::point);
        let checked = check_goal(&self.scene.map, robot, place, self.robot_radius_m);
        checked.map_err(|refusal| refusal.to_string())
    }

    /// Returns the refusal to show: a recent one.
    pub fn recent_refusal(&self, now: ClockTimes) -> Option<&OrderRefusal> {
        self.refusal.as_ref().filter(|refusal| now.host_s - refusal.at_s < REFUSAL_SHOWN_S)
    }

    /// Returns the goal that has just been reached, until another one is set.
    pub fn recent_arrival(&self, now: ClockTimes) -> Option<Point2> {
        let is_recent = |at_s: f64| now.host_s - at_s < REFUSAL_SHOWN_S;
        let (place, _) = self.arrival.filter(|(_, at_s)| is_recent(*at_s))?;
        self.orders.goal().is_none().then_some(place)
    }

    /// Returns what is wrong with the active goal: no path leads to it.
    pub fn goal_problem(&self, now: ClockTimes) -> Option<String> {
        if self.orders.goal().is_some() && self.unheard.contains("goal") {
            return Some("nothing receives the goal: what is linked to it does not run".into());
        }
        if !self.is_linked("path") {
            return None;
        }
        let time_s = self.orders.pathless_s(self.run_time(now).host_s)?;
        Some(format!("no path to the goal for {time_s:.0} s: the planner finds none"))
    }

    /// Takes the state of the mission.
    pub fn set_mission(&mut self, mission: MissionState, now: ClockTimes) {
        let before = self.mission.replace(mission);
        let Some(mission) = &self.mission else { return };
        if before.as_ref().is_some_and(|before| before.places != mission.places) {
            self.orders.follow_button(&mission.places, now.host_s);
            self.alerts_of_button(now);
        }
        let Some(mission) = &self.mission else { return };
        let is_new = before.is_none_or(|before| before.why != mission.why);
        if is_new && !mission.why.is_empty() {
            let text = format!("mission {}: {}, {}", mission.name, mission.stage, mission.why);
            self.alerts.raise(text, now.host_s);
        }
    }

    /// Raises an alert if the mission has come back to where its last button was pressed, unless the
    /// operator has ordered that.
    fn alerts_of_button(&mut self, now: ClockTimes) {
        let (Some(mission), Some((button, _))) = (&self.mission, self.orders.pressed()) else {
            return;
        };
        let followed = self.orders.followed_button();
        let is_back = followed.len() > 1 && followed.last() == Some(&self.pressed_from);
        let event = mission.last_cause.rsplit('.').next().unwrap_or_default();
        let is_own = OperatorEvent::ORDERED.iter().any(|ordered| ordered.name() == event)
            || self.buttons.iter().any(|button| button == event);
        if is_back && !is_own {
            let text = format!(
                "{button} was refused: {}; the mission is in {} again",
                describe_cause(&mission.last_cause),
                self.pressed_from
            );
            self.alerts.raise(text, now.host_s);
        }
    }

    /// Records the executive's reply to an answer of the operator.
    pub fn record_answer(&mut self, order: &str, is_accepted: bool, text: &str, now: ClockTimes) {
        if !is_accepted {
            self.alerts.raise(format!("{order} was refused: {text}"), now.host_s);
        }
    }

    /// Keeps what is shown, as old: the system's component does not send any more. The system may
    /// run.
    pub fn cut_connection(&mut self, system: &str, why: &str, now: ClockTimes) {
        self.begin_silence(now);
        self.connection = SystemConnection::Cut { system: system.into(), why: why.into() };
    }

    /// Keeps what is shown, as old: the mission is over, and the system is ending.
    pub fn await_end(&mut self, system: &str, now: ClockTimes) {
        self.begin_silence(now);
        self.connection = SystemConnection::Ending { system: system.into() };
    }

    /// Keeps what is shown, as that of a system that has ended.
    pub fn end_system(&mut self, system: &str, end: RunEnd, now: ClockTimes) {
        self.begin_silence(now);
        let RunEnd { why, is_normal } = end;
        self.connection = SystemConnection::Ended { system: system.into(), why, is_normal };
    }

    fn begin_silence(&mut self, now: ClockTimes) {
        if !self.connection.is_old() {
            self.lost_s = now.host_s;
            self.orders.handle_order(OperatorOrder::LetGo, now.host_s);
        }
    }

    /// Returns the time of the run: it stands still when nothing comes from the run any more.
    pub fn run_time(&self, now: ClockTimes) -> ClockTimes {
        let is_old = self.connection.is_old();
        if is_old { ClockTimes { host_s: self.lost_s, ..now } } else { now }
    }

    /// Takes what the component has published on `stop`, and how many links have accepted it. STOP
    /// that an earlier window has ordered becomes that of this one.
    pub fn record_stop(&mut self, is_on: bool, to: usize, now: ClockTimes) {
        if self.stop.confirm(is_on, to, now.host_s) {
            self.orders.adopt_stop();
        }
        self.record_delivery("stop", to);
    }

    /// Returns what is known of STOP, while it is active.
    pub fn stop_status(&self, now: ClockTimes) -> Option<StopStatus> {
        if !self.orders.is_stopped() || self.connection.has_ended() {
            return None;
        }
        let problem = self.stop.problem(now.host_s, self.connection.is_cut());
        Some(problem.unwrap_or_else(|| self.find_rest(now)))
    }

    /// Returns whether the robot is at rest since STOP, by its odometry and the driver's report.
    fn find_rest(&self, now: ClockTimes) -> StopStatus {
        let since_s = now.host_s - self.stop.ordered_s();
        let age_s = |input: &str| self.link(input).and_then(|link| link.age_s(now));
        let is_fresh =
            self.link("odometry").is_some_and(|link| link.freshness(now) == Freshness::Fresh);
        let velocity = self.scene.velocity.filter(|_| is_fresh);
        let is_moving = |(mps, radps): (f64, f64)| mps.abs() > REST.0 || radps.abs() > REST.1;
        // It may have been measured before the robot received STOP.
        if let Some(velocity) = velocity.filter(|velocity| is_moving(*velocity)) {
            return StopStatus::Moving(velocity.0.abs());
        }
        let is_measured = age_s("odometry").is_some_and(|age_s| age_s <= since_s);
        let task = self.readings.newest::<TaskReading>().is_some_and(TaskReading::is_stopped);
        let reported = age_s("progress")
            .is_some_and(|age_s| age_s <= since_s && age_s < PROGRESS_VALID_S)
            && task;
        match velocity {
            _ if reported => StopStatus::Stands,
            Some(_) if is_measured => StopStatus::Stands,
            Some(_) => StopStatus::Sent,
            None if self.is_linked("odometry") => StopStatus::OldData,
            None => StopStatus::Unmeasured,
        }
    }

    /// Raises an alert for each thing that has gone wrong.
    pub fn watch_conditions(&mut self, now: ClockTimes) {
        let mut conditions = Vec::new();
        match &self.connection {
            SystemConnection::Ended { system, is_normal: false, .. } => {
                conditions.push(format!("{system} has ended"));
            }
            SystemConnection::Cut { .. } if now.host_s - self.lost_s >= CUT_ALERT_S => {
                conditions.push(CUT.into());
            }
            SystemConnection::Cut { .. }
            | SystemConnection::Ending { .. }
            | SystemConnection::Ended { .. }
            | SystemConnection::Awaited { .. } => {}
            SystemConnection::Part | SystemConnection::Live { .. } => {
                let silent = self.list_silent(now);
                let gone = silent.filter(|(_, how, _)| *how == Freshness::Gone);
                conditions.extend(gone.map(|(link, ..)| format!("no data at {}", link.input)));
                conditions.extend(self.delivery_warning());
                if self.goal_problem(now).is_some() && !self.unheard.contains("goal") {
                    conditions.push("no path to the goal".into());
                }
                if self.orders.is_frame_new() {
                    conditions.push("the map has a new origin".into());
                }
                let battery = self.readings.newest::<BatteryReading>();
                if battery.is_some_and(BatteryReading::is_low) {
                    conditions.push("the battery is low".into());
                }
            }
        }
        if self.stop_status(now) == Some(StopStatus::NotDelivered) {
            conditions.push("STOP not delivered".into());
        }
        self.alerts.update_conditions(conditions, now.host_s);
    }

    /// Records the number of links that accepted a command.
    pub fn record_sent(&mut self, command: &RobotCommand, to: usize, now: ClockTimes) {
        match command {
            RobotCommand::Stop(is_on) => self.record_stop(*is_on, to, now),
            command => {
                if let Some(output) = command.output() {
                    self.record_delivery(output, to);
                }
            }
        }
    }

    /// Records the number of links that accepted a command on an output.
    pub fn record_delivery(&mut self, output: &str, to: usize) {
        let Some(output) = ["goal", "velocity", "stop"].into_iter().find(|it| *it == output) else {
            return;
        };
        self.unheard.remove(output);
        if to > 0 {
            return;
        }
        if output == "goal"
            && let Some((place, at_s)) = self.orders.drop_unheard_goal()
        {
            // It is refused: nothing remains that a subscriber could still receive.
            let why = "nothing receives goals: what is linked to `goal` does not run".into();
            self.refusal = Some(OrderRefusal { place, why, at_s });
        } else {
            self.unheard.insert(output);
        }
    }

    /// Returns a warning if an order reaches no subscriber; STOP has priority.
    pub fn delivery_warning(&self) -> Option<String> {
        let output =
            ["stop", "velocity", "goal"].into_iter().find(|of| self.unheard.contains(of))?;
        Some(format!("no subscriber: no link accepts `{output}`"))
    }

    /// Returns the steady links without recent data, each with the age of its newest data in
    /// seconds.
    pub fn list_silent(
        &self,
        now: ClockTimes,
    ) -> impl Iterator<Item = (&InputLink, Freshness, f64)> {
        let status =
            move |link: &InputLink| (link.freshness(now), link.age_s(now).unwrap_or_default());
        self.links.iter().map(move |link| (link, status(link))).filter_map(
            |(link, (how, age_s))| {
                matches!(how, Freshness::Late | Freshness::Gone).then_some((link, how, age_s))
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LocatedPose;
    use armor_grid::Pose2;

    const FIRST: SequenceNumber = SequenceNumber { instance: 1, sequence: 0 };

    fn now(host_s: f64) -> ClockTimes {
        ClockTimes { host_s, system_s: host_s }
    }

    #[test]
    fn arrival_is_noticed_at_the_next_pose() {
        let mut console = Console::default();
        console.handle_order(
            OperatorOrder::Goal { place: Pose2::IDENTITY, has_heading: false },
            now(0.0),
        );
        let here = LocatedPose { stamp_s: 1.0, pose: Pose2::IDENTITY, covariance_m2: [0.0; 3] };
        let outcome = console.scene.set_located(here);
        console.record_arrival("pose", now(1.0), 1.0, FIRST, outcome);
        assert_eq!(console.orders.take_event(), Some(OperatorEvent::Goal));
        assert_eq!(console.orders.take_event(), Some(OperatorEvent::Arrived));
        assert!(console.recent_arrival(now(2.0)).is_some());
        assert!(console.recent_arrival(now(20.0)).is_none());
        // On a map with another origin its place means nothing.
        let refused = OrderRefusal { place: Point2::default(), why: String::new(), at_s: 2.0 };
        console.refusal = Some(refused);
        console.frame_seen("map");
        assert!(console.recent_refusal(now(2.0)).is_some());
        console.frame_seen("map#2");
        assert!(console.recent_arrival(now(2.0)).is_none());
        assert!(console.recent_refusal(now(2.0)).is_none());
    }

    #[test]
    fn an_order_without_subscriber_gives_a_warning() {
        let mut console = Console::default();
        console.record_sent(&RobotCommand::Stop(true), 0, now(0.0));
        // The zero velocity of the same moment is delivered, but STOP is not.
        console.record_sent(
            &RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 },
            1,
            now(0.0),
        );
        assert_eq!(
            console.delivery_warning().as_deref(),
            Some("no subscriber: no link accepts `stop`")
        );
        console.record_sent(&RobotCommand::Stop(true), 1, now(0.0));
        assert_eq!(console.delivery_warning(), None);
    }

    #[test]
    fn a_goal_without_subscriber_is_refused_once_and_leaves_no_warning() {
        let mut console = Console::default();
        let order = OperatorOrder::Goal { place: Pose2::IDENTITY, has_heading: false };
        for command in console.handle_order(order, now(1.0)) {
            console.record_sent(&command, 0, now(1.0));
        }
        assert!(console.orders.goal().is_none());
        let refusal = console.recent_refusal(now(1.1)).expect("it is refused");
        assert!(refusal.why.contains("nothing receives goals"), "{}", refusal.why);
        assert_eq!(console.delivery_warning(), None, "nothing is left to deliver");
        // One that was received stays: its subscriber may return.
        let order = OperatorOrder::Goal { place: Pose2::IDENTITY, has_heading: false };
        for command in console.handle_order(order, now(2.0)) {
            console.record_sent(&command, 1, now(2.0));
        }
        let repeated = console.orders.repeat_order(9.0).expect("it is repeated");
        console.record_sent(&repeated, 0, now(9.0));
        assert!(console.orders.goal().is_some());
        let warning = console.delivery_warning();
        assert_eq!(warning.as_deref(), Some("no subscriber: no link accepts `goal`"));
    }

    #[test]
    fn the_robot_stands_only_when_its_odometry_or_its_driver_shows_it_after_stop() {
        let mut console = Console::default();
        console.links.push(InputLink::new("odometry", "base.odometry".into(), true));
        console.links.push(InputLink::new("progress", "driver.progress".into(), false));
        let status = |console: &Console, host_s| console.stop_status(now(host_s));
        let mut number = FIRST;
        let mut arrive = |console: &mut Console, input: &str, host_s| {
            number.sequence += 1;
            console.record_arrival(input, now(host_s), host_s, number, Ok(()));
        };
        console.scene.velocity = Some((0.0, 0.0));
        arrive(&mut console, "odometry", 0.9);
        assert_eq!(status(&console, 1.0), None);
        console.handle_order(OperatorOrder::Stop, now(1.0));
        assert_eq!(status(&console, 1.0), Some(StopStatus::Sent));
        console.record_stop(true, 0, now(1.1));
        assert_eq!(status(&console, 1.1), Some(StopStatus::NoSubscriber));
        console.record_stop(true, 1, now(1.1));
        assert_eq!(status(&console, 1.1), Some(StopStatus::Sent), "measured before STOP");
        console.scene.velocity = Some((0.3, 0.0));
        arrive(&mut console, "odometry", 1.2);
        console.readings.store(TaskReading { task: "stopped".into() });
        arrive(&mut console, "progress", 1.2);
        assert_eq!(status(&console, 1.2), Some(StopStatus::Moving(0.3)), "it brakes");
        console.scene.velocity = Some((0.0, 0.0));
        arrive(&mut console, "odometry", 1.3);
        assert_eq!(status(&console, 1.3), Some(StopStatus::Stands));
        assert_eq!(status(&console, 8.0), Some(StopStatus::OldData));
        console.links.remove(0);
        assert_eq!(status(&console, 1.3), Some(StopStatus::Stands), "the driver reports it");
        assert_eq!(status(&console, 8.0), Some(StopStatus::Unmeasured));
    }

    #[test]
    fn stop_without_a_connection_is_remembered_and_other_orders_are_not() {
        let mut console = Console::default();
        console.cut_connection("rover", "", now(1.0));
        console.handle_order(OperatorOrder::Drive { forward: 1.0, turn: 0.0 }, now(1.0));
        console.handle_order(OperatorOrder::Press("home".into()), now(1.0));
        assert!(console.orders.pressed().is_none() && console.refusal.is_none());
        let commands = console.handle_order(OperatorOrder::Stop, now(2.0));
        assert_eq!(commands, [RobotCommand::Stop(true)]);
        assert_eq!(console.stop_status(now(2.0)), Some(StopStatus::NotDelivered));
        console.handle_order(OperatorOrder::Release, now(3.0));
        assert!(console.orders.is_stopped(), "nothing is known of the robot");
        assert_eq!(console.stop.begin_again(4.0), Some(true));
        let end = RunEnd { why: String::new(), is_normal: true };
        console.end_system("rover", end, now(9.0));
        assert_eq!(console.run_time(now(99.0)).host_s, 1.0, "when its data ended");
        console.watch_conditions(now(99.0));
        assert_eq!(console.alerts.count_new(), 0);
    }

    #[test]
    fn a_problem_with_data_stays_at_the_link_until_valid_data_arrive() {
        let mut console = Console::default();
        console.links.push(InputLink::new("scan", "laser.scan".into(), true));
        console.record_arrival("scan", now(0.0), 0.0, FIRST, Err(SceneError::Angles));
        let problem = |console: &Console| console.link("scan").and_then(|l| l.problem.clone());
        assert!(problem(&console).is_some_and(|text| text.contains("angles")));
        console.record_arrival("scan", now(0.1), 0.1, FIRST, Ok(()));
        assert_eq!(problem(&console), None);
        assert_eq!(console.list_silent(now(0.2)).count(), 0);
        assert_eq!(console.list_silent(now(9.0)).count(), 1);
    }
}
