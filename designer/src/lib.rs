//! The designer: a robot drawn as blocks, its mission as a net, and both watched while they run.
//!
//! [`Designer`] is the window; it holds a [`Project`], the open files with their history, and one
//! [`Pane`] for each view. A pane turns the files into a [`canvas::Diagram`], lets
//! [`canvas::Canvas`] show it, and answers gestures and [`Command`]s with edits of the project.
//! Start with `app.rs`.

mod app;
pub mod arguments;
pub mod canvas;
pub mod check;
mod commands;
mod diagram_pane;
pub mod disk;
pub mod export;
mod fragment;
mod help;
mod item;
pub mod kinds;
pub mod layout;
pub mod live;
pub mod map_view;
mod messages;
pub mod mission;
mod name;
mod pane;
mod panels;
pub mod project;
mod remedy;
mod settings;
pub mod system;
mod text;
mod view;
mod window_words;
mod workspace;

pub use app::snapshot::{PictureError, take_picture};
pub use app::{Designer, Start};
pub use commands::{About, Command, Menu, about};
pub use item::Item;
pub use kinds::Kinds;
pub use messages::Messages;
pub use name::ItemName;
pub use pane::Pane;
pub use project::Project;
pub use settings::Settings;
pub use view::View;
pub use window_words::in_window_words;
pub use workspace::Workspace;
