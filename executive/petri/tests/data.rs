//! The nets of the Model Checking Contest, in the folder that `ARMOR_DATA` names.

use armor_petri::file::{NetFile, decode_text, pnml, tina};
use std::path::PathBuf;

/// Reads the net in the file of this name; returns `None`, with a note, if there are no data.
///
/// # Panics
/// If there are no data under `CI`, or the file cannot be read.
pub fn net(name: &str) -> Option<NetFile> {
    let Some(folder) = std::env::var_os("ARMOR_DATA") else {
        assert!(std::env::var_os("CI").is_none(), "ARMOR_DATA is not set");
        eprintln!("skipped: ARMOR_DATA is not set");
        return None;
    };
    let path = PathBuf::from(folder).join("petri").join(name);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let text = decode_text(&bytes).expect("text");
    let read = if name.ends_with(".net") { tina::read(&text) } else { pnml::read(&text) };
    Some(read.unwrap_or_else(|error| panic!("{}:{error}", path.display())))
}
