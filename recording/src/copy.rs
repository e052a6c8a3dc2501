//! Copies recordings: whole, a part of their time, some of their outputs, several into one.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{Seek, Write};
use std::path::Path;

use crate::capture::is_repeated;
use crate::head::MessageHead;
use crate::held_values::keep_newest;
use crate::message_stream::{ReadError, RecordedMessage};
use crate::reader::Recording;
use crate::summary::BEGIN_KEY;
use crate::taps::OutputSelection;
use crate::writer::{Compression, RecordingForm, RecordingWriter, WriteError};

/// Which messages are copied.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CopiedPart {
    /// Those published at this system time or later, and the values that latched outputs have then.
    pub from_s: Option<f64>,
    /// Those published before this system time.
    pub to_s: Option<f64>,
    /// Of these outputs.
    pub outputs: OutputSelection,
}

/// What was copied.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CopyReport {
    /// Messages that were copied.
    pub copied: u64,
    /// Messages of the part that cannot be read, and are missing in the copy.
    pub left_out: LeftOutMessages,
    /// Damaged chunks of the files, of which nothing can be read.
    pub damaged_chunks: u64,
}

/// Messages that cannot be read, by the output.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeftOutMessages {
    /// How many, and the reason that the first one had.
    pub outputs: BTreeMap<String, (u64, String)>,
}

impl LeftOutMessages {
    /// Counts a message of an output.
    pub fn add(&mut self, data: &str, reason: &str) {
        if let Some((count, _)) = self.outputs.get_mut(data) {
            *count += 1;
        } else {
            self.outputs.insert(data.into(), (1, reason.into()));
        }
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.outputs.values().map(|(count, _)| count).sum()
    }
}

/// Why a copy failed.
#[derive(Debug, thiserror::Error)]
pub enum CopyError {
    /// A file cannot be read.
    #[error("{path}: {reason}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        reason: ReadError,
    },
    /// The copy cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl CopiedPart {
    /// Whether a moment of system time is in it.
    pub fn holds_time(&self, stamp_s: f64) -> bool {
        self.from_s.is_none_or(|from_s| stamp_s >= from_s)
            && self.to_s.is_none_or(|to_s| stamp_s < to_s)
    }

    fn holds(&self, message: &RecordedMessage) -> bool {
        self.to_s.is_none_or(|to_s| message.head.stamp_s < to_s)
            && self.outputs.holds(&message.data)
    }

    fn begins_after(&self, message: &RecordedMessage) -> bool {
        self.from_s.is_some_and(|from_s| message.head.stamp_s < from_s)
    }
}

/// Copies the part of each file into `sink`, in the order of their stamps across the files. What is
/// known of the recording, and the files in it, are those of the first one.
///
/// # Errors
/// If a file cannot be read, or the copy cannot be written.
pub fn copy_recordings<W: Write + Seek>(
    paths: &[&Path],
    part: &CopiedPart,
    sink: W,
    compression: Compression,
    form: RecordingForm,
) -> Result<(CopyReport, W), CopyError> {
    let mut sources = Vec::new();
    for path in paths {
        sources.push(Source::open(path, part)?);
    }
    let first = sources.first().map(|source| source.recording.summary());
    let mut about = first.map(|summary| summary.about.clone()).unwrap_or_default();
    let begins = sources.iter().filter_map(|source| source.recording.summary().begin_s());
    let is_known = about.contains_key(BEGIN_KEY);
    if let Some(begin_s) = begins.min_by(f64::total_cmp).filter(|_| is_known) {
        about.insert(BEGIN_KEY.into(), begin_s.to_string());
    }
    if let Some(from_s) = part.from_s {
        about.insert(BEGIN_KEY.into(), from_s.to_string());
    }
    let mut writer = RecordingWriter::with_form(sink, compression, about, form)?;
    if let Some(first) = sources.first_mut() {
        for file in first.recording.summary().files.clone() {
            let bytes = first.read(|recording| recording.read_file(&file.name))?;
            let stamp_s = file.stamp_s.unwrap_or_default();
            let bytes = bytes.unwrap_or_default();
            writer.add_file_at(stamp_s, &file.name, &file.media_type, &bytes)?;
        }
    }
    for source in &mut sources {
        source.advance(part)?;
    }
    let mut report = CopyReport::default();
    let mut written = WrittenValues::default();
    while let Some(source) = earliest(&mut sources) {
        let Some(message) = source.take_next(part)? else { break };
        if written.repeats(&message) {
            continue;
        }
        let payload = match &message.payload {
            Ok(payload) => payload,
            Err(reason) => {
                report.left_out.add(&message.data, reason);
                continue;
            }
        };
        let output = writer.add_output(&message.data, &message.output_type)?;
        writer.write(output, &message.head, payload)?;
        report.copied += 1;
    }
    report.damaged_chunks = sources.iter().map(|source| source.recording.damaged_chunks()).sum();
    Ok((report, writer.finish()?))
}

/// What is written already of the outputs whose values each file of a recording repeats.
#[derive(Default)]
struct WrittenValues(BTreeMap<(String, u64), u64>);

impl WrittenValues {
    /// Whether the message, or a later one of its publisher, was written: another file has it, too.
    fn repeats(&mut self, message: &RecordedMessage) -> bool {
        if !is_repeated(&message.data, &message.output_type) {
            return false;
        }
        let MessageHead { sequence, instance, .. } = message.head;
        match self.0.entry((message.data.clone(), instance)) {
            Entry::Vacant(entry) => {
                entry.insert(sequence);
                false
            }
            Entry::Occupied(mut entry) if *entry.get() < sequence => {
                entry.insert(sequence);
                false
            }
            Entry::Occupied(_) => true,
        }
    }
}

struct Source {
    path: String,
    recording: Recording,
    next: Option<RecordedMessage>,
    /// Of each latched output, its last value before the part: it is still true at its beginning.
    latched: BTreeMap<String, RecordedMessage>,
}

impl Source {
    fn open(path: &Path, part: &CopiedPart) -> Result<Self, CopyError> {
        let name = path.display().to_string();
        let read = |reason| CopyError::Read { path: name.clone(), reason };
        let mut recording = Recording::open(path).map_err(read)?;
        let outputs = recording.summary().outputs.iter();
        let latched = outputs.filter(|it| it.latched && part.outputs.holds(&it.data));
        let latched = latched.map(|output| output.data.clone()).collect();
        // What is before the part is read only for the values that are still true then.
        let held = part.from_s.map(|from_s| recording.seek_with_held(from_s, &latched));
        let latched = held.transpose().map_err(read)?.unwrap_or_default();
        Ok(Self { path: name, recording, next: None, latched })
    }

    /// Takes the next message, and moves on to the one after it.
    fn take_next(&mut self, part: &CopiedPart) -> Result<Option<RecordedMessage>, CopyError> {
        // The values from before the part come first.
        if let Some((_, message)) = self.latched.pop_first() {
            return Ok(Some(message));
        }
        let message = self.next.take();
        self.advance(part)?;
        Ok(message)
    }

    fn read<T>(
        &mut self,
        read: impl FnOnce(&mut Recording) -> Result<T, ReadError>,
    ) -> Result<T, CopyError> {
        read(&mut self.recording)
            .map_err(|reason| CopyError::Read { path: self.path.clone(), reason })
    }

    /// Moves on to the next message of the part.
    fn advance(&mut self, part: &CopiedPart) -> Result<(), CopyError> {
        while let Some(message) = self.read(Recording::next_message)? {
            if !part.holds(&message) {
                continue;
            }
            if !part.begins_after(&message) {
                self.next = Some(message);
                break;
            }
            if message.output_type.latched {
                keep_newest(&mut self.latched, message);
            }
        }
        Ok(())
    }
}

/// The source whose next message was published first; the first one of several.
fn earliest(sources: &mut [Source]) -> Option<&mut Source> {
    let next = |source: &Source| source.latched.first_key_value().map(|it| it.1.head.stamp_s);
    let stamp_s =
        |source: &Source| next(source).or(source.next.as_ref().map(|next| next.head.stamp_s));
    let waiting = sources.iter_mut().filter(|source| stamp_s(source).is_some());
    waiting.min_by(|a, b| stamp_s(a).unwrap_or(0.0).total_cmp(&stamp_s(b).unwrap_or(0.0)))
}
