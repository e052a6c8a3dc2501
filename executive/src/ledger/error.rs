//! Why a journal does not fit a plan.

/// Why a record does not fit what came before it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LedgerError {
    /// The journal was written for another mission, or another version of it.
    #[error("the journal belongs to mission `{mission}` with fingerprint {fingerprint}")]
    OtherMission {
        /// Its mission.
        mission: String,
        /// Its fingerprint.
        fingerprint: String,
    },
    /// A new version of the file that cannot be taken there.
    #[error("the journal states that version {version} of the file was taken, but: {why}")]
    NotTaken {
        /// Its number.
        version: u64,
        /// What is wrong.
        why: String,
    },
    /// A name that the plan does not have.
    #[error("the journal speaks of `{0}`, which the mission does not have")]
    UnknownName(String),
    /// A number of no firing in flight.
    #[error("the journal speaks of firing {0}, which is not in flight")]
    UnknownFiring(u64),
    /// The net does not allow it there.
    #[error("the journal states that `{what}` happened, but the net does not allow it: {why}")]
    NotAllowed {
        /// What was to happen.
        what: String,
        /// The error of the net.
        why: armor_petri::FireError,
    },
}
