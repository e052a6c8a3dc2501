//! Pieces that panels of all views are made of.

pub mod fields;
pub mod fuzzy;
pub mod path;
pub mod pick;
