//! Links: an output's data, straight from the publisher's thread to the subscriber's socket.

mod inbox;
mod input;
mod output;
mod publishing;
mod queue;
mod stream;
mod wire_out;

pub(crate) use inbox::turn;
pub(crate) use input::Input;
pub use output::Sent;
pub(crate) use output::{Output, PublishError};
pub(crate) use publishing::Publish;
pub(crate) use queue::Queue;
pub(crate) use wire_out::LinkOut;
