//! What the crate `mcap` (0.26) does not check: it takes an attachment that is shorter than its own
//! lengths state for whole, and panics; and it allocates as much for a text as its length states, up to
//! 4 GiB.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::op;

/// The footer record: its opcode, its length, and the beginning of the summary first in it.
const FOOTER_LEN: usize = 1 + 8 + 20;
/// Longest summary that is read, far beyond the index of a recording of a terabyte.
const MAX_SUMMARY_LEN: u64 = 256 << 20;
const SUM_LEN: usize = 4;

/// Whether a record of an attachment has room for what it states: two times, a name, a media type, the
/// length of its data, and its checksum.
pub(crate) fn is_whole_attachment(body: &[u8]) -> bool {
    let Some(mut rest) = body.get(16..) else { return false };
    for _ in 0..2 {
        let Some((len, after)) = rest.split_first_chunk() else { return false };
        let Some(after) = after.get(u32::from_le_bytes(*len) as usize..) else { return false };
        rest = after;
    }
    rest.len() >= 8 + SUM_LEN
}

/// A field of a record.
#[derive(Clone, Copy)]
enum RecordField {
    /// So many bytes.
    Bytes(usize),
    /// A length, and so many bytes.
    Text,
    /// A length, and pairs of texts in so many bytes.
    Texts,
}

/// The fields of a record up to its last text.
fn list_fields(opcode: u8) -> &'static [RecordField] {
    use RecordField::{Bytes, Text, Texts};
    match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Bytes(2), Text, Text],
        op::CHANNEL => &[Bytes(4), Text, Text, Texts],
        op::CHUNK => &[Bytes(28), Text],
        // The numbers between are as long as a text would be.
        op::CHUNK_INDEX => &[Bytes(32), Text, Bytes(8), Text],
        op::METADATA => &[Text, Texts],
        op::METADATA_INDEX => &[Bytes(16), Text],
        op::ATTACHMENT_INDEX => &[Bytes(40), Text, Text],
        _ => &[],
    }
}

/// Whether the texts of a record are within it.
pub(crate) fn has_whole_texts(opcode: u8, body: &[u8]) -> bool {
    let mut rest = body;
    list_fields(opcode).iter().all(|field| match field {
        RecordField::Bytes(len) => rest.split_off(..*len).is_some(),
        RecordField::Text => take_text(&mut rest).is_some(),
        RecordField::Texts => {
            let Some(mut texts) = take_text(&mut rest) else { return false };
            while !texts.is_empty() {
                if take_text(&mut texts).is_none() {
                    return false;
                }
            }
            true
        }
    })
}

fn take_text<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (len, after) = rest.split_first_chunk()?;
    let (text, after) = after.split_at_checked(u32::from_le_bytes(*len) as usize)?;
    *rest = after;
    Some(text)
}

/// Whether the summary of a file can be given to `mcap`: no attachment is in a summary that is not
/// damaged. The file is read from its beginning afterwards.
///
/// # Errors
/// If the file cannot be read.
pub(crate) fn is_safe_summary(file: &mut File) -> io::Result<bool> {
    let is_safe = check_summary(file);
    file.seek(SeekFrom::Start(0))?;
    match is_safe {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(true),
        other => other,
    }
}

fn check_summary(file: &mut File) -> io::Result<bool> {
    let end = file.seek(SeekFrom::End(0))?;
    let footer_at = end.saturating_sub((FOOTER_LEN + MAGIC.len()) as u64);
    file.seek(SeekFrom::Start(footer_at))?;
    let mut footer = [0; FOOTER_LEN];
    file.read_exact(&mut footer)?;
    let start = footer[9..].first_chunk().map_or(0, |start| u64::from_le_bytes(*start));
    let len = footer_at.saturating_sub(start);
    if footer[0] != op::FOOTER || start == 0 || len > MAX_SUMMARY_LEN {
        // There is none, or one that is not read.
        return Ok(len <= MAX_SUMMARY_LEN || start == 0 || footer[0] != op::FOOTER);
    }
    file.seek(SeekFrom::Start(start))?;
    let mut summary = Vec::new();
    file.take(len).read_to_end(&mut summary)?;
    let mut rest = summary.as_slice();
    while let [opcode, after @ ..] = rest {
        let Some((len, after)) = after.split_first_chunk() else { break };
        if *opcode == op::ATTACHMENT {
            return Ok(false);
        }
        let len = usize::try_from(u64::from_le_bytes(*len)).unwrap_or(usize::MAX);
        let (body, after) = after.split_at_checked(len).unwrap_or((after, &[]));
        if !has_whole_texts(*opcode, body) {
            return Ok(false);
        }
        rest = after;
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_longer_than_its_record_is_noticed() {
        let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
        let pair = [text("a"), text("bc")].concat();
        let texts = [&(pair.len() as u32).to_le_bytes()[..], &pair].concat();
        let channel = [vec![0; 4], text("topic"), text("cdr"), texts.clone()].concat();
        let header = [text("ros2"), text("armor")].concat();
        for (opcode, body) in [
            (op::CHANNEL, channel),
            (op::HEADER, header),
            (op::METADATA, [text("m"), texts].concat()),
        ] {
            assert!(has_whole_texts(opcode, &body));
            for len in 0..body.len() {
                assert!(!has_whole_texts(opcode, &body[..len]), "{opcode}: {len} of {body:?}");
            }
        }
        assert!(!has_whole_texts(op::SCHEMA, &[1, 0, 0xff, 0xff, 0xff, 0xff, 7]));
        assert!(has_whole_texts(op::MESSAGE, &[]), "it has none");
    }

    #[test]
    fn an_attachment_that_is_shorter_than_it_states_is_not_whole() {
        let mut body = vec![0; 16];
        for text in ["a.xml", "application/xml"] {
            body.extend((text.len() as u32).to_le_bytes());
            body.extend(text.as_bytes());
        }
        body.extend(3_u64.to_le_bytes());
        body.extend(b"abc");
        let without_sum = body.len() - 3;
        body.extend([0; SUM_LEN]);
        assert!(is_whole_attachment(&body));
        assert!(!is_whole_attachment(&body[..without_sum]));
        for len in [0, 15, 18, 24, 40] {
            assert!(!is_whole_attachment(&body[..len]), "{len}");
        }
        body[16] = 0xff;
        assert!(!is_whole_attachment(&body), "a name longer than the record");
    }
}
