//! What can be wrong with a grid map in files.

use crate::pgm::PgmFault;

/// Bytes of a YAML file: it has seven lines.
pub(crate) const YAML_BYTES: usize = 64 << 10;

/// A fault in a grid map, with the place where it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}{}: {fault}", if *line == 0 { String::new() } else { format!(":{line}") })]
pub struct MapFileError {
    /// The YAML file, or the picture it names.
    pub file: String,
    /// The line at fault, counted from 1 (0: the file as a whole).
    pub line: usize,
    /// What is wrong there.
    pub fault: MapFileFault,
}

/// What is wrong with a grid map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapFileFault {
    /// The file cannot be opened or read.
    #[error("cannot read it: {0}; check the path and its permissions")]
    Unreadable(String),
    /// The file is no YAML of a map.
    #[error("more than {YAML_BYTES} bytes, or not text; the file of a map has some seven lines")]
    NotText,
    /// A line is not a key with a value.
    #[error("`{0}` is not `key: value`; one key stands on each line")]
    NotAKey(String),
    /// A key that maps do not have.
    #[error(
        "key `{0}` is not known; a map has image, resolution, origin, negate, occupied_thresh, \
         free_thresh and mode"
    )]
    UnknownKey(String),
    /// A key twice.
    #[error("`{0}` appears a second time; keep one")]
    SecondKey(String),
    /// A key that a map needs.
    #[error("no `{0}`; add {wanted}", wanted = example_line(.0))]
    MissingKey(&'static str),
    /// A value that does not fit its key.
    #[error("`{value}` is no value for `{key}`; write it as in {}", example_line(.key))]
    BadValue {
        /// The key.
        key: &'static str,
        /// What is written there.
        value: String,
    },
    /// The thresholds leave no room between them.
    #[error("free_thresh must be less than occupied_thresh; usual are 0.196 and 0.65")]
    Thresholds,
    /// The picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PgmFault),
    /// No cell is free.
    #[error("no cell is free; check negate and free_thresh, or draw the free space white")]
    NothingFree,
    /// The outlines have too many straight pieces.
    #[error("the outlines have {0} straight pieces; use a coarser map, or remove its speckles")]
    TooRagged(usize),
}

fn example_line(key: &str) -> &'static str {
    match key {
        "image" => "image: map.pgm",
        "resolution" => "resolution: 0.05",
        "origin" => "origin: [-10.0, -5.0, 0.0]",
        "negate" => "negate: 0",
        "occupied_thresh" => "occupied_thresh: 0.65",
        "free_thresh" => "free_thresh: 0.196",
        _ => "mode: trinary",
    }
}
