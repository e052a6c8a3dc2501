//! The states in a marking that are one of a closed set of words.

use crate::word::words;

words! {
    /// The stage of a mission.
    pub enum MarkingStage {
        /// Its transitions fire.
        Playing = "playing",
        /// An operator has paused it, or the executive after a restart.
        Paused = "paused",
        /// It goes to its safe place.
        Retreating = "retreating",
        /// Its last place is marked; the other components are being stopped.
        Ending = "ending",
        /// The executive ends before the mission does.
        Stopping = "stopping",
        /// It has ended at its goal.
        Goal = "goal",
        /// It has ended in its safe place.
        Safe = "safe",
        /// It has ended and reached neither.
        Failed = "failed",
    }
}

impl MarkingStage {
    /// Whether the mission has ended, which stops its time.
    pub fn has_ended(self) -> bool {
        match self {
            Self::Goal | Self::Safe | Self::Failed => true,
            Self::Playing | Self::Paused | Self::Retreating | Self::Ending | Self::Stopping => {
                false
            }
        }
    }
}

words! {
    /// What a firing in flight waits for.
    pub enum FlightPhase {
        /// Components that must stop have not all confirmed it.
        Stopping = "stopping",
        /// Components that must start have not all confirmed it.
        Starting = "starting",
    }
}

words! {
    /// Who decides that an enabled transition fires.
    pub enum FiringDecider {
        /// The mission: it fires when its time comes.
        Mission = "mission",
        /// An operator orders it.
        Operator = "operator",
        /// The mission asks an operator first.
        Confirmation = "confirmation",
        /// An operator has declined it; it asks again when it is newly enabled.
        Declined = "declined",
    }
}

words! {
    /// The value of a guard in three-valued logic.
    pub enum TruthValue {
        /// It is true.
        True = "true",
        /// It is false.
        False = "false",
        /// Data that it reads has not arrived or is too old.
        Unknown = "not known",
    }
}

impl From<Option<bool>> for TruthValue {
    fn from(truth: Option<bool>) -> Self {
        match truth {
            Some(true) => Self::True,
            Some(false) => Self::False,
            None => Self::Unknown,
        }
    }
}

words! {
    /// What a component of a mission does, as far as the executive knows.
    pub enum MissionComponentState {
        /// It runs and is active.
        Active = "active",
        /// It runs and is frozen.
        Frozen = "frozen",
        /// It starts to be active.
        Starting = "starting",
        /// It has a command that it has not confirmed.
        Commanded = "commanded",
        /// The connection to it is lost.
        Lost = "lost",
        /// Its process has ended.
        Gone = "gone",
        /// It has not appeared since the executive started.
        Unseen = "unseen",
    }
}
