//! What a component is: a type with a constructor and the three functions that the system calls.

use std::error::Error;

use armor_wire::codec::{self, DecodeError};
use armor_wire::message::Message;

use crate::armor::Armor;
use crate::parameter::{Parameter, Value};

/// What user code may fail with: any error. It reaches the executive and the log as a report.
pub type Fault = Box<dyn Error + Send + Sync>;

/// One task, in one process.
///
/// `exec`, `data_received` and `parameter_received` never run at the same time: no locks are needed.
/// A frozen component gets no calls at all.
pub trait Component: Sized + Send + 'static {
    /// Name of this kind of component, as the file has it.
    const KIND: &'static str;
    /// What it does, in one line.
    const SUMMARY: &'static str;
    /// What can be set in the file.
    const PARAMETERS: &'static [Parameter] = &[];
    /// What each port carries, in one line, for `armor describe` and the designer.
    const PORTS: &'static [(&'static str, &'static str)] = &[];

    /// Declares ports and asks for parameters. Runs for `--describe` too, so it opens no hardware.
    ///
    /// # Errors
    /// Any; the process then ends and says why.
    fn new(armor: Armor) -> Result<Self, Fault>;

    /// A parameter that was asked for, or a live one that has changed.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let _ = (name, value);
        Ok(())
    }

    /// Data of an input. Data of one input arrive in order, each at most once.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let _ = (header, data);
        Ok(())
    }

    /// One step of the component's work; returns what the executive should know.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let _ = call;
        Ok(Outcome::CarryOn)
    }
}

/// Why `exec` is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// The component has been activated.
    Started,
    /// Its period is over.
    Tick,
    /// It has received data, and the file gives it no rate.
    Data,
    /// The last call before it is frozen or ended: bring actuators to rest.
    Stopping,
}

/// What `exec` returns.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Outcome {
    /// Nothing to report.
    #[default]
    CarryOn,
    /// The task is over; no more calls in this activation, except `Stopping`.
    Done,
    /// The task cannot be done, and why; no more calls in this activation, except `Stopping`.
    Failed(String),
    /// Something happened that the mission may wait for.
    Event {
        /// Its name: `on="component.name"` in the mission.
        name: String,
        /// Its value.
        value: f64,
    },
}

impl Outcome {
    /// A named event with a value.
    pub fn event(name: &str, value: f64) -> Self {
        Self::Event { name: name.into(), value }
    }
}

/// What is known of data besides its content.
#[derive(Clone, Copy, Debug)]
pub struct Header<'a> {
    pub(crate) id: &'a str,
    pub(crate) data: &'a str,
    /// Counts what the output has published, from 0.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Process start that published it.
    pub instance: u64,
    /// How many were lost right before it.
    pub lost: u64,
}

impl<'a> Header<'a> {
    /// Local name of the input.
    pub fn id(&self) -> &'a str {
        self.id
    }

    /// System-wide name of the data, `component.output`.
    pub fn data(&self) -> &'a str {
        self.data
    }
}

/// The content of data, as it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Data<'a> {
    pub(crate) bytes: &'a [u8],
}

impl<'a> Data<'a> {
    /// Reads the content as a message of the type the input was declared with.
    ///
    /// # Errors
    /// If the bytes are not one message of type `T`.
    pub fn decode<T: Message>(&self) -> Result<T, DecodeError> {
        codec::decode(self.bytes)
    }

    /// The encoded message (`docs/protocol.md`, Values).
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}
