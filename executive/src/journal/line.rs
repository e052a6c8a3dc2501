//! One line of a journal: a JSON object whose first fields protect the rest.
//!
//! ```text
//! {"journal":2,"n":17,"more":0,"len":37,"crc":"1a2b3c4d","prev":"0123456789abcdef","at_ns":…}
//! ```
//! `n` numbers the records, `more` counts those that follow in the same batch, `len` is the length
//! of the record as a JSON object of its own, `crc` the CRC-32C of the line with zeros in place of
//! these digits, and `prev` the hash (CRC-64/XZ) of the line before. Both sums detect damage. They
//! keep out no one who may write the file: such a writer can compute them as well.

use super::life::Life;
use crate::record::JournalRecord;
use crc::{CRC_32_ISCSI, CRC_64_XZ, Crc};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The format that this version writes. Its predecessor had no checksums.
pub const FORMAT: u32 = 2;

const LINE_SUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
const LINE_HASH: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// The CRC-32C of bytes.
pub(super) fn checksum(bytes: &[u8]) -> u32 {
    LINE_SUM.checksum(bytes)
}

/// The last record of a journal, or of its part so far; zeros before the first one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChainEnd {
    /// Its number.
    pub number: u64,
    /// The hash of its line, which contains the hash of the line before.
    pub hash: u64,
}

/// What a line holds besides its head.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum JournalLine {
    Life { life: Life },
    Record(JournalRecord),
}

/// A line whose bytes are as they were written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DecodedLine {
    /// Itself as the end of a chain.
    pub(super) end: ChainEnd,
    /// The hash of the line before it.
    pub(super) previous: u64,
    /// How many records follow in the same batch.
    pub(super) more: u64,
    /// Where the fields of the record begin in the line.
    pub(super) fields_at: usize,
}

/// Why a line is not as it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LineDamage {
    /// It does not begin as a record does.
    NoRecord,
    /// It is longer or shorter than it states.
    Length {
        /// The stated length of the record, in bytes.
        stated: u64,
        /// The length found.
        found: u64,
    },
    /// Its bytes are not those that the checksum was computed from.
    Checksum {
        /// The checksum in the line.
        stated: u32,
        /// The checksum of its bytes.
        found: u32,
    },
}

impl fmt::Display for LineDamage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRecord => write!(f, "it does not begin as a record does"),
            Self::Length { stated, found } => {
                write!(f, "its record has {found} bytes, and {stated} were written")
            }
            Self::Checksum { stated, found } => {
                write!(f, "its bytes have the checksum {found:08x}, and {stated:08x} was written")
            }
        }
    }
}

struct LineHead {
    format: u32,
    number: u64,
    more: u64,
    len: u64,
    sum: u32,
    previous: u64,
}

impl fmt::Display for LineHead {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { format, number, more, len, sum, previous } = self;
        write!(f, "{{\"journal\":{format},\"n\":{number},\"more\":{more},\"len\":{len},")?;
        write!(f, "\"crc\":\"{sum:08x}\",\"prev\":\"{previous:016x}\",")
    }
}

impl LineHead {
    /// Reads the head and its length. Only the one spelling that [`fmt::Display`] writes is a head,
    /// so that no flipped bit gives another spelling of the same numbers.
    fn parse(line: &[u8]) -> Option<(Self, usize)> {
        let len = line.windows(2).enumerate().filter(|it| it.1 == b"\",").nth(1)?.0 + 2;
        let text = std::str::from_utf8(&line[..len]).ok()?;
        let rest = text.strip_prefix("{\"journal\":")?;
        let (format, rest) = rest.split_once(",\"n\":")?;
        let (number, rest) = rest.split_once(",\"more\":")?;
        let (more, rest) = rest.split_once(",\"len\":")?;
        let (stated, rest) = rest.split_once(",\"crc\":\"")?;
        let (sum, rest) = rest.split_once("\",\"prev\":\"")?;
        let previous = rest.strip_suffix("\",")?;
        let head = Self {
            format: format.parse().ok()?,
            number: number.parse().ok()?,
            more: more.parse().ok()?,
            len: stated.parse().ok()?,
            sum: u32::from_str_radix(sum, 16).ok()?,
            previous: u64::from_str_radix(previous, 16).ok()?,
        };
        (head.to_string() == text).then_some((head, len))
    }

    fn compute_sum(&self, fields: &[u8]) -> u32 {
        let mut digest = LINE_SUM.digest();
        digest.update(Self { sum: 0, ..*self }.to_string().as_bytes());
        digest.update(fields);
        digest.finalize()
    }
}

/// Writes `bodies`, each a JSON object with at least one field, as the lines of one batch after
/// `end`. Returns the lines and the end after them.
pub(super) fn encode_batch(mut end: ChainEnd, bodies: &[Vec<u8>]) -> (Vec<u8>, ChainEnd) {
    let mut lines = Vec::new();
    for (more, body) in (0..bodies.len() as u64).rev().zip(bodies) {
        let fields = &body[1..];
        let mut head = LineHead {
            format: FORMAT,
            number: end.number + 1,
            more,
            len: body.len() as u64,
            sum: 0,
            previous: end.hash,
        };
        head.sum = head.compute_sum(fields);
        let start = lines.len();
        lines.extend_from_slice(head.to_string().as_bytes());
        lines.extend_from_slice(fields);
        end = ChainEnd { number: head.number, hash: LINE_HASH.checksum(&lines[start..]) };
        lines.push(b'\n');
    }
    (lines, end)
}

/// Reads a line, which is without its line break.
pub(super) fn decode_line(line: &[u8]) -> Result<DecodedLine, LineDamage> {
    let (head, fields_at) = LineHead::parse(line).ok_or(LineDamage::NoRecord)?;
    let found = (line.len() - fields_at) as u64 + 1;
    if found != head.len {
        return Err(LineDamage::Length { stated: head.len, found });
    }
    let sum = head.compute_sum(&line[fields_at..]);
    if sum != head.sum {
        return Err(LineDamage::Checksum { stated: head.sum, found: sum });
    }
    if head.format != FORMAT {
        return Err(LineDamage::NoRecord);
    }
    let end = ChainEnd { number: head.number, hash: LINE_HASH.checksum(line) };
    Ok(DecodedLine { end, previous: head.previous, more: head.more, fields_at })
}

/// Returns the record of a decoded line.
pub(super) fn parse_fields(line: &[u8], fields_at: usize) -> serde_json::Result<JournalLine> {
    let mut body = vec![b'{'];
    body.extend_from_slice(&line[fields_at..]);
    serde_json::from_slice(&body)
}

/// Returns whether a line is the first one of a journal that was not cut.
pub fn begins_journal(line: &str) -> bool {
    LineHead::parse(line.as_bytes()).is_some_and(|(head, _)| head.number == 1)
}

/// Returns the format of a journal by its first line, if that is a record of another version.
pub(super) fn foreign_format(first: &[u8]) -> Option<u32> {
    // The first format had no head; its records began with one of these fields.
    if [&b"{\"at_ns\":"[..], b"{\"life\":"].iter().any(|field| first.starts_with(field)) {
        return Some(1);
    }
    let (head, fields_at) = LineHead::parse(first)?;
    let fields = &first[fields_at..];
    (head.format != FORMAT && head.sum == head.compute_sum(fields)).then_some(head.format)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Vec<u8> {
        let before = ChainEnd { number: 16, hash: 0x0123_4567_89ab_cdef };
        let (mut lines, end) = encode_batch(before, &[br#"{"at_ns":5,"entry":"put"}"#.to_vec()]);
        assert_eq!(lines.pop(), Some(b'\n'));
        assert_eq!(decode_line(&lines).unwrap().end, end);
        lines
    }

    #[test]
    fn a_line_is_json_and_is_spelled_in_one_way() {
        let text = String::from_utf8(line()).unwrap();
        let expected = "{\"journal\":2,\"n\":17,\"more\":0,\"len\":25,\"crc\":\"";
        assert!(text.starts_with(expected), "{text}");
        assert!(text.ends_with("\"prev\":\"0123456789abcdef\",\"at_ns\":5,\"entry\":\"put\"}"));
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&value["n"], &value["at_ns"]), (&17.into(), &5.into()));
        for (from, to) in [("\"n\":17", "\"n\":017"), ("\"n\":17", "\"n\":+17"), ("abc", "aBc")] {
            let other = text.replacen(from, to, 1);
            assert_eq!(decode_line(other.as_bytes()), Err(LineDamage::NoRecord), "{other}");
        }
    }

    #[test]
    fn every_flipped_bit_and_every_shorter_line_is_noticed() {
        let line = line();
        for bit in 0..line.len() * 8 {
            let mut flipped = line.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(decode_line(&flipped).is_err(), "bit {bit}");
            assert_eq!(foreign_format(&flipped), None, "bit {bit}");
        }
        for len in 0..line.len() {
            assert!(decode_line(&line[..len]).is_err(), "{len} bytes");
        }
    }

    #[test]
    fn other_formats_are_known_by_the_first_line() {
        assert_eq!(foreign_format(b"{\"at_ns\":12,\"entry\":\"put\",\"firing\":3}"), Some(1));
        assert_eq!(foreign_format(b"{\"life\":{\"boot\":\"\",\"zero_ns\":0}}"), Some(1));
        assert_eq!(foreign_format(&line()), None);
        let mut head = LineHead { format: 3, number: 1, more: 0, len: 9, sum: 0, previous: 0 };
        head.sum = head.compute_sum(b"\"new\":1}");
        let newer = format!("{head}\"new\":1}}");
        assert_eq!(foreign_format(newer.as_bytes()), Some(3));
        assert_eq!(decode_line(newer.as_bytes()), Err(LineDamage::NoRecord));
    }
}
