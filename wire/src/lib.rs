//! The Armor protocol without IO and without a clock: the messages, their bytes, and the small
//! state machines that both ends of a connection run.
//!
//! Start with [`frame`] (how bytes become frames), then [`hello`] (how a connection begins), then
//! [`message`] and [`schema`] (how data is typed). The normative text is `docs/protocol.md`.

// Derived code names this crate by its public path, also inside the crate itself.
extern crate self as armor_wire;

pub mod acting;
pub mod array;
pub mod array_view;
pub mod backoff;
pub mod clock;
pub mod codec;
pub mod config;
pub mod control;
pub mod datagram;
pub mod frame;
pub mod gate;
pub mod hello;
pub mod keep;
pub mod limits;
pub mod liveness;
pub mod manifest;
pub mod message;
pub mod name;
pub mod peer;
pub mod refusal;
pub mod registry;
pub mod remote_process;
pub mod run_key;
pub mod schema;
pub mod shared_memory;
pub mod text_format;
pub mod transport;
pub mod version;
pub mod zone_text;

pub use armor_quantity as quantity;
pub use armor_wire_derive::Message;
pub use array::Array;
pub use array_view::ArrayView;
pub use message::{Message, WireType};

#[doc(hidden)]
pub use bincode;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
