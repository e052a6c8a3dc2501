//! What the user did with a drawing.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::node::PortAt;

/// What the user did.
#[derive(Clone, Debug, PartialEq)]
pub enum CanvasEvent<Id> {
    /// Dragged what is selected.
    Moved(Vec2),
    /// Joined two ports that may be joined.
    Joined(PortAt, PortAt),
    /// Tried to join two that may not be.
    Refused(String),
    /// Let a wire go over nothing.
    Loose {
        /// The port it comes from.
        from: PortAt,
        /// Where, in the drawing.
        at: Pos2,
    },
    /// Took a wire by its end and let it go at another port, or nowhere.
    Rewired {
        /// The wire.
        wire: usize,
        /// The port that stays.
        stays: PortAt,
        /// The other end's new port.
        to: Option<PortAt>,
    },
    /// Clicked something twice.
    Opened(Id),
    /// Clicked the empty drawing twice, there.
    OpenedEmpty(Pos2),
    /// Asked for a menu.
    Menu {
        /// Of what; none is the drawing's own.
        of: Option<Id>,
        /// Where, in the drawing.
        at: Pos2,
    },
    /// Gave a group or note another size.
    Resized(Id, Rect),
}
