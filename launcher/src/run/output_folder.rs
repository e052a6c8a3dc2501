//! The folder for what a run produces, for one run at a time.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use armor_files::{create_own_folder, open_own_file};

/// Most runs of one system that may write at the same time.
const MAX_PARALLEL_RUNS: u32 = 100;

/// Words that stand for no folder in other programs.
const NO_FOLDER: [&str; 7] = ["none", "None", "null", "no", "off", "false", "-"];

/// Where a run writes if nothing else is asked for.
pub fn default_folder(name: &str) -> PathBuf {
    Path::new("out").join(name)
}

/// A folder that is ours as long as this lives.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    _lock: File,
}

impl OutputFolder {
    /// The folder that was asked for; otherwise `out/NAME` in the current one, with a number if
    /// another run is writing there.
    ///
    /// # Errors
    /// If it cannot be made, or another run is writing into the one asked for.
    pub fn take(asked: Option<&Path>, name: &str) -> Result<Self> {
        if let Some(path) = asked {
            let is_word = NO_FOLDER.iter().any(|word| path.as_os_str() == *word);
            if is_word && !path.exists() {
                let out = path.display();
                bail!(
                    "a run needs a folder for its logs, and `--out {out}` would be one called \
                     {out}: leave --out out for out/{name}, or write `--out ./{out}`"
                );
            }
            return match Self::lock(path)? {
                Some(folder) => Ok(folder),
                None => bail!("another run is writing into {}; give another --out", path.display()),
            };
        }
        let first = default_folder(name);
        for number in 1..=MAX_PARALLEL_RUNS {
            let path = match number {
                1 => first.clone(),
                number => first.with_file_name(format!("{name}-{number}")),
            };
            if let Some(folder) = Self::lock(&path)? {
                return Ok(folder);
            }
        }
        bail!("{MAX_PARALLEL_RUNS} runs are writing next to {}; give --out", first.display())
    }

    /// Where it is; absolute.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn lock(path: &Path) -> Result<Option<Self>> {
        let problem = |error: io::Error| anyhow!(describe_problem(path, &error));
        create_own_folder(path).map_err(problem)?;
        let absolute = path.canonicalize().map_err(problem)?;
        let lock = open_own_file(&absolute.join(".lock"), OpenOptions::new().write(true))
            .map_err(problem)?;
        Ok(lock.try_lock().is_ok().then_some(Self { path: absolute, _lock: lock }))
    }
}

/// Names the folder that refuses, and the remedy.
fn describe_problem(path: &Path, error: &io::Error) -> String {
    let out = path.display();
    if path.exists() && !path.is_dir() {
        return format!("the output folder {out} is no folder: give another --out");
    }
    if error.raw_os_error().is_none() {
        // Its text names the remedy.
        return format!("the output folder {out} cannot be used: {error}");
    }
    let text = error.to_string();
    // The number of an error of the operating system helps no user.
    let why = text.split(" (os error").next().unwrap_or_default();
    let existing = path.ancestors().skip(1).find(|folder| folder.is_dir());
    let within = match existing.filter(|_| !path.exists()) {
        Some(folder) => format!("made in {}", folder.display()),
        None if path.exists() => "used".into(),
        None => "made in the current folder".into(),
    };
    format!(
        "the output folder {out} cannot be {within}: {why}; give --out a folder that this user can \
         make and write"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    #[test]
    fn a_folder_that_cannot_be_made_is_named_with_the_remedy() {
        let error = OutputFolder::take(Some(Path::new("/proc/x/y")), "x").expect_err("no disk");
        let error = error.to_string();
        assert!(
            error.starts_with("the output folder /proc/x/y cannot be made in /proc: "),
            "{error}"
        );
        let file = OutputFolder::take(Some(Path::new("/dev/null")), "x").expect_err("a file");
        assert!(file.to_string().starts_with("the output folder /dev/null is no folder"), "{file}");
        assert!(error.contains("; give --out a folder ") && !error.contains("os error"), "{error}");
    }

    #[test]
    fn a_word_for_no_folder_makes_none() {
        for word in NO_FOLDER {
            let error = OutputFolder::take(Some(Path::new(word)), "x").expect_err(word);
            let expected = format!("leave --out out for out/x, or write `--out ./{word}`");
            assert!(error.to_string().ends_with(&expected), "{error}");
            assert!(!Path::new(word).exists());
        }
    }

    #[test]
    fn two_runs_do_not_write_into_one_folder() {
        let scratch = ScratchFolder::new("out");
        let path = scratch.path().join("a/b");
        let first = OutputFolder::take(Some(&path), "x").expect("it is free");
        assert!(first.path().is_absolute() && first.path().is_dir());
        let error = OutputFolder::take(Some(&path), "x").expect_err("it is taken");
        assert!(error.to_string().contains("--out"), "{error}");
        drop(first);
        OutputFolder::take(Some(&path), "x").expect("it is free again");
    }
}
