//! The stage of the mission as a whole.

use crate::terms::MissionOutcome;
use serde::{Deserialize, Serialize};

/// The stage of the mission as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MissionStage {
    /// It plays.
    Playing,
    /// It goes to the safe place.
    Retreating,
    /// Its last place is marked; what does not belong to it is being stopped.
    Ending(MissionOutcome),
    /// It is over.
    Ended(MissionOutcome),
}
