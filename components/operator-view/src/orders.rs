//! Orders of the operator → commands to the robot. When driving by hand ends, zero is sent once; a
//! goal is sent again until the robot reaches it; STOP stays active until it is released.

mod order_kinds;

use std::collections::VecDeque;
use std::sync::Arc;

use armor_grid::{Point2, Pose2, wrap_angle};

pub use order_kinds::{OperatorEvent, OperatorOrder, RobotCommand};

/// Period of the velocity while driving by hand, in seconds: ten commands within the half second
/// after which a driver stops.
const DRIVE_PERIOD_S: f64 = 0.05;
/// Shortest time until a goal is sent again, in seconds, at any rate of the component.
const REPEAT_S: f64 = 0.02;
/// A goal with a heading is reached within this angle, in radians.
const HEADING_TOLERANCE_RAD: f64 = 0.26;
/// A goal without a path for this long is reported, in seconds.
const PATH_WITHIN_S: f64 = 1.0;
/// A path that ends within this distance of the goal leads to it, in metres: a planner may end it at
/// the nearest cell.
const PATH_END_M: f64 = 0.5;
/// Most events that wait to be reported; a person causes fewer in a tick.
const MAX_EVENTS: usize = 16;
/// Changes of the mission are taken for what a button has caused for this time, in seconds.
const FOLLOWED_S: f64 = 10.0;
/// Most of these changes that are kept.
const MAX_FOLLOWED: usize = 4;

/// Limits of orders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderLimits {
    /// Fastest by hand, in m/s.
    pub speed_mps: f64,
    /// Fastest turn by hand, in rad/s.
    pub turn_radps: f64,
    /// A goal is reached within this, in metres.
    pub tolerance_m: f64,
}

impl Default for OrderLimits {
    fn default() -> Self {
        Self { speed_mps: 0.5, turn_radps: 1.0, tolerance_m: 0.3 }
    }
}

/// The active goal.
#[derive(Clone, Debug, PartialEq)]
pub struct OperatorGoal {
    /// Its pose on the map.
    pub place: Pose2,
    frame: Arc<str>,
    has_heading: bool,
}

impl OperatorGoal {
    fn to_command(&self) -> RobotCommand {
        RobotCommand::Goal { place: self.place, frame: Arc::clone(&self.frame) }
    }
}

/// Whether the map frame is the one that the operator knows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum FrameKnowledge {
    #[default]
    Known,
    /// It has changed, and the operator has not acknowledged it yet.
    Changed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Hand {
    sent_s: f64,
    share: (f64, f64),
}

/// The active orders.
#[derive(Clone, Debug, Default)]
pub struct OperatorOrders {
    /// Limits of orders.
    pub limits: OrderLimits,
    goal: Option<OperatorGoal>,
    goal_set_s: f64,
    goal_sent_s: f64,
    /// Since when the goal has no path: since it was set, or since the last path to it.
    pathless_s: f64,
    hand: Option<Hand>,
    is_stopped: bool,
    /// Frame of the goals to come; `None` before the first pose or map.
    frame: Option<Arc<str>>,
    knowledge: FrameKnowledge,
    pressed: Option<(String, f64)>,
    /// The places that the mission went to after the button.
    followed: Vec<String>,
    /// The button that was pressed last during STOP.
    pressed_in_stop: Option<String>,
    events: VecDeque<OperatorEvent>,
}

impl OperatorOrders {
    /// The goal, until the robot is there.
    pub fn goal(&self) -> Option<&OperatorGoal> {
        self.goal.as_ref()
    }

    /// Whether the map frame has changed and the operator has not acknowledged it yet.
    pub fn is_frame_new(&self) -> bool {
        self.knowledge == FrameKnowledge::Changed
    }

    /// Sets the frame of the goals to come.
    pub fn set_frame(&mut self, frame: &str) {
        self.frame = Some(frame.into());
    }

    /// Deletes the goal, since its map frame has another origin now. Further goals are refused
    /// until the operator acknowledges: a click may still be meant for the map before.
    pub fn change_frame(&mut self, frame: &str) {
        self.set_frame(frame);
        self.goal = None;
        self.knowledge = FrameKnowledge::Changed;
        self.report(OperatorEvent::FrameChanged);
    }

    /// Whether STOP is active.
    pub fn is_stopped(&self) -> bool {
        self.is_stopped
    }

    /// Takes over a STOP that another window has ordered: nothing is reported again.
    pub fn adopt_stop(&mut self) {
        self.is_stopped = true;
        self.goal = None;
        self.hand = None;
    }

    /// Whether the operator drives by hand.
    pub fn is_driving(&self) -> bool {
        self.hand.is_some()
    }

    /// The button that was pressed last, and when by the host's clock.
    pub fn pressed(&self) -> Option<&(String, f64)> {
        self.pressed.as_ref()
    }

    /// Takes the places of the mission after they have changed at `now_s` of the host's clock: they
    /// may be what the last button has caused.
    pub fn follow_button(&mut self, places: &[String], now_s: f64) {
        let is_recent = |at_s: f64| now_s - at_s < FOLLOWED_S;
        if self.pressed.as_ref().is_some_and(|(_, at_s)| is_recent(*at_s))
            && self.followed.len() < MAX_FOLLOWED
        {
            self.followed.push(places.join(" and "));
        }
    }

    /// The places that the mission went to after the last button, in their order.
    pub fn followed_button(&self) -> &[String] {
        &self.followed
    }

    /// The button of the mission that was pressed last since STOP: with what Release continues.
    pub fn pressed_in_stop(&self) -> Option<&str> {
        self.pressed_in_stop.as_deref()
    }

    /// Carries out an order given at `now_s` of the host's clock.
    pub fn handle_order(&mut self, order: OperatorOrder, now_s: f64) -> Vec<RobotCommand> {
        match order {
            OperatorOrder::Goal { place, has_heading } => {
                (self.goal_set_s, self.goal_sent_s, self.pathless_s) = (now_s, now_s, now_s);
                let frame = self.frame.clone().unwrap_or_else(|| "map".into());
                self.set_goal(OperatorGoal { place, frame, has_heading })
            }
            // The alerts are the console's.
            OperatorOrder::AcknowledgeAlerts => Vec::new(),
            OperatorOrder::Cancel => {
                self.goal = None;
                Vec::new()
            }
            OperatorOrder::Acknowledge => {
                self.knowledge = FrameKnowledge::Known;
                Vec::new()
            }
            OperatorOrder::Drive { forward, turn } => self.drive((forward, turn), now_s),
            OperatorOrder::LetGo => self.let_go(),
            OperatorOrder::Stop => self.stop(),
            OperatorOrder::Release if self.is_stopped => {
                self.is_stopped = false;
                self.pressed_in_stop = None;
                self.report(OperatorEvent::Released);
                vec![RobotCommand::Stop(false)]
            }
            OperatorOrder::Release => Vec::new(),
            OperatorOrder::Press(name) => {
                // A button returns the robot to its mission, which chooses its goals itself.
                self.goal = None;
                self.report(OperatorEvent::Pressed(name.clone()));
                self.pressed_in_stop = Some(name.clone()).filter(|_| self.is_stopped);
                self.pressed = Some((name, now_s));
                self.followed.clear();
                Vec::new()
            }
            OperatorOrder::Resume => vec![RobotCommand::Resume],
            OperatorOrder::Answer { transition, is_confirmed } => {
                vec![RobotCommand::Answer { transition, is_confirmed }]
            }
        }
    }

    /// Returns the active goal if it is due to be sent again.
    pub fn repeat_order(&mut self, now_s: f64) -> Option<RobotCommand> {
        let goal = self.goal.as_ref().filter(|_| now_s - self.goal_sent_s >= REPEAT_S)?;
        self.goal_sent_s = now_s;
        Some(goal.to_command())
    }

    /// Deletes a goal that no link has accepted when it was set; returns its place and when that was,
    /// by the host's clock. One that was received before stays, since its subscriber may return.
    pub fn drop_unheard_goal(&mut self) -> Option<(Point2, f64)> {
        let is_new = self.goal_set_s == self.goal_sent_s;
        let goal = self.goal.take_if(|_| is_new)?;
        Some((goal.place.point(), self.goal_set_s))
    }

    /// Takes notice of a path that ends at `end`.
    pub fn check_path(&mut self, end: Point2, now_s: f64) {
        let leads_there = |goal: &OperatorGoal| {
            goal.place.point().distance_m(end) <= self.limits.tolerance_m.max(PATH_END_M)
        };
        if self.goal.as_ref().is_some_and(leads_there) {
            self.pathless_s = now_s;
        }
    }

    /// Returns for how long the goal has had no path, in seconds, if that is longer than a planner
    /// needs.
    pub fn pathless_s(&self, now_s: f64) -> Option<f64> {
        self.goal.as_ref()?;
        Some(now_s - self.pathless_s).filter(|time_s| *time_s >= PATH_WITHIN_S)
    }

    /// Takes notice of where the robot is on the map. Returns the goal if it is there.
    pub fn check_arrival(&mut self, robot: Pose2) -> Option<Point2> {
        let &OperatorGoal { place, has_heading, .. } = self.goal.as_ref()?;
        let is_near = robot.point().distance_m(place.point()) <= self.limits.tolerance_m;
        let off_rad = wrap_angle(robot.yaw_rad - place.yaw_rad).abs();
        if !is_near || has_heading && off_rad > HEADING_TOLERANCE_RAD {
            return None;
        }
        self.goal = None;
        self.report(OperatorEvent::Arrived);
        Some(place.point())
    }

    /// The event to report next.
    pub fn take_event(&mut self) -> Option<OperatorEvent> {
        self.events.pop_front()
    }

    fn set_goal(&mut self, goal: OperatorGoal) -> Vec<RobotCommand> {
        let Pose2 { x_m, y_m, yaw_rad } = goal.place;
        // During STOP goals are refused: otherwise the release of STOP would start the robot.
        if self.is_stopped
            || self.is_frame_new()
            || !(x_m.is_finite() && y_m.is_finite() && yaw_rad.is_finite())
        {
            return Vec::new();
        }
        let command = goal.to_command();
        self.goal = Some(goal);
        self.report(OperatorEvent::Goal);
        vec![command]
    }

    fn drive(&mut self, share: (f64, f64), now_s: f64) -> Vec<RobotCommand> {
        if self.is_stopped || !(share.0.is_finite() && share.1.is_finite()) {
            return self.let_go();
        }
        let share = (share.0.clamp(-1.0, 1.0), share.1.clamp(-1.0, 1.0));
        match self.hand {
            None => self.report(OperatorEvent::Driving),
            Some(hand) if hand.share == share && now_s - hand.sent_s < DRIVE_PERIOD_S => {
                return Vec::new();
            }
            Some(_) => {}
        }
        self.hand = Some(Hand { sent_s: now_s, share });
        vec![RobotCommand::Velocity {
            forward_mps: share.0 * self.limits.speed_mps,
            turn_radps: share.1 * self.limits.turn_radps,
        }]
    }

    fn let_go(&mut self) -> Vec<RobotCommand> {
        let zero = RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 };
        self.hand.take().map(|_| zero).into_iter().collect()
    }

    fn stop(&mut self) -> Vec<RobotCommand> {
        if !self.is_stopped {
            self.report(OperatorEvent::Stopped);
        }
        self.is_stopped = true;
        self.goal = None;
        // STOP is sent first: no other command may delay it.
        let mut commands = vec![RobotCommand::Stop(true)];
        commands.extend(self.let_go());
        commands
    }

    fn report(&mut self, event: OperatorEvent) {
        if self.events.len() < MAX_EVENTS {
            self.events.push_back(event);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ZERO: RobotCommand = RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 };

    fn goal(x_m: f64, has_heading: bool) -> OperatorOrder {
        OperatorOrder::Goal { place: Pose2::new(x_m, 0.0, 0.0), has_heading }
    }

    fn events(orders: &mut OperatorOrders) -> Vec<OperatorEvent> {
        std::iter::from_fn(|| orders.take_event()).collect()
    }

    #[test]
    fn letting_go_sends_zero_once() {
        let mut orders = OperatorOrders::default();
        let full = || OperatorOrder::Drive { forward: 1.0, turn: -3.0 };
        let fast = vec![RobotCommand::Velocity { forward_mps: 0.5, turn_radps: -1.0 }];
        assert_eq!(orders.handle_order(full(), 0.0), fast, "beyond the limits nothing is ordered");
        assert_eq!(orders.handle_order(full(), 0.01), [], "not more often than needed");
        assert_eq!(orders.handle_order(full(), 0.06), fast);
        assert_eq!(orders.handle_order(OperatorOrder::LetGo, 0.07), [ZERO]);
        assert_eq!(orders.handle_order(OperatorOrder::LetGo, 0.08), []);
        assert_eq!(orders.repeat_order(9.0), None);
        assert_eq!(events(&mut orders), [OperatorEvent::Driving]);
    }

    #[test]
    fn stop_overrides_everything_until_it_is_released() {
        let mut orders = OperatorOrders::default();
        orders.handle_order(goal(5.0, false), 0.0);
        orders.handle_order(OperatorOrder::Drive { forward: 1.0, turn: 0.0 }, 0.0);
        assert_eq!(orders.handle_order(OperatorOrder::Stop, 0.1), [RobotCommand::Stop(true), ZERO]);
        assert_eq!(orders.handle_order(OperatorOrder::Drive { forward: 1.0, turn: 0.0 }, 0.2), []);
        assert_eq!(orders.handle_order(goal(5.0, false), 0.3), []);
        assert_eq!(orders.repeat_order(9.0), None, "the goal of before is gone too");
        assert_eq!(
            orders.handle_order(OperatorOrder::Stop, 0.4),
            [RobotCommand::Stop(true)],
            "repeated by the component, ordered once"
        );
        assert_eq!(orders.handle_order(OperatorOrder::Release, 0.5), [RobotCommand::Stop(false)]);
        assert_eq!(orders.handle_order(OperatorOrder::Release, 0.6), []);
        let expected = [
            OperatorEvent::Goal,
            OperatorEvent::Driving,
            OperatorEvent::Stopped,
            OperatorEvent::Released,
        ];
        assert_eq!(events(&mut orders), expected);
    }

    #[test]
    fn a_goal_is_sent_until_the_robot_reaches_it() {
        let mut orders = OperatorOrders::default();
        let place = Pose2::new(2.0, 0.0, 0.0);
        let command = || RobotCommand::Goal { place, frame: "map".into() };
        assert_eq!(orders.handle_order(goal(2.0, false), 0.0), [command()]);
        orders.check_arrival(Pose2::new(1.0, 0.0, 0.0));
        assert_eq!(orders.repeat_order(9.0), Some(command()));
        orders.check_arrival(Pose2::new(1.8, 0.0, 3.0));
        assert_eq!(orders.repeat_order(9.0), None, "its heading was not asked for");
        assert_eq!(events(&mut orders), [OperatorEvent::Goal, OperatorEvent::Arrived]);
    }

    #[test]
    fn a_goal_without_a_path_for_a_second_is_known() {
        let mut orders = OperatorOrders::default();
        orders.handle_order(goal(2.0, false), 5.0);
        assert_eq!(orders.pathless_s(5.9), None);
        orders.check_path(Point2::new(9.0, 0.0), 5.9);
        assert_eq!(orders.pathless_s(7.0), Some(2.0), "that path leads to another goal");
        orders.check_path(Point2::new(2.1, 0.0), 7.0);
        assert_eq!(orders.pathless_s(7.5), None);
        orders.handle_order(OperatorOrder::Cancel, 8.0);
        assert_eq!(orders.pathless_s(99.0), None);
    }

    #[test]
    fn a_goal_with_a_heading_is_reached_in_that_heading() {
        let mut orders = OperatorOrders::default();
        orders.handle_order(goal(2.0, true), 0.0);
        orders.check_arrival(Pose2::new(2.0, 0.0, 3.0));
        assert!(orders.goal().is_some());
        orders.check_arrival(Pose2::new(2.0, 0.0, -0.1));
        assert!(orders.goal().is_none());
    }

    #[test]
    fn a_button_is_sent_to_the_mission_once() {
        let mut orders = OperatorOrders::default();
        assert_eq!(orders.handle_order(OperatorOrder::Press("home".into()), 3.0), []);
        assert_eq!(orders.pressed(), Some(&("home".to_owned(), 3.0)));
        assert_eq!(orders.take_event().map(|event| event.name().to_owned()), Some("home".into()));
        assert_eq!(orders.take_event(), None);
    }

    #[test]
    fn after_a_change_of_the_frame_goals_wait_for_the_operator() {
        let mut orders = OperatorOrders::default();
        orders.set_frame("map");
        orders.handle_order(goal(2.0, false), 0.0);
        orders.change_frame("map#3f2a");
        assert!(
            orders.goal().is_none() && orders.repeat_order(9.0).is_none() && orders.is_frame_new()
        );
        assert_eq!(orders.handle_order(goal(2.0, false), 1.0), [], "a click on the map before");
        let stop = orders.handle_order(OperatorOrder::Stop, 1.1);
        assert_eq!(stop, [RobotCommand::Stop(true)], "STOP waits for nothing");
        orders.handle_order(OperatorOrder::Release, 1.2);
        orders.handle_order(OperatorOrder::Acknowledge, 1.3);
        let commands = orders.handle_order(goal(2.0, false), 2.0);
        assert!(
            matches!(&commands[..], [RobotCommand::Goal { frame, .. }] if &**frame == "map#3f2a"),
            "{commands:?}"
        );
        assert_eq!(events(&mut orders)[..2], [OperatorEvent::Goal, OperatorEvent::FrameChanged]);
    }

    #[test]
    fn invalid_numbers_are_ignored() {
        let mut orders = OperatorOrders::default();
        assert_eq!(orders.handle_order(goal(f64::NAN, false), 0.0), []);
        orders.handle_order(OperatorOrder::Drive { forward: 1.0, turn: 0.0 }, 0.0);
        assert_eq!(
            orders.handle_order(OperatorOrder::Drive { forward: f64::NAN, turn: 0.0 }, 0.1),
            [ZERO]
        );
    }

    #[test]
    fn a_mission_button_deletes_the_goal() {
        let mut orders = OperatorOrders::default();
        orders.handle_order(goal(3.0, false), 0.0);
        orders.handle_order(OperatorOrder::Press("home".into()), 1.0);
        assert!(orders.goal().is_none() && orders.repeat_order(9.0).is_none());
        assert_eq!(
            events(&mut orders),
            [OperatorEvent::Goal, OperatorEvent::Pressed("home".into())]
        );
    }
}
