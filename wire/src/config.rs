//! What is said between a component and configd. The component asks, configd answers (ArMoR 2.3);
//! only parameters marked live are sent unasked.

use crate::Message;
use crate::hello::Refusal;
use crate::keep::{Keep, Transport, Wake};

/// From a component to configd.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum Request {
    /// "How am I connected, and how do I run?"
    Settings {
        /// Names the answer.
        request: u64,
    },
    /// "What is this parameter of mine?"
    Parameter {
        /// Names the answer.
        request: u64,
        /// Its name.
        name: String,
    },
    /// "I am alive."
    Beat,
}

/// From configd to a component.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum Reply {
    /// The component's place in the system.
    Settings {
        /// The request.
        request: u64,
        /// How it runs and is connected.
        settings: Settings,
    },
    /// A parameter.
    Parameter {
        /// The request; 0 if sent unasked.
        request: u64,
        /// Its name.
        name: String,
        /// What the file says; `None` if it does not assign it.
        assigned: Option<Assigned>,
    },
    /// The request cannot be answered.
    Refused {
        /// The request.
        request: u64,
        /// Why.
        refusal: Refusal,
    },
    /// "I am alive."
    Beat,
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
#[message(wire = "armor_wire")]
pub struct Settings {
    /// Counts the accepted versions of the file, from 1.
    pub version: u64,
    /// How often `exec` is called, in hertz; `None`: after each data.
    pub rate_hz: Option<f64>,
    /// Whether the mission activates and freezes the component. If not it is always active.
    pub controlled: bool,
    /// Its inputs that are fed.
    pub inputs: Vec<InputSettings>,
    /// How long one call of user code may take before the component counts as hung, in seconds.
    pub watchdog_s: Option<f64>,
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
}
