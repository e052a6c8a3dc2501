//! Other files that name a thing of the open ones, in the folder and below: missions over the same
//! system and their sub-missions name its components, and a mission names the places and
//! transitions of its sub-missions in checks. A change of such a thing can be made there too, as part
//! of the same step of the history.

mod mission_name;
mod references;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_robotfile::Document;

use self::references::{FileReferences, FolderFiles};
use crate::item::Item;
use crate::project::files::OpenFile;
use crate::project::{Project, Refused};

/// A change of components, or of places and transitions, that other files may name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NameChange {
    /// It has another name.
    Rename {
        /// The component, place or transition, by the name before.
        item: Item,
        /// The name now.
        new: String,
    },
    /// They were removed.
    Remove(Vec<Item>),
    /// The mission has another name, which precedes the names of its places and transitions in the
    /// missions that include it.
    RenameMission {
        /// The name before; none was that of the file.
        old: Option<String>,
        /// The name now.
        new: Option<String>,
    },
}

impl NameChange {
    /// The removal of those of the items that other files may name; none if there are none.
    pub fn removal(items: &[Item]) -> Option<Self> {
        let named = items.iter().copied().filter(|item| is_named_elsewhere(*item));
        let named: Vec<_> = named.collect();
        (!named.is_empty()).then_some(Self::Remove(named))
    }

    /// The names before the change, as a sentence lists them.
    pub fn names(&self) -> String {
        if let Self::RenameMission { old, .. } = self {
            return old.clone().unwrap_or_else(|| "this mission".into());
        }
        let names = self.items().iter().filter_map(|item| item_name(*item));
        names.collect::<Vec<_>>().join(", ")
    }

    /// Whether it is one of a mission or of its places or transitions, not of the system's
    /// components.
    pub fn is_of_mission(&self) -> bool {
        matches!(self, Self::RenameMission { .. })
            || self.items().iter().any(|item| !matches!(item, Item::Component(_)))
    }

    fn items(&self) -> &[Item] {
        match self {
            Self::Rename { item, .. } => std::slice::from_ref(item),
            Self::Remove(items) => items,
            Self::RenameMission { .. } => &[],
        }
    }

    /// The same change in a file where these prefixes precede the names of a mission.
    fn qualified(&self, prefixes: &[String]) -> Vec<Self> {
        let with = |item: &Item, prefix: &String| match item {
            Item::Place(name) => Item::place(format!("{prefix}.{name}")),
            Item::Transition(name) => Item::transition(format!("{prefix}.{name}")),
            other => *other,
        };
        match self {
            _ if !self.is_of_mission() => vec![self.clone()],
            Self::Rename { item, new } => {
                let renames = prefixes.iter().map(|prefix| Self::Rename {
                    item: with(item, prefix),
                    new: format!("{prefix}.{new}"),
                });
                renames.collect()
            }
            Self::Remove(items) => {
                let all = prefixes.iter().flat_map(|it| items.iter().map(|item| with(item, it)));
                vec![Self::Remove(all.collect())]
            }
            Self::RenameMission { .. } => Vec::new(),
        }
    }

    fn count_mentions(&self, document: &Document) -> usize {
        let named = self.items().iter().filter_map(|item| item.named());
        named.map(|item| document.mentions(item).len()).sum()
    }

    fn apply(&self, document: &mut Document) -> Result<(), Refused> {
        let named = self.items().iter().filter_map(|item| item.named());
        let named: Vec<_> = named.filter(|item| !document.mentions(*item).is_empty()).collect();
        match self {
            Self::Rename { new, .. } => {
                named.into_iter().try_for_each(|item| document.rename(item, new))?;
            }
            Self::Remove(_) => document.remove_all(&named)?,
            Self::RenameMission { .. } => {}
        }
        Ok(())
    }
}

fn is_named_elsewhere(item: Item) -> bool {
    item_name(item).is_some()
}

fn item_name(item: Item) -> Option<&'static str> {
    match item {
        Item::Component(name) | Item::Place(name) | Item::Transition(name) => Some(name.as_str()),
        _ => None,
    }
}

/// A file that names a changed thing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamingFile {
    /// Its path.
    pub path: PathBuf,
    /// How many times it names them.
    pub mentions: usize,
    /// Why it cannot be changed here; none if it can.
    pub obstacle: Option<String>,
    /// The change as it is made there, with the names that the things have in this file.
    changes: Vec<NameChange>,
}

/// The files that name changed things.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Elsewhere {
    /// What was changed in the open files.
    pub change: NameChange,
    /// The files, by path.
    pub files: Vec<NamingFile>,
    /// Whether the folder has more entries than were looked at.
    pub is_cut: bool,
}

/// What became of the files.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct ChangedElsewhere {
    /// Those that were changed; they are open from then on.
    pub changed: Vec<PathBuf>,
    /// Those that were not, and why.
    pub left: Vec<(PathBuf, String)>,
}

impl Project {
    /// Finds the other files that name the things of a change that was just made. Returns none if
    /// there are none. An edit of components has changed the open files already; one of a mission
    /// changes its own file only.
    pub fn find_elsewhere(&self, change: NameChange) -> Option<Elsewhere> {
        let source = |path: &Path| self.current_document(path);
        let mut references = FileReferences::new(&source);
        let mut found = FolderFiles::default();
        let folder = self.folder();
        found.search(&folder);
        let open: BTreeSet<_> =
            self.files.iter().filter_map(|file| file.path()?.canonicalize().ok()).collect();
        let files: Vec<_> = if change.is_of_mission() {
            let mission = self.own_files().find(|file| {
                file.document().is_some_and(|it| it.find(armor_robotfile::Item::Mission).is_some())
            });
            let mission = mission?.path()?.canonicalize().ok()?;
            // A sub-mission is often in a folder next to the missions that include it.
            folder.canonicalize().ok()?.parent().inspect(|above| found.search_shallow(above));
            let others = found.paths.union(&open).filter(|path| **path != mission);
            let others = others.filter_map(|path| {
                let changes = match &change {
                    NameChange::RenameMission { old, new } => {
                        let names = [old.as_deref(), new.as_deref()];
                        self.mission_renames(path, &mission, names, &mut references)
                    }
                    change => change.qualified(&references.prefixes(path, &mission)),
                };
                self.naming_file(path, changes)
            });
            others.collect()
        } else {
            let read = self.reading.files.iter().filter_map(|path| path.canonicalize().ok());
            let related =
                found.related(open.iter().cloned().chain(read).collect(), &mut references);
            let others = found.paths.iter().filter(|path| related.contains(*path));
            let others = others.filter(|path| !open.contains(*path));
            others.filter_map(|path| self.naming_file(path, vec![change.clone()])).collect()
        };
        (!files.is_empty()).then_some(Elsewhere { change, files, is_cut: found.is_cut })
    }

    /// Makes the change in these files too, which are open from then on: a part of the last step
    /// of the history. Each is read again, so that no newer version is overwritten.
    pub fn change_elsewhere(&mut self, elsewhere: &Elsewhere) -> ChangedElsewhere {
        let mut result = ChangedElsewhere::default();
        for file in elsewhere.files.iter().filter(|file| file.obstacle.is_none()) {
            let path = self.known_path(&file.path);
            match self.change_file(&path, &file.changes) {
                Ok(()) => result.changed.push(path),
                Err(why) => result.left.push((path, why)),
            }
        }
        let obstacles = elsewhere
            .files
            .iter()
            .filter_map(|file| Some((file.path.clone(), file.obstacle.clone()?)));
        result.left.extend(obstacles);
        if !result.changed.is_empty() {
            self.changed();
        }
        result
    }

    /// Opens another file as one that is changed along with the open ones.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn open_companion(&mut self, path: &Path) -> std::io::Result<usize> {
        let mut file = OpenFile::read(path)?;
        file.is_companion = true;
        self.files.push(file);
        Ok(self.files.len() - 1)
    }

    /// Changes a file as a part of the last step of the history, and opens it if it is not open.
    fn change_file(&mut self, path: &Path, changes: &[NameChange]) -> Result<(), String> {
        if let Some(number) = self.open_at(path) {
            let open = &mut self.files[number];
            let mut document = open.shared_document().ok_or("it is not well-formed XML")?;
            apply_all(changes, Arc::make_mut(&mut document)).map_err(|why| why.to_string())?;
            open.set_document(document);
            self.history.amend_last(number, open.text());
            return Ok(());
        }
        let (saved, document) = changed_file(path, changes)?;
        let mut open = OpenFile::given(path, &saved);
        open.is_companion = true;
        open.set_document(document);
        self.history.extend_last(&saved, open.text());
        self.files.push(open);
        Ok(())
    }

    /// The number of the open file at this path.
    fn open_at(&self, path: &Path) -> Option<usize> {
        let path = path.canonicalize().ok()?;
        let is_it = |file: &OpenFile| file.path().and_then(|it| it.canonicalize().ok());
        self.files.iter().position(|file| is_it(file).as_ref() == Some(&path))
    }

    /// The file as it is open, or else as it is on the disk; none if it is not well-formed.
    fn current_document(&self, path: &Path) -> Option<Arc<Document>> {
        match self.open_at(path) {
            Some(number) => self.files[number].shared_document(),
            None => read_document(path).ok().map(|(_, document)| Arc::new(document)),
        }
    }

    /// The file, if it names a thing of the changes; and what prevents them there.
    fn naming_file(&self, path: &Path, changes: Vec<NameChange>) -> Option<NamingFile> {
        let mut document = self.current_document(path).filter(|_| !changes.is_empty())?;
        let mentions = changes.iter().map(|change| change.count_mentions(&document)).sum();
        if mentions == 0 {
            return None;
        }
        let is_read_only = fs::metadata(path).is_ok_and(|about| about.permissions().readonly());
        let obstacle = if is_read_only {
            Some("it is read-only".to_owned())
        } else {
            let changed = apply_all(&changes, Arc::make_mut(&mut document));
            changed.err().map(|why| why.to_string())
        };
        Some(NamingFile { path: path.to_path_buf(), mentions, obstacle, changes })
    }

    /// The path by which the open files name this one, if they do.
    fn known_path(&self, path: &Path) -> PathBuf {
        let is_it = |known: &&PathBuf| known.canonicalize().is_ok_and(|known| known == path);
        self.reading.files.iter().find(is_it).cloned().unwrap_or_else(|| path.to_path_buf())
    }
}

fn apply_all(changes: &[NameChange], document: &mut Document) -> Result<(), Refused> {
    changes.iter().try_for_each(|change| change.apply(document))
}

fn read_document(path: &Path) -> Result<(String, Document), String> {
    let bytes = armor_robotfile::read_bytes(path).map_err(|error| error.to_string())?;
    let text = String::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_owned())?;
    let document = Document::open(path, text.as_bytes());
    Ok((text, document.map_err(|_| "it is not well-formed XML".to_owned())?))
}

/// The text of the file on the disk, and the file as it is changed.
fn changed_file(path: &Path, changes: &[NameChange]) -> Result<(String, Arc<Document>), String> {
    let (text, mut document) = read_document(path)?;
    apply_all(changes, &mut document).map_err(|why| why.to_string())?;
    if document.bytes() == text.as_bytes() {
        return Err("it was changed by another program and does not name it any more".into());
    }
    Ok((text, Arc::new(document)))
}

#[cfg(test)]
mod tests;
