//! The mission on the map: drawn, looked at and edited.
//!
//! The pure parts know no window: `camera.rs` is which part is shown, `scene.rs` makes items with
//! positions of the model, `position_text.rs` writes positions as the file has them, `edits.rs`
//! changes the file. [`MapView`] shows it: `painting.rs` with `hatching.rs`, `symbol_picture.rs`,
//! `triangles.rs` and `mesh_batch.rs` paints, `hit.rs` finds what is at a point, `pointer.rs` turns gestures into
//! `actions.rs`, `panel.rs` is what is selected, `palette.rs` tools and `layers.rs`, `leg_labels.rs`
//! finds room for the texts of legs, `shaping.rs` changes what is selected by numbers and draws
//! patterns, `fragment.rs` copies and pastes, `others.rs` shows drawings of other files, `stops.rs` adds stays and meetings, `movers.rs` finds what drives a route, `malformed.rs` draws zones that cross themselves, `pictures.rs` the
//! picture under it all. `times.rs` shows when the robots are where before the mission runs,
//! `rehearsal.rs` a rehearsal of it, `live.rs` where they are while it runs; `view.rs` is the pane.

mod actions;
mod camera;
mod commands;
mod corner;
pub(crate) mod edits;
mod fragment;
mod hatching;
mod hit;
mod layers;
mod leg_labels;
mod live;
mod malformed;
mod mesh_batch;
mod model;
mod movers;
mod names;
mod other_drawings;
mod other_robots;
mod others;
mod painting;
mod palette;
mod panel;
mod pictures;
mod pointer;
mod position_text;
mod rehearsal;
mod scene;
mod scene_exits;
mod shaping;
mod shaping_form;
mod state;
mod stops;
mod symbol_picture;
mod times;
mod tools;
mod triangles;
mod view;

pub use state::MapView;
