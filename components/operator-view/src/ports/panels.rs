//! The panels next to the map. A new panel is a file in `panels/` and a line in [`PANELS`].

mod battery;
mod goal;
mod hosts;
mod links;
mod mapping;
mod mission_buttons;
mod motion;
mod progress;
mod stick;
mod stop;

pub(crate) use hosts::HostsReading;
pub(crate) use links::LinksReading;

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
    hosts::PANEL,
];

/// Makes one panel of each kind.
pub(crate) fn make_panels() -> Vec<Box<dyn SidePanel>> {
    PANELS.iter().map(|kind| (kind.make)()).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::make_panels;

    #[test]
    fn every_panel_has_its_own_name_and_a_row_in_the_documentation() {
        let names: Vec<_> = make_panels().iter().map(|panel| panel.name()).collect();
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len(), "{names:?}");
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/screen.md");
        let page = std::fs::read_to_string(page).unwrap();
        for name in names {
            let row = format!("| `{name}` |");
            assert!(page.lines().any(|line| line.starts_with(&row)), "docs/screen.md: {row}");
        }
    }
}
