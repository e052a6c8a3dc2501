//! Orders of the operator: which can be carried out, why a goal was refused, and whether one was reached.

use armor_grid::Point2;

use super::Console;
use crate::goal_check::check_goal;
use crate::links::ClockTimes;
use crate::orders::{OperatorOrder, RobotCommand};

/// How long a refusal, or the arrival at a goal, is shown, in seconds.
const REFUSAL_SHOWN_S: f64 = 6.0;

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
            // Of a run that has ended there is nothing to continue.
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
}
