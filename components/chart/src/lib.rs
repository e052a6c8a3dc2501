//! Publishes what is drawn on a map: its zones, and the grid of a file. its zones
//! are read by `armor-convert`; `ports` handles messages.

mod ports;

pub use ports::Chart;
