//! Components in other languages: a binding declares their kind, ports, parameters and events while it
//! runs, and gives and takes messages encoded by their schema (`docs/protocol.md`, Values).
//!
//! [`ForeignArmor`] has nine of the twelve functions, [`ForeignComponent`] the other three.
//! [`run`] is [`armor_sdk::run`](crate::run): `--describe`, the command line, signals, the loop, and
//! the end of the process. A component under test is a
//! [`TestedComponent`], too.
//!
//! ```
//! use armor_sdk::foreign::{ForeignArmor, ForeignComponent, KindDeclaration, PortType};
//! use armor_sdk::testing::TestedComponent;
//! use armor_sdk::{Call, Data, Fault, Header, Outcome, Value};
//!
//! /// What a binding has for a component: here one that sends each number on, plus one.
//! struct Successor(ForeignArmor);
//!
//! impl ForeignComponent for Successor {
//!     fn parameter_received(&mut self, _: &str, _: &Value) -> Result<(), Fault> {
//!         Ok(())
//!     }
//!
//!     fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
//!         let count = u64::from_le_bytes(data.bytes().try_into()?) + 1;
//!         self.0.send_data("out", &[&count.to_le_bytes()])?;
//!         Ok(())
//!     }
//!
//!     fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
//!         Ok(Outcome::CarryOn)
//!     }
//! }
//!
//! let kind = KindDeclaration::new("successor", "Counts on.");
//! let count = PortType::parse("Count{count:u64}")?;
//! let mut successor = TestedComponent::build_foreign(&kind, &[], |armor| {
//!     armor.subscribe("in", &count, true, false)?;
//!     armor.provide("out", &count, false)?;
//!     Ok(Box::new(Successor(armor)))
//! })?;
//! successor.start()?;
//! successor.send_encoded("in", None, &count, &41_u64.to_le_bytes())?;
//! assert_eq!(successor.encoded_outputs("out")?.1, [42_u64.to_le_bytes()]);
//! # Ok::<(), armor_sdk::Fault>(())
//! ```

use std::ffi::OsString;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use armor_wire::codec::EncodedPieces;
use armor_wire::manifest::Manifest;
use armor_wire::name::is_name;
use armor_wire::schema::{self, ANY_SCHEMA, Schema};
use thiserror::Error;

pub use crate::kind_declaration::{KindDeclaration, ThreadScope};

use crate::any_message::AnyMessage;
use crate::armor::Armor;
use crate::call::{Call, Fault, Outcome};
use crate::data::{Data, Header};
use crate::describe::describe_kind;
use crate::launch::run_kind;
use crate::link::output::Sent;
use crate::link::payload::StoredPayload;
use crate::message_type::MessageType;
use crate::parameter::Value;
use crate::port_table::{DeclareError, SendError};
use crate::testing::{TestError, TestedComponent};
use crate::user_code::UserCode;

/// A message up to this length is written to a link in about the time that the system call takes.
const QUICK_LEN: usize = 4 << 10;

/// The three functions of a component in another language, as of [`Component`](crate::Component). They
/// never run at the same time, but on different threads.
pub trait ForeignComponent: Send {
    /// A parameter that was requested has arrived, or a live one has changed.
    ///
    /// # Errors
    /// Any: the value is refused.
    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault>;

    /// Data of an input have arrived: [`Data::bytes`] has the message, [`Data::keep`] keeps it.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault>;

    /// One step of the component's work.
    ///
    /// # Errors
    /// Any; reported as a failure of the component.
    fn exec(&mut self, call: Call) -> Result<Outcome, Fault>;

    /// Data have arrived, and `exec` follows, because the component has no rate. `enter_exec` is called
    /// between the two. A binding whose runtime is entered for each call may enter it once for both.
    ///
    /// # Errors
    /// As of `data_received` and `exec`.
    fn data_received_then_exec(
        &mut self,
        header: &Header<'_>,
        data: &Data<'_>,
        enter_exec: &dyn Fn(),
    ) -> Result<Outcome, Fault> {
        self.data_received(header, data)?;
        enter_exec();
        self.exec(Call::Data)
    }
}

/// The type of the messages of a port, from its schema.
#[derive(Clone)]
pub struct PortType {
    message_type: Arc<MessageType>,
    schema: Arc<Schema>,
}

/// Why a text is not the schema of a message.
#[derive(Debug, Error)]
pub enum PortTypeError {
    /// It is no schema.
    #[error(transparent)]
    Text(#[from] schema::ParseError),
    /// It is the schema of a number, a text or a list.
    #[error("`{0}` is not the schema of a message: a message is a struct or an enum, with a name")]
    NoName(String),
    /// The type has a name that a message cannot have.
    #[error("`{0}` is not a name for a message; use letters, digits, _ and -")]
    Name(String),
}

impl PortType {
    /// Reads a schema in canonical form, such as `Count{count:u64}`; `Any{}` is that of a port of any
    /// type, as [`AnyMessage`] declares it in Rust.
    ///
    /// # Errors
    /// [`PortTypeError`] if it is malformed, or not that of a struct or an enum.
    pub fn parse(text: &str) -> Result<Self, PortTypeError> {
        Self::of_schema(schema::parse(text)?)
    }

    /// The type of messages with this layout.
    ///
    /// # Errors
    /// [`PortTypeError`] if it is not that of a struct or an enum with a name.
    pub fn of_schema(schema: Schema) -> Result<Self, PortTypeError> {
        let text = schema.to_string();
        let (Schema::Struct { name, .. } | Schema::Enum { name, .. }) = &schema else {
            return Err(PortTypeError::NoName(text));
        };
        if !is_name(name) {
            return Err(PortTypeError::Name(name.clone()));
        }
        let message_type = Arc::new(MessageType::of_schema(name, &text));
        Ok(Self { message_type, schema: Arc::new(schema) })
    }

    /// The name of the type.
    pub fn name(&self) -> &str {
        &self.message_type.name
    }

    /// The layout of its messages.
    pub fn schema(&self) -> &Arc<Schema> {
        &self.schema
    }

    /// Whether a port with it takes or gives messages of any type.
    pub fn is_any(&self) -> bool {
        self.text() == ANY_SCHEMA
    }

    /// The schema as text.
    pub fn text(&self) -> &str {
        &self.message_type.schema
    }
}

impl fmt::Debug for PortType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

/// The handle of a component in another language, as [`Armor`]: nine of the twelve functions. Cheap to
/// clone; threads of the component may share it.
#[derive(Clone)]
pub struct ForeignArmor(Armor);

impl ForeignArmor {
    /// Declares an output. Only in the constructor. `latched`: a late subscriber immediately gets the
    /// last message.
    ///
    /// # Errors
    /// As [`Armor::provide`].
    pub fn provide(&self, id: &str, of: &PortType, latched: bool) -> Result<(), DeclareError> {
        self.0.check_declaration(id)?;
        let ports = &self.0.participant.ports;
        if of.is_any() {
            return ports.add_output::<AnyMessage>(id, latched);
        }
        ports.add_encoded_output(id, &of.message_type, latched)
    }

    /// Declares an input. Only in the constructor. `required`: the file must feed it; `many`: any number
    /// of links may.
    ///
    /// # Errors
    /// As [`Armor::subscribe`].
    pub fn subscribe(
        &self,
        id: &str,
        of: &PortType,
        required: bool,
        many: bool,
    ) -> Result<(), DeclareError> {
        self.0.check_declaration(id)?;
        let ports = &self.0.participant.ports;
        if of.is_any() {
            return ports.add_input::<AnyMessage>(id, required, many);
        }
        ports.add_encoded_input(id, &of.message_type, required, many)
    }

    /// Explains what a port carries, in one line, for `armor describe` and the designer; as
    /// [`KindDeclaration::ports`]. Only in the constructor.
    pub fn document_port(&self, id: &str, doc: &str) {
        self.0.participant.ports.document_port(id, doc);
    }

    /// As [`Armor::provided_data`].
    pub fn provided_data(&self, id: &str) -> Option<String> {
        self.0.provided_data(id)
    }

    /// As [`Armor::subscribed_data`].
    pub fn subscribed_data(&self, id: &str) -> Option<String> {
        self.0.subscribed_data(id)
    }

    /// As [`Armor::get_parameter`].
    ///
    /// # Errors
    /// If the name is malformed.
    pub fn get_parameter(&self, name: &str) -> Result<(), Fault> {
        self.0.get_parameter(name)
    }

    /// As [`Armor::synchronize`].
    ///
    /// # Errors
    /// As there.
    pub fn synchronize(&self) -> Result<(), Fault> {
        self.0.synchronize()
    }

    /// The value of a parameter that has arrived and waits to be handed to `parameter_received`: for a
    /// constructor that has synchronized. `None` for `--describe`.
    pub fn find_arrived(&self, name: &str) -> Option<Value> {
        self.0.participant.parameters.find_arrived(name)
    }

    /// Publishes an encoded message, given in the pieces in which it lies in memory. Its bytes are not
    /// checked against the schema: a binding encodes by the schema with which it declared the output.
    /// Otherwise as [`Armor::send_data`].
    ///
    /// # Errors
    /// As there.
    pub fn send_data(&self, id: &str, pieces: &[&[u8]]) -> Result<Sent, SendError> {
        let stamp_s = self.timestamp();
        let message = EncodedPieces(pieces);
        self.0.send_with_right(id, |ports| ports.publish_encoded(id, message, stamp_s))
    }

    /// Whether [`send_data`](Self::send_data) of so many bytes might take longer than one system call:
    /// then a binding releases what other threads wait for. Another thread that sends on the same output
    /// may change the answer before it is used.
    pub fn may_wait(&self, id: &str, len: usize) -> bool {
        len > QUICK_LEN || self.0.participant.ports.may_wait(id)
    }

    /// Passes a message on, on an output that was declared with any type. Its bytes and its stamp stay as
    /// they are. Otherwise as [`Armor::send_data`].
    ///
    /// # Errors
    /// As there.
    pub fn send_any(&self, id: &str, message: &AnyMessage) -> Result<Sent, SendError> {
        self.0.send_data(id, message)
    }

    /// Reports that a thread which the component has started itself has failed: a failure of the
    /// component, as a panic of such a thread is in Rust.
    pub fn report_thread_failure(&self, reason: String) {
        self.0.participant.thread_panics.add_panic(reason);
    }

    /// As [`Armor::timestamp`].
    pub fn timestamp(&self) -> f64 {
        self.0.timestamp()
    }

    /// As [`Armor::set_non_controllable`].
    ///
    /// # Errors
    /// As there.
    pub fn set_non_controllable(&self) -> Result<(), DeclareError> {
        self.0.set_non_controllable()
    }
}

/// A received message that is kept beyond the call, by [`Data::keep`]. The clones share it.
#[derive(Clone, Debug)]
pub struct KeptMessage(Arc<StoredPayload>);

impl KeptMessage {
    /// A copy of these bytes, for a message that has not come over a link.
    pub fn copy_of(bytes: &[u8]) -> Self {
        Self(Arc::new(StoredPayload::Copied(bytes.to_vec())))
    }
}

impl Deref for KeptMessage {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl Data<'_> {
    /// Keeps the message beyond the call: a large one stays in the shared memory in which it came,
    /// unless the component keeps so many that the publisher would lack memory; others are copied once.
    pub fn keep(&self) -> KeptMessage {
        KeptMessage(Arc::new(self.store()))
    }

    /// How many messages the history of their own input and source has, with this one: for a binding
    /// that keeps them itself. `None` if the link keeps no history.
    pub fn kept_count(&self) -> Option<usize> {
        self.own_history_len()
    }
}

struct ForeignCode(Box<dyn ForeignComponent>);

impl UserCode for ForeignCode {
    fn receive_parameter(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.0.parameter_received(name, value)
    }

    fn receive_data(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        self.0.data_received(header, data)
    }

    fn execute(&mut self, call: Call) -> Result<Outcome, Fault> {
        self.0.exec(call)
    }

    fn receive_data_then_execute(
        &mut self,
        header: &Header<'_>,
        data: &Data<'_>,
        enter_exec: &dyn Fn(),
    ) -> Result<Outcome, Fault> {
        self.0.data_received_then_exec(header, data, enter_exec)
    }
}

/// Turns the constructor of a binding into one of this crate.
fn wrap(
    constructor: impl FnOnce(ForeignArmor) -> Result<Box<dyn ForeignComponent>, Fault>,
) -> impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault> {
    |armor| Ok(Box::new(ForeignCode(constructor(ForeignArmor(armor))?)))
}

/// Runs a component as this process, by the arguments after the program's name. Returns the exit code
/// of the process.
///
/// SIGINT and SIGTERM end it in order: a binding leaves both to this function.
#[must_use = "it is the exit code of the process"]
pub fn run(
    kind: &KindDeclaration,
    arguments: impl IntoIterator<Item = OsString>,
    constructor: impl FnOnce(ForeignArmor) -> Result<Box<dyn ForeignComponent>, Fault>,
) -> u8 {
    run_kind(kind, wrap(constructor), arguments)
}

/// The manifest of a kind, as [`manifest_of`](crate::manifest_of).
///
/// # Errors
/// As there.
pub fn manifest_of(
    kind: &KindDeclaration,
    constructor: impl FnOnce(ForeignArmor) -> Result<Box<dyn ForeignComponent>, Fault>,
) -> Result<Manifest, Fault> {
    describe_kind(kind, wrap(constructor))
}

impl TestedComponent {
    /// As [`build`](Self::build), for a component in another language.
    ///
    /// # Errors
    /// As there.
    pub fn build_foreign(
        kind: &KindDeclaration,
        parameters: &[(&str, &str)],
        constructor: impl FnOnce(ForeignArmor) -> Result<Box<dyn ForeignComponent>, Fault>,
    ) -> Result<Self, TestError> {
        Self::build_kind(kind, wrap(constructor), parameters)
    }

    /// Hands an encoded message of this type, created now, to the component as data of `input`, which may
    /// be one of any type; of an input that takes several sources as that of `source`, else of `test.INPUT`.
    ///
    /// # Errors
    /// As [`send_from`](Self::send_from).
    pub fn send_encoded(
        &mut self,
        input: &str,
        source: Option<&str>,
        of: &PortType,
        bytes: &[u8],
    ) -> Result<(), TestError> {
        self.send_bytes(input, source, &of.message_type, bytes)
    }

    /// Returns the type of `output` and all messages that have been published on it, encoded.
    ///
    /// # Errors
    /// If there is no such output.
    pub fn encoded_outputs(&self, output: &str) -> Result<(String, Vec<Vec<u8>>), TestError> {
        self.list_encoded(output)
    }
}

#[cfg(test)]
mod tests;
