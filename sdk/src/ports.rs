//! How ports are declared: by message type, or by `Latched` or `Optional` of one.

use std::marker::PhantomData;

use armor_wire::Message;

/// An output type: a message, or [`Latched`] of one.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the type of an output",
    note = "an output is of a message, or `Latched` of one; `Optional` is for inputs"
)]
pub trait OutputType: 'static {
    /// The type of what is published.
    type Message: Message;
    /// Whether a late subscriber immediately gets the last value.
    const LATCHED: bool;
}

/// An input type: a message, or [`Optional`] of one.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the type of an input",
    note = "an input is of a message, or `Optional` of one; `Latched` is for outputs"
)]
pub trait InputType: 'static {
    /// The type of what is received.
    type Message: Message;
    /// Whether the file must feed it.
    const REQUIRED: bool;
}

/// An output whose last value a late subscriber gets immediately: maps, states, results.
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
