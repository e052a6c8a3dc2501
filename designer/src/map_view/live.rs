//! The mission on the map while it runs: the robots at their poses with their trails, done and coming legs,
//! what others track, and a strip with progress, expected times and orders. Closed, it costs nothing, and
//! no output is linked to.

mod following;
mod on_map;
pub(in crate::map_view) mod robots;
mod strip;
mod tracks;
mod words;

use armor_robotfile::timing::{FollowedMission, RouteProgress};

use crate::live::mission;
use crate::map_view::live::robots::ShownRobot;
use crate::map_view::live::tracks::TrackPicture;

/// What the view of the map shows of the system that is watched.
#[derive(Default)]
pub struct LiveMap {
    /// Whether it is shown.
    pub is_open: bool,
    /// The routes of the version that is played, and of which version of which system they are.
    followed: Option<(FollowedVersion, FollowedMission)>,
    /// Why nothing is shown of the system, if that is so.
    why_not: Option<String>,
    /// The robots, one for each route.
    robots: Vec<ShownRobot>,
    /// How far each route has come.
    progress: Vec<RouteProgress>,
    /// What others track.
    tracks: TrackPicture,
    /// When the mission was paused, as far as this window has seen it.
    pauses: Vec<[f64; 2]>,
    /// Since when it is paused, if it is.
    paused_s: Option<f64>,
    /// The buttons of an operator.
    orders: mission::Panel,
}

/// What the routes were read from.
#[derive(Clone, Debug, PartialEq)]
struct FollowedVersion {
    /// The system.
    registry: String,
    /// The version that its mission plays; none if its text is not known here.
    played: Option<u64>,
    /// The revision of the open files, of which the routes are if the version is not known.
    revision: Option<u64>,
}

impl LiveMap {
    /// Shows or hides it.
    pub fn toggle(&mut self) {
        *self = Self { is_open: !self.is_open, ..Self::default() };
    }
}
