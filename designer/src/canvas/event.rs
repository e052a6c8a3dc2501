//! What the user did with a drawing.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::node::PortAt;

/// The user's actions.
#[derive(Clone, Debug, PartialEq)]
pub enum CanvasEvent<Id> {
    /// Dragged what is selected.
    Moved(Vec2),
    /// Joined two ports that may be joined.
    Joined(PortAt, PortAt),
    /// Tried to join two that may not be.
    Refused(String),
    /// Dropped a wire on the background.
    Loose {
        /// The port it comes from.
        from: PortAt,
        /// Where, in the drawing.
        at: Pos2,
    },
    /// Dragged an end of a wire to another port, or to the background.
    Rewired {
        /// The wire.
        wire: usize,
        /// The port that stays.
        stays: PortAt,
        /// The other end's new port.
        to: Option<PortAt>,
    },
    /// Double-clicked something.
    Opened(Id),
    /// Double-clicked the background, at this point.
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
