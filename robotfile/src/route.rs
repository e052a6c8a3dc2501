//! From a drawn route to its net: what is driven at a stretch, which rally point an exit leads to,
//! and the places and transitions. The same drawing gives the same net; a step's places have its
//! name, so that other steps may come and go without another name for them.

pub(crate) mod clear;
mod drives;
mod exit_paths;
mod exits;
mod leading;
mod net;
mod pieces;

pub use drives::{DrivePurpose, RouteDrive, list_drives};
pub(crate) use exit_paths::{ExitPath, ExitPaths};
pub(crate) use exits::{ExitTarget, find_exit_target};
pub(crate) use leading::find_firings;
pub(crate) use net::{add_nets, find_partner, name_piece, name_wait};
pub(crate) use pieces::{MAX_ROUTE_PIECES, RoutePiece, divide_into_pieces};
