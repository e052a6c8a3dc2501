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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DateWindow, MissedAction, UnansweredAction};

    #[test]
    fn the_words_that_travel_are_part_of_the_protocol() {
        use MarkingStage as Stage;
        use MissionComponentState as State;
        let stages = [Stage::Playing, Stage::Paused, Stage::Retreating, Stage::Ending];
        let ends = [Stage::Stopping, Stage::Goal, Stage::Safe, Stage::Failed];
        assert_eq!(stages.map(Stage::as_str), ["playing", "paused", "retreating", "ending"]);
        assert_eq!(ends.map(Stage::as_str), ["stopping", "goal", "safe", "failed"]);
        let running = [State::Active, State::Frozen, State::Starting, State::Commanded];
        let absent = [State::Lost, State::Gone, State::Unseen];
        assert_eq!(running.map(State::as_str), ["active", "frozen", "starting", "commanded"]);
        assert_eq!(absent.map(State::as_str), ["lost", "gone", "unseen"]);
        let phases = [FlightPhase::Stopping, FlightPhase::Starting];
        assert_eq!(phases.map(FlightPhase::as_str), ["stopping", "starting"]);
        let deciders = [FiringDecider::Mission, FiringDecider::Operator];
        let asked = [FiringDecider::Confirmation, FiringDecider::Declined];
        assert_eq!(deciders.map(FiringDecider::as_str), ["mission", "operator"]);
        assert_eq!(asked.map(FiringDecider::as_str), ["confirmation", "declined"]);
        let truths = [Some(true), Some(false), None].map(TruthValue::from);
        assert_eq!(truths.map(TruthValue::as_str), ["true", "false", "not known"]);
        let windows = [DateWindow::Early, DateWindow::Open, DateWindow::Past];
        assert_eq!(windows.map(DateWindow::as_str), ["early", "open", "past"]);
        let missed = [MissedAction::Fire, MissedAction::Skip, MissedAction::Fail];
        assert_eq!(missed.map(MissedAction::as_str), ["fire", "skip", "fail"]);
        let unanswered = [UnansweredAction::Fire, UnansweredAction::Decline];
        assert_eq!(unanswered.map(UnansweredAction::as_str), ["fire", "decline"]);
    }
}
