//! The status of a running system for the person at the terminal: one line that is redrawn in
//! place, or plain lines where stderr is not a terminal.
//!
//! `line` formats the status (pure), `display` decides what is written when, and
//! `observer` collects it on a thread of its own, through links that keep the newest value only.

mod display;
mod line;
mod observer;
mod rates;

pub use display::StatusLine;
pub use observer::{StatusObserver, StatusSources};
