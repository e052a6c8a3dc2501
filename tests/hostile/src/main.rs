//! Writes the seeds of each decoder into `FOLDER/NAME/`, as the initial corpus of a fuzzer.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use armor_hostile::entry::DECODERS;
use armor_hostile::seeds::make_seeds;

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.context("usage: armor-hostile FOLDER")?;
    for (name, _) in DECODERS {
        let corpus = folder.join(name);
        fs::create_dir_all(&corpus)?;
        let temporary = std::env::temp_dir().join(format!("armor-seeds-{}", std::process::id()));
        fs::create_dir_all(&temporary)?;
        let seeds = make_seeds(name, &temporary);
        fs::remove_dir_all(&temporary)?;
        for (index, seed) in seeds?.iter().enumerate() {
            fs::write(corpus.join(format!("seed-{index}")), seed)?;
        }
    }
    Ok(())
}
