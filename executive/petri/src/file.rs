//! Nets as files: PNML ([`pnml`]) and TINA's `.net` ([`tina`]), text in and net out, and back.
//!
//! Errors state line and column. Nothing here opens a file.

mod draft;
mod numeral;
pub mod pnml;
mod pnml_writing;
pub mod tina;
mod tina_tokens;
mod tina_writing;
mod xml;

use crate::net::{Net, NetError};

/// Longest text that is read, in bytes: twice the largest net of the Model Checking Contest.
pub const MAX_BYTES: usize = 256 << 20;

/// A net with the notes of its file, which do not affect its behaviour.
#[derive(Clone, Debug)]
pub struct NetFile {
    /// The net's own name; may be empty.
    pub name: String,
    /// The net. Places and transitions are named as the file identifies them.
    pub net: Net,
    /// One per place of the net.
    pub places: Vec<Note>,
    /// One per transition of the net.
    pub transitions: Vec<Note>,
}

impl NetFile {
    /// Returns a net without notes.
    pub fn new(name: impl Into<String>, net: Net) -> Self {
        let places = vec![Note::default(); net.places().len()];
        let transitions = vec![Note::default(); net.transitions().len()];
        Self { name: name.into(), net, places, transitions }
    }
}

/// A file's notes on one place or transition, for people.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Note {
    /// Another name, not necessarily unique; empty if there is none.
    pub label: String,
    /// Its position in a drawing, `[x, y]` in the file's own unit, y downwards.
    pub position: Option<[f64; 2]>,
    /// Further words of its author, as name and value; kept, but not interpreted. PNML only.
    pub words: Vec<(String, String)>,
}

/// A fault of a text, with its position.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {fault}")]
pub struct FileError {
    /// The line, from 1.
    pub line: usize,
    /// The column in characters, from 1.
    pub column: usize,
    /// The fault.
    pub fault: NetFault,
}

/// The kinds of faults of a text that should contain a net.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetFault {
    /// The text is too long.
    #[error("the file has more than {MAX_BYTES} bytes, the most that is read")]
    TooLong,
    /// A byte that the encoding does not allow.
    #[error("this is not UTF-8; save the file as UTF-8")]
    Encoding,
    /// The text is not well-formed XML.
    #[error("this is not well-formed XML: {0}")]
    Xml(String),
    /// The text exceeds a limit.
    #[error("{0}")]
    Limit(&'static str),
    /// Something else is expected here.
    #[error("expected {wanted}, found {found}")]
    Wanted {
        /// What is expected.
        wanted: &'static str,
        /// What was found.
        found: String,
    },
    /// Not a number of tokens.
    #[error("`{0}` is not a whole number of tokens")]
    Number(String),
    /// A number that is too large.
    #[error("`{0}` is more than a place can count (4,294,967,295)")]
    TooMany(String),
    /// An arc of weight zero.
    #[error("an arc weighs 1 or more; remove the arc if it does nothing")]
    ZeroWeight,
    /// Not a time.
    #[error("`{0}` is not a time; write a number such as 4 or 0.5, or w for no limit")]
    Time(String),
    /// An interval that is open at a finite end.
    #[error("an interval that is open at a finite end is not supported; close it")]
    OpenInterval,
    /// An interval that ends before it begins.
    #[error("the interval ends before it begins")]
    EmptyInterval,
    /// Two things with one identifier.
    #[error("the id `{0}` is used twice; change one of them")]
    Duplicate(String),
    /// An id that does not exist.
    #[error("`{0}` is not in the net")]
    Unknown(String),
    /// References or priorities that form a circle.
    #[error("the references or priorities that start at `{0}` form a circle")]
    Circle(String),
    /// An arc between two places or two transitions.
    #[error("an arc leads from a place to a transition or back, not between two of a kind")]
    ArcEnds,
    /// A feature of other kinds of nets.
    #[error("{0} is not supported; without it the net would be another one")]
    Unsupported(String),
    /// The net as a whole is invalid.
    #[error("{0}")]
    Net(#[from] NetError),
}

/// Returns the error for byte `offset` of `text`.
pub(crate) fn fault_at(text: &str, offset: usize, fault: NetFault) -> FileError {
    let before = text.get(..offset.min(text.len())).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    FileError {
        line: before.bytes().filter(|byte| *byte == b'\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
        fault,
    }
}

/// Decodes the bytes of a file: as ISO-8859-1 if an XML declaration names it, else as UTF-8.
///
/// # Errors
/// If it is too long or not of its encoding.
pub fn decode_text(bytes: &[u8]) -> Result<String, FileError> {
    if bytes.len() > MAX_BYTES {
        return Err(FileError { line: 1, column: 1, fault: NetFault::TooLong });
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.trim_start_matches('\u{feff}').to_owned()),
        Err(_) if is_latin1(bytes) => Ok(bytes.iter().map(|byte| char::from(*byte)).collect()),
        Err(error) => {
            let good = String::from_utf8_lossy(&bytes[..error.valid_up_to()]).into_owned();
            Err(fault_at(&good, good.len(), NetFault::Encoding))
        }
    }
}

fn is_latin1(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).to_ascii_lowercase();
    let declaration = head.split("?>").next().unwrap_or_default();
    declaration.contains("iso-8859-1") || declaration.contains("latin1")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_has_line_and_column() {
        let error = fault_at("ä\nöx", "ä\nö".len(), NetFault::ZeroWeight);
        assert_eq!((error.line, error.column), (2, 2));
    }

    #[test]
    fn latin1_is_decoded_where_it_is_declared() {
        let text =
            decode_text(b"<?xml version=\"1.0\" encoding=\"iso-8859-1\"?><a>\xe4</a>").unwrap();
        assert!(text.contains('ä'));
        assert_eq!(decode_text(b"ab\n\xff").unwrap_err().line, 2);
    }
}
