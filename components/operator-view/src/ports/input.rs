//! What an input of the screen is: its port, and how its messages change the console.

use armor_sdk::prelude::*;
use armor_sdk::wire::codec;

use crate::console::Console;
use crate::scene::SceneError;

/// A change of the console that a message asks for.
pub(super) type ConsoleUpdate = Box<dyn FnOnce(&mut Console) -> Result<(), SceneError>>;

/// An input: implemented by an empty type, listed as an [`ScreenPort`].
pub(super) trait ScreenInput {
    /// Name of the input.
    const ID: &'static str;
    /// What arrives, for `armor describe`.
    const DOC: &'static str;
    /// Whether data arrive all the time, so that silence is worth a warning.
    const IS_STEADY: bool;
    /// The type of its messages.
    type Message: Message + 'static;

    /// Converts a message. It runs without the lock of the console, so that decoding a large map or
    /// image delays neither the window nor STOP.
    fn read_message(message: Self::Message) -> Result<ConsoleUpdate, SceneError>;
}

/// An input of any type, as an entry of a list.
pub(super) struct ScreenPort {
    pub(super) id: &'static str,
    pub(super) doc: &'static str,
    pub(super) is_steady: bool,
    subscribe: fn(&Armor) -> Result<(), Fault>,
    read: fn(&Data<'_>) -> Result<ConsoleUpdate, SceneError>,
    read_bytes: fn(&[u8]) -> Result<ConsoleUpdate, SceneError>,
}

impl ScreenPort {
    /// Returns the entry of an input.
    pub(super) const fn of<I: ScreenInput>() -> Self {
        Self {
            id: I::ID,
            doc: I::DOC,
            is_steady: I::IS_STEADY,
            subscribe: |armor| Ok(armor.subscribe::<Optional<I::Message>>(I::ID)?),
            read: |data| {
                let message = data.decode().map_err(|e| SceneError::Bytes(e.to_string()))?;
                I::read_message(message)
            },
            read_bytes: |bytes| {
                let message = codec::decode(bytes).map_err(|e| SceneError::Bytes(e.to_string()))?;
                I::read_message(message)
            },
        }
    }

    /// Declares the input. It may stay unlinked.
    pub(super) fn subscribe(&self, armor: &Armor) -> Result<(), Fault> {
        (self.subscribe)(armor)
    }

    /// Decodes data of the input.
    ///
    /// # Errors
    /// If the bytes are no message of the input's type, or the message cannot be shown.
    pub(super) fn read(&self, data: &Data<'_>) -> Result<ConsoleUpdate, SceneError> {
        (self.read)(data)
    }

    /// As [`Self::read`], for the bytes that another process of the screen has received.
    ///
    /// # Errors
    /// If they are no message of the input's type, or the message cannot be shown.
    pub(super) fn read_bytes(&self, bytes: &[u8]) -> Result<ConsoleUpdate, SceneError> {
        (self.read_bytes)(bytes)
    }
}
