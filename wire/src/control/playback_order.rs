//! Orders to the process that plays a recording.

use crate::Message;

/// What the player of a recording is to do.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum PlaybackOrder {
    /// Let time stand still.
    Pause,
    /// Let time pass again.
    Resume,
    /// Let this much time pass, and pause again.
    Step {
        /// In seconds; 0 for the time up to the next message.
        time_s: f64,
    },
    /// Change the speed.
    Speed {
        /// How many times as fast as recorded; 0 for as fast as the messages are taken.
        factor: f64,
    },
    /// Continue at another moment.
    Seek {
        /// In seconds from the beginning of the recording.
        at_s: f64,
    },
    /// Begin again at the end, or not.
    Loop {
        /// Whether it does.
        on: bool,
    },
}
