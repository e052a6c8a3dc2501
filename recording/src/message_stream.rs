//! The messages of a recording one after the other, from a place of the file on.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use armor_wire::codec;
use armor_wire::message::Message;
use armor_wire::schema;
use mcap::read::ChunkReader;
use mcap::records::{ChunkIndex, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, Summary};
use thiserror::Error;

use crate::ABOUT;
use crate::attachment_check::{has_whole_texts, is_whole_attachment};
use crate::head::{HEADS, HeadCodec, MessageHead, RecordedHead};
use crate::output_types::{
    ChannelOutput, DescribedChannel, TypeDefinition, identify_channel, identify_output,
};
use crate::writer::OutputType;

/// Longest record that is read: the longest message, and a chunk around it.
pub(crate) const MAX_RECORD_LEN: usize = 160 << 20;

/// Operation and length of a record, which come before it.
const RECORD_HEAD_LEN: usize = 9;

/// Where a chunk is in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChunkPlace {
    pub start: u64,
    pub len: u64,
}

impl From<&ChunkIndex> for ChunkPlace {
    fn from(index: &ChunkIndex) -> Self {
        Self { start: index.chunk_start_offset, len: index.chunk_length }
    }
}

/// Why a recording cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// It cannot be opened or read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is no MCAP file.
    #[error("it does not begin as an MCAP file does")]
    NotMcap,
    /// It is damaged.
    #[error("{0}")]
    Format(#[from] McapError),
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

impl RecordedMessage {
    /// Decodes it as a type of this program.
    ///
    /// # Errors
    /// In words: if it cannot be read, or was recorded with other fields than `T` has here, which
    /// are named.
    pub fn decode_as<T: Message>(&self) -> Result<T, String> {
        let (recorded, here) = (&self.output_type.schema, T::schema().to_string());
        if *recorded != here {
            return Err(describe_other_fields(&self.data, T::NAME, recorded, &here));
        }
        let payload = self.payload.as_ref().map_err(Clone::clone)?;
        codec::decode(payload).map_err(|error| error.to_string())
    }
}

/// States that an output was recorded with other fields than its type has in this program.
pub fn describe_other_fields(data: &str, type_name: &str, recorded: &str, here: &str) -> String {
    let difference = schema::difference(("the recording", recorded), ("this version", here));
    format!(
        "{data} was recorded with other fields than {type_name} has here: {}",
        difference.replace('\n', "; ")
    )
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
    schemas: HashMap<u16, TypeDefinition>,
    channels: HashMap<u16, StreamChannel>,
    heads: HeadCodec,
    head: Option<RecordedHead>,
    /// The outputs whose messages are decoded; all of them if there are none.
    decoded: Option<BTreeSet<String>>,
    left_out: HashSet<String>,
}

struct StreamChannel {
    /// That of [`HEADS`], too.
    output: ChannelOutput,
    ros_type: String,
}

impl MessageStream {
    pub(crate) fn begin(file: &mut File) -> Result<Self, ReadError> {
        file.seek(SeekFrom::Start(0))?;
        Ok(Self::with_options(LinearReaderOptions::default()))
    }

    pub(crate) fn at_chunk(
        file: &mut File,
        offset: u64,
        index: &Summary,
    ) -> Result<Self, ReadError> {
        file.seek(SeekFrom::Start(offset))?;
        let mut stream =
            Self::with_options(LinearReaderOptions::default().with_skip_start_magic(true));
        for (id, channel) in &index.channels {
            let ros_type = channel.schema.as_ref().map(|schema| schema.name.clone());
            let (output, ros_type) = (identify_channel(channel), ros_type.unwrap_or_default());
            stream.channels.insert(*id, StreamChannel { output, ros_type });
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

    /// Passes over the messages of these outputs.
    pub(crate) fn leave_out(&mut self, outputs: &HashSet<String>) {
        self.left_out.clone_from(outputs);
    }

    pub(crate) fn ros_type(&self, topic: &str) -> String {
        let found = self.channels.values().find(|channel| channel.output.data == topic);
        found.map(|channel| channel.ros_type.clone()).unwrap_or_default()
    }

    pub(crate) fn next_message(
        &mut self,
        file: &mut File,
    ) -> Result<Option<RecordedMessage>, ReadError> {
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
                    // A length that is wrong must not take memory for what is not there.
                    let left = file.metadata()?.len().saturating_sub(file.stream_position()?);
                    let len = len.min(usize::try_from(left).unwrap_or(usize::MAX));
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
                    if !has_whole_texts(opcode, data) {
                        return Err(McapError::UnexpectedEof.into());
                    }
                    mcap::parse_record(opcode, data)?.into_owned()
                }
            };
            if let Some(event) = self.take_record(record) {
                return Ok(Some(event));
            }
        }
    }

    /// Reads the chunk at a place of the file, and passes on its messages.
    ///
    /// # Errors
    /// If it cannot be read; its checksum comes last, so what was passed on may be wrong then.
    pub(crate) fn read_chunk(
        &mut self,
        mut file: &File,
        place: ChunkPlace,
        mut take: impl FnMut(RecordedMessage),
    ) -> Result<(), ReadError> {
        let len = usize::try_from(place.len).unwrap_or(usize::MAX).min(MAX_RECORD_LEN);
        file.seek(SeekFrom::Start(place.start))?;
        let mut bytes = Vec::new();
        file.take(len as u64).read_to_end(&mut bytes)?;
        let body = bytes.get(RECORD_HEAD_LEN..).ok_or(McapError::UnexpectedEof)?;
        let Record::Chunk { header, data } = mcap::parse_record(op::CHUNK, body)? else {
            return Ok(());
        };
        for record in ChunkReader::new(header, &data)? {
            if let Some(StreamEvent::Message(message)) = self.take_record(record?) {
                take(message);
            }
        }
        Ok(())
    }

    /// Takes the next record of the file; returns what it is, unless it only describes what follows.
    fn take_record(&mut self, record: Record<'_>) -> Option<StreamEvent> {
        match record {
            Record::Schema { header, data } => {
                let (name, encoding, text) = (header.name, header.encoding, data.into_owned());
                self.schemas.insert(header.id, TypeDefinition { name, encoding, text });
                None
            }
            Record::Channel(channel) => {
                let definition = self.schemas.get(&channel.schema_id);
                let ros_type = definition.map(|it| it.name.clone()).unwrap_or_default();
                let output = identify_output(DescribedChannel {
                    topic: &channel.topic,
                    encoding: &channel.message_encoding,
                    metadata: &channel.metadata,
                    definition,
                });
                self.channels.insert(channel.id, StreamChannel { output, ros_type });
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
        let channel = &self.channels.get(&header.channel_id)?.output;
        if channel.data == HEADS {
            let decoded = channel.message.as_ref().ok().map(|_| self.heads.decode(bytes));
            self.head = decoded.and_then(Result::ok);
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
            Ok(message) => message.decode(bytes, stamps_s).map_err(|error| error.to_string()),
            Err(reason) => Err(reason.clone()),
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

/// When a file appeared while the recording ran.
pub(crate) fn read_file_time(log_time: u64) -> Option<f64> {
    (log_time > 0).then(|| to_seconds(log_time))
}

pub(crate) fn to_seconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 / 1e9
}
