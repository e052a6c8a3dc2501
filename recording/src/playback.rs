//! Plays a recording into a system: what is due when, and the process that publishes it.
//!
//! `pace` is the time, `queue` the messages in its order, `schedule` decides from both what comes next:
//! these do no IO but reading the file. `followers` finds out whether the system has taken what was
//! published, `player` publishes. `remote` shows and controls a player from another process.

mod followers;
mod pace;
mod player;
mod queue;
mod remote;
mod schedule;
mod state;
#[cfg(test)]
mod tests;

pub use pace::PlaybackSpeed;
pub use player::{
    AwaitedLink, PLAYBACK, PlayedComponent, PlayerOptions, PlayerReport, play_recording,
};
pub use queue::DataRename;
pub use remote::{PlayerLook, PlayerRemote};
pub use state::PlaybackState;
