//! The outputs and inputs that a component has declared.

mod sending;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use armor_wire::config::InputSettings;
use armor_wire::message::Message;
use armor_wire::registry::DataEntry;
use parking_lot::{Mutex, RwLock};
use thiserror::Error;

use crate::any_message::AnyMessage;
use crate::call_trace::{CALLS, CallTrace, TracedCalls, calls_of};
use crate::identity::ProcessIdentity;
use crate::link::input::InputPort;
use crate::link::output::OutputPort;
use crate::link::publishing::PublishContext;
use crate::message_type::MessageType;
use crate::wake::Wakers;
pub use sending::SendError;

/// Most outputs or inputs of one component: a robot's, not a data centre's.
const MAX_PORTS: usize = 256;

/// Why a port cannot be declared.
#[derive(Debug, Error)]
pub enum DeclareError {
    /// The name of the port is malformed.
    #[error(
        "`{0}` is not a name for a port; use letters, digits, _ and -, beginning with a letter"
    )]
    Name(String),
    /// The component has a port of that name.
    #[error(
        "the port `{0}` is declared twice; inputs and outputs share their names: rename or remove one"
    )]
    Twice(String),
    /// Ports are declared in the constructor.
    #[error("the port `{0}` is declared after the constructor; declare all ports in `new`")]
    Late(String),
    /// Whether a mission may freeze a component is decided before it runs.
    #[error("`set_non_controllable` is called after the constructor; call it in `new`")]
    LateNonControllable,
    /// Too many ports.
    #[error("more than {MAX_PORTS} ports")]
    TooMany,
}

/// The ports of one process.
pub(crate) struct PortTable {
    identity: Arc<ProcessIdentity>,
    outputs: RwLock<Vec<Arc<OutputPort>>>,
    inputs: RwLock<Vec<Arc<InputPort>>>,
    /// What ports carry, as their component explains when it declares them.
    docs: Mutex<Vec<(String, String)>>,
    /// Links hold small frames that are to be written together when the call of user code ends.
    gathering: AtomicBool,
    /// Outputs record what they publish: the component is under test.
    is_recording: AtomicBool,
    wakers: Arc<Wakers>,
    /// What the component's calls receive and publish, for tools that ask.
    pub trace: CallTrace,
    /// The output on which tools get that, of a component that serves it.
    calls_output: OnceLock<Arc<OutputPort>>,
}

impl PortTable {
    pub fn new(identity: Arc<ProcessIdentity>, wakers: Arc<Wakers>, trace: CallTrace) -> Self {
        Self {
            identity,
            outputs: RwLock::default(),
            inputs: RwLock::default(),
            docs: Mutex::default(),
            gathering: AtomicBool::new(false),
            is_recording: AtomicBool::new(false),
            wakers,
            trace,
            calls_output: OnceLock::new(),
        }
    }

    /// Declares an output of message type `T`.
    ///
    /// # Errors
    /// If the name is taken or there are too many outputs.
    pub fn add_output<T: Message>(&self, id: &str, latched: bool) -> Result<(), DeclareError> {
        self.insert_output(id, |data| OutputPort::new::<T>(id, data, latched))
    }

    /// Declares an output whose messages are given encoded.
    ///
    /// # Errors
    /// As [`add_output`](Self::add_output).
    pub fn add_encoded_output(
        &self,
        id: &str,
        message_type: &MessageType,
        latched: bool,
    ) -> Result<(), DeclareError> {
        self.insert_output(id, |data| OutputPort::of_schema(id, data, message_type, latched))
    }

    fn insert_output(
        &self,
        id: &str,
        create: impl FnOnce(&str) -> OutputPort,
    ) -> Result<(), DeclareError> {
        let mut outputs = self.outputs.write();
        check_free(id, outputs.iter().map(|output| output.id.as_str()))?;
        let output = create(&format!("{}.{id}", self.identity.name));
        if self.is_recording.load(Ordering::Relaxed) {
            output.start_recording();
        }
        outputs.push(Arc::new(output));
        Ok(())
    }

    /// Adds an output whose messages are passed on and have this type.
    ///
    /// # Errors
    /// If the name is taken or there are too many outputs.
    pub fn add_typed_output(
        &self,
        id: &str,
        message_type: &MessageType,
        latched: bool,
    ) -> Result<(), DeclareError> {
        self.add_output::<AnyMessage>(id, latched)?;
        self.give_type(message_type);
        Ok(())
    }

    /// Records what is published on every output that is declared from now on.
    pub fn start_recording(&self) {
        self.is_recording.store(true, Ordering::Relaxed);
    }

    /// Declares an input of message type `T`.
    ///
    /// # Errors
    /// If the name is taken or there are too many inputs.
    pub fn add_input<T: Message>(
        &self,
        id: &str,
        required: bool,
        many: bool,
    ) -> Result<(), DeclareError> {
        self.insert_input(InputPort::new::<T>(id, required, many))
    }

    /// Declares an input whose messages are taken encoded.
    ///
    /// # Errors
    /// As [`add_input`](Self::add_input).
    pub fn add_encoded_input(
        &self,
        id: &str,
        message_type: &MessageType,
        required: bool,
        many: bool,
    ) -> Result<(), DeclareError> {
        self.insert_input(InputPort::of_schema(id, required, many, message_type))
    }

    fn insert_input(&self, input: InputPort) -> Result<(), DeclareError> {
        let mut inputs = self.inputs.write();
        check_free(&input.id, inputs.iter().map(|input| input.id.as_str()))?;
        inputs.push(Arc::new(input));
        Ok(())
    }

    /// Gives every output that was declared without a type that of what it passes on. Returns their
    /// entries.
    pub fn give_type(&self, message_type: &MessageType) -> Vec<DataEntry> {
        let mut outputs = self.outputs.write();
        let mut entries = Vec::new();
        for output in outputs.iter_mut().filter(|output| output.lacks_type()) {
            *output = Arc::new(output.with_type(message_type));
            entries.push(output.entry.clone());
        }
        entries
    }

    /// Connects an input as the file specifies. One more source of an input that takes many is a port
    /// of its own, next to the others; any other input has the last source that it is connected to.
    /// Returns the place of the port among the inputs; `None` if there is no such input.
    pub fn connect_input(&self, settings: &InputSettings) -> Option<usize> {
        let mut inputs = self.inputs.write();
        let mut places = (0..inputs.len()).filter(|place| inputs[*place].id == settings.id);
        let first = places.next()?;
        let last = places.next_back().unwrap_or(first);
        let is_taken = |port: &InputPort| port.data().is_some_and(|data| data != settings.data);
        let place = if inputs[first].many {
            let free = (first..=last).find(|place| !is_taken(&inputs[*place]));
            free.unwrap_or(last + 1)
        } else {
            first
        };
        if place > last {
            let source = inputs[first].new_source();
            inputs.insert(place, Arc::new(source));
        }
        inputs[place].connect(settings.clone());
        Some(place)
    }

    /// Explains what a port carries, in one line.
    pub fn document_port(&self, id: &str, doc: &str) {
        self.docs.lock().push((id.into(), doc.into()));
    }

    /// The ports that were explained, and the texts.
    pub fn list_docs(&self) -> Vec<(String, String)> {
        self.docs.lock().clone()
    }

    pub fn outputs(&self) -> Vec<Arc<OutputPort>> {
        self.outputs.read().clone()
    }

    /// The declared outputs, and that of the calls.
    pub fn served_outputs(&self) -> Vec<Arc<OutputPort>> {
        let mut outputs = self.outputs();
        outputs.extend(self.calls_output.get().cloned());
        outputs
    }

    /// Serves the component's calls from now on to tools that ask for them.
    pub fn serve_calls(&self) {
        let output = OutputPort::new::<TracedCalls>(CALLS, &calls_of(&self.identity.name), false);
        let _ = self.calls_output.set(Arc::new(output));
    }

    /// Reports the calls since the last report, and records further ones only for tools that are
    /// linked.
    pub fn report_calls(&self, stamp_s: f64) {
        let Some(output) = self.calls_output.get() else { return };
        self.trace.set_watched(output.has_links());
        if let Some(report) = self.trace.take_report()
            && let Err(error) = output.publish(
                &report,
                &PublishContext {
                    stamp_s,
                    instance: self.identity.instance,
                    call: 0,
                    gathered: &self.gathering,
                    wake: &|| {},
                    noted: &|_| {},
                },
            )
        {
            tracing::warn!("the calls of this component are not reported: {error}");
        }
    }

    pub fn inputs(&self) -> Vec<Arc<InputPort>> {
        self.inputs.read().clone()
    }

    /// Ends every link.
    pub fn close_links(&self) {
        for output in self.served_outputs() {
            output.close_links();
        }
        for input in self.inputs() {
            input.close_link();
        }
    }
}

fn check_free<'a>(
    id: &str,
    mut taken: impl ExactSizeIterator<Item = &'a str>,
) -> Result<(), DeclareError> {
    if taken.len() >= MAX_PORTS {
        return Err(DeclareError::TooMany);
    }
    if taken.any(|other| other == id) {
        return Err(DeclareError::Twice(id.into()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Flag, Image, Number};

    fn table() -> PortTable {
        let identity = ProcessIdentity { name: "lamp".into(), kind: "lamp".into(), instance: 1 };
        let trace = CallTrace::new(Arc::default());
        PortTable::new(Arc::new(identity), Arc::new(Wakers::new().unwrap()), trace)
    }

    #[test]
    fn ports_have_names_of_their_own_and_there_is_a_limit() {
        let ports = table();
        ports.add_output::<Flag>("light", false).unwrap();
        ports.add_input::<Flag>("light", true, false).expect("an input may be called as an output");
        let again = ports.add_output::<Number>("light", false);
        assert!(matches!(again, Err(DeclareError::Twice(id)) if id == "light"));
        for n in 1..MAX_PORTS {
            ports.add_output::<Flag>(&format!("o{n}"), false).unwrap();
        }
        assert!(matches!(ports.add_output::<Flag>("more", false), Err(DeclareError::TooMany)));
    }

    #[test]
    fn only_declared_outputs_take_messages_of_their_type() {
        let ports = table();
        ports.add_output::<Flag>("light", false).unwrap();
        assert!(ports.publish("light", &Flag { data: true }, 1.0).is_ok());
        let unknown = ports.publish("sound", &Flag { data: true }, 1.0).unwrap_err();
        assert!(unknown.to_string().contains("`lamp` has no output `sound`"), "{unknown}");
        let wrong = ports.publish("light", &Number { data: 1.0 }, 1.0).unwrap_err();
        assert!(wrong.to_string().contains("`lamp.light` is declared as"), "{wrong}");
        let misspelt = ports.publish("lihgt", &Flag { data: true }, 1.0).unwrap_err().to_string();
        let expected = "`lamp` has no output `lihgt`, only: light; correct the name";
        assert!(misspelt.contains(expected), "{misspelt}");
    }

    #[test]
    fn a_message_that_is_too_large_is_refused_without_a_subscriber_too() {
        let ports = table();
        ports.add_output::<Image>("view", false).unwrap();
        let image = |len: usize| Image { data: vec![0; len].into(), ..Image::default() };
        assert!(ports.publish("view", &image(100), 1.0).is_ok());
        let error = ports.publish("view", &image(70 << 20), 1.0).unwrap_err().to_string();
        let expected = "`lamp.view` (Image) is not sent: the value takes 734";
        assert!(error.starts_with(expected), "{error}");
        assert!(error.ends_with("a message has at most 67108864"), "{error}");
    }
}
