//! What latched outputs held at a moment of a recording, without reading all that comes before it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;

use mcap::Summary;

use crate::message_stream::{ChunkPlace, MessageStream, ReadError, RecordedMessage};
use crate::output_types::name_output;
use crate::writer::to_nanoseconds;

/// Returns the newest message of each of these outputs that was published before `stamp_s`. Chunks
/// are read from this moment backwards, only those that hold one of the outputs, and none that is
/// older than what was found. A damaged chunk is passed over.
///
/// # Errors
/// If the file cannot be read.
pub(crate) fn find_held(
    file: &mut File,
    index: &Summary,
    outputs: &BTreeSet<String>,
    stamp_s: f64,
) -> Result<BTreeMap<String, RecordedMessage>, ReadError> {
    let time = to_nanoseconds(stamp_s);
    let named = index.channels.iter().map(|(id, channel)| (*id, name_output(channel)));
    let (channels, others): (BTreeMap<u16, String>, BTreeMap<u16, String>) =
        named.partition(|(_, data)| outputs.contains(data));
    let mut chunks: Vec<_> = index
        .chunk_indexes
        .iter()
        .filter(|chunk| chunk.message_start_time <= time)
        .filter(|chunk| channels.keys().any(|id| chunk.message_index_offsets.contains_key(id)))
        .collect();
    chunks.sort_unstable_by_key(|chunk| {
        std::cmp::Reverse((chunk.message_end_time, chunk.chunk_start_offset))
    });
    let mut stream = MessageStream::at_chunk(file, 0, index)?;
    stream.leave_out(&others.into_values().collect());
    let mut held: BTreeMap<String, RecordedMessage> = BTreeMap::new();
    for chunk in chunks {
        let may_be_newer = |data: &str| {
            let found = held.get(data).map(|message| to_nanoseconds(message.head.stamp_s));
            found.is_none_or(|found| found <= chunk.message_end_time)
        };
        let in_it = chunk.message_index_offsets.keys().filter_map(|id| channels.get(id));
        if !in_it.into_iter().any(|data| may_be_newer(data)) {
            continue;
        }
        let mut found: BTreeMap<String, RecordedMessage> = BTreeMap::new();
        let take = |message: RecordedMessage| {
            if message.head.stamp_s < stamp_s {
                keep_newest(&mut found, message);
            }
        };
        match stream.read_chunk(file, ChunkPlace::from(chunk), take) {
            Ok(()) => {}
            Err(ReadError::Format(_)) => continue,
            Err(error) => return Err(error),
        }
        // Of the same stamp, the one that comes later in the file is newer.
        for message in found.into_values() {
            let present = held.get(&message.data);
            if present.is_none_or(|it| it.head.stamp_s < message.head.stamp_s) {
                held.insert(message.data.clone(), message);
            }
        }
    }
    Ok(held)
}

/// Takes a message of an output if none that was published later is there.
pub(crate) fn keep_newest(held: &mut BTreeMap<String, RecordedMessage>, message: RecordedMessage) {
    let present = held.get(&message.data);
    if present.is_none_or(|it| it.head.stamp_s <= message.head.stamp_s) {
        held.insert(message.data.clone(), message);
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use armor_sdk::messages::Number;
    use armor_wire::codec;
    use armor_wire::message::WireType;

    use super::*;
    use crate::head::MessageHead;
    use crate::reader::Recording;
    use crate::writer::{Compression, OutputType, RecordingWriter};

    const OUTPUTS: [&str; 4] = ["a.map", "b.map", "c.map", "d.pose"];

    /// Messages of three latched outputs and another one, some of them late, in chunks of random
    /// length.
    fn record(random: &mut fastrand::Rng, messages: usize) -> Vec<u8> {
        let sink = Cursor::new(Vec::new());
        let mut writer = RecordingWriter::new(sink, Compression::Lz4, BTreeMap::new()).unwrap();
        let outputs = OUTPUTS.map(|data| {
            let latched = data.ends_with("map");
            let schema = Number::schema().to_string();
            let output_type = OutputType { name: "Number".into(), schema, latched };
            writer.add_output(data, &output_type).unwrap()
        });
        for sequence in 0..messages as u64 {
            // Seldom the first, often the last.
            let output = random.usize(1..16).ilog2().min(3) as usize;
            let stamp_s = sequence as f64 * 0.1 - random.f64() * 0.4 + 1.0;
            let head = MessageHead { sequence, stamp_s, instance: 1, lost: 0 };
            let number = codec::encode(&Number { data: stamp_s }).unwrap();
            writer.write(outputs[output], &head, &number).unwrap();
            if random.u8(0..8) == 0 {
                writer.flush().unwrap();
            }
        }
        writer.finish().unwrap().into_inner()
    }

    fn open(bytes: &[u8]) -> Recording {
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, bytes).unwrap();
        Recording::read(file).unwrap()
    }

    fn latched() -> BTreeSet<String> {
        OUTPUTS[..3].iter().map(|data| (*data).to_owned()).collect()
    }

    #[test]
    fn what_outputs_held_is_found_as_by_reading_from_the_beginning() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut found = 0;
        for _ in 0..200 {
            let count = random.usize(1..200);
            let bytes = record(&mut random, count);
            let mut recording = open(&bytes);
            let stamp_s = random.f64() * 22.0;
            let mut expected = BTreeMap::new();
            while let Some(message) = recording.next_message().unwrap() {
                if message.head.stamp_s < stamp_s && message.output_type.latched {
                    keep_newest(&mut expected, message);
                }
            }
            let held = recording.seek_with_held(stamp_s, &latched()).unwrap();
            assert_eq!(held, expected, "{count} messages, at {stamp_s}");
            found += held.len();
        }
        assert!(found > 300, "{found}");
    }

    #[test]
    fn damage_long_before_a_moment_does_not_matter() {
        let mut random = fastrand::Rng::with_seed(2);
        let bytes = record(&mut random, 2000);
        let mut recording = open(&bytes);
        let held = recording.seek_with_held(190.0, &latched()).unwrap();
        let mut damaged = bytes.clone();
        // What is not among the newest values is damaged, the index at the end is not.
        damaged[bytes.len() / 20..bytes.len() / 3].fill(0x5a);
        let mut recording = open(&damaged);
        assert_eq!(recording.seek_with_held(190.0, &latched()).unwrap(), held);
        let mut rest = 0;
        while recording.next_message().unwrap().is_some() {
            rest += 1;
        }
        assert!(rest >= 99 && recording.damaged_chunks() == 0, "{rest}");
    }
}
