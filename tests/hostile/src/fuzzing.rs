//! All decoders under damaged inputs for a given time: `armor-hostile fuzz`.
//!
//! Each decoder runs in a process of its own, so that a stack that overflows, an allocation that fails or an
//! endless loop is found too. Each input is in a file before it is decoded; if the process does not end
//! well, that file is kept.

use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use fastrand::Rng;
use rustix::process::{Resource, Rlimit, Signal, getrlimit, setrlimit};

use crate::damage::damage_one;
use crate::entry::{DECODERS, FileDecoder};
use crate::seeds::make_seeds;
use crate::{connection_entry, robotfile_entry};

/// Memory that a decoder may take in all: far beyond what the longest input needs.
const MAX_MEMORY: u64 = 8 << 30;
/// Processor time that a decoder may take for its last input. A busy host is no fault of the decoder.
const HANGS_AFTER: Duration = Duration::from_secs(10);
/// How long a process may live after its time: one that waits takes no processor time.
const WAITS_FOR: Duration = Duration::from_secs(300);
/// Period with which the processes are looked after.
const LOOK: Duration = Duration::from_millis(20);
/// Longest input that is printed when it is found, in bytes.
const MAX_PRINTED: usize = 512;

/// What to do.
#[derive(Clone, Debug)]
pub struct FuzzOptions {
    /// The time of all decoders together.
    pub time: Duration,
    /// Draws the inputs.
    pub seed: u64,
    /// The only decoder; all of them without it.
    pub only: Option<String>,
    /// Where inputs are kept that a decoder does not survive.
    pub found: PathBuf,
    /// The repository's `fuzz/corpus`.
    pub corpus: PathBuf,
}

/// Returns all decoders: of files, of connections, and the readers of the robot's file.
pub fn list_targets() -> Vec<FileDecoder> {
    let files = DECODERS.into_iter();
    files.chain(connection_entry::ENTRIES).chain(robotfile_entry::ENTRIES).collect()
}

/// Runs `program` (this one) for each decoder in turn, and returns how many inputs were tried.
///
/// # Errors
/// If a decoder does not survive an input, with the file of that input; all decoders are tried before.
pub fn fuzz_all(program: &Path, options: &FuzzOptions) -> Result<u64> {
    let is_wanted = |name: &str| options.only.as_deref().is_none_or(|only| only == name);
    let targets: Vec<_> =
        list_targets().into_iter().map(|(name, _)| name).filter(|name| is_wanted(name)).collect();
    if targets.is_empty() {
        let names: Vec<_> = list_targets().iter().map(|(name, _)| *name).collect();
        let only = options.only.as_deref().unwrap_or_default();
        bail!("there is no decoder {only}: name one of {}", names.join(", "));
    }
    fs::create_dir_all(&options.found)
        .with_context(|| format!("{} cannot be made", options.found.display()))?;
    let share = options.time / targets.len() as u32;
    let (mut tried, mut faults) = (0, Vec::new());
    for name in &targets {
        match fuzz_one(program, name, share, options)? {
            Ok(inputs) => {
                println!("{name:12} {inputs:8} inputs in {:.1} s", share.as_secs_f64());
                tried += inputs;
            }
            Err(fault) => {
                eprintln!("{fault}");
                faults.push(*name);
            }
        }
    }
    match faults.as_slice() {
        [] => Ok(tried),
        faults => bail!(
            "{} did not survive an input of seed {}: add it to fuzz/corpus/NAME (fuzz/README.md)",
            faults.join(", "),
            options.seed
        ),
    }
}

/// Runs one decoder in a process. Returns the number of its inputs, or what it did not survive.
fn fuzz_one(
    program: &Path,
    name: &str,
    time: Duration,
    options: &FuzzOptions,
) -> Result<Result<u64, String>> {
    let current = options.found.join(format!("{name}.current"));
    let count = options.found.join(format!("{name}.count"));
    let mut command = Command::new(program);
    command.arg("fuzz-one").arg(name).arg(options.seed.to_string());
    command.arg(time.as_millis().to_string()).args([&options.corpus, &current, &count]);
    let mut child = command.spawn().context("the process of a decoder cannot be started")?;
    let how = match wait_until(&mut child, time + WAITS_FOR)? {
        Some(status) if status.success() => None,
        Some(status) if status.signal() == Some(Signal::XCPU.as_raw()) => {
            Some(format!("has not returned within {} s of a processor", HANGS_AFTER.as_secs()))
        }
        Some(status) => Some(format!("ends its process ({status})")),
        None => Some(format!("has not returned within {} s", WAITS_FOR.as_secs())),
    };
    let tried = fs::read_to_string(&count).ok().and_then(|text| text.trim().parse().ok());
    let _ = fs::remove_file(&count);
    let Some(how) = how else {
        let _ = fs::remove_file(&current);
        return Ok(Ok(tried.unwrap_or(0)));
    };
    let Ok(input) = fs::read(&current) else {
        return Ok(Err(format!("{name} {how} before its first input")));
    };
    let kept = options.found.join(format!("{name}-{}-{:08x}", options.seed, checksum(&input)));
    fs::rename(&current, &kept).with_context(|| format!("{} cannot be kept", current.display()))?;
    let mut fault = format!("{name} {how} at the input of {} bytes in ", input.len());
    fault += &kept.display().to_string();
    if input.len() <= MAX_PRINTED {
        fault += &format!(": b\"{}\"", input.escape_ascii());
    }
    Ok(Err(fault))
}

/// Waits for a process; one that does not end in time is killed.
fn wait_until(child: &mut Child, time: Duration) -> Result<Option<ExitStatus>> {
    let end = Instant::now() + time;
    while Instant::now() < end {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        thread::sleep(LOOK);
    }
    child.kill()?;
    child.wait()?;
    Ok(None)
}

/// One decoder in this process, for a time. Does not return if an input ends the process.
#[derive(Debug)]
pub struct FuzzedDecoder {
    /// Its name.
    pub name: String,
    /// Draws the inputs.
    pub seed: u64,
    /// How long.
    pub time: Duration,
    /// The repository's `fuzz/corpus`.
    pub corpus: PathBuf,
    /// The file with the input that is decoded.
    pub current: PathBuf,
    /// The file with the number of inputs, at the end.
    pub count: PathBuf,
}

impl FuzzedDecoder {
    /// Decodes damaged inputs until the time is over.
    ///
    /// # Errors
    /// If there is no such decoder, or nothing that could be damaged; if the decoder panics.
    pub fn run(&self) -> Result<()> {
        let decoder = list_targets().into_iter().find(|(name, _)| *name == self.name);
        let (_, decode) = decoder.with_context(|| format!("there is no decoder {}", self.name))?;
        let processor_s = (self.time + HANGS_AFTER).as_secs() + 1;
        for (resource, most) in [(Resource::As, MAX_MEMORY), (Resource::Cpu, processor_s)] {
            let maximum = getrlimit(resource).maximum;
            let current = Some(maximum.map_or(most, |maximum| most.min(maximum)));
            setrlimit(resource, Rlimit { current, maximum }).context("a limit cannot be set")?;
        }
        let inputs = self.collect_inputs()?;
        let file = File::create(&self.current)
            .with_context(|| format!("{} cannot be written", self.current.display()))?;
        let mut rng = Rng::with_seed(self.seed);
        let (end, mut tried) = (Instant::now() + self.time, 0_u64);
        while Instant::now() < end {
            let input = damage_one(&inputs, &mut rng);
            file.write_all_at(&input, 0)?;
            file.set_len(input.len() as u64)?;
            if std::panic::catch_unwind(|| decode(&input)).is_err() {
                bail!("{} has panicked", self.name);
            }
            tried += 1;
        }
        fs::write(&self.count, tried.to_string())?;
        Ok(())
    }

    /// What is damaged: well-formed inputs, and those that are kept.
    fn collect_inputs(&self) -> Result<Vec<Vec<u8>>> {
        let mut inputs = Vec::new();
        if DECODERS.iter().any(|(name, _)| *name == self.name) {
            let folder = self.current.with_extension("seeds");
            fs::create_dir_all(&folder)?;
            inputs = make_seeds(&self.name, &folder)?;
            fs::remove_dir_all(&folder)?;
        }
        let folder = self.corpus.join(&self.name);
        let entries = fs::read_dir(&folder)
            .with_context(|| format!("{} has the inputs that are kept", folder.display()))?;
        let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        paths.sort();
        for path in paths {
            inputs.push(fs::read(&path).with_context(|| path.display().to_string())?);
        }
        if inputs.is_empty() {
            bail!("{} has no input", folder.display());
        }
        Ok(inputs)
    }
}

/// FNV-1a, for a name.
fn checksum(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |sum, byte| (sum ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}
