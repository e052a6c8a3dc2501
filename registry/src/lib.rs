//! The registry: tells processes where each other's outputs are, and what time it is. Asked once per
//! link, never on the way of data.
//!
//! Start with [`directory`], the pure state machine; [`serve`] puts it on a socket.

mod background;
pub mod directory;
pub mod limits;
mod refusals;
mod serve;
mod similar;

pub use background::BackgroundRegistry;
pub use directory::RegistryDirectory;
pub use serve::{RegistryOptions, RegistryStartError, serve};
