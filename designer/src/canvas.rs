//! A drawing that is looked at, pointed at and dragged: nodes with ports, wires, groups and notes.
//!
//! [`Diagram`] is what is drawn, as plain data; [`Canvas`] is how it is looked at (where, how
//! large, what is selected, what is being dragged). Both are generic over the id of what is drawn
//! and know nothing of files, commands or views: gestures come out as [`CanvasEvent`]s, and the
//! caller's [`JoinRules`] decide what may be joined. Nothing here imports another module of the
//! designer but the theme.

mod actions;
mod align;
pub mod arrange;
mod bar_text;
mod bundle;
mod cells;
mod curve;
mod diagram;
mod edges;
mod event;
mod gesture;
mod hit;
mod hover;
mod keyboard;
mod labels;
mod names;
mod node;
mod open_bundle;
mod overview;
mod paint;
mod pointer;
mod route;
mod rules;
mod search;
mod selection;
mod snap;
mod state;
mod viewport;

pub use actions::ViewAction;
pub use align::{Alignment, align};
pub use curve::{curve, point_at};
pub use diagram::{Diagram, DiagramId};
pub use edges::{path, wire_ends};
pub use event::CanvasEvent;
pub use hit::{Hit, NearestPort};
pub(crate) use hover::paint_hint;
pub(crate) use keyboard::{ARROWS, keep_arrow_keys};
pub use labels::{LABELLED, paintable};
pub use node::{
    Badge, Decoration, DiagramNode, Direction, Mark, NodeLine, NodeLook, NodePort, NodeShape,
    Outline, PortAt, PortSide, Wire, WireEnd,
};
pub(crate) use pointer::wheel_steps;
pub use rules::JoinRules;
pub use selection::Selection;
pub use snap::{GRID, snapped};
pub use state::{Canvas, CanvasOutput};
pub use viewport::Viewport;
