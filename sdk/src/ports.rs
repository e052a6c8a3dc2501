//! How ports are declared: by message type, with two words that say more.

use std::marker::PhantomData;

use armor_wire::Message;

/// An output type: a message, or [`Latched`] of one.
pub trait OutputType: 'static {
    /// What is published.
    type Message: Message;
    /// Whether a late subscriber gets the last value at once.
    const LATCHED: bool;
}

/// An input type: a message, or [`Optional`] of one.
pub trait InputType: 'static {
    /// What is received.
    type Message: Message;
    /// Whether the file must feed it.
    const REQUIRED: bool;
}

/// An output whose last value a late subscriber gets at once: maps, states, results.
pub struct Latched<T>(PhantomData<T>);

/// An input that may stay unconnected.
pub struct Optional<T>(PhantomData<T>);

impl<T: Message> OutputType for T {
    type Message = T;
    const LATCHED: bool = false;
}

impl<T: Message> OutputType for Latched<T> {
    type Message = T;
    const LATCHED: bool = true;
}

impl<T: Message> InputType for T {
    type Message = T;
    const REQUIRED: bool = true;
}

impl<T: Message> InputType for Optional<T> {
    type Message = T;
    const REQUIRED: bool = false;
}
