//! The recorder as a component: a mission activates it where something is worth keeping. What it
//! writes, and how, is in `armor-recording`; `ports` alone handles parameters and events.

mod activation;
mod ports;

pub use ports::SystemRecorder;
