//! What a time line marks in a recording: reports of components, losses, and the messages of a few
//! outputs. Of a complete file only the chunks that hold them are read, and only they are decoded.

use std::collections::{BTreeSet, VecDeque};
use std::fs::File;
use std::io::Seek;

use mcap::Summary;

use crate::message_stream::{ChunkPlace, MessageStream, ReadError, RecordedMessage, StreamEvent};
use crate::output_types::name_output;
use crate::reports::{REPORTS, RecordedReport};
use crate::summary::RecordingSummary;

/// A moment of a recording that a time line marks.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordedMark {
    /// A component has reported to the mission.
    Report(RecordedReport),
    /// Messages of an output are missing before this moment: the recorder has lost them.
    Loss {
        /// The output.
        data: String,
        /// How many.
        count: u64,
        /// When the next message was published, in system time.
        stamp_s: f64,
    },
    /// A message of an output that was wanted.
    Message(RecordedMessage),
    /// A report that cannot be read, with the reason.
    Unread(String),
}

/// Reads the marks of a recording, in the order of the file.
pub struct MarkReader {
    file: File,
    len: u64,
    /// The chunks that are still to be read; none of a file without an index, which is read as a whole.
    chunks: Option<VecDeque<ChunkPlace>>,
    chunk_count: usize,
    stream: MessageStream,
    wanted: BTreeSet<String>,
    found: VecDeque<RecordedMark>,
    damaged_chunks: u64,
}

impl MarkReader {
    pub(crate) fn new(
        file: File,
        len: u64,
        summary: &RecordingSummary,
        index: Option<&Summary>,
        mut stream: MessageStream,
        wanted: &[&str],
    ) -> Self {
        let wanted: BTreeSet<String> = wanted.iter().map(|it| (*it).to_owned()).collect();
        let mut decoded = wanted.clone();
        decoded.insert(REPORTS.into());
        let lossy = summary.outputs.iter().filter(|output| output.lost > 0);
        let sought: BTreeSet<&str> =
            decoded.iter().map(String::as_str).chain(lossy.map(|it| it.data.as_str())).collect();
        let chunks = index.map(|index| find_chunks(index, &sought));
        stream.decode_only(decoded);
        let chunk_count = chunks.as_ref().map_or(0, VecDeque::len);
        Self {
            file,
            len,
            chunks,
            chunk_count,
            stream,
            wanted,
            found: VecDeque::new(),
            damaged_chunks: 0,
        }
    }

    /// How much of what is to be read has been read, from 0 to 1.
    pub fn progress(&mut self) -> f32 {
        let (left, all) = match &self.chunks {
            Some(chunks) => (chunks.len() as f32, self.chunk_count as f32),
            None => {
                let reached = self.file.stream_position().unwrap_or(self.len);
                (self.len.saturating_sub(reached) as f32, self.len as f32)
            }
        };
        if all > 0.0 { 1.0 - left / all } else { 1.0 }
    }

    /// How many damaged chunks were left out so far.
    pub fn damaged_chunks(&self) -> u64 {
        self.damaged_chunks
    }

    /// Returns the next mark; `None` at the end, which in a file that was not finished is where it can
    /// be read no further.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next_mark(&mut self) -> Result<Option<RecordedMark>, ReadError> {
        loop {
            if let Some(mark) = self.found.pop_front() {
                return Ok(Some(mark));
            }
            let Some(chunks) = &mut self.chunks else {
                match self.stream.next_event(&mut self.file) {
                    Ok(Some(StreamEvent::Message(message))) => {
                        take_message(message, &self.wanted, &mut self.found);
                    }
                    Ok(Some(_)) => {}
                    Ok(None) | Err(ReadError::Format(_)) => return Ok(None),
                    Err(error) => return Err(error),
                }
                continue;
            };
            let Some(place) = chunks.pop_front() else { return Ok(None) };
            let (wanted, found) = (&self.wanted, &mut self.found);
            let take = |message| take_message(message, wanted, found);
            match self.stream.read_chunk(&self.file, place, take) {
                Ok(()) => {}
                Err(ReadError::Format(_)) => {
                    // Its checksum comes last: what was found in it before may be wrong, too.
                    self.found.clear();
                    self.damaged_chunks += 1;
                }
                Err(error) => return Err(error),
            }
        }
    }
}

fn take_message(
    message: RecordedMessage,
    wanted: &BTreeSet<String>,
    found: &mut VecDeque<RecordedMark>,
) {
    let stamp_s = message.head.stamp_s;
    if !stamp_s.is_finite() {
        return;
    }
    if message.head.lost > 0 {
        let (data, count) = (message.data.clone(), message.head.lost);
        found.push_back(RecordedMark::Loss { data, count, stamp_s });
    }
    if message.data == REPORTS {
        found.push_back(match message.decode_as() {
            Ok(report) => RecordedMark::Report(report),
            Err(reason) => RecordedMark::Unread(reason),
        });
    } else if wanted.contains(&message.data) {
        found.push_back(RecordedMark::Message(message));
    }
}

/// The chunks that hold messages of these outputs, in the order of the file.
fn find_chunks(index: &Summary, sought: &BTreeSet<&str>) -> VecDeque<ChunkPlace> {
    let channels =
        index.channels.iter().filter(|(_, channel)| sought.contains(&*name_output(channel)));
    let channels: BTreeSet<u16> = channels.map(|(id, _)| *id).collect();
    let chunks = index
        .chunk_indexes
        .iter()
        .filter(|chunk| channels.iter().any(|id| chunk.message_index_offsets.contains_key(id)));
    let mut places: Vec<_> = chunks.map(ChunkPlace::from).collect();
    places.sort_unstable();
    places.into()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::io::Cursor;

    use armor_sdk::control::ReportKind;
    use armor_sdk::messages::Number;
    use armor_wire::codec;
    use armor_wire::message::WireType;

    use super::*;
    use crate::head::MessageHead;
    use crate::reader::Recording;
    use crate::writer::{Compression, OutputType, RecordingWriter};

    fn output_type<T: WireType>(name: &str) -> OutputType {
        OutputType { name: name.into(), schema: T::schema().to_string(), latched: false }
    }

    /// 40 s: numbers of which the one at 20 s misses three before it, a report at 10 s, and a wanted
    /// output at 30 s. A chunk holds a second.
    fn record(losses: u64) -> Vec<u8> {
        let sink = Cursor::new(Vec::new());
        let mut writer = RecordingWriter::new(sink, Compression::Lz4, BTreeMap::new()).unwrap();
        let numbers = writer.add_output("a.number", &output_type::<Number>("Number")).unwrap();
        let wanted = writer.add_output("b.wanted", &output_type::<Number>("Number")).unwrap();
        let reports =
            writer.add_output(REPORTS, &output_type::<RecordedReport>("RecordedReport")).unwrap();
        for second in 0..40_u32 {
            let stamp_s = f64::from(second);
            let lost = if second == 20 { losses } else { 0 };
            let head = MessageHead { sequence: second.into(), stamp_s, instance: 1, lost };
            let plain = MessageHead { lost: 0, ..head };
            let number = codec::encode(&Number { data: stamp_s }).unwrap();
            writer.write(numbers, &head, &number).unwrap();
            if second == 10 {
                let report = RecordedReport::new(stamp_s, "arm", 3, &ReportKind::Done);
                writer.write(reports, &plain, &codec::encode(&report).unwrap()).unwrap();
            }
            if second == 30 {
                writer.write(wanted, &plain, &number).unwrap();
            }
            writer.flush().unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn open(bytes: &[u8]) -> (MarkReader, tempfile::TempDir) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        std::fs::write(&path, bytes).unwrap();
        (Recording::open(&path).unwrap().into_marks(&["b.wanted"]).unwrap(), folder)
    }

    fn read(bytes: &[u8]) -> Vec<(f64, String)> {
        let (mut reader, _folder) = open(bytes);
        let marks = std::iter::from_fn(|| reader.next_mark().unwrap()).map(|mark| match mark {
            RecordedMark::Report(it) => (it.stamp, format!("{} {}", it.component, it.report)),
            RecordedMark::Loss { data, count, stamp_s } => (stamp_s, format!("{data} -{count}")),
            RecordedMark::Message(it) => {
                let number: Number = codec::decode(&it.payload.unwrap()).unwrap();
                (it.head.stamp_s, format!("{} {}", it.data, number.data))
            }
            RecordedMark::Unread(reason) => (0.0, reason),
        });
        marks.collect()
    }

    #[test]
    fn reports_losses_and_wanted_messages_are_found() {
        let expected = [
            (10.0, "arm done".to_owned()),
            (20.0, "a.number -3".to_owned()),
            (30.0, "b.wanted 30".to_owned()),
        ];
        let whole = record(3);
        assert_eq!(read(&whole), expected);
        let part = &whole[..whole.len() * 9 / 10];
        assert_eq!(read(part)[..2], expected[..2], "of a file without an index");
    }

    #[test]
    fn only_chunks_with_marks_are_read() {
        let (reader, _folder) = open(&record(0));
        assert_eq!(reader.chunk_count, 2, "that of the report and that of the wanted output");
        let (reader, _folder) = open(&record(1));
        assert_eq!(reader.chunk_count, 40, "where messages were lost, its output is read");
    }

    #[test]
    fn a_damaged_chunk_is_left_out() {
        let mut bytes = record(0);
        let (mut reader, _folder) = open(&bytes);
        let ChunkPlace { start, len } = reader.chunks.as_ref().unwrap()[0];
        assert!(reader.progress() < 0.1);
        let damaged = usize::try_from(start + len * 2 / 3).unwrap();
        bytes[damaged] ^= 0xff;
        let (mut reader, _folder) = open(&bytes);
        let mark = reader.next_mark().unwrap();
        assert!(
            matches!(&mark, Some(RecordedMark::Message(it)) if it.data == "b.wanted"),
            "{mark:?}"
        );
        assert_eq!((reader.next_mark().unwrap(), reader.damaged_chunks()), (None, 1));
        assert!(reader.progress() > 0.9);
    }
}
