//! What the driver is doing, for people.

/// What the driver is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DrivingPhase {
    /// Stands: neither a path nor a manual velocity is fresh.
    Idle,
    /// Stands because `stop` orders it.
    Stopped,
    /// Follows a manual velocity.
    Manual,
    /// Stands: the scan, the odometry or the robot's pose is missing.
    Blind,
    /// Stands: the path is empty.
    WithoutPath,
    /// Stands: the zones of the robot's map frame are not known.
    WithoutZones,
    /// Stands: the path leads into a zone where no robot may be.
    AtZone,
    /// Drives along a path.
    Following {
        /// The rest of the path, in metres.
        to_go_m: f64,
    },
    /// Backs off and turns, since the robot was stuck.
    Escaping,
    /// Is at the end of the path: turns to the goal's heading, then stands.
    AtGoal,
}

impl DrivingPhase {
    /// Returns the phase as a task; empty if the driver has none.
    pub fn task(self) -> &'static str {
        match self {
            Self::Idle => "",
            Self::Stopped => "stopped",
            Self::Manual => "manual driving",
            Self::Blind => "waiting for scan, odometry and pose",
            Self::WithoutPath => "waiting for a path",
            Self::WithoutZones => "waiting for the zones",
            Self::AtZone => "standing before a zone",
            Self::Following { .. } => "driving",
            Self::Escaping => "freeing the stuck robot",
            Self::AtGoal => "at the goal",
        }
    }

    /// Returns details for people; may be empty.
    pub fn detail(self) -> String {
        match self {
            Self::Following { to_go_m } => format!("{to_go_m:.1} m to go"),
            _ => String::new(),
        }
    }
}
