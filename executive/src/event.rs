//! The controller's events, and the actions that it wants done.

use crate::answer::VersionAnswer;
use crate::incoming_order::IncomingOrder;
use crate::record::JournalRecord;
use crate::roster::Doing;
use crate::terms::{ComponentReport, MissionOutcome};
use armor_plan::{ComponentId, GivenValue, Version, WatchId};
use armor_robotfile::Date;
use armor_robotfile::guard::Scalar;
use std::sync::Arc;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum ControllerEvent {
    /// The control connection to a component's process is up; what it is doing follows. A new
    /// instance means that the old one has ended.
    Appeared {
        /// Whose.
        component: ComponentId,
        /// The process start, unique in the system.
        instance: u64,
    },
    /// A component reports what it does: first after appearing, then at every change.
    StateReported {
        /// Who.
        component: ComponentId,
        /// The process start.
        instance: u64,
        /// What.
        doing: Doing,
        /// In which activation.
        activation: u64,
        /// Whether its code lets itself be commanded.
        controllable: bool,
    },
    /// A component reports.
    Reported {
        /// Who.
        component: ComponentId,
        /// The process start.
        instance: u64,
        /// Counts the reports of that process start, from 1.
        serial: u64,
        /// The activation it belongs to.
        activation: u64,
        /// What.
        report: ComponentReport,
    },
    /// The control connection is down; the process may be running.
    Lost {
        /// Whose.
        component: ComponentId,
        /// The process start.
        instance: u64,
    },
    /// The process has ended, for certain.
    Gone {
        /// Whose.
        component: ComponentId,
        /// The process start; none: whichever there was.
        instance: Option<u64>,
    },
    /// An operator gives an order.
    Ordered(IncomingOrder),
    /// The connection of an operator has ended.
    OperatorLeft {
        /// Which.
        connection: u64,
    },
    /// A field of data that guards look at has a new value; none: what was published has none.
    Sensed {
        /// Which.
        watch: WatchId,
        /// In SI.
        value: Option<Scalar>,
    },
    /// The link to the provider of a field is down; its last value holds for a while.
    Unlinked {
        /// Which.
        watch: WatchId,
    },
    /// There is a version of the file; nothing follows from the one that is played.
    Offered(Arc<Version>),
    /// What came of a question about a version.
    Answered(VersionAnswer),
    /// What came of a question about tokens to be moved.
    MoveJudged {
        /// Which.
        serial: u64,
        /// Nothing bad follows, or what does, in words.
        verdict: Result<(), String>,
    },
    /// A reading of the wall clock. Without one no date comes or passes, and no transition with a date
    /// fires.
    Utc {
        /// The moment at which mission time was 0, by that clock.
        at_start: Date,
    },
    /// Time has passed; see [`crate::Controller::next_deadline`].
    Timer,
    /// Everything is to come to rest; the mission stays as it is and can be resumed.
    Stop,
}

/// Something to be done, in the order given.
#[derive(Clone, Debug, PartialEq)]
pub enum ControllerAction {
    /// Write it down, on disk, before doing what follows.
    Journal(JournalRecord),
    /// Tell a component to run.
    Activate {
        /// Who.
        component: ComponentId,
        /// The activation that begins.
        activation: u64,
        /// The values that places give its parameters.
        values: Vec<GivenValue>,
    },
    /// Tell a component to come to rest.
    Freeze {
        /// Who.
        component: ComponentId,
        /// The activation that ends.
        activation: u64,
    },
    /// End the process, whether it wants or not, and say [`Event::Gone`] when it has.
    Kill {
        /// Whose.
        component: ComponentId,
    },
    /// Tell a component that its report need not be sent again.
    Acknowledge {
        /// Who.
        component: ComponentId,
        /// The report.
        serial: u64,
    },
    /// Tell an operator what became of an order.
    Answer {
        /// The connection it came on.
        connection: u64,
        /// The order.
        request: u64,
        /// Whether it is carried out.
        accepted: bool,
        /// What follows from it, or why it is refused.
        text: String,
    },
    /// Find the answer to [`crate::Controller::question`], elsewhere, and say [`Event::Answered`].
    Judge,
    /// Find the answer to [`crate::Controller::move_question`], elsewhere, and say
    /// [`Event::MoveJudged`].
    JudgeMove,
    /// Another plan is played from now on: look at what its guards look at.
    Changed,
    /// The marking has changed: publish it.
    Publish,
    /// The mission is over; the last action there is.
    Finished(MissionOutcome),
}
