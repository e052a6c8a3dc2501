//! The state of a mission as the executive publishes it.

use crate::change::MissionChange;
use crate::command::{Confirmation, Holder, OrderGiven, Paused};
use crate::dates::DateStand;
use crate::state::{FiringDecider, FlightPhase, MarkingStage, MissionComponentState, TruthValue};
use armor_wire::Message;

/// The state of the mission: the message of the output `executive.marking`. Times named `…_at_s`
/// are mission time, in seconds since its start.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct Marking {
    /// System time, seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The mission.
    pub mission: String,
    /// Mission time now.
    #[message(unit = "s")]
    pub now_at_s: f64,
    /// The data that mission time follows; empty if it is the host's.
    pub clock: String,
    /// Its stage, or how it ended.
    pub stage: MarkingStage,
    /// Why it retreats or has given up; empty if it does not.
    pub why: String,
    /// The places that hold tokens.
    pub places: Vec<MarkedPlace>,
    /// Tokens on their way.
    pub in_flight: Vec<InFlight>,
    /// The transitions that are enabled, those that may fire first.
    pub enabled: Vec<EnabledTransition>,
    /// The transitions out of marked places that are not enabled.
    pub waiting: Vec<WaitingTransition>,
    /// The variables of the mission.
    pub variables: Vec<VariableValue>,
    /// The guards of its transitions.
    pub guards: Vec<GuardTruth>,
    /// Its absolute dates.
    pub dates: Vec<DateStand>,
    /// The components of the mission.
    pub components: Vec<MissionComponent>,
    /// Transitions fired so far.
    pub fired: u64,
    /// The last of them, the oldest first.
    pub history: Vec<Fired>,
    /// Reports dropped because their activation was over.
    pub late_reports: u64,
    /// Reports that nothing in the mission waited for.
    pub unheard_reports: u64,
    /// Orders that were refused or changed nothing and, as there were too many, not written down.
    pub unwritten_orders: u64,
    /// Whether it stands still.
    pub pause: Option<Paused>,
    /// The operator who holds the lease; without one, any operator may order.
    pub holder: Option<Holder>,
    /// Since when the link to the holder of the lease is lost, if it is.
    #[message(unit = "s")]
    pub link_lost_at_s: Option<f64>,
    /// What the operator is asked.
    pub confirmations: Vec<Confirmation>,
    /// The last orders, the oldest first.
    pub orders: Vec<OrderGiven>,
    /// The version of the file that is played, as configd counts them; 0 if it is not known.
    pub version: u64,
    /// Since when.
    #[message(unit = "s")]
    pub version_since_at_s: f64,
    /// A newer version that is not played.
    pub change: Option<MissionChange>,
}

/// A place that holds tokens.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct MarkedPlace {
    /// Its name.
    pub place: String,
    /// How many.
    pub tokens: u32,
    /// Whether all of its components run and have confirmed it.
    pub active: bool,
    /// Those of its components that do not run, or have not confirmed it.
    pub waits_for: Vec<String>,
}

/// A firing on its way.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct InFlight {
    /// Counts firings.
    pub firing: u64,
    /// The transition, or in words what else moves the tokens.
    pub cause: String,
    /// Places the tokens were taken from.
    pub from: Vec<String>,
    /// Places they will be put into.
    pub to: Vec<String>,
    /// What it waits for.
    pub phase: FlightPhase,
    /// The components whose confirmation it waits for.
    pub waits_for: Vec<String>,
}

/// A transition whose clock runs.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct EnabledTransition {
    /// Its name.
    pub transition: String,
    /// When it became enabled.
    #[message(unit = "s")]
    pub enabled_at_s: f64,
    /// When it may fire.
    #[message(unit = "s")]
    pub earliest_at_s: f64,
    /// When it must have fired, if ever.
    #[message(unit = "s")]
    pub latest_at_s: Option<f64>,
    /// Who decides that it fires.
    pub by: FiringDecider,
    /// Whether a pause stops its clock; its times count from the beginning of the pause then.
    pub held: bool,
}

/// A transition out of a marked place that is not enabled, and what it waits for.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct WaitingTransition {
    /// Its name.
    pub transition: String,
    /// The marked places that it takes tokens from.
    pub from: Vec<String>,
    /// The report it waits for, `component.event`; empty if it has arrived or there is none.
    pub report: String,
    /// Whether it waits for its guard to be true.
    pub guard: bool,
    /// What else keeps it from being enabled, in words: tokens or a date; may be empty.
    pub hindrance: String,
}

/// A variable and what it is known to be.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct VariableValue {
    /// Its name.
    pub variable: String,
    /// In words: a number in SI, `true`, `false`, a text between single quotes, or `not known`.
    pub value: String,
    /// As a number in SI; 1 or 0 for true or false; none for a text and what is not known.
    pub number: Option<f64>,
    /// How many values came from outside its domain and counted as the nearer end.
    pub outside: u64,
}

/// A transition's guard and what it is known to be.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct GuardTruth {
    /// The transition.
    pub transition: String,
    /// The guard.
    pub guard: String,
    /// Its value.
    pub truth: TruthValue,
    /// The values it looks at, in words.
    pub because: String,
}

/// A component and what it is known to do.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct MissionComponent {
    /// Its name.
    pub component: String,
    /// Whether the mission activates and freezes it.
    pub controlled: bool,
    /// What it does, as far as it is known.
    pub state: MissionComponentState,
    /// Its last activation by this mission; 0 if there was none.
    pub activation: u64,
    /// Its reports that nothing in the mission waited for.
    pub unheard_reports: u64,
    /// The values that places gave its parameters when that began.
    pub values: Vec<ParameterGiven>,
}

/// A value that a place gives a parameter.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct ParameterGiven {
    /// The parameter.
    pub parameter: String,
    /// Its value, as written.
    pub value: String,
}

/// A transition that has fired.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct Fired {
    /// Its name.
    pub transition: String,
    /// When.
    #[message(unit = "s")]
    pub fired_at_s: f64,
}
