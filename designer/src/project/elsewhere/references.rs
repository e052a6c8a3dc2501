//! The files of a folder, and how they name one another.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item, submission_prefix};

/// Entries of folders that are looked at: a home folder has many more.
const MAX_ENTRIES: usize = 5000;
/// Folders within folders that are looked at.
const MAX_DEPTH: usize = 6;
/// Sub-missions of one mission that are looked at, with those inside them: missions that include
/// the next one twice double their number with each file.
const MAX_SUBMISSIONS: usize = 4096;

/// Gives the file at a path as it is now: the open one, or that on the disk.
pub(super) type FileSource<'a> = &'a dyn Fn(&Path) -> Option<Arc<Document>>;

/// The files of folders and those below that may be read.
#[derive(Default)]
pub(super) struct FolderFiles {
    pub(super) paths: BTreeSet<PathBuf>,
    seen: usize,
    pub(super) is_cut: bool,
}

impl FolderFiles {
    /// Adds the files of a folder and those below it.
    pub(super) fn search(&mut self, folder: &Path) {
        self.search_to(folder, MAX_DEPTH);
    }

    /// Adds the files of a folder alone.
    pub(super) fn search_shallow(&mut self, folder: &Path) {
        self.search_to(folder, 0);
    }

    fn search_to(&mut self, folder: &Path, depth: usize) {
        let Ok(entries) = fs::read_dir(folder) else { return };
        for entry in entries.flatten() {
            self.seen += 1;
            if self.seen > MAX_ENTRIES {
                self.is_cut = true;
                return;
            }
            if entry.file_name().to_string_lossy().starts_with('.') {
                continue;
            }
            let path = entry.path();
            // Not through links, which may lead back.
            match entry.file_type() {
                Ok(sort) if sort.is_dir() && depth > 0 => self.search_to(&path, depth - 1),
                Ok(_) if path.extension().is_some_and(|ending| ending == "xml") => {
                    self.paths.extend(path.canonicalize());
                }
                _ => {}
            }
        }
    }

    /// The files that refer to one of `open`, and those that these refer to.
    pub(super) fn related(
        &self,
        open: BTreeSet<PathBuf>,
        references: &mut FileReferences<'_>,
    ) -> BTreeSet<PathBuf> {
        let references: Vec<_> =
            self.paths.iter().map(|path| (path, references.of(path).clone())).collect();
        let mut related = open;
        loop {
            let before = related.len();
            for (path, references) in &references {
                if references.system.as_ref().is_some_and(|system| related.contains(system)) {
                    related.insert((*path).clone());
                }
                if related.contains(*path) {
                    related.extend(references.submissions.iter().cloned());
                }
            }
            if related.len() == before {
                return related;
            }
        }
    }
}

/// What each file names of the others, read when it is first requested.
pub(super) struct FileReferences<'a> {
    source: FileSource<'a>,
    known: BTreeMap<PathBuf, References>,
}

/// A sub-mission as a mission includes it.
pub(super) struct Inclusion {
    pub(super) file: PathBuf,
    /// What precedes its names in the checks there: `dock`, `dock-2`, `park.dock`.
    pub(super) prefix: String,
}

/// The files that a mission names.
#[derive(Clone, Default)]
struct References {
    /// The mission's name, or that of its file.
    name: String,
    system: Option<PathBuf>,
    submissions: Vec<PathBuf>,
}

impl<'a> FileReferences<'a> {
    pub(super) fn new(source: FileSource<'a>) -> Self {
        Self { source, known: BTreeMap::new() }
    }

    /// Returns what precedes the names of the mission `inner` in the checks of the file at `path`,
    /// once for each time that it is included there: `dock`, `dock-2`, `park.dock`.
    pub(super) fn prefixes(&mut self, path: &Path, inner: &Path) -> Vec<String> {
        let all = self.inclusions(path, inner).into_iter();
        all.filter(|inclusion| inclusion.file == inner).map(|inclusion| inclusion.prefix).collect()
    }

    /// Returns all sub-missions that the file at `path` includes, with those inside them, except
    /// those inside `inner`. The order does not depend on names.
    pub(super) fn inclusions(&mut self, path: &Path, inner: &Path) -> Vec<Inclusion> {
        let mut found = Vec::new();
        let mut open = vec![(path.to_path_buf(), String::new())];
        while let Some((file, before)) = open.pop() {
            let mut siblings = Vec::new();
            for file in self.of(&file).submissions.clone() {
                if found.len() == MAX_SUBMISSIONS {
                    return found;
                }
                let name = submission_prefix(&self.of(&file).name, &siblings);
                siblings.push(name.clone());
                let prefix = format!("{before}{name}");
                if file != inner {
                    open.push((file.clone(), format!("{prefix}.")));
                }
                found.push(Inclusion { file, prefix });
            }
        }
        found
    }

    /// Gives the mission at a path another name from here on; none is that of its file.
    pub(super) fn set_name(&mut self, path: &Path, name: Option<&str>) {
        let name = name.map_or_else(|| stem(path), str::to_owned);
        self.of(path);
        if let Some(known) = self.known.get_mut(path) {
            known.name = name;
        }
    }

    fn of(&mut self, path: &Path) -> &References {
        let source = self.source;
        self.known.entry(path.to_path_buf()).or_insert_with(|| References::read(path, source))
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

impl References {
    fn read(path: &Path, source: FileSource<'_>) -> Self {
        let stem = stem(path);
        let unnamed = Self { name: stem.clone(), ..Self::default() };
        let Some(document) = source(path) else { return unnamed };
        let mission = document.find(Item::Mission);
        let Some(mission) = mission.and_then(|at| document.tree().element(&at)) else {
            return unnamed;
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let named = |element: &Element, attribute: &str| {
            folder.join(&element.attribute(attribute)?.value).canonicalize().ok()
        };
        let submissions = mission.elements().filter(|element| element.name == "submission");
        Self {
            name: mission.attribute("name").map_or(stem, |name| name.value.clone()),
            system: named(mission, "system"),
            submissions: submissions.filter_map(|element| named(element, "ref")).collect(),
        }
    }
}
