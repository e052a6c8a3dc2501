//! The system while it runs: started by the window or attached to, watched without disturbing it,
//! with orders to its mission.
//!
//! [`Session`] is what is watched, and belongs to the window; [`LiveView`] shows it: blocks and
//! links by what they do (`blocks.rs`), the net by where it stands (`net.rs`), and next to them the
//! log, plots, parameters and the mission. All that is asked of the running system is asked through
//! `armor_inspect`, which states how it keeps from disturbing it.

mod blocks;
mod comparison;
mod firings;
mod hosts;
mod hover;
mod inspect;
mod log;
pub(crate) mod mission;
mod moves;
mod net;
pub(crate) mod orders;
mod parameters;
mod play_folder;
mod playback;
mod plots;
mod presence;
mod preview;
mod rows;
pub(crate) mod session;
mod sheet;
mod split;
mod systems;
mod tone;
mod values;
mod version;
mod view;
mod watched;
mod words;

pub use playback::keys::TIME_LINE_KEYS;
pub use playback::marks::{FoundMarks, MarkKind, TimeMark};
pub use playback::{Playback, is_recording};
pub use session::{Session, Standing, running};
pub use systems::attach;
pub use tone::Tone;
pub use version::RunningVersions;
pub use view::LiveView;
pub(crate) use watched::TOOL;
pub use watched::Watched;
