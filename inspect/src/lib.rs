//! Observes a running system from outside, once (`armor ps`) or continuously for a window.
//!
//! [`Observed`] reads the system once; [`Watch`] keeps observing and maintains a [`Picture`];
//! [`Values`] shows data on outputs and [`MissionWatch`] the state of the mission; [`OrderDesk`] and
//! [`ParameterDesk`] send an operator's orders and an engineer's changes. [`launch`] runs a file.
//! Start with `observation.rs`.

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
mod wake;
mod watch;
pub mod words;

pub use following::{FollowError, Following};
pub use links::{Edge, Looks, links, looks};
pub use mission::{History, MissionLook, MissionWatch};
pub use observation::{Action, Condition, DEAD_AFTER, Event, LONG_CALL_S, Picture, Process};
pub use observed::{CONFIGD, CONFIGURATION, Observed, Sighting, TAP_KEEP};
pub use orders::{Given, OrderDesk, this_user};
pub use parameters::{ParameterDesk, Told};
pub use series::{MAX_POINTS, Series};
pub use values::{ValueLook, Values};
pub use wake::Wake;
pub use watch::Watch;
