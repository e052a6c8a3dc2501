//! What is in the component directories: the executables, each once, and everything that looks as
//! if it were meant to be one. Nothing in them is opened.

use std::collections::BTreeSet;
use std::fs::Metadata;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use armor_robotfile::{Code, Finding};

/// Folder next to the system file that is always searched.
const NEXT_TO_FILE: &str = "components";
/// More folders, separated by colons.
const VARIABLE: &str = "ARMOR_COMPONENTS";

/// The contents of the component directories.
#[derive(Debug, Default)]
pub struct FolderContents {
    /// The executables of all folders, in their order; twice, if two links lead to it.
    pub executables: Vec<PathBuf>,
    /// Files without execute permission.
    pub not_executable: Vec<PathBuf>,
    /// The folders that were searched, and whether each exists.
    pub searched: Vec<(PathBuf, bool)>,
}

/// Searches all folders; what cannot be used is added to `problems`.
pub fn search_folders<'a>(
    asked: &[PathBuf],
    files: impl IntoIterator<Item = &'a Path>,
    problems: &mut Vec<Finding>,
) -> FolderContents {
    let variable = std::env::var_os(VARIABLE).unwrap_or_default();
    let variable: Vec<_> =
        std::env::split_paths(&variable).filter(|path| !path.as_os_str().is_empty()).collect();
    let mut found = FolderContents::default();
    let mut folders = BTreeSet::new();
    // One that cannot be resolved is found wanting where it is read.
    let mut is_new =
        |folder: &Path| folder.canonicalize().map_or(true, |folder| folders.insert(folder));
    for directory in asked.iter().chain(&variable) {
        if is_new(directory) {
            found.add_searched(directory);
            if let Err(error) = look_into(directory, &mut found, problems) {
                problems.push(no_directory(directory, &error));
            }
        }
    }
    for file in files {
        let next_to = file.parent().unwrap_or(Path::new("")).join(NEXT_TO_FILE);
        if !is_new(&next_to) {
            continue;
        }
        found.add_searched(&next_to);
        match look_into(&next_to, &mut found, problems) {
            // The user did not name this folder, so it is not an error if it does not exist.
            Err(error) if next_to.is_dir() => problems.push(no_directory(&next_to, &error)),
            _ => {}
        }
    }
    found
}

impl FolderContents {
    fn add_searched(&mut self, folder: &Path) {
        let path = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        // Two files of one folder share its `components`, also if that does not exist.
        if !self.searched.iter().any(|(known, _)| *known == path) {
            let exists = path.is_dir();
            self.searched.push((path, exists));
        }
    }
}

fn no_directory(directory: &Path, error: &io::Error) -> Finding {
    let directory = directory.display();
    let message = format!("the component directory {directory} cannot be read: {error}");
    Finding::nowhere(Code::NoDirectory, message)
        .remedy("check --components, ARMOR_COMPONENTS and the folder's permissions")
}

fn look_into(
    directory: &Path,
    found: &mut FolderContents,
    problems: &mut Vec<Finding>,
) -> io::Result<()> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(directory)? {
        // What vanishes while it is looked at was not meant to be used.
        let Ok(entry) = entry else { break };
        if !entry.file_name().to_string_lossy().starts_with('.') {
            paths.push(entry.path());
        }
    }
    paths.sort();
    for path in paths {
        match path.metadata().and_then(|metadata| find_executable(&path, &metadata)) {
            Ok(Some(executable)) => found.executables.push(executable),
            Ok(None) if path.is_file() => found.not_executable.push(path),
            Ok(None) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound && !path.is_symlink() => {}
            Err(error) => {
                let message = format!("{} cannot be used: {error}", path.display());
                let finding = Finding::nowhere(Code::UnusableEntry, message);
                problems.push(finding.remedy("remove it, or put there what was meant"));
            }
        }
    }
    Ok(())
}

/// The executable behind `path`; none if it is a folder or a file without execute permission.
fn find_executable(path: &Path, metadata: &Metadata) -> io::Result<Option<PathBuf>> {
    let mode = metadata.permissions().mode();
    if metadata.is_dir() {
        return Ok(None);
    }
    if !metadata.is_file() {
        return Err(io::Error::other("it is a pipe, a socket or a device"));
    }
    if mode & 0o111 != 0 {
        return path.canonicalize().map(Some);
    }
    if mode & 0o444 == 0 {
        return Err(io::Error::other("no user may read or execute it"));
    }
    Ok(None)
}
