//! Observes a running system from outside, once (`armor ps`) or continuously for a window.
//!
//! [`ObservedSystem`] reads the system once; [`SystemWatch`] keeps observing and maintains a
//! [`SystemPicture`]; [`WatchedValues`] shows data on outputs and [`MissionWatch`] the state of the
//! mission; [`OrderSender`] and [`ParameterClient`] send an operator's orders and an engineer's
//! changes; [`DriveLimits`] is for driving by hand. [`launch`] runs a file. Start with `observation.rs`.

mod following;
mod hand_driving;
mod hosts;
pub mod launch;
mod links;
pub mod log;
mod message_draft;
mod message_trace;
mod mission;
mod observation;
mod observed;
mod orders;
mod parameters;
pub mod run_control;
mod series;
pub mod systems;
mod values;
mod wake;
mod watch;
pub mod words;

pub use following::{FollowError, FollowingTap, ProviderWatcher};
pub use hand_driving::{DEAD_MAN, DriveLimits};
pub use hosts::ObservedHost;
pub use links::{Looks, ObservedLink, combine_links, pair_reports};
pub use message_draft::{FieldFault, MessageDraft};
pub use message_trace::{
    CallCause, CallReport, CallTaps, ReceivedMessage, TraceAssembly, TracePlace, TraceStep,
};
pub use mission::{FiringHistory, MissionLook, MissionWatch};
pub use observation::{
    Condition, DEAD_AFTER, HANGING_CALL_S, LONG_CALL_S, ObservedProcess, ObserverAction,
    SystemEvent, SystemPicture,
};
pub use observed::{CONFIGD, CONFIGURATION, ObservedSystem, Sighting, TAP_KEEP, find_own_registry};
pub use orders::{OrderSender, SentOrder, this_user};
pub use parameters::{ParameterClient, SetReport};
pub use series::{MAX_POINTS, Series};
pub use values::{ValueLook, WatchedValues};
pub use wake::WakeCallback;
pub use watch::SystemWatch;
