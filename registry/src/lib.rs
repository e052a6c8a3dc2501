//! The registry: tells processes where each other's outputs are, and what time it is. Asked once per
//! link, never on the way of data.
//!
//! Start with [`directory`], the pure state machine; [`serve`] puts it on a socket.

mod background;
pub mod directory;
pub mod limits;
mod serve;
mod similar;
mod texts;

pub use background::Background;
pub use directory::Directory;
pub use serve::{Options, ServeError, serve};
