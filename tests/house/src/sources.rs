//! The crates of the workspace and their source files, found on the disk.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Folders that hold no source of ours.
const SKIPPED: &[&str] = &["target", "out", ".git", "fuzz"];

/// A crate: where it lies and the files that are compiled into its library and programs.
#[derive(Clone, Debug)]
pub struct CrateSources {
    /// The folder of the crate, relative to the workspace.
    pub folder: PathBuf,
    /// `src/lib.rs` and `src/main.rs`, as far as they exist.
    pub roots: Vec<PathBuf>,
}

/// The root of the workspace that this crate was built in.
pub fn workspace_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Finds every crate below `root` that has a library or a program, ordered by folder.
///
/// # Errors
/// If a folder cannot be read.
pub fn find_crates(root: &Path) -> Result<Vec<CrateSources>> {
    let mut crates = Vec::new();
    visit_folders(root, &mut |folder| {
        if folder.join("Cargo.toml").is_file() {
            let roots = ["src/lib.rs", "src/main.rs"].map(|file| folder.join(file));
            let roots: Vec<_> = roots.into_iter().filter(|file| file.is_file()).collect();
            if !roots.is_empty() {
                let folder = folder.strip_prefix(root).unwrap_or(folder).to_path_buf();
                crates.push(CrateSources { folder, roots });
            }
        }
    })?;
    crates.sort_by(|left, right| left.folder.cmp(&right.folder));
    Ok(crates)
}

/// The files below `root` whose names end as given, ordered by path.
pub(crate) fn find_files(root: &Path, endings: &[&str]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    visit_folders(root, &mut |folder| {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_file() && endings.contains(&ending.as_str()) {
                files.push(path);
            }
        }
    })?;
    files.sort();
    Ok(files)
}

fn visit_folders(folder: &Path, visit: &mut dyn FnMut(&Path)) -> Result<()> {
    visit(folder);
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    for entry in entries {
        let entry = entry?;
        let is_skipped = SKIPPED.iter().any(|skipped| entry.file_name() == *skipped);
        if entry.file_type()?.is_dir() && !is_skipped {
            visit_folders(&entry.path(), visit)?;
        }
    }
    Ok(())
}
