//! Shared memory between the two ends of a link: a publisher encodes a message once into a *slot*,
//! and every subscriber on the host reads it there.
//!
//! A slot is a piece of memory that the publisher alone can write; subscribers map it read-only. Each
//! link has a *page*, which both of its ends can write: a ring with the slots that are new to the
//! subscriber, and a table of the slots that it holds. A subscriber can spoil only its own page. The
//! kernel frees all of it when the last process that has mapped it ends; nothing has a name in the
//! file system (docs/protocol.md, Shared memory).
//!
//! [`ring`] and [`pool`] are the protocol, pure and without memory of their own; [`mapping`] has the
//! only `unsafe` code of the workspace.

pub mod mapping;
pub mod page;
pub mod pool;
pub mod ring;
pub mod step;
mod word;

pub use mapping::{LinkPage, MemoryError, SlotMemory, SlotView};
pub use page::{PageLayout, PageWords};
pub use pool::{Placement, SlotPool};
pub use ring::{RingEntry, RingReader, RingWriter};
pub use word::Word;
