//! Nets as files: PNML ([`pnml`]) and TINA's `.net` ([`tina`]), text in and net out, and back.
//!
//! What is wrong with a text is said with its line and column. Nothing here opens a file.

mod draft;
mod numeral;
pub mod pnml;
mod pnml_writing;
pub mod tina;
mod tina_tokens;
mod tina_writing;
mod xml;

use crate::net::{Net, NetError};

/// Longest text that is read, in bytes: the largest nets of the Model Checking Contest have half.
pub const MAX_BYTES: usize = 256 << 20;

/// A net, and what its file says about it that changes nothing it does.
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
    /// A net without any notes.
    pub fn new(name: impl Into<String>, net: Net) -> Self {
        let places = vec![Note::default(); net.places().len()];
        let transitions = vec![Note::default(); net.transitions().len()];
        Self { name: name.into(), net, places, transitions }
    }
}

/// What a file says about one place or transition for people.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Note {
    /// Another name, not necessarily unique; empty if there is none.
    pub label: String,
    /// Where it is drawn, `[x, y]` in the file's own unit, y downwards.
    pub position: Option<[f64; 2]>,
    /// What else its author says of it, name and value; kept, and not understood here. PNML only.
    pub words: Vec<(String, String)>,
}

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {fault}")]
pub struct FileError {
    /// The line, from 1.
    pub line: usize,
    /// The column in characters, from 1.
    pub column: usize,
    /// What it is.
    pub fault: Fault,
}

/// What can be wrong with a text that should hold a net.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The text is longer than is read.
    #[error("the file has more than {MAX_BYTES} bytes, the most that is read")]
    TooLong,
    /// Some byte is not of the encoding.
    #[error("this is not UTF-8; save the file as UTF-8")]
    Encoding,
    /// It is no well-formed XML.
    #[error("this is not well-formed XML: {0}")]
    Xml(String),
    /// XML within a limit that it breaks.
    #[error("{0}")]
    Limit(&'static str),
    /// Something else is needed here.
    #[error("{wanted} is needed here, not {found}")]
    Wanted {
        /// What is needed.
        wanted: &'static str,
        /// What stands there.
        found: String,
    },
    /// A number that is none, or not of this kind.
    #[error("`{0}` is not a whole number of tokens")]
    Number(String),
    /// A number that does not fit.
    #[error("`{0}` is more than a place can count (4,294,967,295)")]
    TooMany(String),
    /// An arc of weight zero.
    #[error("an arc weighs 1 or more; remove the arc if it does nothing")]
    ZeroWeight,
    /// A time that is none.
    #[error("`{0}` is not a time; write a number such as 4 or 0.5, and no end as w")]
    Time(String),
    /// An interval without one of its finite ends.
    #[error("an interval open at a finite end cannot be told; close it")]
    OpenInterval,
    /// An interval that ends before it begins.
    #[error("the interval ends before it begins")]
    EmptyInterval,
    /// Two things with one identifier.
    #[error("`{0}` is there twice; give one of them another id")]
    Duplicate(String),
    /// A name for nothing.
    #[error("`{0}` is not in the net")]
    Unknown(String),
    /// A reference that leads back to itself.
    #[error("the references from `{0}` on lead in a circle")]
    Circle(String),
    /// An arc between two places or two transitions.
    #[error("an arc leads from a place to a transition or back, not between two of a kind")]
    ArcEnds,
    /// Something known that nets here do not have.
    #[error("{0} cannot be told by a place/transition net; it would be another net without it")]
    Unsupported(String),
    /// The net as a whole is not one.
    #[error("{0}")]
    Net(#[from] NetError),
}

/// The error for byte `offset` of `text`.
pub(crate) fn fault_at(text: &str, offset: usize, fault: Fault) -> FileError {
    let before = text.get(..offset.min(text.len())).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    FileError {
        line: before.bytes().filter(|byte| *byte == b'\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
        fault,
    }
}

/// The text of a file; ISO-8859-1 where an XML declaration says so, else UTF-8.
///
/// # Errors
/// If it is too long or not of its encoding.
pub fn decode(bytes: &[u8]) -> Result<String, FileError> {
    if bytes.len() > MAX_BYTES {
        return Err(FileError { line: 1, column: 1, fault: Fault::TooLong });
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.trim_start_matches('\u{feff}').to_owned()),
        Err(_) if is_latin1(bytes) => Ok(bytes.iter().map(|byte| char::from(*byte)).collect()),
        Err(error) => {
            let good = String::from_utf8_lossy(&bytes[..error.valid_up_to()]).into_owned();
            Err(fault_at(&good, good.len(), Fault::Encoding))
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
    fn a_fault_is_told_with_line_and_column() {
        let error = fault_at("ä\nöx", "ä\nö".len(), Fault::ZeroWeight);
        assert_eq!((error.line, error.column), (2, 2));
    }

    #[test]
    fn latin1_is_read_where_it_is_declared() {
        let text = decode(b"<?xml version=\"1.0\" encoding=\"iso-8859-1\"?><a>\xe4</a>").unwrap();
        assert!(text.contains('ä'));
        assert_eq!(decode(b"ab\n\xff").unwrap_err().line, 2);
    }
}
