//! The registry: answers where a process or an output is, and what time it is. It is asked once per
//! link; data do not pass through it.
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
