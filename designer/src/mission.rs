//! The mission as a net: drawn, edited, proven and played.
//!
//! The pure parts know no window: `stage.rs` makes a net of a mission that can be played, `play.rs`
//! plays it, `schedule.rs` computes when the firings of a proof happen; `rules.rs` is what may be
//! joined, `edits.rs` what changes the file, `words.rs` what the drawing states. [`MissionView`]
//! shows it: `derived.rs` knows what a route stands for, `drawing.rs` is the net as a diagram, `panel.rs` what is selected, `changes.rs` all
//! that the panels change, `view.rs` gestures, commands and simulation.

pub(crate) mod changes;
mod derived;
mod drawing;
mod edits;
pub(crate) mod form;
pub(crate) mod marks;
pub(crate) mod panel;
mod play;
mod rules;
mod schedule;
mod stage;
mod view;
mod words;

pub use changes::Change;
pub use drawing::{NetRules, Scene};
pub use edits::{Decides, Timing};
pub use marks::Marks;
pub use play::chance::{Chance, Step};
pub use play::follow::{Course, Leg};
pub use play::refusal::NotNow;
pub use play::world::{Sense, World};
pub use play::{Happened, Outcome, Play, Standing};
pub use stage::{Stage, StageError};
pub use view::{MissionView, net};

/// What a file states, in tests.
#[cfg(test)]
fn read_text(file: &str) -> armor_robotfile::Configuration {
    let reading = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
    reading.configuration.expect("the file can be read")
}
