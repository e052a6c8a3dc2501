//! An entry of the list of panels.

use super::input::InputPort;
use crate::screen::Panel;

/// A kind of panel: the inputs that it needs besides those of the map area, and its constructor.
pub(super) struct PanelKind {
    pub(super) inputs: &'static [InputPort],
    pub(super) make: fn() -> Box<dyn Panel>,
}
