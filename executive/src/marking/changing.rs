//! What the marking shows of a version of the file that is there and not played.

use crate::change::{Change, Standing};
use crate::controller::Controller;
use armor_sdk::Message;

/// A version of the file that is not played.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct MissionChange {
    /// Its number.
    pub version: u64,
    /// `reading`, `waiting` or `refused`.
    pub state: String,
    /// What it waits for, or why it is refused.
    pub why: String,
    /// What would not be as before.
    pub changes: Vec<String>,
}

impl Controller {
    pub(super) fn change_shown(&self) -> Option<MissionChange> {
        let Change { version, standing, .. } = self.change.as_ref()?;
        let (state, why, changes) = match standing {
            Standing::Reading => ("reading", "", &[][..]),
            Standing::Waiting { offer, why, .. } => ("waiting", why.as_str(), &offer.changes[..]),
            Standing::Refused(why) => ("refused", why.as_str(), &[][..]),
        };
        Some(MissionChange {
            version: version.number,
            state: state.to_owned(),
            why: why.to_owned(),
            changes: changes.to_vec(),
        })
    }
}
