//! A position that the file has of an item.

use crate::item::Item;

/// A position of an item: its own, or one of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The item.
    pub item: Item,
    /// The number of the corner; 0 is the item's own position, or a circle's centre.
    pub number: usize,
}
