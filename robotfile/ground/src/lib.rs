//! Proves drawn routes over the known grid of a site: a path exists for every leg and every exit.
//!
//! [`check_ground`] reads the grids that the maps of a file name, and returns findings. The rest is
//! pure: [`SiteGround`] is what a robot of a radius may drive over, [`examine_drives`] compares the drives
//! of a mission with it.

mod check;
mod examining;
mod ground;
mod path_search;
#[cfg(test)]
mod tests;

pub use check::{check_ground, with_drive_lengths};
pub use examining::{examine_drives, with_path_lengths};
pub use ground::SiteGround;
