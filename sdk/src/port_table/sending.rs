//! Messages on the outputs of a component: their publication, and the frames that are gathered.

use std::any::TypeId;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use armor_wire::codec::{Encodable, EncodeError, EncodedPieces};
use armor_wire::message::Message;
use thiserror::Error;

use super::PortTable;
use crate::any_message::AnyMessage;
use crate::calls::current_call;
use crate::link::output::{OutputPort, Sent};
use crate::link::publishing::PublishContext;

/// Why data was not published. Slow or missing subscribers are no reason.
#[derive(Debug, Error)]
pub enum SendError {
    /// The component has no such output.
    #[error("component `{component}` has no output `{id}`{existing}; {remedy}")]
    UnknownOutput {
        /// The component.
        component: String,
        /// The id given.
        id: String,
        /// Those that it has, in words; empty if there are none.
        existing: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The component sends in its constructor, before it has declared the output.
    #[error("`{id}` is not declared yet: in `new`, call `provide` for it before `send_data`")]
    NotYetDeclared {
        /// The id given.
        id: String,
    },
    /// A thread outside the calls of user code sends while the component is not active.
    #[error(
        "`{id}` is not sent: the component is not active, and until it is, none of its threads \
         publishes; drop the value, or end the thread in `exec(Call::Stopping)`"
    )]
    NotActive {
        /// The id given.
        id: String,
    },
    /// The output was declared with another type.
    #[error(
        "`{data}` is declared as {declared}, but a {given} is sent: send a {declared}, or declare it \
         with `provide::<{given}>` in `new`"
    )]
    WrongType {
        /// The data.
        data: String,
        /// Its declared type.
        declared: String,
        /// The type given.
        given: String,
    },
    /// The message is too large, or cannot be written.
    #[error("`{data}` ({type_name}) is not sent: {error}")]
    NotEncoded {
        /// The data.
        data: String,
        /// Its type.
        type_name: String,
        /// Why, with its size and the limit.
        error: EncodeError,
    },
}

impl PortTable {
    /// Publishes `message`, created at `stamp_s`, on output `id`.
    ///
    /// # Errors
    /// [`SendError`] if there is no such output, it has another type, or the message is too large.
    pub fn publish<T: Message>(
        &self,
        id: &str,
        message: &T,
        stamp_s: f64,
    ) -> Result<Sent, SendError> {
        let outputs = self.outputs.read();
        let output = outputs.iter().find(|output| output.id == id);
        let output = output.ok_or_else(|| self.unknown_output(id, &outputs))?;
        let any = AnyMessage::find_in(message).map(AnyMessage::message_type);
        let is_its_type = output.message == TypeId::of::<T>()
            && any.is_none_or(|any| any.schema_hash == output.schema_hash());
        if !is_its_type {
            return Err(SendError::WrongType {
                data: output.entry.data.clone(),
                declared: output.entry.type_name.clone(),
                given: any.map_or(T::NAME, |any| any.name.as_str()).into(),
            });
        }
        self.publish_on(output, message, stamp_s)
    }

    /// Publishes an encoded message, created at `stamp_s`, on output `id`, which takes such.
    ///
    /// # Errors
    /// As [`publish`](Self::publish).
    pub fn publish_encoded(
        &self,
        id: &str,
        message: EncodedPieces<'_>,
        stamp_s: f64,
    ) -> Result<Sent, SendError> {
        let outputs = self.outputs.read();
        let output = outputs.iter().find(|output| output.id == id);
        let output = output.ok_or_else(|| self.unknown_output(id, &outputs))?;
        if output.message != TypeId::of::<EncodedPieces<'static>>() {
            return Err(SendError::WrongType {
                data: output.entry.data.clone(),
                declared: output.entry.type_name.clone(),
                given: "message in encoded form".into(),
            });
        }
        self.publish_on(output, &message, stamp_s)
    }

    /// Whether a small message on the output might wait for a subscriber; no for one that does not exist.
    pub fn may_wait(&self, id: &str) -> bool {
        self.outputs
            .read()
            .iter()
            .find(|output| output.id == id)
            .is_some_and(|output| output.may_wait())
    }

    fn publish_on<T: Encodable>(
        &self,
        output: &OutputPort,
        message: &T,
        stamp_s: f64,
    ) -> Result<Sent, SendError> {
        let traced_at_s = self.trace.time_s();
        let noted = |sequence| {
            if let Some(at_s) = traced_at_s {
                self.trace.note_published(&output.id, sequence, at_s);
            }
        };
        let wake = || self.wakers.wake_service();
        let origin = PublishContext {
            stamp_s,
            instance: self.identity.instance,
            call: current_call(),
            gathered: &self.gathering,
            wake: &wake,
            noted: &noted,
        };
        output.publish(message, &origin).map_err(|error| SendError::NotEncoded {
            data: output.entry.data.clone(),
            type_name: output.entry.type_name.clone(),
            error,
        })
    }

    fn unknown_output(&self, id: &str, outputs: &[Arc<OutputPort>]) -> SendError {
        let existing: Vec<_> = outputs.iter().map(|output| output.id.as_str()).collect();
        let (existing, remedy) = match existing.as_slice() {
            [] => (String::new(), "declare it with `provide` in `new`"),
            ids => (
                format!(", only: {}", ids.join(", ")),
                "correct the name, or declare it with `provide` in `new`",
            ),
        };
        SendError::UnknownOutput {
            component: self.identity.name.clone(),
            id: id.into(),
            existing,
            remedy,
        }
    }

    /// Whether frames are being gathered now.
    pub fn is_gathering(&self) -> bool {
        self.gathering.load(Ordering::Relaxed)
    }

    /// Writes the frames that the ending call of user code has gathered.
    pub fn flush_gathered(&self) {
        // Read before it is swapped: most calls gather nothing, and a swap is the costlier one.
        if !self.is_gathering() || !self.gathering.swap(false, Ordering::Relaxed) {
            return;
        }
        // Not through `flush_outputs`: that would clone the list for every call.
        let mut all_written = true;
        for output in self.outputs.read().iter() {
            all_written &= output.flush_links();
        }
        if !all_written {
            self.wakers.wake_service();
        }
    }

    /// Writes what waits on all outputs; whether nothing waits any more.
    pub fn flush_outputs(&self) -> bool {
        // Every output is flushed, also after one that cannot be written completely.
        let mut all_written = true;
        for output in self.served_outputs() {
            all_written &= output.flush_links();
        }
        all_written
    }
}
