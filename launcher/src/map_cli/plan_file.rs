//! Plans on the disk.

use std::path::Path;

use anyhow::{Context, Result, bail};
use armor_exchange::{PlanFormat, PlanNote, RoutePlan, read_plan};
use serde_json::{Value, json};

use crate::print::print_notice;

/// Reads a plan in the format of its file's name.
///
/// # Errors
/// If it cannot be read; the reason names the file and the place in it.
pub fn load_plan(path: &Path) -> Result<RoutePlan> {
    let format = format_of(path)?;
    let text = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let Ok(text) = String::from_utf8(text) else {
        bail!("{} is not text in UTF-8", path.display());
    };
    read_plan(&text, format).with_context(|| path.display().to_string())
}

/// The format of a file of this name.
///
/// # Errors
/// If its end is that of no format.
pub fn format_of(path: &Path) -> Result<PlanFormat> {
    PlanFormat::of_file_name(&path.to_string_lossy()).with_context(|| {
        let ends: Vec<_> = PlanFormat::ALL.iter().map(|format| format.extensions()[0]).collect();
        format!("{}: end the name with .{}", path.display(), ends.join(", ."))
    })
}

/// Prints notes on a file on stderr.
pub fn print_notes(path: &Path, notes: &[PlanNote]) {
    for note in notes {
        print_notice(format!("{}: {note}", path.display()));
    }
}

/// Notes for programs.
pub fn notes_to_json(notes: &[PlanNote]) -> Value {
    let note = |note: &PlanNote| json!({ "place": note.place, "text": note.text });
    notes.iter().map(note).collect()
}
