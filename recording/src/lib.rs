//! Recordings of a running system as MCAP files, which the viewers that people have open too:
//! writing them, reading them back to the byte, copying parts of them, and playing them.
//!
//! [`RecordingWriter`] and [`Recording`] are the two ends; [`ros`] converts messages; [`capture`]
//! records a system, and [`playback`] plays a recording into one. The format is in docs/recordings.md.

mod attachment_check;
pub mod capture;
mod copy;
mod head;
mod held_values;
mod marks;
mod message_stream;
mod output_types;
pub mod playback;
mod reader;
mod reports;
pub mod ros;
pub mod ros1_bag;
mod ros1_writer;
mod stamping;
mod summary;
mod taps;
#[cfg(test)]
mod tests;
pub mod trail;
mod writer;

pub use copy::{CopiedPart, CopyError, CopyReport, LeftOutMessages, copy_recordings};
pub use head::MessageHead;
pub use marks::{MarkReader, RecordedMark};
pub use message_stream::{ReadError, RecordedMessage, describe_other_fields};
pub use reader::Recording;
pub use reports::{REPORTS, RecordedReport};
pub use ros1_writer::{BagWriteError, Ros1Writer};
pub use summary::{BEGIN_KEY, RecordedFile, RecordedOutput, RecordingSummary};
pub use taps::{OutputSelection, OutputTaps, TappedMessage};
pub use writer::{Compression, OutputType, RecordingForm, RecordingWriter, WriteError};

/// The profile of a file that this crate has written.
pub const PROFILE: &str = "armor";
/// The profile of a recording of ROS 2.
const ROS2_PROFILE: &str = "ros2";
/// What ROS 2 writes about the publishers of a topic.
const ROS_QOS: &str = "offered_qos_profiles";
/// The metadata record that states what was recorded.
const ABOUT: &str = "armor";
/// The metadata record at the end of a complete file: for each output how many messages were lost,
/// and the stamps of its first and its last one.
const OUTPUTS: &str = "armor.outputs";
/// Members of a channel's metadata: the type of its messages in Armor.
const TYPE_KEY: &str = "armor.type";
const SCHEMA_KEY: &str = "armor.schema";
const LATCHED_KEY: &str = "armor.latched";
/// The name of the output, where the topic is one of ROS.
const DATA_KEY: &str = "armor.data";
/// The encodings of messages and of their definitions.
const CDR: &str = "cdr";
const ROS2MSG: &str = "ros2msg";
