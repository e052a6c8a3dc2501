//! Everything that the screen shows and the operator has ordered, as plain data. Inputs fill it and
//! the window shows it; tests need neither.

use std::collections::BTreeSet;

use armor_convert::FrameNews;

use crate::links::{ClockTimes, Freshness, InputLink, SequenceNumber};
use crate::orders::{OperatorOrder, OperatorOrders, RobotCommand};
use crate::readings::Readings;
use crate::scene::{RobotScene, SceneError};

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
        if let Some(robot) = self.scene.robot() {
            self.orders.check_arrival(robot);
        }
    }

    /// Takes the frame of a pose or a map: if it has another origin than before, the scene is
    /// cleared and the goal deleted.
    pub fn frame_seen(&mut self, frame: &str) {
        match self.scene.frame_seen(frame) {
            FrameNews::Same => {}
            FrameNews::First => self.orders.set_frame(frame),
            FrameNews::Changed => self.orders.change_frame(frame),
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
        self.orders.handle_order(order, now.host_s)
    }

    /// Records the number of links that accepted a command.
    pub fn record_sent(&mut self, command: &RobotCommand, to: usize) {
        let output = match command {
            RobotCommand::Goal { .. } => "goal",
            RobotCommand::Velocity { .. } => "velocity",
            RobotCommand::Stop(_) => "stop",
        };
        if to == 0 {
            self.unheard.insert(output);
        } else {
            self.unheard.remove(output);
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
    use crate::orders::OperatorEvent;
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
    }

    #[test]
    fn an_order_without_subscriber_gives_a_warning() {
        let mut console = Console::default();
        console.record_sent(&RobotCommand::Stop(true), 0);
        // The zero velocity of the same moment is delivered, but STOP is not.
        console.record_sent(&RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 }, 1);
        assert_eq!(
            console.delivery_warning().as_deref(),
            Some("no subscriber: no link accepts `stop`")
        );
        console.record_sent(&RobotCommand::Stop(true), 1);
        assert_eq!(console.delivery_warning(), None);
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
