//! The components that are in this program.

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
    /// What it says of itself.
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
    armor_camera::Camera,
    armor_carmen_player::CarmenPlayer,
    armor_driver::Driver,
    armor_explorer::Explorer,
    armor_grid_slam::GridSlam,
    armor_homing::Homing,
    armor_map_writer::MapWriter,
    armor_patrol::Patrol,
    armor_planner::Planner,
    armor_simulator::Simulator,
}
