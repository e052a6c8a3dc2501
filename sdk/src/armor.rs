//! The handle that a component gets: nine of the twelve functions.

use std::sync::Arc;
use std::time::Duration;

use armor_wire::message::Message;
use armor_wire::name;

use crate::any_message::AnyMessage;
use crate::call::Fault;
use crate::calls::is_in_call;
use crate::link::output::Sent;
use crate::participant::Participant;
use crate::port_table::{DeclareError, PortTable, SendError};
use crate::ports::{InputType, OutputType};

/// How long [`Armor::synchronize`] waits for configd.
const SYNCHRONIZE_LIMIT: Duration = Duration::from_secs(10);

/// The handle through which a component publishes, asks and declares. Cheap to clone; threads of
/// the component may share it.
#[derive(Clone)]
pub struct Armor {
    pub(crate) participant: Arc<Participant>,
}

impl Armor {
    /// Declares an output of message type `T`, or `Latched<T>`; of [`AnyMessage`] for one that passes on
    /// what an input of that type receives. Only in the constructor.
    ///
    /// # Errors
    /// [`DeclareError`] if the name is malformed or taken.
    pub fn provide<T: OutputType>(&self, id: &str) -> Result<(), DeclareError> {
        self.check_declaration(id)?;
        self.participant.ports.add_output::<T::Message>(id, T::LATCHED)
    }

    /// Declares an input of message type `T`, `Optional<T>`, or `Many<T>` for one that several links may
    /// feed. Only in the constructor.
    ///
    /// # Errors
    /// [`DeclareError`] if the name is malformed or taken.
    pub fn subscribe<T: InputType>(&self, id: &str) -> Result<(), DeclareError> {
        self.check_declaration(id)?;
        self.participant.ports.add_input::<T::Message>(id, T::REQUIRED, T::MANY)
    }

    pub(crate) fn check_declaration(&self, id: &str) -> Result<(), DeclareError> {
        if !name::is_name(id) {
            return Err(DeclareError::Name(id.into()));
        }
        if !self.participant.lifecycle.is_starting() {
            return Err(DeclareError::Late(id.into()));
        }
        Ok(())
    }

    /// The system-wide name of what an output publishes, `component.output`.
    pub fn provided_data(&self, id: &str) -> Option<String> {
        let outputs = self.participant.ports.outputs();
        outputs.iter().find(|output| output.id == id).map(|output| output.entry.data.clone())
    }

    /// The system-wide name of what feeds an input; `None` if nothing does. Those of an input with
    /// several sources are in the order of the file, with spaces between them. Known from the first
    /// call of `exec` on.
    pub fn subscribed_data(&self, id: &str) -> Option<String> {
        let inputs = self.participant.ports.inputs();
        let sources = inputs.iter().filter(|input| input.id == id).filter_map(|input| input.data());
        let sources: Vec<_> = sources.collect();
        (!sources.is_empty()).then(|| sources.join(" "))
    }

    /// Asks for a parameter; the answer arrives in `parameter_received`, before any call that
    /// follows [`synchronize`](Self::synchronize).
    ///
    /// # Errors
    /// If the name is malformed.
    pub fn get_parameter(&self, name: &str) -> Result<(), Fault> {
        if !name::is_name(name) {
            return Err(format!("`{name}` is not a name for a parameter").into());
        }
        self.participant.parameters.ask_for(name);
        Ok(())
    }

    /// Waits until every parameter asked for has arrived; they are handed to `parameter_received`
    /// before the next call of the component. [`Parameters::request`](crate::Parameters::request) asks
    /// and waits itself.
    ///
    /// # Errors
    /// If a parameter is not assigned and has no default, if its text is not of its type, or if
    /// configd does not answer within ten seconds.
    pub fn synchronize(&self) -> Result<(), Fault> {
        if self.participant.is_described {
            return Ok(());
        }
        self.participant.parameters.wait_for_all(SYNCHRONIZE_LIMIT)
    }

    /// Publishes `data` on output `id`: encoded once, and on its way to every subscriber that can
    /// take it when this returns. Waits only for subscribers that asked for `keep="all"`.
    ///
    /// A thread that the component has started itself may publish while the component is active, and
    /// after it has reported `done` or a failure, until it is frozen. It is frozen only after such a
    /// call of `send_data` has returned.
    ///
    /// An [`AnyMessage`] keeps the stamp with which it was created.
    ///
    /// # Errors
    /// [`SendError`] if there is no such output, it has another type, or the data is too large; on a
    /// thread of the component's own, [`SendError::NotActive`] while it is frozen or starting.
    pub fn send_data<T: Message>(&self, id: &str, data: &T) -> Result<Sent, SendError> {
        let any = AnyMessage::find_in(data);
        let stamp_s = any.map_or_else(|| self.timestamp(), AnyMessage::stamp_s);
        self.send_with_right(id, |ports| ports.publish(id, data, stamp_s))
    }

    /// Publishes, if this thread may now.
    pub(crate) fn send_with_right(
        &self,
        id: &str,
        publish: impl FnOnce(&PortTable) -> Result<Sent, SendError>,
    ) -> Result<Sent, SendError> {
        let lifecycle = &self.participant.lifecycle;
        let _right = match is_in_call() {
            true => None,
            false => Some(
                lifecycle
                    .try_publish_outside_calls()
                    .ok_or_else(|| SendError::NotActive { id: id.into() })?,
            ),
        };
        publish(&self.participant.ports).map_err(|error| match error {
            SendError::UnknownOutput { id, .. } if lifecycle.is_starting() => {
                SendError::NotYetDeclared { id }
            }
            error => error,
        })
    }

    /// The current time of the whole system in seconds since the Unix epoch. In a system with a
    /// `<clock>`, the last value of that clock, from the first call of `exec` on.
    pub fn timestamp(&self) -> f64 {
        self.participant.clock.timestamp()
    }

    /// Forbids the executive to freeze this component: it serves a person, or another system. Only
    /// in the constructor: the manifest contains it, and `armor check` refuses a mission that names it.
    ///
    /// # Errors
    /// [`DeclareError::LateNonControllable`] after the constructor.
    pub fn set_non_controllable(&self) -> Result<(), DeclareError> {
        let lifecycle = &self.participant.lifecycle;
        if !lifecycle.is_starting() {
            return Err(DeclareError::LateNonControllable);
        }
        lifecycle.set_non_controllable();
        Ok(())
    }
}
