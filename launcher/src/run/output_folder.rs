//! The folder for what a run produces, for one run at a time.

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_files::{create_own_folder, open_own_file};

/// Most runs of one system that may write at the same time.
const MAX_PARALLEL_RUNS: u32 = 100;

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
        let problem = || format!("the output folder {} cannot be used", path.display());
        create_own_folder(path).with_context(problem)?;
        let path = path.canonicalize().with_context(problem)?;
        let lock = open_own_file(&path.join(".lock"), OpenOptions::new().write(true))
            .with_context(problem)?;
        Ok(lock.try_lock().is_ok().then_some(Self { path, _lock: lock }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

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
