//! Looking at a running system from outside, once (`armor ps`) or for as long as a window shows it.
//!
//! [`Observed`] is one look; [`Watch`] goes on looking and keeps a [`Picture`]; [`Values`],
//! [`MissionWatch`] show what flows and where the mission stands; [`OrderDesk`] and
//! [`ParameterDesk`] are for those who may change something. [`launch`] runs a file. Start with
//! `picture.rs`.

mod following;
pub mod launch;
mod links;
pub mod log;
mod mission;
mod observation;
mod observed;
mod orders;
mod parameters;
mod series;
pub mod systems;
mod values;
mod watch;
pub mod words;

use std::sync::Arc;

pub use following::{FollowError, Following};
pub use links::{Edge, Looks, links, looks};
pub use mission::{History, MissionLook, MissionWatch};
pub use observation::{Action, Condition, DEAD_AFTER, Event, LONG_CALL_S, Picture, Process};
pub use observed::{CONFIGD, CONFIGURATION, Observed, Sighting, TAP_KEEP};
pub use orders::{Given, OrderDesk, this_user};
pub use parameters::{ParameterDesk, Told};
pub use series::{MAX_POINTS, Series};
pub use values::{ValueLook, Values};
pub use watch::Watch;

/// Called, from any thread, when there is something new to see.
pub type Wake = Arc<dyn Fn() + Send + Sync>;
