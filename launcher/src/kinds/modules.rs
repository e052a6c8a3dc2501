//! The modules of Python next to a script: it imports them, so that their change may change how it
//! describes itself.

use std::fmt::Write;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use armor_wire::schema::hash_text;
use serde::{Deserialize, Serialize};

/// Most modules that are looked at: a folder with more is no component's.
const MAX_MODULES: usize = 1000;
/// How deep packages within packages are looked at.
const MAX_DEPTH: usize = 4;

/// Distinguishes the modules next to a script before and after a change of any of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModulesIdentity {
    /// Of the names, lengths, inodes and times of all.
    hash: u64,
    /// The newest time at which the kernel has noted a change, in nanoseconds since 1970.
    pub changed_ns: i128,
}

impl ModulesIdentity {
    /// That of the modules in the folder of a script, and in the packages in it.
    pub fn of_script(script: &Path) -> Self {
        let mut found = FoundModules::default();
        if let Some(folder) = script.parent() {
            found.search(folder, script, 0);
        }
        found.texts.sort_unstable();
        Self { hash: hash_text(&found.texts.concat()), changed_ns: found.changed_ns }
    }
}

#[derive(Default)]
struct FoundModules {
    texts: Vec<String>,
    changed_ns: i128,
}

impl FoundModules {
    fn search(&mut self, folder: &Path, script: &Path, depth: usize) {
        // An environment has its own packages, which `interpreter` and the script itself stand for.
        if folder.join("pyvenv.cfg").exists() {
            return;
        }
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let name = entry.file_name();
            let is_hidden = name.to_string_lossy().starts_with(['.', '_']) && is_folder;
            if is_folder && !is_hidden && depth < MAX_DEPTH {
                self.search(&path, script, depth + 1);
            } else if path.extension().is_some_and(|it| it == "py" || it == "so") && path != script
            {
                self.add(&path);
            }
        }
    }

    fn add(&mut self, path: &Path) {
        let Ok(metadata) = fs::metadata(path) else { return };
        if self.texts.len() >= MAX_MODULES {
            return;
        }
        let ns = |s: i64, ns: i64| i128::from(s) * 1_000_000_000 + i128::from(ns);
        let changed_ns = ns(metadata.ctime(), metadata.ctime_nsec());
        let modified_ns = ns(metadata.mtime(), metadata.mtime_nsec());
        let mut text = String::new();
        let (len, inode) = (metadata.len(), metadata.ino());
        let _ = writeln!(text, "{} {len} {inode} {modified_ns} {changed_ns}", path.display());
        self.texts.push(text);
        self.changed_ns = self.changed_ns.max(changed_ns);
    }
}
