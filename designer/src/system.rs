//! The view of the system: components as blocks, links as wires between their ports.
//!
//! `drawing.rs` turns the model into a diagram, `rules.rs` decides what may be linked, `edits.rs`
//! and
//! `fragment.rs` change the files; none of these needs a window. [`SystemView`] (`state.rs`,
//! `pane.rs`) shows the drawing.

mod choices;
mod docs;
mod drawing;
mod edits;
mod folding;
mod fragment;
mod grouping;
mod menu;
mod palette;
mod pane;
mod picker;
mod properties;
mod repair;
mod robot;
mod rules;
mod run;
mod state;

pub(crate) use docs::show as show_manifest;
pub use drawing::{SystemDrawing, draw, unassigned};
pub use edits::{add_component, arrange_all, free_name, join, place, remove, rename, rewire};
pub use folding::draw_folded;
pub use fragment::{copied, paste};
pub use palette::DraggedKind;
pub use robot::add_robot;
pub use rules::{Joint, Joints, types_fit};
pub use state::SystemView;
