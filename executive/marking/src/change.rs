//! A newer version of the mission file that is not in force.

use crate::word::words;
use armor_wire::Message;

/// A newer version of the file that is not in force.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct MissionChange {
    /// Its number.
    pub version: u64,
    /// How far it has come.
    pub state: ChangeState,
    /// What it waits for, or why it is refused; empty while it is read.
    pub why: String,
    /// The differences to the version in force, in words.
    pub changes: Vec<String>,
}

words! {
    /// How far a newer version of the file has come.
    pub enum ChangeState {
        /// The executive reads it.
        Reading = "reading",
        /// It can be played; it waits for its moment, or for its proof.
        Waiting = "waiting",
        /// It will not be played.
        Refused = "refused",
    }
}
