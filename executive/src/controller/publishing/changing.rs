//! What the marking shows of a version of the file that is there and not played.

use crate::controller::Controller;
use crate::controller::file_changes::{ChangeProgress, PendingChange};
use armor_marking::{ChangeState, MissionChange};

impl Controller {
    pub(super) fn change_shown(&self) -> Option<MissionChange> {
        let PendingChange { version, progress, .. } = self.changes.pending_change()?;
        let (state, why, changes) = match progress {
            ChangeProgress::Reading => (ChangeState::Reading, "", &[][..]),
            ChangeProgress::Waiting { offer, why, .. } => {
                (ChangeState::Waiting, why.as_str(), &offer.changes[..])
            }
            ChangeProgress::Refused(why) => (ChangeState::Refused, why.as_str(), &[][..]),
        };
        Some(MissionChange {
            version: version.number,
            state,
            why: why.to_owned(),
            changes: changes.to_vec(),
        })
    }
}
