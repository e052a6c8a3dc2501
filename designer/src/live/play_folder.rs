//! A folder of its own for each recording that the window plays: nothing is left behind.

use std::fs::DirBuilder;
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Removed with what is in it when this is dropped.
#[derive(Debug)]
pub struct PlayFolder(PathBuf);

impl PlayFolder {
    /// Makes one among the temporary files.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create() -> io::Result<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("armor-designer-play-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        // One of a designer that was killed, whose process id this one has, is not ours.
        DirBuilder::new().recursive(true).mode(0o700).create(&path)?;
        Ok(Self(path))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for PlayFolder {
    fn drop(&mut self) {
        // What is left among the temporary files harms nothing.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
