//! Reads a recording: what is in it, and its messages from any moment on.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{Record, op};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{MAGIC, Summary};

use crate::attachment_check::is_safe_summary;
use crate::head::HEADS;
use crate::held_values::find_held;
use crate::marks::MarkReader;
use crate::message_stream::{
    MAX_RECORD_LEN, MessageStream, ReadError, RecordedMessage, StreamEvent, read_file_time,
    to_seconds,
};
use crate::output_types::{ChannelOutput, identify_channel};
use crate::summary::{RecordedFile, RecordedOutput, RecordingSummary, widen};
use crate::writer::to_nanoseconds;
use crate::{ABOUT, OUTPUTS};

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
        self.stream.leave_out(&self.left_out);
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
        self.stream.leave_out(&self.left_out);
        Ok(())
    }

    /// Returns the newest message of each of these outputs that was published before `stamp_s`, and
    /// continues as [`Self::seek`] to that moment. In a file without an index it continues at the
    /// beginning: what they held is among what comes first.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn seek_with_held(
        &mut self,
        stamp_s: f64,
        outputs: &BTreeSet<String>,
    ) -> Result<BTreeMap<String, RecordedMessage>, ReadError> {
        let held = match &self.index {
            _ if outputs.is_empty() || !stamp_s.is_finite() => BTreeMap::new(),
            Some(index) => find_held(&mut self.file, index, outputs, stamp_s)?,
            None => {
                self.seek(f64::NEG_INFINITY)?;
                return Ok(BTreeMap::new());
            }
        };
        self.seek(stamp_s)?;
        Ok(held)
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
            self.stream.leave_out(&self.left_out);
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
            output.set_type(message.output_type);
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
    if magic == MAGIC { Ok(()) } else { Err(ReadError::NotMcap) }
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
    // By their numbers, which are in the order in which they were added.
    let channels: BTreeMap<_, _> = index.channels.iter().collect();
    for (id, channel) in channels {
        if channel.topic == HEADS {
            continue;
        }
        let ChannelOutput { data, output_type, .. } = identify_channel(channel);
        let output = outputs.entry(data.clone()).or_default();
        output.data = data;
        output.messages += stats.channel_message_counts.get(id).copied().unwrap_or_default();
        output.ros_type =
            channel.schema.as_ref().map(|schema| schema.name.clone()).unwrap_or_default();
        output.set_type(output_type);
        (output.lost, output.span_s) =
            ends.get(&output.data).map(|text| read_end(text)).unwrap_or_default();
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
