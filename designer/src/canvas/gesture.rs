//! The gesture that the pointer is making.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::node::PortAt;
use crate::canvas::rules::JoinRules;
use crate::canvas::selection::Selection;

/// The gesture between pressing and releasing a button.
#[derive(Clone, Debug, Default)]
pub(super) enum Gesture<Id> {
    /// Nothing.
    #[default]
    Idle,
    /// The drawing is moved.
    Pan,
    /// What is selected is dragged; so far by this much, in the drawing.
    Move {
        /// Where the drag began.
        from: Pos2,
        by: Vec2,
    },
    /// An area is drawn, and what is in it selected.
    Band {
        from: Pos2,
        to: Pos2,
        /// What was selected before and stays so.
        kept: Selection<Id>,
    },
    /// A wire is drawn.
    Wire {
        from: PortAt,
        to: Pos2,
        /// The wire that was taken by its end.
        taken: Option<usize>,
        /// Whether it hangs on the pointer without a button being held.
        is_hanging: bool,
    },
    /// A group or note gets another size.
    Resize { number: usize, rect: Rect },
}

/// A wire that is being dragged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PendingWire {
    /// The port at which its other end is.
    pub(super) from: PortAt,
    /// The wire that was taken by its end, if it is not a new one.
    pub(super) taken: Option<usize>,
}

impl PendingWire {
    /// Whether it may end at a port, else why not.
    pub(super) fn may_end(self, rules: &dyn JoinRules, to: PortAt) -> Result<(), String> {
        match self.taken {
            Some(wire) => rules.may_lead(wire, self.from, to),
            None => rules.may_join(self.from, to),
        }
    }
}

impl<Id> Gesture<Id> {
    /// How far what is selected is being dragged.
    pub(super) fn shift(&self) -> Vec2 {
        match self {
            Self::Move { by, .. } => *by,
            _ => Vec2::ZERO,
        }
    }
}
