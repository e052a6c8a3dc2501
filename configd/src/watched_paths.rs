//! The path to a file: every folder on it, and in each the entry whose change may redirect the
//! path. A symbolic link adds the path to its target.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Most links that are followed on one path, as in the kernel.
const MAX_LINKS: usize = 40;

/// Folders, each with the paths of its entries that matter. Links are resolved, so that a folder
/// has one spelling.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct WatchedPaths {
    pub(crate) folders: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
    /// The files themselves after all links: a file may be written under another of its names.
    pub(crate) files: BTreeSet<PathBuf>,
}

impl WatchedPaths {
    /// Returns the paths to all of `files`. A missing entry ends its path.
    pub(crate) fn leading_to<'a>(files: impl Iterator<Item = &'a Path>) -> Self {
        let mut paths = Self::default();
        for file in files {
            if let Ok(file) = std::path::absolute(file) {
                paths.add_path(Path::new("/"), &file, MAX_LINKS);
            }
        }
        paths
    }

    /// Adds the path from the folder `at` along `rest`.
    fn add_path(&mut self, at: &Path, rest: &Path, links: usize) {
        let mut at = at.to_path_buf();
        let mut parts = rest.components();
        while let Some(part) = parts.next() {
            match part {
                Component::RootDir => at = PathBuf::from("/"),
                Component::ParentDir => {
                    at.pop();
                }
                Component::Normal(name) => {
                    let entry = at.join(name);
                    self.folders.entry(at.clone()).or_default().insert(entry.clone());
                    if let Ok(target) = fs::read_link(&entry) {
                        if links > 0 {
                            self.add_path(&at, &target.join(parts.as_path()), links - 1);
                        }
                        return;
                    }
                    at = entry;
                }
                Component::CurDir | Component::Prefix(_) => {}
            }
        }
        self.files.insert(at);
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn every_name_and_link_on_the_path_matters() {
        let folder = std::env::temp_dir().join(format!("armor-way-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("v1/parts")).expect("writable");
        let folder = folder.canonicalize().expect("it exists");
        fs::write(folder.join("v1/parts/real.xml"), "").expect("writable");
        symlink("parts/../parts/real.xml", folder.join("v1/robot.xml")).expect("writable");
        symlink("v1", folder.join("current")).expect("writable");
        symlink("loop", folder.join("loop")).expect("writable");
        let paths = WatchedPaths::leading_to(
            [folder.join("current/robot.xml"), folder.join("loop/x")].iter().map(AsRef::as_ref),
        );
        let names = |of: &str| -> Vec<_> {
            let entries = paths.folders.get(&folder.join(of)).into_iter().flatten();
            entries.map(|entry| entry.file_name().and_then(|name| name.to_str())).collect()
        };
        assert_eq!(paths.folders[&folder].len(), 3, "current, v1, loop: {paths:?}");
        assert_eq!(names("v1"), [Some("parts"), Some("robot.xml")]);
        assert_eq!(names("v1/parts"), [Some("real.xml")]);
        assert_eq!(paths.files, [folder.join("v1/parts/real.xml")].into());
        assert!(paths.folders.contains_key(Path::new("/")));
        fs::remove_dir_all(&folder).expect("ours");
    }
}
