//! Reads bags of ROS 1 (`.bag`, format 2.0), from their beginning to their end: an index is not needed,
//! so that a bag whose recorder was killed is read up to there.
//!
//! A bag is a sequence of records, each a header of fields `name=value` and data. Chunks hold the
//! connections and the messages: <http://wiki.ros.org/Bags/Format/2.0>.

use std::collections::HashMap;
use std::io::{self, Read};

use armor_wire::schema::Schema;
use thiserror::Error;

use crate::head::MessageHead;
use crate::message_stream::RecordedMessage;
use crate::output_types::{name_topic, standard_output};
use crate::ros::{RosMessage, find_standard_type};
use crate::writer::OutputType;

/// How a bag begins.
pub const BAG_MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Longest header of a record: a definition of a message and its topic.
const MAX_HEADER_LEN: usize = 16 << 20;
/// Longest data of a record, before and after decompression.
const MAX_DATA_LEN: usize = 512 << 20;
/// Values of the field `op`.
pub(crate) const MESSAGE: u8 = 2;
pub(crate) const CHUNK: u8 = 5;
pub(crate) const CONNECTION: u8 = 7;
const NANOSECONDS: f64 = 1e9;

/// Why a bag cannot be read.
#[derive(Debug, Error)]
pub enum BagError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is no bag of format 2.0.
    #[error("it is no bag of ROS 1 in format 2.0")]
    NoBag,
    /// A record is not as the format has it.
    #[error("record {record} is damaged: {problem}")]
    Damaged {
        /// Counts from 1.
        record: u64,
        /// What is wrong.
        problem: &'static str,
    },
}

/// An open bag, at a message.
pub struct Ros1Bag<R> {
    source: R,
    /// The number of records read so far.
    records: u64,
    connections: HashMap<u32, BagConnection>,
    /// The records of the present chunk, and where the next one begins.
    chunk: Vec<u8>,
    at: usize,
}

struct BagConnection {
    data: String,
    output_type: OutputType,
    /// How its messages are read, if they are standard messages.
    message: Option<RosMessage>,
    ros_type: String,
    messages: u64,
}

impl<R: Read> Ros1Bag<R> {
    /// Begins at the first message.
    ///
    /// # Errors
    /// If it is no bag.
    pub fn begin(mut source: R) -> Result<Self, BagError> {
        let mut magic = vec![0; BAG_MAGIC.len()];
        source.read_exact(&mut magic).map_err(|_| BagError::NoBag)?;
        if magic != BAG_MAGIC {
            return Err(BagError::NoBag);
        }
        Ok(Self { source, records: 0, connections: HashMap::new(), chunk: Vec::new(), at: 0 })
    }

    /// Returns the next message; `None` at the end, which in a bag that was not closed is its last
    /// whole record. A message of a type that Armor does not have has the reason instead of its bytes.
    ///
    /// # Errors
    /// If the bag is damaged.
    pub fn next_message(&mut self) -> Result<Option<RecordedMessage>, BagError> {
        loop {
            if self.at < self.chunk.len() {
                let chunk = std::mem::take(&mut self.chunk);
                let mut rest = &chunk[self.at..];
                let read = read_record(&mut rest).map_err(|problem| self.damaged(problem));
                self.at = chunk.len() - rest.len();
                let message = match &read {
                    Ok(Some(record)) => self.take_record(record),
                    _ => Ok(None),
                };
                self.chunk = chunk;
                if read?.is_none() {
                    return Err(self.damaged("a chunk ends within a record"));
                }
                if let Some(message) = message? {
                    return Ok(Some(message));
                }
                continue;
            }
            self.records += 1;
            let Some(record) =
                read_record(&mut self.source).map_err(|problem| self.damaged(problem))?
            else {
                return Ok(None);
            };
            if record.op() == Some(CHUNK) {
                self.chunk = self.decompress(&record)?;
                self.at = 0;
            } else if let Some(message) = self.take_record(&record)? {
                return Ok(Some(message));
            }
        }
    }

    fn damaged(&self, problem: &'static str) -> BagError {
        BagError::Damaged { record: self.records, problem }
    }

    fn take_record(&mut self, record: &BagRecord) -> Result<Option<RecordedMessage>, BagError> {
        match record.op() {
            Some(CONNECTION) => {
                let number = record.number("conn").ok_or_else(|| self.damaged("no connection"))?;
                let topic = record.field("topic").unwrap_or_default();
                let topic = String::from_utf8_lossy(topic).into_owned();
                let about = BagRecord { header: record.data.clone(), data: Vec::new() };
                self.connections.insert(number, BagConnection::new(&topic, &about));
                Ok(None)
            }
            Some(MESSAGE) => {
                let number = record.number("conn").ok_or_else(|| self.damaged("no connection"))?;
                let time = record.field("time").and_then(|time| time.first_chunk::<8>());
                let time = *time.ok_or_else(|| self.damaged("a message without its time"))?;
                let Some(connection) = self.connections.get_mut(&number) else {
                    return Err(self.damaged("a message of an unknown connection"));
                };
                Ok(Some(connection.read_message(time, &record.data)))
            }
            _ => Ok(None),
        }
    }

    fn decompress(&self, record: &BagRecord) -> Result<Vec<u8>, BagError> {
        let size = record.number("size").unwrap_or_default() as usize;
        if size > MAX_DATA_LEN {
            return Err(self.damaged("a chunk is longer than 512 MiB"));
        }
        let mut bytes = Vec::new();
        let limit = size as u64 + 1;
        let read = match record.field("compression").unwrap_or_default() {
            b"none" => record.data.as_slice().take(limit).read_to_end(&mut bytes),
            b"bz2" => {
                let decoder = bzip2_rs::DecoderReader::new(record.data.as_slice());
                decoder.take(limit).read_to_end(&mut bytes)
            }
            b"lz4" => lz4::Decoder::new(record.data.as_slice())
                .and_then(|decoder| decoder.take(limit).read_to_end(&mut bytes)),
            _ => return Err(self.damaged("a chunk has an unknown compression")),
        };
        match read {
            Ok(len) if len == size => Ok(bytes),
            Ok(_) => Err(self.damaged("a chunk does not have its length")),
            Err(_) => Err(self.damaged("a chunk cannot be decompressed")),
        }
    }
}

impl BagConnection {
    /// `about` is how the publisher describes itself.
    fn new(topic: &str, about: &BagRecord) -> Self {
        let ros_type =
            String::from_utf8_lossy(about.field("type").unwrap_or_default()).into_owned();
        let latched = about.field("latching") == Some(b"1");
        let schema: Option<&'static Schema> = find_standard_type(&ros_type);
        Self {
            data: name_topic(topic),
            output_type: schema.map(|it| standard_output(it, latched)).unwrap_or_default(),
            message: schema.map(RosMessage::new),
            ros_type,
            messages: 0,
        }
    }

    fn read_message(&mut self, time: [u8; 8], bytes: &[u8]) -> RecordedMessage {
        let [seconds, nanoseconds] = [0, 4].map(|at| {
            let word = time[at..].first_chunk().copied().unwrap_or_default();
            f64::from(u32::from_le_bytes(word))
        });
        let stamp_s = seconds + nanoseconds / NANOSECONDS;
        let head = MessageHead { sequence: self.messages, stamp_s, instance: 0, lost: 0 };
        self.messages += 1;
        let payload = match &self.message {
            Some(message) => message.decode_ros1(bytes).map_err(|error| error.to_string()),
            None => Err(format!("Armor has no type for {}", self.ros_type)),
        };
        let output_type = self.output_type.clone();
        RecordedMessage { data: self.data.clone(), output_type, head, payload }
    }
}

struct BagRecord {
    header: Vec<u8>,
    data: Vec<u8>,
}

impl BagRecord {
    /// The value of a field of the header.
    fn field(&self, name: &str) -> Option<&[u8]> {
        let mut rest = self.header.as_slice();
        while let Some((len, after)) = rest.split_first_chunk() {
            let len = u32::from_le_bytes(*len) as usize;
            let field = after.get(..len)?;
            rest = &after[len..];
            let at = field.iter().position(|byte| *byte == b'=')?;
            if &field[..at] == name.as_bytes() {
                return Some(&field[at + 1..]);
            }
        }
        None
    }

    fn op(&self) -> Option<u8> {
        self.field("op").and_then(|value| value.first()).copied()
    }

    fn number(&self, name: &str) -> Option<u32> {
        self.field(name).and_then(|value| value.first_chunk()).map(|it| u32::from_le_bytes(*it))
    }
}

/// Reads a record; `None` if there is not a whole one.
fn read_record(source: &mut impl Read) -> Result<Option<BagRecord>, &'static str> {
    let Some(header) = read_part(source, MAX_HEADER_LEN, "a header is too long")? else {
        return Ok(None);
    };
    let data = read_part(source, MAX_DATA_LEN, "a record is longer than 512 MiB")?;
    Ok(data.map(|data| BagRecord { header, data }))
}

fn read_part(
    source: &mut impl Read,
    most: usize,
    problem: &'static str,
) -> Result<Option<Vec<u8>>, &'static str> {
    let mut len = [0; 4];
    if source.read_exact(&mut len).is_err() {
        return Ok(None);
    }
    let len = u32::from_le_bytes(len) as usize;
    if len > most {
        return Err(problem);
    }
    let mut bytes = Vec::new();
    let read = source.take(len as u64).read_to_end(&mut bytes);
    Ok(read.is_ok_and(|read| read == len).then_some(bytes))
}

#[cfg(test)]
mod tests {
    use armor_sdk::messages::{LaserScan, Text};
    use armor_wire::codec;

    use super::*;

    fn with_len(bytes: &[u8]) -> Vec<u8> {
        [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
    }

    fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
        let field =
            |(name, value): &(&str, &[u8])| with_len(&[name.as_bytes(), b"=", value].concat());
        let header: Vec<u8> = fields.iter().flat_map(field).collect();
        [with_len(&header), with_len(data)].concat()
    }

    fn connection(number: u32, topic: &str, ros_type: &str) -> Vec<u8> {
        let about = [format!("type={ros_type}"), "latching=1".into(), "md5sum=*".into()];
        let about: Vec<u8> = about.iter().flat_map(|field| with_len(field.as_bytes())).collect();
        let conn = number.to_le_bytes();
        record(&[("op", &[CONNECTION]), ("conn", &conn), ("topic", topic.as_bytes())], &about)
    }

    fn message(number: u32, seconds: u32, data: &[u8]) -> Vec<u8> {
        let time = [seconds.to_le_bytes(), 500_000_000_u32.to_le_bytes()].concat();
        record(&[("op", &[MESSAGE]), ("conn", &number.to_le_bytes()), ("time", &time)], data)
    }

    /// A scan as ROS 1 has it: no gaps, a counter in its header.
    fn scan() -> Vec<u8> {
        let mut bytes = [7_u32, 12, 250_000_000].map(u32::to_le_bytes).concat();
        bytes.extend(with_len(b"laser"));
        for value in [-1.0_f32, 1.0, 0.5, 0.0, 0.1, 0.2, 30.0] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([2_u32.to_le_bytes(), 1.5_f32.to_le_bytes(), 2.5_f32.to_le_bytes()].concat());
        bytes.extend(0_u32.to_le_bytes());
        bytes
    }

    fn bag(compression: &str, compress: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
        let chunk = [
            connection(0, "/base/scan", "sensor_msgs/LaserScan"),
            connection(1, "/name", "std_msgs/String"),
            connection(2, "/odd", "my_msgs/Odd"),
            message(0, 12, &scan()),
            message(1, 13, &with_len("Ålesund".as_bytes())),
            message(2, 14, b"xyz"),
            message(0, 15, &scan()[..30]),
        ]
        .concat();
        let size = (chunk.len() as u32).to_le_bytes();
        let fields: [(&str, &[u8]); 3] =
            [("op", &[CHUNK]), ("compression", compression.as_bytes()), ("size", &size)];
        let head = record(&[("op", &[3])], &[b' '; 32]);
        [BAG_MAGIC, &head, &record(&fields, &compress(&chunk)), &record(&[("op", &[6])], &[0])]
            .concat()
    }

    fn lz4(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
        io::Write::write_all(&mut encoder, bytes).unwrap();
        encoder.finish().0
    }

    fn read(bytes: &[u8]) -> Vec<RecordedMessage> {
        let mut bag = Ros1Bag::begin(bytes).unwrap();
        std::iter::from_fn(|| bag.next_message().unwrap()).collect()
    }

    #[test]
    fn standard_messages_of_a_bag_are_those_of_armor() {
        for bytes in [bag("none", <[u8]>::to_vec), bag("lz4", lz4)] {
            let messages = read(&bytes);
            let [first, name, odd, short] = &messages[..] else { panic!("{messages:?}") };
            assert_eq!((first.data.as_str(), first.head.stamp_s), ("base.scan", 12.5));
            assert!(first.output_type.latched);
            let scan: LaserScan = codec::decode(first.payload.as_ref().unwrap()).unwrap();
            assert_eq!((scan.stamp, scan.frame.as_str(), scan.range_max), (12.25, "laser", 30.0));
            assert_eq!(scan.ranges, vec![1.5, 2.5].into());
            let text: Text = codec::decode(name.payload.as_ref().unwrap()).unwrap();
            assert_eq!((name.data.as_str(), text.data.as_str()), ("ros.name", "Ålesund"));
            assert_eq!(odd.payload, Err("Armor has no type for my_msgs/Odd".into()));
            assert!(short.payload.is_err() && short.head.sequence == 1);
        }
    }

    #[test]
    fn a_bag_that_was_cut_off_is_read_up_to_there_and_a_damaged_one_names_the_record() {
        let whole = bag("none", <[u8]>::to_vec);
        // Within the record after the chunk, and within the chunk.
        for (cut, count) in [(10, 4), (20, 0)] {
            assert_eq!(read(&whole[..whole.len() - cut]).len(), count, "{cut}");
        }
        assert!(Ros1Bag::begin(&b"#ROSBAG V1.2\n"[..]).is_err());
        let damaged = bag("lz4", <[u8]>::to_vec);
        let mut bag = Ros1Bag::begin(&damaged[..]).unwrap();
        let error = bag.next_message().unwrap_err();
        assert_eq!(error.to_string(), "record 2 is damaged: a chunk cannot be decompressed");
    }
}
