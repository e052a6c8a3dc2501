//! The messages between configd and components or tools. A component asks, configd answers (ArMoR
//! 2.3); only parameters marked live are sent unasked. Tools list and set parameters and request
//! changes.

mod records;

use crate::Message;
use crate::keep::{Keep, Wake};
use crate::refusal::Refusal;
use crate::transport::Transport;

pub use records::{
    ChangeKind, ChangeRecord, ChangeSubject, ConfigurationState, FindingRecord, FindingSeverity,
    ListedParameter, ListedType, MAX_RECORD_TEXT_LEN, MAX_RECORDS, cut_text,
};

/// From a component or a tool to configd.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Request")]
pub enum ConfigRequest {
    /// How the component is connected and how it runs.
    Settings {
        /// Names the answer.
        request: u64,
    },
    /// The value of a parameter of the component.
    Parameter {
        /// Names the answer.
        request: u64,
        /// Its name.
        name: String,
    },
    /// A sign of life.
    Beat,
    /// Lists the parameters, in the order of the file and the manifests.
    List {
        /// Names the answer.
        request: u64,
        /// Only of this component.
        component: Option<String>,
        /// Number of parameters to skip: an answer has at most [`MAX_RECORDS`].
        from: u32,
    },
    /// Writes a value into the file.
    Set {
        /// Names the answer.
        request: u64,
        /// The component.
        component: String,
        /// Its parameter.
        parameter: String,
        /// The value as it is to be written; `None` removes it, so that the default applies.
        value: Option<String>,
    },
    /// Lists the changes between two versions.
    Diff {
        /// Names the answer.
        request: u64,
        /// The earlier one; `None`: the one before `to`.
        from: Option<u64>,
        /// The later one; `None`: the one in force.
        to: Option<u64>,
    },
}

/// From configd to a component or a tool.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Reply")]
pub enum ConfigReply {
    /// The component's place in the system.
    Settings {
        /// The request.
        request: u64,
        /// How it runs and is connected.
        settings: ComponentSettings,
    },
    /// A parameter.
    Parameter {
        /// The request; 0 if sent unasked.
        request: u64,
        /// Its name.
        name: String,
        /// The value in the file; `None` if the file does not assign it.
        assigned: Option<Assigned>,
    },
    /// The request cannot be answered.
    Refused {
        /// The request.
        request: u64,
        /// Why.
        refusal: Refusal,
    },
    /// A sign of life.
    Beat,
    /// Parameters of the version in force.
    Listed {
        /// The request.
        request: u64,
        /// The version in force.
        version: u64,
        /// Whether the file on the disk differs from that version and is refused.
        refused: bool,
        /// The parameters, from the one asked for on.
        parameters: Vec<ListedParameter>,
        /// Their total number.
        total: u32,
    },
    /// The value is in the file, and in force.
    Set {
        /// The request.
        request: u64,
        /// The version that has it.
        version: u64,
        /// What changed with it, and when that takes effect; empty if the file had the value
        /// already.
        changes: Vec<ChangeRecord>,
        /// Warnings about the value, such as that a file that it names is missing, and those that
        /// the version before did not have.
        findings: Vec<FindingRecord>,
    },
    /// The value was not written.
    Rejected {
        /// The request.
        request: u64,
        /// Why, and what to do.
        text: String,
        /// The problems of the file as it would be, or as it is.
        findings: Vec<FindingRecord>,
        /// Number of further findings.
        left_out: u32,
    },
    /// What changed between two versions.
    Differences {
        /// The request.
        request: u64,
        /// The earlier version.
        from: u64,
        /// The later version.
        to: u64,
        /// What changed, and when that takes or took effect.
        changes: Vec<ChangeRecord>,
        /// Number of further changes.
        left_out: u32,
    },
}

/// A value as the file assigns it.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Assigned {
    /// The text of the value.
    pub text: String,
    /// The folder that a relative path in it is relative to.
    pub base: String,
    /// Where it was assigned, `file:line:column` or `--set`.
    pub origin: String,
}

/// How a component runs and is connected.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Settings")]
pub struct ComponentSettings {
    /// Counts the accepted versions of the file, from 1.
    pub version: u64,
    /// Rate at which `exec` is called, in hertz; `None`: after each data.
    pub rate_hz: Option<f64>,
    /// Whether the mission activates and freezes the component. If not it is always active.
    pub controlled: bool,
    /// Its inputs that are fed.
    pub inputs: Vec<InputSettings>,
    /// How long one call of user code may take before the component counts as hung, in seconds.
    pub watchdog_s: Option<f64>,
    /// Unique name of the data that its time follows, of type [`Clock`](crate::clock::Clock);
    /// `None`: the registry's clock.
    pub clock: Option<String>,
}

/// How one input is fed.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct InputSettings {
    /// Local name of the input.
    pub id: String,
    /// Unique name of the data that feeds it.
    pub data: String,
    /// What it gets when the component is slow.
    pub keep: Keep,
    /// How both ends wait.
    pub wake: Wake,
    /// What the data travels on.
    pub transport: Transport,
    /// How many of its last messages the input stores; 1: none beyond the one it is given.
    pub history: u32,
}
