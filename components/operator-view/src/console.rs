//! Everything that the screen shows and the operator has ordered, as plain data. Inputs fill it and
//! the window shows it; tests need neither.

mod conditions;
mod delivery;
mod mission_news;
mod order_check;
mod stop_check;

use std::collections::BTreeSet;

use armor_convert::FrameNews;
use armor_grid::Point2;

use crate::alerts::AlertList;
use crate::connection::{RunEnd, SystemConnection};
use crate::links::{ClockTimes, InputLink, SequenceNumber};
use crate::mission::MissionState;
use crate::orders::{OperatorOrder, OperatorOrders};
use crate::readings::Readings;
use crate::scene::{RobotScene, SceneError};
use crate::stop_delivery::StopDelivery;
pub use order_check::OrderRefusal;

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
}

#[cfg(test)]
mod tests {
    use armor_grid::Pose2;

    use super::*;
    use crate::orders::OperatorEvent;
    use crate::scene::LocatedPose;

    pub(super) const FIRST: SequenceNumber = SequenceNumber { instance: 1, sequence: 0 };

    pub(super) fn now(host_s: f64) -> ClockTimes {
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
