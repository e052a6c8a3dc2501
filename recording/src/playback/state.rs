//! What the player publishes about itself.

use armor_sdk::prelude::Message;

/// How far the playback has come.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct PlaybackState {
    /// System time, which is that of the recording.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The first moment that is played, in system time.
    #[message(unit = "s")]
    pub from: f64,
    /// The last one.
    #[message(unit = "s")]
    pub to: f64,
    /// How much has been played since `from`.
    #[message(unit = "s")]
    pub at: f64,
    /// How many times as fast as recorded; 0 for as fast as the messages are taken.
    pub speed: f64,
    /// Whether time stands still by an order.
    pub paused: bool,
    /// Whether everything has been played.
    pub over: bool,
    /// Whether it begins again at the end.
    pub loops: bool,
    /// What time waits for, in words; empty if it does not wait.
    pub waits_for: String,
    /// The path of the recording on the player's host.
    pub recording: String,
    /// The components that are played; others run.
    pub components: Vec<String>,
}

/// Times that differ by less are the same.
const SAME_S: f64 = 1e-3;

impl PlaybackState {
    /// Whether the last message has been played, or jumped to.
    pub fn is_at_end(&self) -> bool {
        self.over || (self.paused && self.at >= self.to - self.from - SAME_S)
    }
}
