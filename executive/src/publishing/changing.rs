//! What the marking shows of a version of the file that is there and not played.

use crate::change::{Change, Standing};
use crate::controller::Controller;
use armor_marking::{ChangeState, MissionChange};

impl Controller {
    pub(super) fn change_shown(&self) -> Option<MissionChange> {
        let Change { version, standing, .. } = self.change.as_ref()?;
        let (state, why, changes) = match standing {
            Standing::Reading => (ChangeState::Reading, "", &[][..]),
            Standing::Waiting { offer, why, .. } => {
                (ChangeState::Waiting, why.as_str(), &offer.changes[..])
            }
            Standing::Refused(why) => (ChangeState::Refused, why.as_str(), &[][..]),
        };
        Some(MissionChange {
            version: version.number,
            state,
            why: why.to_owned(),
            changes: changes.to_vec(),
        })
    }
}
