//! The events that the controller takes, and the actions that it returns.

use crate::answer::VersionAnswer;
use crate::incoming_order::IncomingOrder;
use crate::record::JournalRecord;
use crate::roster::Doing;
use crate::terms::{ComponentReport, MissionOutcome};
use armor_plan::{ComponentId, GivenValue, Version, WatchId};
use armor_robotfile::Date;
use armor_robotfile::guard::Scalar;
use std::sync::Arc;

/// An event: something that the controller observes or is asked to do.
#[derive(Clone, Debug, PartialEq)]
pub enum ControllerEvent {
    /// The control connection to a component's process is up; a state report follows. A new
    /// instance means that the old one has ended.
    Appeared {
        /// The component.
        component: ComponentId,
        /// The process start, unique in the system.
        instance: u64,
    },
    /// A component reports its state: once after the connection is up, then at every change.
    StateReported {
        /// The component.
        component: ComponentId,
        /// The process start.
        instance: u64,
        /// Its state.
        doing: Doing,
        /// The activation that it is in.
        activation: u64,
        /// Whether its code accepts commands.
        controllable: bool,
    },
    /// A component reports that its task is done, that it failed, or an event.
    Reported {
        /// The component.
        component: ComponentId,
        /// The process start.
        instance: u64,
        /// Counts the reports of that process start, from 1.
        serial: u64,
        /// The activation it belongs to.
        activation: u64,
        /// The report.
        report: ComponentReport,
    },
    /// The control connection is down; the process may be running.
    Lost {
        /// The component.
        component: ComponentId,
        /// The process start.
        instance: u64,
    },
    /// The process has ended, for certain.
    Gone {
        /// The component.
        component: ComponentId,
        /// The process start; `None` stands for any.
        instance: Option<u64>,
    },
    /// The launcher has given up a component that died too often: its process has ended and is not
    /// started again.
    GivenUp {
        /// The component.
        component: ComponentId,
        /// Why; `None`: it is started again.
        why: Option<String>,
    },
    /// An operator gives an order.
    Ordered(IncomingOrder),
    /// The connection of an operator has ended.
    OperatorLeft {
        /// The number of the connection.
        connection: u64,
    },
    /// A field of data that guards read has a new value; `None`: the message has no such value.
    Sensed {
        /// The field.
        watch: WatchId,
        /// Its value, in SI units.
        value: Option<Scalar>,
    },
    /// The unit of a field's values is known, for the texts that name them.
    UnitKnown {
        /// The field.
        watch: WatchId,
        /// The SI unit of its values.
        unit: &'static str,
    },
    /// The link to the provider of a field is down; its last value stays in force for a while.
    Unlinked {
        /// The field.
        watch: WatchId,
    },
    /// A version of the file is offered; the version in force is ignored.
    Offered(Arc<Version>),
    /// The answer to a [`crate::VersionQuestion`].
    Answered(VersionAnswer),
    /// The answer to a [`crate::MoveQuestion`].
    MoveJudged {
        /// The number of the question.
        serial: u64,
        /// An error describes the faults that the move would lead to.
        verdict: Result<(), String>,
    },
    /// A reading of the wall clock. Without one no date comes or passes, and no transition with a
    /// date fires.
    Utc {
        /// The moment at which mission time was 0, by that clock.
        at_start: Date,
    },
    /// The executive cannot play the mission much longer: the mission goes to its safe place.
    Endangered {
        /// The reason, in words.
        why: String,
    },
    /// Time has passed; see [`crate::Controller::next_deadline`].
    Timer,
    /// The executive is to end: all components come to rest, and the mission can be resumed later.
    Stop,
}

/// An action for the caller. Actions must be performed in the order in which they are returned.
#[derive(Clone, Debug, PartialEq)]
pub enum ControllerAction {
    /// Write the record to the journal; it must be on disk before the next action is performed.
    Journal(JournalRecord),
    /// Command a component to run.
    Activate {
        /// The component.
        component: ComponentId,
        /// The activation that begins.
        activation: u64,
        /// The values that places give its parameters.
        values: Vec<GivenValue>,
    },
    /// Command a component to come to rest.
    Freeze {
        /// The component.
        component: ComponentId,
        /// The activation that ends.
        activation: u64,
    },
    /// Kill the process, and report [`ControllerEvent::Gone`] when it has ended.
    Kill {
        /// The component.
        component: ComponentId,
    },
    /// Acknowledge a report, so that the component does not send it again.
    Acknowledge {
        /// The component.
        component: ComponentId,
        /// The number of the report.
        serial: u64,
    },
    /// Answer an operator's order.
    Answer {
        /// The connection it came on.
        connection: u64,
        /// The number of the order.
        request: u64,
        /// Whether it is carried out.
        accepted: bool,
        /// What follows from it, or why it is refused.
        text: String,
    },
    /// Answer [`crate::Controller::question`] on another thread, and report
    /// [`ControllerEvent::Answered`].
    Judge,
    /// Answer [`crate::Controller::move_question`] on another thread, and report
    /// [`ControllerEvent::MoveJudged`].
    JudgeMove,
    /// Another plan is in force: watch the data that its guards read.
    Changed,
    /// The marking has changed: publish it.
    Publish,
    /// The mission is over. This is the last action.
    Finished(MissionOutcome),
}
