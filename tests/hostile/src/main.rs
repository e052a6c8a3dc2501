//! Writes well-formed inputs of each decoder, or runs all decoders on damaged ones for a time.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use armor_hostile::entry::DECODERS;
use armor_hostile::fuzzing::{FuzzOptions, FuzzedDecoder, fuzz_all};
use armor_hostile::seeds::make_seeds;

const USAGE: &str = "usage: armor-hostile seeds FOLDER
       armor-hostile fuzz [--seconds N] [--seed N] [--only DECODER] [--found FOLDER]";
/// How long all decoders take together without `--seconds`.
const SECONDS: u64 = 60;
const S_PER_DAY: u64 = 24 * 60 * 60;

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    match words.next().as_deref() {
        Some("seeds") => write_seeds(Path::new(&words.next().context(USAGE)?)),
        Some("fuzz") => fuzz(words),
        Some("fuzz-one") => fuzz_one(words),
        _ => bail!(USAGE),
    }
}

/// Writes the seeds of each decoder into `FOLDER/NAME/`, as the initial corpus of a fuzzer.
fn write_seeds(folder: &Path) -> Result<()> {
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

fn fuzz(mut words: impl Iterator<Item = String>) -> Result<()> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let days = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs() / S_PER_DAY;
    let mut options = FuzzOptions {
        time: Duration::from_secs(SECONDS),
        seed: days,
        only: None,
        found: repository.join("target/fuzz"),
        corpus: repository.join("fuzz/corpus"),
    };
    while let Some(word) = words.next() {
        let value = words.next().context(USAGE)?;
        let number =
            || value.parse().with_context(|| format!("{word} needs a number, not {value}"));
        match word.as_str() {
            "--seconds" => options.time = Duration::from_secs(number()?),
            "--seed" => options.seed = number()?,
            "--only" => options.only = Some(value),
            "--found" => options.found = PathBuf::from(value),
            _ => bail!("{word} is no option\n{USAGE}"),
        }
    }
    println!("seed {0}: --seed {0} draws the same inputs again", options.seed);
    let tried = fuzz_all(&std::env::current_exe()?, &options)?;
    println!("{tried} inputs, and every decoder has survived");
    Ok(())
}

fn fuzz_one(mut words: impl Iterator<Item = String>) -> Result<()> {
    let mut next = || words.next().context(USAGE);
    let decoder = FuzzedDecoder {
        name: next()?,
        seed: next()?.parse()?,
        time: Duration::from_millis(next()?.parse()?),
        corpus: next()?.into(),
        current: next()?.into(),
        count: next()?.into(),
    };
    decoder.run()
}
