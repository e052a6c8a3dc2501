//! The panels next to the map. A new panel is a file in `panels/` and a line in [`PANELS`].

mod battery;
mod goal;
mod links;
mod mapping;
mod mission_buttons;
mod motion;
mod progress;
mod stick;
mod stop;

use super::panel_kind::PanelKind;
use crate::screen::SidePanel;

/// All panels, from top to bottom.
pub(super) const PANELS: &[PanelKind] = &[
    stop::PANEL,
    mission_buttons::PANEL,
    progress::PANEL,
    motion::PANEL,
    battery::PANEL,
    mapping::PANEL,
    goal::PANEL,
    stick::PANEL,
    links::PANEL,
];

/// Makes one panel of each kind.
pub(crate) fn make_panels() -> Vec<Box<dyn SidePanel>> {
    PANELS.iter().map(|kind| (kind.make)()).collect()
}
