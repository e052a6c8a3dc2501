//! The lists over the window that are searched by typing.

use crate::item::Item;
use crate::panels::pick::{Entry, Picker};

/// The list while it is open.
#[derive(Default)]
pub(crate) struct AllCommands {
    pub(super) picker: Picker,
}

/// A search that is open.
#[derive(Default)]
pub(crate) struct FindList {
    pub(super) picker: Picker,
    /// All entries, collected when it was opened.
    pub(super) entries: Option<Vec<Entry<Item>>>,
}
