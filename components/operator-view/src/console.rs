//! All that the screen shows and the operator has ordered, in one place. Sockets fill it, the window
//! looks at it; neither is needed to try it.

use std::collections::BTreeSet;

use crate::links::{ClockTimes, Freshness, InputLink, SequenceNumber};
use crate::orders::{OperatorOrder, OperatorOrders, RobotCommand};
use crate::readings::Readings;
use crate::scene::{RobotScene, SceneError};

/// What the operator sees and has ordered.
#[derive(Clone, Debug, Default)]
pub struct Console {
    /// What is known of the robot.
    pub scene: RobotScene,
    /// What the panels keep of their own inputs.
    pub readings: Readings,
    /// The linked inputs.
    pub links: Vec<InputLink>,
    /// The orders that hold.
    pub orders: OperatorOrders,
    /// The outputs whose last order reached nobody.
    pub unheard: BTreeSet<&'static str>,
    /// The mission's own buttons.
    pub buttons: Vec<String>,
    /// Radius of the circle that is drawn for the robot, in metres.
    pub robot_radius_m: f64,
    /// The screen is to close.
    pub is_over: bool,
}

impl Console {
    /// The link of an input, if it is linked.
    pub fn link(&self, input: &str) -> Option<&InputLink> {
        self.links.iter().find(|link| link.input == input)
    }

    /// Whether an input is linked.
    pub fn is_linked(&self, input: &str) -> bool {
        self.link(input).is_some()
    }

    /// Takes notice of data of an input, and of what came of them.
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
        if let Some(robot) = self.scene.robot() {
            self.orders.check_arrival(robot);
        }
    }

    /// Carries out an order of the operator.
    pub fn handle_order(&mut self, order: OperatorOrder, now: ClockTimes) -> Vec<RobotCommand> {
        self.orders.handle_order(order, now.host_s)
    }

    /// Takes notice of how many links took what was said.
    pub fn record_sent(&mut self, say: RobotCommand, to: usize) {
        let output = match say {
            RobotCommand::Goal(_) => "goal",
            RobotCommand::Velocity { .. } => "velocity",
            RobotCommand::Stop(_) => "stop",
        };
        if to == 0 {
            self.unheard.insert(output);
        } else {
            self.unheard.remove(output);
        }
    }

    /// What is ordered and reaches nobody; STOP before all.
    pub fn delivery_warning(&self) -> Option<String> {
        let output =
            ["stop", "velocity", "goal"].into_iter().find(|of| self.unheard.contains(of))?;
        Some(format!("nobody hears it: no link takes `{output}`"))
    }

    /// The links that are silent though they should not be, each with its age in seconds.
    pub fn list_silent(
        &self,
        now: ClockTimes,
    ) -> impl Iterator<Item = (&InputLink, Freshness, f64)> {
        let told =
            move |link: &InputLink| (link.freshness(now), link.age_s(now).unwrap_or_default());
        self.links.iter().map(move |link| (link, told(link))).filter_map(|(link, (how, age_s))| {
            matches!(how, Freshness::Late | Freshness::Gone).then_some((link, how, age_s))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orders::OperatorEvent;
    use crate::scene::LocatedPose;
    use armor_grid::Pose2;

    const FIRST: SequenceNumber = SequenceNumber { instance: 1, sequence: 0 };

    fn now(host_s: f64) -> ClockTimes {
        ClockTimes { host_s, system_s: host_s }
    }

    #[test]
    fn arriving_is_noticed_when_a_pose_comes() {
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
    }

    #[test]
    fn an_order_that_nobody_takes_is_told() {
        let mut console = Console::default();
        console.record_sent(RobotCommand::Stop(true), 0);
        // The hand that lets go in the same moment is heard, which makes STOP no better.
        console.record_sent(RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 }, 1);
        assert_eq!(
            console.delivery_warning().as_deref(),
            Some("nobody hears it: no link takes `stop`")
        );
        console.record_sent(RobotCommand::Stop(true), 1);
        assert_eq!(console.delivery_warning(), None);
    }

    #[test]
    fn what_is_wrong_with_data_stands_at_their_link_until_better_ones_come() {
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
