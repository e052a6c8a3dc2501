//! An entry of the list of panels.

use super::input::ScreenPort;
use crate::screen::SidePanel;

/// A kind of panel: the inputs that it needs besides those of the map area, and its constructor.
pub(super) struct PanelKind {
    pub(super) inputs: &'static [ScreenPort],
    pub(super) make: fn() -> Box<dyn SidePanel>,
}
