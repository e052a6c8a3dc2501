//! Reads a recording: what is in it, and its messages from any moment on.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use armor_wire::schema::{Schema, parse};
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{MAGIC, McapError, Summary};
use thiserror::Error;

use crate::attachment_check::{is_safe_summary, is_whole_attachment};
use crate::head::{HEADS, HeadCodec, MessageHead, RecordedHead};
use crate::marks::MarkReader;
use crate::ros::{RosMessage, find_standard_type};
use crate::summary::{RecordedFile, RecordedOutput, RecordingSummary, widen};
use crate::writer::{OutputType, to_nanoseconds};
use crate::{ABOUT, CDR, LATCHED_KEY, OUTPUTS, ROS_QOS, SCHEMA_KEY, TYPE_KEY};

/// The component of a topic of ROS without one.
const ROS_COMPONENT: &str = "ros";

/// Longest record that is read: the longest message, and a chunk around it.
pub(crate) const MAX_RECORD_LEN: usize = 160 << 20;

/// Why a recording cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// It cannot be opened or read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is no MCAP file, or damaged.
    #[error("{0}")]
    Format(#[from] McapError),
}

/// An open recording, at a message.
pub struct Recording {
    file: File,
    summary: RecordingSummary,
    index: Option<Summary>,
    stream: MessageStream,
    /// The outputs whose messages are passed over.
    left_out: HashSet<String>,
    damaged_chunks: u64,
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedMessage {
    /// Its output.
    pub data: String,
    /// The type of its output at that time.
    pub output_type: OutputType,
    /// Sequence, stamp and publisher.
    pub head: MessageHead,
    /// Its bytes in Armor's form, or why they cannot be read.
    pub payload: Result<Vec<u8>, String>,
}

impl Recording {
    /// Opens a file, at its first message.
    ///
    /// # Errors
    /// If it cannot be read or is no MCAP file. One that ends too early is read as far as it goes.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::read(File::open(path)?)
    }

    /// Reads an open file, which may have no name.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn read(mut file: File) -> Result<Self, ReadError> {
        file.seek(SeekFrom::Start(0))?;
        check_magic(&mut file)?;
        let index = read_index(&mut file).ok().flatten();
        let mut recording = Self {
            summary: RecordingSummary::default(),
            stream: MessageStream::begin(&mut file)?,
            left_out: HashSet::new(),
            damaged_chunks: 0,
            index,
            file,
        };
        recording.summary = match &recording.index {
            Some(index) => summarize(index, &mut recording.file)?,
            None => recording.scan()?,
        };
        recording.seek(f64::NEG_INFINITY)?;
        Ok(recording)
    }

    /// Returns only messages of the outputs for which this is true, from now on. The others are not
    /// decoded.
    pub fn select(&mut self, is_selected: impl Fn(&str) -> bool) {
        let names = self.summary.outputs.iter().map(|output| &output.data);
        self.left_out = names.filter(|name| !is_selected(name)).cloned().collect();
        self.stream.left_out.clone_from(&self.left_out);
    }

    /// What is in it.
    pub fn summary(&self) -> &RecordingSummary {
        &self.summary
    }

    /// Continues at the first chunk that holds a message of this time or later. Messages before it
    /// may come first; `next_message` returns them too.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn seek(&mut self, stamp_s: f64) -> Result<(), ReadError> {
        let time = to_nanoseconds(stamp_s);
        let chunk = self.index.as_ref().and_then(|index| {
            let later = index.chunk_indexes.iter().filter(|chunk| chunk.message_end_time >= time);
            later.map(|chunk| chunk.chunk_start_offset).min()
        });
        self.stream = match (chunk, &self.index) {
            (Some(offset), Some(index)) if time > 0 => {
                MessageStream::at_chunk(&mut self.file, offset, index)?
            }
            _ => MessageStream::begin(&mut self.file)?,
        };
        self.stream.left_out.clone_from(&self.left_out);
        Ok(())
    }

    /// Returns the next message in the order in which they were recorded; `None` at the end, which
    /// in a file that was not finished is where it can be read no further. In a finished one a chunk
    /// that is damaged is left out, and counted.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next_message(&mut self) -> Result<Option<RecordedMessage>, ReadError> {
        loop {
            match self.stream.next_message(&mut self.file) {
                Err(ReadError::Format(_)) => {}
                other => return other,
            }
            let Some(index) = &self.index else { return Ok(None) };
            self.damaged_chunks += 1;
            let reached = self.file.stream_position()?;
            let starts = index.chunk_indexes.iter().map(|chunk| chunk.chunk_start_offset);
            let Some(next) = starts.filter(|start| *start >= reached).min() else {
                return Ok(None);
            };
            self.stream = MessageStream::at_chunk(&mut self.file, next, index)?;
            self.stream.left_out.clone_from(&self.left_out);
        }
    }

    /// How many damaged chunks were left out so far.
    pub fn damaged_chunks(&self) -> u64 {
        self.damaged_chunks
    }

    /// Reads it no further as a whole, but for its marks. `wanted` are outputs whose messages are
    /// marks, too.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn into_marks(mut self, wanted: &[&str]) -> Result<MarkReader, ReadError> {
        let stream = match &self.index {
            // The channels are known from the index; chunks are read one by one.
            Some(index) => MessageStream::at_chunk(&mut self.file, 0, index)?,
            None => MessageStream::begin(&mut self.file)?,
        };
        let len = self.file.metadata()?.len();
        Ok(MarkReader::new(self.file, len, &self.summary, self.index.as_ref(), stream, wanted))
    }

    /// Reads a file that was recorded, by its name.
    ///
    /// # Errors
    /// If the recording cannot be read.
    pub fn read_file(&mut self, name: &str) -> Result<Option<Vec<u8>>, ReadError> {
        let place = self.file.stream_position()?;
        let found = find_file(&mut self.file, name);
        self.file.seek(SeekFrom::Start(place))?;
        match found {
            Err(ReadError::Format(_)) if self.index.is_none() => Ok(None),
            other => other,
        }
    }

    /// Reads all of a file that has no index.
    fn scan(&mut self) -> Result<RecordingSummary, ReadError> {
        let mut summary = RecordingSummary::default();
        let mut outputs: BTreeMap<String, RecordedOutput> = BTreeMap::new();
        loop {
            let message = match self.stream.next_event(&mut self.file) {
                Ok(Some(StreamEvent::Message(message))) => message,
                Ok(Some(StreamEvent::About(about))) => {
                    summary.about = about;
                    continue;
                }
                Ok(Some(StreamEvent::File { name, media_type, stamp_s, bytes })) => {
                    let len = bytes.len() as u64;
                    summary.files.push(RecordedFile { name, media_type, len, stamp_s });
                    continue;
                }
                Ok(None) | Err(ReadError::Format(_)) => break,
                Err(error) => return Err(error),
            };
            let stamp_s = message.head.stamp_s;
            summary.span_s = Some(widen(summary.span_s, stamp_s));
            let output = outputs.entry(message.data.clone()).or_default();
            output.messages += 1;
            output.span_s = Some(widen(output.span_s, stamp_s));
            output.lost = output.lost.saturating_add(message.head.lost);
            output.data = message.data;
            output.ros_type = self.stream.ros_type(&output.data);
            output.type_name = message.output_type.name;
            output.schema = message.output_type.schema;
            output.latched = message.output_type.latched;
        }
        summary.outputs = outputs.into_values().collect();
        Ok(summary)
    }
}

fn find_file(file: &mut File, name: &str) -> Result<Option<Vec<u8>>, ReadError> {
    let mut stream = MessageStream::begin(file)?;
    while let Some(event) = stream.next_event(file)? {
        if let StreamEvent::File { name: found, bytes, .. } = event
            && found == name
        {
            return Ok(Some(bytes));
        }
    }
    Ok(None)
}

fn check_magic(file: &mut File) -> Result<(), ReadError> {
    let mut magic = Vec::new();
    file.take(MAGIC.len() as u64).read_to_end(&mut magic)?;
    if magic == MAGIC { Ok(()) } else { Err(McapError::BadMagic.into()) }
}

fn read_index(file: &mut File) -> Result<Option<Summary>, ReadError> {
    if !is_safe_summary(file)? {
        return Ok(None);
    }
    let options = SummaryReaderOptions::default().with_record_length_limit(MAX_RECORD_LEN);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(len) => {
                let read = file.read(reader.insert(len))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to)?),
        }
    }
    // A file that no message was written to has a summary without anything.
    Ok(reader.finish().filter(|summary| summary.stats.is_some()))
}

fn summarize(index: &Summary, file: &mut File) -> Result<RecordingSummary, ReadError> {
    let metadata = |file: &mut File, name: &str| -> Result<BTreeMap<String, String>, ReadError> {
        let found = index.metadata_indexes.iter().find(|entry| entry.name == name);
        let Some(entry) = found else { return Ok(BTreeMap::new()) };
        file.seek(SeekFrom::Start(entry.offset))?;
        let len = usize::try_from(entry.length).unwrap_or(usize::MAX).min(MAX_RECORD_LEN);
        let mut bytes = Vec::new();
        file.take(len as u64).read_to_end(&mut bytes)?;
        // Operation and length come before the record.
        match mcap::parse_record(op::METADATA, bytes.get(9..).unwrap_or_default())? {
            Record::Metadata(metadata) => Ok(metadata.metadata),
            _ => Ok(BTreeMap::new()),
        }
    };
    let about = metadata(file, ABOUT)?;
    let ends = metadata(file, OUTPUTS)?;
    let stats = index.stats.clone().unwrap_or_default();
    let mut outputs: BTreeMap<String, RecordedOutput> = BTreeMap::new();
    for (id, channel) in &index.channels {
        if channel.topic == HEADS {
            continue;
        }
        let ros_type = channel.schema.as_ref().map(|schema| schema.name.as_str());
        let (data, output_type) = identify_output(
            &channel.topic,
            ros_type.unwrap_or_default(),
            &channel.message_encoding,
            &channel.metadata,
        );
        let output = outputs.entry(data.clone()).or_default();
        output.data = data;
        output.messages += stats.channel_message_counts.get(id).copied().unwrap_or_default();
        output.ros_type =
            channel.schema.as_ref().map(|schema| schema.name.clone()).unwrap_or_default();
        output.type_name = output_type.name;
        output.schema = output_type.schema;
        output.latched = output_type.latched;
        (output.lost, output.span_s) =
            ends.get(&channel.topic).map(|text| read_end(text)).unwrap_or_default();
    }
    let has_messages = stats.message_count > 0;
    let span = (to_seconds(stats.message_start_time), to_seconds(stats.message_end_time));
    let files = index.attachment_indexes.iter().map(|file| RecordedFile {
        name: file.name.clone(),
        media_type: file.media_type.clone(),
        len: file.data_size,
        stamp_s: read_file_time(file.log_time),
    });
    Ok(RecordingSummary {
        about,
        is_complete: true,
        outputs: outputs.into_values().collect(),
        files: files.collect(),
        span_s: has_messages.then_some(span),
    })
}

/// Losses, and the first and the last stamp, as the writer leaves them.
fn read_end(text: &str) -> (u64, Option<(f64, f64)>) {
    let mut words = text.split(' ');
    let lost = words.next().and_then(|word| word.parse().ok()).unwrap_or_default();
    let mut number = || words.next()?.parse().ok();
    let from_s = number();
    (lost, from_s.zip(number()))
}

/// When a file appeared while the recording ran.
fn read_file_time(log_time: u64) -> Option<f64> {
    (log_time > 0).then(|| to_seconds(log_time))
}

fn to_seconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 / 1e9
}

/// The output of a channel and its type. Of a recording of ROS 2, the standard messages are those of
/// Armor.
fn identify_output(
    topic: &str,
    ros_type: &str,
    encoding: &str,
    metadata: &BTreeMap<String, String>,
) -> (String, OutputType) {
    let output_type = read_type(metadata);
    let standard = find_standard_type(ros_type).filter(|_| encoding == CDR);
    match standard {
        Some(schema) if output_type.schema.is_empty() => {
            let latched = metadata.get(ROS_QOS).is_some_and(|qos| is_transient_local(qos));
            (name_topic(topic), standard_output(schema, latched))
        }
        _ => (topic.into(), output_type),
    }
}

/// The type of an output with standard messages.
pub(crate) fn standard_output(schema: &Schema, latched: bool) -> OutputType {
    let name = match schema {
        Schema::Struct { name, .. } => name.as_str(),
        _ => "",
    };
    OutputType { name: name.into(), schema: schema.to_string(), latched }
}

/// Whether a publisher of ROS keeps its last message for late subscribers.
fn is_transient_local(qos: &str) -> bool {
    qos.split(['\n', ',']).any(|line| {
        let value = line.trim().trim_start_matches("- ").strip_prefix("durability:");
        matches!(value.map(str::trim), Some("1" | "transient_local"))
    })
}

/// Names the data of a topic: `/robot/base/scan` is `robot.base_scan`, and `/scan` is `ros.scan`.
pub(crate) fn name_topic(topic: &str) -> String {
    let mut parts = topic.split('/').filter(|part| !part.is_empty()).peekable();
    let first = parts.next().unwrap_or(ROS_COMPONENT);
    let rest: Vec<_> = parts.collect();
    match rest.as_slice() {
        [] => format!("{ROS_COMPONENT}.{first}"),
        rest => format!("{first}.{}", rest.join("_")),
    }
}

fn read_type(metadata: &BTreeMap<String, String>) -> OutputType {
    let text = |key: &str| metadata.get(key).cloned().unwrap_or_default();
    OutputType {
        name: text(TYPE_KEY),
        schema: text(SCHEMA_KEY),
        latched: text(LATCHED_KEY) == "true",
    }
}

/// What comes next in a file.
pub(crate) enum StreamEvent {
    Message(RecordedMessage),
    About(BTreeMap<String, String>),
    File { name: String, media_type: String, stamp_s: Option<f64>, bytes: Vec<u8> },
}

/// Reads a file from a place on.
pub(crate) struct MessageStream {
    reader: LinearReader,
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, StreamChannel>,
    heads: HeadCodec,
    head: Option<RecordedHead>,
    /// The outputs whose messages are decoded; all of them if there are none.
    decoded: Option<BTreeSet<String>>,
    left_out: HashSet<String>,
}

struct StreamChannel {
    /// The output, or [`HEADS`].
    data: String,
    ros_type: String,
    output_type: OutputType,
    /// How its messages are read, if Armor has written them.
    message: Option<RosMessage>,
}

impl MessageStream {
    fn begin(file: &mut File) -> Result<Self, ReadError> {
        file.seek(SeekFrom::Start(0))?;
        Ok(Self::with_options(LinearReaderOptions::default()))
    }

    fn at_chunk(file: &mut File, offset: u64, index: &Summary) -> Result<Self, ReadError> {
        file.seek(SeekFrom::Start(offset))?;
        let mut stream =
            Self::with_options(LinearReaderOptions::default().with_skip_start_magic(true));
        for (id, channel) in &index.channels {
            let ros_type = channel.schema.as_ref().map(|schema| schema.name.clone());
            stream.add_channel(
                *id,
                &channel.topic,
                ros_type.unwrap_or_default(),
                &channel.message_encoding,
                &channel.metadata,
            );
        }
        Ok(stream)
    }

    fn with_options(options: LinearReaderOptions) -> Self {
        let options =
            options.with_record_length_limit(MAX_RECORD_LEN).with_prevalidate_chunk_crcs(true);
        Self {
            reader: LinearReader::new_with_options(options),
            schemas: HashMap::new(),
            channels: HashMap::new(),
            heads: HeadCodec::new(),
            head: None,
            decoded: None,
            left_out: HashSet::new(),
        }
    }

    /// Decodes the messages of these outputs only. Others come without their bytes.
    pub(crate) fn decode_only(&mut self, outputs: BTreeSet<String>) {
        self.decoded = Some(outputs);
    }

    fn ros_type(&self, topic: &str) -> String {
        let found = self.channels.values().find(|channel| channel.data == topic);
        found.map(|channel| channel.ros_type.clone()).unwrap_or_default()
    }

    fn add_channel(
        &mut self,
        id: u16,
        topic: &str,
        ros_type: String,
        encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) {
        let (data, output_type) = identify_output(topic, &ros_type, encoding, metadata);
        let is_ours = encoding == CDR && !output_type.schema.is_empty();
        let schema = is_ours.then(|| parse(&output_type.schema).ok()).flatten();
        let message = schema.as_ref().map(RosMessage::new);
        let channel = StreamChannel { data, ros_type, output_type, message };
        self.channels.insert(id, channel);
    }

    fn next_message(&mut self, file: &mut File) -> Result<Option<RecordedMessage>, ReadError> {
        while let Some(event) = self.next_event(file)? {
            if let StreamEvent::Message(message) = event {
                return Ok(Some(message));
            }
        }
        Ok(None)
    }

    pub(crate) fn next_event(&mut self, file: &mut File) -> Result<Option<StreamEvent>, ReadError> {
        loop {
            let Some(event) = self.reader.next_event() else { return Ok(None) };
            let record = match event? {
                LinearReadEvent::ReadRequest(len) => {
                    let read = file.read(self.reader.insert(len))?;
                    self.reader.notify_read(read);
                    continue;
                }
                LinearReadEvent::Record { data, opcode } => {
                    // Those of later versions are passed over.
                    if !is_known(opcode) {
                        continue;
                    }
                    if opcode == op::ATTACHMENT && !is_whole_attachment(data) {
                        let (header, available) = (data.len() as u64, 0);
                        return Err(McapError::BadAttachmentLength { header, available }.into());
                    }
                    mcap::parse_record(opcode, data)?.into_owned()
                }
            };
            if let Some(event) = self.take_record(record) {
                return Ok(Some(event));
            }
        }
    }

    /// Takes the next record of the file; returns what it is, unless it only describes what follows.
    pub(crate) fn take_record(&mut self, record: Record<'_>) -> Option<StreamEvent> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
                None
            }
            Record::Channel(channel) => {
                let ros_type = self.schemas.get(&channel.schema_id).cloned();
                self.add_channel(
                    channel.id,
                    &channel.topic,
                    ros_type.unwrap_or_default(),
                    &channel.message_encoding,
                    &channel.metadata,
                );
                None
            }
            Record::Metadata(metadata) if metadata.name == ABOUT => {
                Some(StreamEvent::About(metadata.metadata))
            }
            Record::Attachment { header, data, .. } => Some(StreamEvent::File {
                name: header.name,
                media_type: header.media_type,
                stamp_s: read_file_time(header.log_time),
                bytes: data.into_owned(),
            }),
            Record::Message { header, data } => {
                self.read_message(header, &data).map(StreamEvent::Message)
            }
            _ => None,
        }
    }

    /// Returns a message; `None` for a head, and for a message of an unknown channel.
    fn read_message(
        &mut self,
        header: mcap::records::MessageHeader,
        bytes: &[u8],
    ) -> Option<RecordedMessage> {
        let channel = self.channels.get(&header.channel_id)?;
        if channel.data == HEADS {
            self.head = self.heads.decode(bytes).ok();
            return None;
        }
        if self.left_out.contains(&channel.data) {
            self.head = None;
            return None;
        }
        // One that another program has put in between has no head.
        let head = self.head.take().filter(|head| head.channel == header.channel_id);
        let stamps_s = head.as_ref().map_or(&[] as &[f64], |head| &head.stamps);
        let is_decoded = self.decoded.as_ref().is_none_or(|it| it.contains(&channel.data));
        let payload = match &channel.message {
            _ if !is_decoded => Err("it was not asked for".into()),
            Some(message) => message.decode(bytes, stamps_s).map_err(|error| error.to_string()),
            None => Err("another program has written it, and it has no type of Armor".into()),
        };
        let head = head.map_or_else(
            || MessageHead {
                sequence: header.sequence.into(),
                stamp_s: to_seconds(header.log_time),
                ..MessageHead::default()
            },
            |head| MessageHead {
                sequence: head.sequence,
                stamp_s: head.published,
                instance: head.instance,
                lost: head.lost,
            },
        );
        let output_type = channel.output_type.clone();
        Some(RecordedMessage { data: channel.data.clone(), output_type, head, payload })
    }
}

fn is_known(opcode: u8) -> bool {
    (op::HEADER..=op::DATA_END).contains(&opcode)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_ros_have_names_of_data_and_a_durability() {
        let names = ["/scan", "/robot/scan", "/robot/base/scan", "tf", "/"].map(name_topic);
        assert_eq!(names, ["ros.scan", "robot.scan", "robot.base_scan", "ros.tf", "ros.ros"]);
        assert!(is_transient_local("- history: 1\n  durability: 1\n  depth: 1\n"));
        assert!(is_transient_local("- durability: transient_local"));
        assert!(!is_transient_local("- durability: 2\n") && !is_transient_local(""));
    }
}
