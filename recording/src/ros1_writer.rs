//! Writes bags of ROS 1 (`.bag`, format 2.0), with their indexes and without compression:
//! <http://wiki.ros.org/Bags/Format/2.0>.

use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};

use armor_wire::schema::{ParseError, parse};
use thiserror::Error;

use crate::ros::{LayoutError, Ros1Type, RosMessage};
use crate::ros1_bag::{BAG_MAGIC, CHUNK, CONNECTION, MESSAGE};
use crate::writer::{OutputType, name_ros_topic, to_nanoseconds};

/// Values of the field `op`.
const BAG_HEADER: u8 = 3;
const INDEX: u8 = 4;
const CHUNK_INFO: u8 = 6;
/// The record at the beginning, which is written again at the end, has this length.
const BAG_HEADER_LEN: usize = 4096;
/// A chunk is written when it is this long.
const CHUNK_LEN: usize = 768 << 10;
const NANOSECONDS: u64 = 1_000_000_000;
/// Version of the indexes.
const INDEX_VERSION: u32 = 1;

/// Why a bag cannot be written.
#[derive(Debug, Error)]
pub enum BagWriteError {
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The schema of an output cannot be read.
    #[error("the type of {data} cannot be read: {reason}")]
    Schema {
        /// The output.
        data: String,
        /// Why.
        reason: ParseError,
    },
}

/// Writes a bag: outputs, and their messages.
pub struct Ros1Writer<W> {
    sink: W,
    connections: Vec<WrittenConnection>,
    /// The present chunk, and where its messages are.
    chunk: Vec<u8>,
    index: BTreeMap<u32, Vec<(u64, u32)>>,
    infos: Vec<ChunkInfo>,
    written: u64,
}

struct WrittenConnection {
    data: String,
    output_type: OutputType,
    message: RosMessage,
    /// Its record, which a bag has in the chunk of its first message and at the end.
    record: Vec<u8>,
    is_in_chunk: bool,
}

struct ChunkInfo {
    at: u64,
    /// The times of its first and its last message, in nanoseconds.
    span: (u64, u64),
    counts: Vec<(u32, u32)>,
}

impl<W: Write + Seek> Ros1Writer<W> {
    /// Begins a bag.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(mut sink: W) -> Result<Self, BagWriteError> {
        sink.write_all(BAG_MAGIC)?;
        sink.write_all(&bag_header(0, 0, 0))?;
        let (connections, infos) = (Vec::new(), Vec::new());
        let (chunk, index) = (Vec::new(), BTreeMap::new());
        Ok(Self { sink, connections, chunk, index, infos, written: 0 })
    }

    /// Writes a message of an output. Its time is rounded to a nanosecond. Returns what is wrong with
    /// the bytes, of which nothing is written then.
    ///
    /// # Errors
    /// If the type of the output cannot be read, or the file cannot be written.
    pub fn write(
        &mut self,
        data: &str,
        output_type: &OutputType,
        stamp_s: f64,
        payload: &[u8],
    ) -> Result<Result<(), LayoutError>, BagWriteError> {
        let number = self.add_connection(data, output_type)?;
        let connection = &mut self.connections[number as usize];
        let bytes = match connection.message.encode_ros1(payload) {
            Ok(bytes) => bytes,
            Err(reason) => return Ok(Err(reason)),
        };
        if !connection.is_in_chunk {
            connection.is_in_chunk = true;
            self.chunk.extend_from_slice(&connection.record);
        }
        let time = to_nanoseconds(stamp_s);
        let entry = (time, self.chunk.len() as u32);
        let conn = number.to_le_bytes();
        put_record(
            &mut self.chunk,
            &[("op", &[MESSAGE]), ("conn", &conn), ("time", &encode_time(time))],
            &bytes,
        );
        self.index.entry(number).or_default().push(entry);
        self.written += 1;
        if self.chunk.len() >= CHUNK_LEN {
            self.finish_chunk()?;
        }
        Ok(Ok(()))
    }

    /// How many messages have been written.
    pub fn count_written(&self) -> u64 {
        self.written
    }

    /// Completes the bag with its indexes.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<W, BagWriteError> {
        self.finish_chunk()?;
        let index_at = self.sink.stream_position()?;
        for connection in &self.connections {
            self.sink.write_all(&connection.record)?;
        }
        for info in &self.infos {
            let counts = info.counts.iter();
            let counts: Vec<u8> = counts
                .flat_map(|(conn, count)| [conn.to_le_bytes(), count.to_le_bytes()].concat())
                .collect();
            let mut record = Vec::new();
            put_record(
                &mut record,
                &[
                    ("op", &[CHUNK_INFO]),
                    ("ver", &INDEX_VERSION.to_le_bytes()),
                    ("chunk_pos", &info.at.to_le_bytes()),
                    ("start_time", &encode_time(info.span.0)),
                    ("end_time", &encode_time(info.span.1)),
                    ("count", &(info.counts.len() as u32).to_le_bytes()),
                ],
                &counts,
            );
            self.sink.write_all(&record)?;
        }
        self.sink.seek(SeekFrom::Start(BAG_MAGIC.len() as u64))?;
        let (connections, chunks) = (self.connections.len() as u32, self.infos.len() as u32);
        self.sink.write_all(&bag_header(index_at, connections, chunks))?;
        self.sink.flush()?;
        Ok(self.sink)
    }

    fn add_connection(
        &mut self,
        data: &str,
        output_type: &OutputType,
    ) -> Result<u32, BagWriteError> {
        let is_known =
            |known: &WrittenConnection| known.data == data && known.output_type == *output_type;
        if let Some(known) = self.connections.iter().position(is_known) {
            return Ok(known as u32);
        }
        let schema = parse(&output_type.schema)
            .map_err(|reason| BagWriteError::Schema { data: data.into(), reason })?;
        let message = RosMessage::new(&schema);
        let ros1 = Ros1Type::of(&message);
        let topic = name_ros_topic(data);
        let number = self.connections.len() as u32;
        let mut about = Vec::new();
        let latching: &[u8] = if output_type.latched { b"1" } else { b"0" };
        for (name, value) in [
            ("topic", topic.as_bytes()),
            ("type", ros1.name.as_bytes()),
            ("md5sum", ros1.md5.as_bytes()),
            ("message_definition", ros1.definition.as_bytes()),
            ("latching", latching),
        ] {
            put_field(&mut about, name, value);
        }
        let mut record = Vec::new();
        put_record(
            &mut record,
            &[("op", &[CONNECTION]), ("conn", &number.to_le_bytes()), ("topic", topic.as_bytes())],
            &about,
        );
        let (data, output_type) = (data.to_owned(), output_type.clone());
        let connection =
            WrittenConnection { data, output_type, message, record, is_in_chunk: false };
        self.connections.push(connection);
        Ok(number)
    }

    fn finish_chunk(&mut self) -> Result<(), BagWriteError> {
        let index = std::mem::take(&mut self.index);
        let times = || index.values().flatten().map(|(time, _)| *time);
        let Some(span) = times().min().zip(times().max()) else { return Ok(()) };
        let at = self.sink.stream_position()?;
        let mut record = Vec::with_capacity(self.chunk.len() + 128);
        let size = (self.chunk.len() as u32).to_le_bytes();
        let fields: [(&str, &[u8]); 3] =
            [("op", &[CHUNK]), ("compression", b"none"), ("size", &size)];
        put_record(&mut record, &fields, &self.chunk);
        for (conn, entries) in &index {
            let places: Vec<u8> = entries
                .iter()
                .flat_map(|(time, offset)| {
                    [&encode_time(*time)[..], &offset.to_le_bytes()].concat()
                })
                .collect();
            put_record(
                &mut record,
                &[
                    ("op", &[INDEX]),
                    ("ver", &INDEX_VERSION.to_le_bytes()),
                    ("conn", &conn.to_le_bytes()),
                    ("count", &(entries.len() as u32).to_le_bytes()),
                ],
                &places,
            );
        }
        self.sink.write_all(&record)?;
        let counts = index.iter().map(|(conn, entries)| (*conn, entries.len() as u32)).collect();
        self.infos.push(ChunkInfo { at, span, counts });
        self.chunk.clear();
        Ok(())
    }
}

/// The record at the beginning, filled up with spaces.
fn bag_header(index_at: u64, connections: u32, chunks: u32) -> Vec<u8> {
    let mut header = Vec::new();
    for (name, value) in [
        ("op", &[BAG_HEADER][..]),
        ("index_pos", &index_at.to_le_bytes()),
        ("conn_count", &connections.to_le_bytes()),
        ("chunk_count", &chunks.to_le_bytes()),
    ] {
        put_field(&mut header, name, value);
    }
    let filling = vec![b' '; BAG_HEADER_LEN - header.len()];
    let mut record = Vec::new();
    put_part(&mut record, &header);
    put_part(&mut record, &filling);
    record
}

fn put_record(out: &mut Vec<u8>, fields: &[(&str, &[u8])], data: &[u8]) {
    let mut header = Vec::new();
    fields.iter().for_each(|(name, value)| put_field(&mut header, name, value));
    put_part(out, &header);
    put_part(out, data);
}

fn put_field(out: &mut Vec<u8>, name: &str, value: &[u8]) {
    put_part(out, &[name.as_bytes(), b"=", value].concat());
}

fn put_part(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
    out.extend_from_slice(bytes);
}

/// Seconds and nanoseconds. A time that ROS 1 cannot express is its last one.
fn encode_time(nanoseconds: u64) -> [u8; 8] {
    let seconds = u32::try_from(nanoseconds / NANOSECONDS).unwrap_or(u32::MAX);
    let rest = (nanoseconds % NANOSECONDS) as u32;
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&seconds.to_le_bytes());
    bytes[4..].copy_from_slice(&rest.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use armor_sdk::messages::{BatteryState, FrameTransforms, LaserScan, Number, Odometry};
    use armor_wire::codec;
    use armor_wire::message::{Message, WireType};

    use super::*;
    use crate::message_stream::RecordedMessage;
    use crate::ros1_bag::Ros1Bag;

    fn type_of<T: Message>(latched: bool) -> OutputType {
        OutputType { name: T::NAME.into(), schema: T::schema().to_string(), latched }
    }

    fn read(bytes: &[u8]) -> Vec<RecordedMessage> {
        let mut bag = Ros1Bag::begin(bytes).unwrap();
        std::iter::from_fn(|| bag.next_message().unwrap()).collect()
    }

    #[test]
    fn standard_messages_come_back_as_they_were() {
        let mut writer = Ros1Writer::begin(Cursor::new(Vec::new())).unwrap();
        let mut put = |data: &str, output_type: &OutputType, stamp_s: f64, payload: Vec<u8>| {
            writer.write(data, output_type, stamp_s, &payload).unwrap().unwrap();
            (data.to_owned(), output_type.clone(), stamp_s, payload)
        };
        let mut expected = Vec::new();
        for second in 0..30 {
            let stamp = f64::from(second) + 0.25;
            let ranges = vec![second as f32; 10_000];
            let scan = LaserScan {
                stamp,
                frame: "laser".into(),
                ranges: ranges.into(),
                ..Default::default()
            };
            let odometry = Odometry { stamp, frame: "odom".into(), ..Default::default() };
            let battery = BatteryState { stamp, ..Default::default() };
            let frames = FrameTransforms::from_odometry(&odometry);
            let number = Number { data: stamp };
            for (data, output_type, payload) in [
                ("base.scan", type_of::<LaserScan>(false), codec::encode(&scan)),
                ("base.odometry", type_of::<Odometry>(false), codec::encode(&odometry)),
                ("base.battery", type_of::<BatteryState>(true), codec::encode(&battery)),
                ("base.frames", type_of::<FrameTransforms>(false), codec::encode(&frames)),
                ("base.number", type_of::<Number>(false), codec::encode(&number)),
            ] {
                expected.push(put(data, &output_type, stamp, payload.unwrap()));
            }
        }
        assert_eq!(writer.count_written(), 150);
        let schema = LaserScan::schema().to_string();
        let wrong = OutputType { schema, ..OutputType::default() };
        assert!(writer.write("a.b", &wrong, 0.0, &[1]).unwrap().is_err(), "of another layout");
        let bytes = writer.finish().unwrap().into_inner();
        let found = read(&bytes).into_iter().map(|message| {
            (message.data, message.output_type, message.head.stamp_s, message.payload.unwrap())
        });
        assert!(found.eq(expected));
    }
}
