//! Edits of a file that stay in their lines. An edit is worked out on the tree as changes of the
//! text, which are applied together and read again; so comments, order, blank lines, quotes,
//! foreign attributes and line ends survive, and an edit that fails has changed nothing.

mod adding;
mod attribute;
mod document;
mod element_edits;
mod error;
mod expanding;
mod item;
mod layout;
mod mention;
mod naming;
mod new_element;
mod parameter;
mod patch;
mod placement;
mod removal;
mod removing;
mod words;

pub(crate) use attribute::quote;
pub use document::Document;
pub use element_edits::ElementEdit;
pub use error::EditError;
pub use item::{Derivation, Item};
pub use layout::Position;
pub(crate) use mention::mentions;
pub use new_element::NewElement;
pub(crate) use placement::line_break;
