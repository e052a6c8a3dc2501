//! The structure of the workspace in figures: names of functions and types, circles of modules,
//! comments, wording. `cargo run -p armor-house` prints them; `tests/house.rs` keeps the limits.
//!
//! Everything is read from the source text with `syn`; no compiler runs. A name that a macro
//! builds, or a method that is called on a value, is therefore not seen.

mod circles;
mod modules;
mod names;
mod sources;
mod wording;

pub use circles::{Circle, circles_of};
pub use modules::{CrateModules, read_modules};
pub use names::{NameFigures, SharedName, measure_names};
pub use sources::{CrateSources, find_crates, workspace_root};
pub use wording::{WordCount, count_words};
