//! Writes a recording.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use armor_wire::schema::{ParseError, parse};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions};
use thiserror::Error;

use crate::head::{HEADS, HeadCodec, MessageHead, RecordedHead};
use crate::ros::{LayoutError, RosBytes, RosMessage};
use crate::summary::widen;
use crate::{
    ABOUT, CDR, DATA_KEY, LATCHED_KEY, OUTPUTS, PROFILE, ROS_QOS, ROS2_PROFILE, ROS2MSG,
    SCHEMA_KEY, TYPE_KEY,
};

/// A chunk is compressed and indexed as one, and written when it is this long.
const CHUNK_LEN: u64 = 1 << 20;
const NANOSECONDS: f64 = 1e9;

/// Why something was not recorded.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] McapError),
    /// The schema of an output cannot be read.
    #[error("the type of {data} cannot be read: {reason}")]
    Schema {
        /// The output.
        data: String,
        /// Why.
        reason: ParseError,
    },
    /// The bytes of a message do not have the layout of its output.
    #[error("a message of {data} does not have the layout of its type: {reason}")]
    Layout {
        /// The output.
        data: String,
        /// What is wrong with them.
        reason: LayoutError,
    },
}

/// How the chunks of a file are compressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Not at all: the least work.
    #[default]
    None,
    /// LZ4: a little work.
    Lz4,
    /// Zstandard: the smallest files.
    Zstd,
}

impl From<Compression> for Option<mcap::Compression> {
    fn from(compression: Compression) -> Self {
        match compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        }
    }
}

/// Which programs a file is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RecordingForm {
    /// Armor, which gets back every message to the byte, and viewers.
    #[default]
    Armor,
    /// ROS 2: its profile, topics as `/component/output`, and what only Armor has as metadata alone.
    Ros2,
}

/// The type of an output's messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OutputType {
    /// Its name in Armor.
    pub name: String,
    /// Its layout in Armor.
    pub schema: String,
    /// A late subscriber gets the last value.
    pub latched: bool,
}

/// Writes a recording: outputs, and their messages in the order in which they came.
pub struct RecordingWriter<W: Write + Seek> {
    file: mcap::Writer<W>,
    /// With the channel of the heads, where there are heads.
    heads: Option<(HeadCodec, u16)>,
    outputs: Vec<WrittenOutput>,
    written: u64,
    /// The last message, for its memory.
    converted: RosBytes,
}

struct WrittenOutput {
    data: String,
    output_type: OutputType,
    message: RosMessage,
    channel: u16,
    lost: u64,
    span_s: Option<(f64, f64)>,
}

impl<W: Write + Seek> RecordingWriter<W> {
    /// Begins a file for Armor. `about` is what is known of the recording, such as the name of the
    /// system.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(
        sink: W,
        compression: Compression,
        about: BTreeMap<String, String>,
    ) -> Result<Self, WriteError> {
        Self::with_form(sink, compression, about, RecordingForm::Armor)
    }

    /// Begins a file in a form.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn with_form(
        sink: W,
        compression: Compression,
        about: BTreeMap<String, String>,
        form: RecordingForm,
    ) -> Result<Self, WriteError> {
        let options = WriteOptions::new()
            .profile(match form {
                RecordingForm::Armor => PROFILE,
                RecordingForm::Ros2 => ROS2_PROFILE,
            })
            .library(format!("armor {}", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_LEN))
            .compression(compression.into());
        let mut file = options.create(sink)?;
        let mut heads = None;
        file.write_metadata(&Metadata { name: ABOUT.into(), metadata: about })?;
        if form == RecordingForm::Armor {
            let codec = HeadCodec::new();
            let definition = codec.message.definition().as_bytes();
            let schema = file.add_schema(codec.message.name(), ROS2MSG, definition)?;
            heads = Some((codec, file.add_channel(schema, HEADS, CDR, &BTreeMap::new())?));
        }
        Ok(Self { file, heads, outputs: Vec::new(), written: 0, converted: RosBytes::default() })
    }

    /// Adds a file as it is, such as the system's.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add_file(
        &mut self,
        name: &str,
        media_type: &str,
        bytes: &[u8],
    ) -> Result<(), WriteError> {
        self.add_file_at(0.0, name, media_type, bytes)
    }

    /// Adds a file that appeared while the recording ran, at this system time.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add_file_at(
        &mut self,
        stamp_s: f64,
        name: &str,
        media_type: &str,
        bytes: &[u8],
    ) -> Result<(), WriteError> {
        self.file.attach(&Attachment {
            log_time: to_nanoseconds(stamp_s),
            create_time: 0,
            name: name.into(),
            media_type: media_type.into(),
            data: bytes.into(),
        })?;
        Ok(())
    }

    /// Adds an output, and returns its number. The same one again, if it has been added with this
    /// type.
    ///
    /// # Errors
    /// If its schema cannot be read, or the file cannot be written.
    pub fn add_output(
        &mut self,
        data: &str,
        output_type: &OutputType,
    ) -> Result<usize, WriteError> {
        let is_known =
            |known: &WrittenOutput| known.data == data && known.output_type == *output_type;
        if let Some(known) = self.outputs.iter().position(is_known) {
            return Ok(known);
        }
        let schema = parse(&output_type.schema)
            .map_err(|reason| WriteError::Schema { data: data.into(), reason })?;
        let message = RosMessage::new(&schema);
        let id = self.file.add_schema(message.name(), ROS2MSG, message.definition().as_bytes())?;
        let mut metadata = BTreeMap::from([
            (TYPE_KEY.into(), output_type.name.clone()),
            (SCHEMA_KEY.into(), output_type.schema.clone()),
            (LATCHED_KEY.into(), output_type.latched.to_string()),
        ]);
        let mut topic = data.to_owned();
        if self.heads.is_none() {
            topic = name_ros_topic(data);
            metadata.insert(ROS_QOS.into(), describe_qos(output_type.latched));
            metadata.insert(DATA_KEY.into(), data.into());
        }
        let channel = self.file.add_channel(id, &topic, CDR, &metadata)?;
        let output_type = output_type.clone();
        self.outputs.push(WrittenOutput {
            data: data.into(),
            output_type,
            message,
            channel,
            lost: 0,
            span_s: None,
        });
        Ok(self.outputs.len() - 1)
    }

    /// Writes a message of an output, as [`Self::add_output`] has numbered it.
    ///
    /// # Errors
    /// If its bytes do not have the layout of its type, and then nothing of it is written; or if the
    /// file cannot be written.
    pub fn write(
        &mut self,
        output: usize,
        head: &MessageHead,
        payload: &[u8],
    ) -> Result<(), WriteError> {
        let Some(output) = self.outputs.get_mut(output) else { return Ok(()) };
        let layout = |reason| WriteError::Layout { data: output.data.clone(), reason };
        output.message.encode_into(payload, &mut self.converted).map_err(layout)?;
        output.lost = output.lost.saturating_add(head.lost);
        let time = to_nanoseconds(head.stamp_s);
        let header = |channel_id| MessageHeader {
            channel_id,
            sequence: head.sequence as u32,
            log_time: time,
            publish_time: time,
        };
        if let Some((heads, channel)) = &self.heads {
            let recorded = RecordedHead {
                channel: output.channel,
                sequence: head.sequence,
                published: head.stamp_s,
                instance: head.instance,
                lost: head.lost,
                stamps: self.converted.stamps_s.clone(),
            };
            let head_bytes = heads.encode(&recorded).map_err(layout)?;
            self.file.write_to_known_channel(&header(*channel), &head_bytes)?;
        }
        self.file.write_to_known_channel(&header(output.channel), &self.converted.bytes)?;
        output.span_s = Some(widen(output.span_s, head.stamp_s));
        self.written += 1;
        Ok(())
    }

    /// How many messages have been written.
    pub fn count_written(&self) -> u64 {
        self.written
    }

    /// Passes on everything to the file: what was written so far can be read although the rest never
    /// comes.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        Ok(self.file.flush()?)
    }

    /// Completes the file with what each output has lost and when, and with its indexes.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<W, WriteError> {
        let mut outputs: BTreeMap<String, (u64, Option<(f64, f64)>)> = BTreeMap::new();
        for output in &self.outputs {
            let (lost, span_s) = outputs.entry(output.data.clone()).or_default();
            *lost = lost.saturating_add(output.lost);
            if let Some((from_s, to_s)) = output.span_s {
                *span_s = Some(widen(Some(widen(*span_s, from_s)), to_s));
            }
        }
        let metadata = outputs.into_iter().map(|(data, (lost, span_s))| {
            let times = span_s.map_or(String::new(), |(from_s, to_s)| format!(" {from_s} {to_s}"));
            (data, format!("{lost}{times}"))
        });
        let metadata = Metadata { name: OUTPUTS.into(), metadata: metadata.collect() };
        self.file.write_metadata(&metadata)?;
        self.file.finish()?;
        Ok(self.file.into_inner())
    }
}

/// The topic of an output in ROS: `/component/output`.
pub(crate) fn name_ros_topic(data: &str) -> String {
    format!("/{}", data.replace('.', "/").replace('-', "_"))
}

/// How ROS 2 publishes a topic: reliably, and with `latched` the last message for late subscribers.
fn describe_qos(latched: bool) -> String {
    let (depth, durability) = if latched { (1, 1) } else { (10, 2) };
    let unlimited = "    sec: 9223372036\n    nsec: 854775807\n";
    format!(
        "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline:\n\
         {unlimited}  lifespan:\n{unlimited}  liveliness: 1\n  liveliness_lease_duration:\n\
         {unlimited}  avoid_ros_namespace_conventions: false\n"
    )
}

/// Since the beginning of system time; a time before it is 0.
pub(crate) fn to_nanoseconds(seconds: f64) -> u64 {
    // Saturates, and NaN is 0.
    (seconds * NANOSECONDS).round() as u64
}
