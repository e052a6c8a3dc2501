//! How ports are declared: by message type, or by `Latched`, `Optional` or `Many` of one.

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

/// An input type: a message, [`Optional`] or [`Many`] of one, or `Optional<Many<…>>`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the type of an input",
    note = "an input is of a message, `Optional` or `Many` of one, or `Optional<Many<…>>`; `Latched` is \
            for outputs"
)]
pub trait InputType: 'static {
    /// The type of what is received.
    type Message: Message;
    /// Whether the file must feed it.
    const REQUIRED: bool;
    /// Whether any number of links may feed it.
    const MANY: bool;
}

/// An output whose last value a late subscriber gets immediately: maps, states, results.
pub struct Latched<T>(PhantomData<T>);

/// An input that may stay unconnected.
pub struct Optional<T>(PhantomData<T>);

/// An input that any number of links may feed, at least one unless it is `Optional<Many<T>>`. Each link
/// has its own queue, counters and history; [`Header::data`](crate::Header::data) names the source.
pub struct Many<T>(PhantomData<T>);

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
    const MANY: bool = false;
}

impl<T: Message> InputType for Optional<T> {
    type Message = T;
    const REQUIRED: bool = false;
    const MANY: bool = false;
}

impl<T: Message> InputType for Many<T> {
    type Message = T;
    const REQUIRED: bool = true;
    const MANY: bool = true;
}

impl<T: Message> InputType for Optional<Many<T>> {
    type Message = T;
    const REQUIRED: bool = false;
    const MANY: bool = true;
}
