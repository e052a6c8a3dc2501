//! The components that are in this program. A new one is its crate in `components/`, its line in
//! `launcher/Cargo.toml` and its line here.

use std::ffi::OsString;
use std::process::ExitCode;

use armor_sdk::Fault;
use armor_wire::manifest::Manifest;

/// A kind that this program runs itself.
pub struct Stock {
    /// The kind.
    pub kind: &'static str,
    /// Runs one, with the arguments that every component takes.
    pub run: fn(Vec<OsString>) -> ExitCode,
    /// Its description of itself.
    pub manifest: fn() -> Result<Manifest, Fault>,
}

macro_rules! stock {
    ($($component:ty),* $(,)?) => {
        /// All of them, by kind.
        pub const STOCK: &[Stock] = &[$(Stock {
            kind: <$component as armor_sdk::Component>::KIND,
            run: |arguments| armor_sdk::run_with::<$component>(arguments.into_iter()),
            manifest: armor_sdk::manifest_of::<$component>,
        }),*];
    };
}

stock! {
    armor_board::Board,
    armor_camera::Camera,
    armor_carmen_player::CarmenPlayer,
    armor_chart::Chart,
    armor_driver::Driver,
    armor_explorer::Explorer,
    armor_fence::Fence,
    armor_grid_slam::GridSlam,
    armor_homing::Homing,
    armor_map_writer::MapWriter,
    armor_patrol::Patrol,
    armor_planner::Planner,
    armor_recorder::SystemRecorder,
    armor_simulator::Simulator,
    armor_web_view::WebView,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Programs of their own: one brings a window, the other serves a program that few robots need.
    const SEPARATE: [&str; 2] = ["foxglove", "operator-view"];
    /// What components share.
    const SHARED: [&str; 5] = ["convert", "drawn-world", "grid", "map-file", "zones"];

    #[test]
    fn the_folders_and_the_readme_of_the_components_list_them_all() {
        let readme = include_str!("../../../components/README.md");
        let linked = readme.lines().filter_map(|line| line.strip_prefix("| ["));
        let mut listed: Vec<&str> =
            linked.filter_map(|line| line.split_once("](").map(|(kind, _)| kind)).collect();
        let mut expected: Vec<&str> = STOCK.iter().map(|stock| stock.kind).collect();
        expected.extend(SEPARATE);
        listed.sort_unstable();
        expected.sort_unstable();
        assert_eq!(listed, expected);
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../components");
        let folders = std::fs::read_dir(folder).expect("readable").flatten();
        let crates = folders.filter(|entry| entry.path().join("Cargo.toml").exists());
        let mut crates: Vec<_> =
            crates.filter_map(|entry| entry.file_name().into_string().ok()).collect();
        crates.retain(|name| !SHARED.contains(&name.as_str()));
        crates.sort_unstable();
        assert_eq!(crates, expected, "a component is missing in stock.rs, or its folder");
    }

    #[test]
    fn every_stock_component_has_a_manifest() {
        for stock in STOCK {
            let manifest = (stock.manifest)().expect(stock.kind);
            manifest.validate().expect(stock.kind);
            assert_eq!(manifest.kind, stock.kind);
            assert!(manifest.events.is_some(), "{} does not list its events", stock.kind);
        }
    }
}
