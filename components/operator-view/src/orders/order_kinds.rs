//! What an operator can order, the commands that the robot is sent for it, and the events that the
//! mission hears.

use std::sync::Arc;

use armor_grid::Pose2;

/// What the operator can do.
#[derive(Clone, Debug, PartialEq)]
pub enum OperatorOrder {
    /// Drive to a goal; with a heading if one was drawn.
    Goal {
        /// Its pose on the map.
        place: Pose2,
        /// Whether the heading was chosen.
        has_heading: bool,
    },
    /// Delete the goal.
    Cancel,
    /// Confirm that the map frame has another origin now.
    Acknowledge,
    /// Mark all alerts as seen.
    AcknowledgeAlerts,
    /// Drive by hand, as shares of the limits in -1..=1. Repeated while a key or the stick is held.
    Drive {
        /// Ahead.
        forward: f64,
        /// To the left.
        turn: f64,
    },
    /// End driving by hand.
    LetGo,
    /// Stand, whatever else is ordered.
    Stop,
    /// End STOP.
    Release,
    /// A button of the mission: sent to the mission, not to the robot.
    Press(String),
    /// Let the paused mission continue.
    Resume,
    /// Answer a question of the mission.
    Answer {
        /// The transition that asks.
        transition: String,
        /// Whether it may fire.
        is_confirmed: bool,
    },
}

/// A command to the robot.
#[derive(Clone, Debug, PartialEq)]
pub enum RobotCommand {
    /// Where to drive.
    Goal {
        /// Its pose on the map.
        place: Pose2,
        /// The frame of that map.
        frame: Arc<str>,
    },
    /// How to drive.
    Velocity {
        /// Ahead, in m/s.
        forward_mps: f64,
        /// To the left, in rad/s.
        turn_radps: f64,
    },
    /// Whether it must stand.
    Stop(bool),
    /// To the executive: the pause ends.
    Resume,
    /// To the executive: the answer to a question of the mission.
    Answer {
        /// The transition that asks.
        transition: String,
        /// Whether it may fire.
        is_confirmed: bool,
    },
}

impl RobotCommand {
    /// Returns the output on which it is published, if it is.
    pub fn output(&self) -> Option<&'static str> {
        match self {
            Self::Goal { .. } => Some("goal"),
            Self::Velocity { .. } => Some("velocity"),
            Self::Stop(_) => Some("stop"),
            Self::Answer { .. } | Self::Resume => None,
        }
    }
}

/// An event for the mission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OperatorEvent {
    /// STOP was ordered.
    Stopped,
    /// STOP was released.
    Released,
    /// A goal was set.
    Goal,
    /// The robot is at the goal.
    Arrived,
    /// The operator has begun to drive by hand.
    Driving,
    /// The map frame has another origin.
    FrameChanged,
    /// A button of the mission was pressed.
    Pressed(String),
}

impl OperatorEvent {
    /// Those that follow an order of the operator, besides the buttons.
    pub const ORDERED: [Self; 5] =
        [Self::Stopped, Self::Released, Self::Goal, Self::Arrived, Self::Driving];

    /// Returns its name in a mission.
    pub fn name(&self) -> &str {
        match self {
            Self::Stopped => "stopped",
            Self::Released => "released",
            Self::Goal => "goal",
            Self::Arrived => "arrived",
            Self::Driving => "driving",
            Self::FrameChanged => "frame_changed",
            Self::Pressed(name) => name,
        }
    }
}
