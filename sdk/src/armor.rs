//! The handle a component is given: nine of the twelve functions.

use std::sync::Arc;
use std::time::Duration;

use armor_wire::codec::EncodeError;
use armor_wire::message::Message;
use armor_wire::name;
use thiserror::Error;

use crate::component::Fault;
use crate::link::{Input, Output, PublishError, Sent};
use crate::ports::{InputType, OutputType};
use crate::shared::Shared;

/// Most outputs or inputs of one component: a robot's, not a data centre's.
const MAX_PORTS: usize = 256;
/// How long [`Armor::synchronize`] waits for configd.
const SYNCHRONIZE_LIMIT: Duration = Duration::from_secs(10);

/// Why a port cannot be declared.
#[derive(Debug, Error)]
pub enum DeclareError {
    /// The name of the port is malformed.
    #[error(
        "`{0}` is not a name for a port; use letters, digits, _ and -, beginning with a letter"
    )]
    Name(String),
    /// The component has a port of that name.
    #[error("the port `{0}` is declared twice")]
    Twice(String),
    /// Ports are declared in the constructor.
    #[error("the port `{0}` is declared after the constructor; declare all ports in `new`")]
    Late(String),
    /// Too many ports.
    #[error("more than {MAX_PORTS} ports")]
    TooMany,
}

/// Why data was not published. Slow or missing subscribers are no reason.
#[derive(Debug, Error)]
pub enum SendError {
    /// The component has no such output.
    #[error("component `{component}` has no output `{id}`; declare it with `provide` in `new`")]
    UnknownOutput {
        /// The component.
        component: String,
        /// The id given.
        id: String,
    },
    /// The output was declared with another type.
    #[error("`{data}` was declared as {declared}, but a {given} was given")]
    WrongType {
        /// The data.
        data: String,
        /// Its declared type.
        declared: String,
        /// The type given.
        given: &'static str,
    },
    /// The message is too large.
    #[error(transparent)]
    TooLarge(#[from] EncodeError),
}

impl From<PublishError> for SendError {
    fn from(PublishError::Encode(error): PublishError) -> Self {
        Self::TooLarge(error)
    }
}

/// What a component does its work with. Cheap to clone; threads of the component may share it.
#[derive(Clone)]
pub struct Armor {
    pub(crate) shared: Arc<Shared>,
}

impl Armor {
    /// Declares an output of message type `T`, or `Latched<T>`. Only in the constructor.
    ///
    /// # Errors
    /// [`DeclareError`] if the name is malformed or taken.
    pub fn provide<T: OutputType>(&self, id: &str) -> Result<(), DeclareError> {
        let outputs = self.shared.outputs();
        self.check(id, outputs.iter().map(|output| output.id.as_str()))?;
        let data = format!("{}.{id}", self.shared.name);
        self.shared.add_output(Output::new::<T::Message>(id, &data, T::LATCHED));
        Ok(())
    }

    /// Declares an input of message type `T`, or `Optional<T>`. Only in the constructor.
    ///
    /// # Errors
    /// [`DeclareError`] if the name is malformed or taken.
    pub fn subscribe<T: InputType>(&self, id: &str) -> Result<(), DeclareError> {
        let inputs = self.shared.inputs();
        self.check(id, inputs.iter().map(|input| input.id.as_str()))?;
        self.shared.add_input(Input::new::<T::Message>(id, T::REQUIRED));
        Ok(())
    }

    fn check<'a>(
        &self,
        id: &str,
        mut taken: impl ExactSizeIterator<Item = &'a str>,
    ) -> Result<(), DeclareError> {
        if !name::is_name(id) {
            return Err(DeclareError::Name(id.into()));
        }
        if self.shared.state().0 != armor_wire::control::RunState::Starting {
            return Err(DeclareError::Late(id.into()));
        }
        if taken.len() >= MAX_PORTS {
            return Err(DeclareError::TooMany);
        }
        if taken.any(|other| other == id) {
            return Err(DeclareError::Twice(id.into()));
        }
        Ok(())
    }

    /// The system-wide name of what an output publishes, `component.output`.
    pub fn provided_data(&self, id: &str) -> Option<String> {
        self.shared.outputs().iter().find(|output| output.id == id).map(|o| o.entry.data.clone())
    }

    /// The system-wide name of what feeds an input; `None` if nothing does. Known from the first
    /// call of `exec` on.
    pub fn subscribed_data(&self, id: &str) -> Option<String> {
        self.shared.inputs().iter().find(|input| input.id == id).and_then(|input| input.data())
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
        self.shared.parameters.ask(name);
        Ok(())
    }

    /// Waits until every parameter asked for has arrived; they are handed to `parameter_received`
    /// before the next call of the component.
    ///
    /// # Errors
    /// If a parameter is not assigned and has no default, if its text is not of its type, or if
    /// configd does not answer within ten seconds.
    pub fn synchronize(&self) -> Result<(), Fault> {
        if self.shared.describing {
            return Ok(());
        }
        self.shared.parameters.wait(SYNCHRONIZE_LIMIT)
    }

    /// Publishes `data` on output `id`: encoded once, and on its way to every subscriber that can
    /// take it when this returns. Waits only for subscribers that asked for `keep="all"`.
    ///
    /// # Errors
    /// [`SendError`] if there is no such output, it has another type, or the data is too large.
    pub fn send_data<T: Message>(&self, id: &str, data: &T) -> Result<Sent, SendError> {
        self.shared.publish(id, data)
    }

    /// Now, in the one time of the whole system: seconds since the Unix epoch. In a system with a
    /// `<clock>`, what that said last, from the first call of `exec` on.
    pub fn timestamp(&self) -> f64 {
        self.shared.clock.timestamp()
    }

    /// The executive may not freeze this component: it serves a person, or another system.
    pub fn set_non_controllable(&self) {
        self.shared.set_non_controllable();
    }
}
