//! The folder for what a run produces, for one run at a time.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// How many runs of one system may write beside each other.
const MAX_BESIDE: u32 = 100;

/// Where a run writes if nothing else is asked for.
pub fn usual(name: &str) -> PathBuf {
    Path::new("out").join(name)
}

/// A folder that is ours as long as this lives.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    _lock: File,
}

impl Folder {
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
        let first = usual(name);
        for number in 1..=MAX_BESIDE {
            let path = match number {
                1 => first.clone(),
                number => first.with_file_name(format!("{name}-{number}")),
            };
            if let Some(folder) = Self::lock(&path)? {
                return Ok(folder);
            }
        }
        bail!("{MAX_BESIDE} runs are writing beside {}; give --out", first.display())
    }

    /// Where it is; absolute.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn lock(path: &Path) -> Result<Option<Self>> {
        let problem = || format!("the output folder {} cannot be used", path.display());
        fs::create_dir_all(path).with_context(problem)?;
        let path = path.canonicalize().with_context(problem)?;
        let lock = File::create(path.join(".lock")).with_context(problem)?;
        Ok(lock.try_lock().is_ok().then_some(Self { path, _lock: lock }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    #[test]
    fn two_runs_do_not_write_into_one_folder() {
        let scratch = Scratch::new("out");
        let path = scratch.path().join("a/b");
        let first = Folder::take(Some(&path), "x").expect("it is free");
        assert!(first.path().is_absolute() && first.path().is_dir());
        let error = Folder::take(Some(&path), "x").expect_err("it is taken");
        assert!(error.to_string().contains("--out"), "{error}");
        drop(first);
        Folder::take(Some(&path), "x").expect("it is free again");
    }
}
