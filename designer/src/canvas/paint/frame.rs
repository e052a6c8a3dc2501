//! What painting one frame needs to know.

use eframe::egui::{Color32, Painter, Vec2};

use crate::canvas::diagram::Diagram;
use crate::canvas::gesture::PendingWire;
use crate::canvas::hit::Hit;
use crate::canvas::node::{Mark, PortAt};
use armor_picture::theme::ThemeColours;

/// What painting one frame needs to know.
pub(in crate::canvas) struct PaintFrame<'a, Id> {
    pub(in crate::canvas) painter: &'a Painter,
    pub(in crate::canvas) diagram: &'a Diagram<Id>,
    pub(in crate::canvas) colours: &'a ThemeColours,
    /// How far what is selected is being dragged.
    pub(in crate::canvas) shift: Vec2,
    pub(in crate::canvas) hovered: Option<Hit>,
    pub(in crate::canvas) zoom: f32,
    /// The wire that is being dragged, and the port it would end at.
    pub(in crate::canvas) pending: Option<(PendingWire, Option<PortAt>)>,
}

impl<Id> PaintFrame<'_, Id> {
    /// Returns the colour of a mark, if it has one.
    pub(in crate::canvas) fn mark_colour(&self, mark: Mark) -> Option<Color32> {
        match mark {
            Mark::None => None,
            Mark::Warning => Some(self.colours.warning),
            Mark::Error => Some(self.colours.error),
        }
    }
}
