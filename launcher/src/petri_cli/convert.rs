//! `armor net convert`: PNML to TINA's `.net` and back.

use std::path::Path;

use anyhow::{Context, Result, bail};
use armor_petri::file::{pnml, tina};

use super::{is_tina, load};
use crate::exit::Ending;

/// Reads one file and writes the other; the endings of their names say how.
///
/// # Errors
/// If a file cannot be read or written, or the other format cannot tell the net.
pub fn run(from: &Path, to: &Path) -> Result<Ending> {
    let file = load(from)?;
    let is_pnml = to.extension().is_some_and(|extension| {
        extension.eq_ignore_ascii_case("pnml") || extension.eq_ignore_ascii_case("xml")
    });
    let text = match (is_tina(to), is_pnml) {
        (true, _) => tina::write(&file)?,
        (_, true) => pnml::write(&file),
        _ => bail!("{}: end the name with .pnml or .net", to.display()),
    };
    std::fs::write(to, text).with_context(|| format!("cannot write {}", to.display()))?;
    Ok(Ending::Fine)
}
