//! What is drawn of a mission.

use std::collections::BTreeSet;

use armor_petri::PlaceId;
use armor_picture::theme::ThemeColours;
use armor_robotfile::mission::Mission;

use crate::item::Item;
use crate::layout::Layout;
use crate::mission::marks::Marks;
use crate::mission::play::Play;

/// What is drawn.
pub struct Scene<'a> {
    /// The mission as the file has it.
    pub mission: &'a Mission,
    /// What was found of it.
    pub marks: &'a Marks,
    /// Where the file shows things.
    pub layout: &'a Layout,
    /// The mission as it is being played.
    pub play: Option<&'a Play>,
    /// Tokens that have not arrived yet.
    pub in_flight: &'a [(PlaceId, u32)],
    /// The window's colours.
    pub colours: &'a ThemeColours,
    /// The steps of routes that are open; none: all.
    pub opened: Option<&'a BTreeSet<Item>>,
}
