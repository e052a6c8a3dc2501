//! The state of the executive's clock in a journal.

use serde::{Deserialize, Serialize};

/// The state of the clock in one life of the executive, from its start to its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Life {
    /// Names the machine's start; monotonic clocks of one start can be compared.
    pub boot: String,
    /// The machine's monotonic clock at mission time 0, in nanoseconds; below 0 if the mission is
    /// older than the machine's start.
    pub zero_ns: i64,
    /// The data that mission time follows; `None` if it follows this clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor: Option<Anchor>,
}

/// Ties mission time to the data that it follows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The process start that provides the data.
    pub instance: u64,
    /// The stamp of the data, in seconds.
    pub stamp_s: f64,
    /// The mission time at that stamp, in nanoseconds.
    pub at_ns: u64,
}
