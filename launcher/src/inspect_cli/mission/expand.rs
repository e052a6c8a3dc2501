//! `armor mission expand`: a mission file with its routes written out as places and transitions.

use std::path::Path;

use anyhow::{Context, Result};
use armor_robotfile::{Document, read_bytes};

use crate::exit::CommandEnding;
use crate::findings_error::refuse_file;
use crate::print::{end_printing, print_line};

/// Prints the file; nothing in it changes.
///
/// # Errors
/// If the file has an error or no route.
pub fn print_expanded(file: &Path) -> Result<CommandEnding> {
    let reading = armor_robotfile::check(armor_robotfile::load(file), &[], None);
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(refuse_file(file, &reading.findings));
    };
    let mission = configuration.mission.as_ref();
    let mission = mission
        .filter(|mission| !mission.routes.is_empty())
        .with_context(|| format!("{} has no <route>", file.display()))?;
    let bytes = read_bytes(file).with_context(|| format!("{}", file.display()))?;
    let mut document =
        Document::open(file, &bytes).map_err(|findings| refuse_file(file, &findings))?;
    document.expand_routes(mission)?;
    let text = String::from_utf8_lossy(document.bytes());
    end_printing(print_line(text.trim_end()))
}
