//! `armor net convert`: PNML to TINA's `.net` and back.

use std::path::Path;

use anyhow::{Context, Result, bail};
use armor_petri::file::{pnml, tina};

use super::net_facts::{is_tina, load_net};
use crate::exit::CommandEnding;

/// Reads one file and writes the other; the endings of their names specify the formats.
///
/// # Errors
/// If a file cannot be read or written, or the other format cannot express the net.
pub fn convert_file(from: &Path, to: &Path) -> Result<CommandEnding> {
    let file = load_net(from)?;
    let is_pnml = to.extension().is_some_and(|extension| {
        extension.eq_ignore_ascii_case("pnml") || extension.eq_ignore_ascii_case("xml")
    });
    let text = match (is_tina(to), is_pnml) {
        (true, _) => tina::write(&file)?,
        (_, true) => pnml::write(&file),
        _ => bail!("{}: end the name with .pnml or .net", to.display()),
    };
    std::fs::write(to, text).with_context(|| format!("cannot write {}", to.display()))?;
    Ok(CommandEnding::Fine)
}
