//! Files that are not open and name a component of the open ones: missions over the same system
//! and their sub-missions, in the folder and below. A change of the component can be made there
//! too, as part of the same step of the history.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_robotfile::tree::Element;
use armor_robotfile::{Document, Item};

use crate::project::files::OpenFile;
use crate::project::{Project, Refused};

/// Entries of folders that are looked at: a home folder has many more.
const MAX_ENTRIES: usize = 5000;
/// Folders within folders that are looked at.
const MAX_DEPTH: usize = 6;

/// A change of components that other files may name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ComponentChange {
    /// It has another name.
    Rename {
        /// The name before.
        old: String,
        /// The name now.
        new: String,
    },
    /// They were removed.
    Remove(Vec<String>),
}

impl ComponentChange {
    fn names(&self) -> Vec<&str> {
        match self {
            Self::Rename { old, .. } => vec![old],
            Self::Remove(names) => names.iter().map(String::as_str).collect(),
        }
    }

    fn apply(&self, document: &mut Document) -> Result<(), Refused> {
        match self {
            Self::Rename { old, new } => document.rename(Item::Component(old), new)?,
            Self::Remove(names) => {
                let named = names.iter().map(|name| Item::Component(name));
                let named: Vec<_> =
                    named.filter(|item| !document.mentions(*item).is_empty()).collect();
                document.remove_all(&named)?;
            }
        }
        Ok(())
    }
}

/// A file that names a changed component.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamingFile {
    /// Its path.
    pub path: PathBuf,
    /// How many times it names them.
    pub mentions: usize,
    /// Why it cannot be changed here; none if it can.
    pub obstacle: Option<String>,
}

/// The files that name changed components.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Elsewhere {
    /// What was changed in the open files.
    pub change: ComponentChange,
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
    /// Finds the files that are not open and name the components of a change that was just made.
    /// Returns none if there are none.
    pub fn find_elsewhere(&self, change: ComponentChange) -> Option<Elsewhere> {
        let mut found = FolderFiles::default();
        found.search(&self.folder(), 0);
        let own: BTreeSet<_> =
            self.files.iter().filter_map(|file| file.path()?.canonicalize().ok()).collect();
        let read = self.reading.files.iter().filter_map(|path| path.canonicalize().ok());
        let related = found.related(own.iter().cloned().chain(read).collect());
        let others = found.paths.iter().filter(|path| related.contains(*path));
        let others = others.filter(|path| !own.contains(*path));
        let files: Vec<_> = others.filter_map(|path| naming_file(path, &change)).collect();
        (!files.is_empty()).then_some(Elsewhere { change, files, is_cut: found.is_cut })
    }

    /// Makes the change in these files too, which are open from then on: a part of the last step
    /// of the history. Each is read again, so that no newer version is overwritten.
    pub fn change_elsewhere(&mut self, elsewhere: &Elsewhere) -> ChangedElsewhere {
        let mut result = ChangedElsewhere::default();
        for file in elsewhere.files.iter().filter(|file| file.obstacle.is_none()) {
            let path = self.known_path(&file.path);
            match changed_file(&path, &elsewhere.change) {
                Ok((saved, document)) => {
                    let mut open = OpenFile::given(&path, &saved);
                    open.is_companion = true;
                    open.set_document(document);
                    self.history.extend_last(&saved, open.text());
                    self.files.push(open);
                    result.changed.push(path);
                }
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

    /// The path by which the open files name this one, if they do.
    fn known_path(&self, path: &Path) -> PathBuf {
        let is_it = |known: &&PathBuf| known.canonicalize().is_ok_and(|known| known == path);
        self.reading.files.iter().find(is_it).cloned().unwrap_or_else(|| path.to_path_buf())
    }
}

/// The files of a folder and those below that may be read.
#[derive(Default)]
struct FolderFiles {
    paths: BTreeSet<PathBuf>,
    seen: usize,
    is_cut: bool,
}

impl FolderFiles {
    fn search(&mut self, folder: &Path, depth: usize) {
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
                Ok(sort) if sort.is_dir() && depth < MAX_DEPTH => self.search(&path, depth + 1),
                Ok(_) if path.extension().is_some_and(|ending| ending == "xml") => {
                    self.paths.extend(path.canonicalize());
                }
                _ => {}
            }
        }
    }

    /// The files that refer to one of `open`, and those that these refer to.
    fn related(&self, open: BTreeSet<PathBuf>) -> BTreeSet<PathBuf> {
        let references: Vec<_> =
            self.paths.iter().map(|path| (path, References::of(path))).collect();
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

/// The files that a mission names.
#[derive(Default)]
struct References {
    system: Option<PathBuf>,
    submissions: Vec<PathBuf>,
}

impl References {
    fn of(path: &Path) -> Self {
        let Some(document) = read_document(path).ok().map(|(_, document)| document) else {
            return Self::default();
        };
        let mission = document.find(Item::Mission);
        let Some(mission) = mission.and_then(|at| document.tree().element(&at)) else {
            return Self::default();
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let named = |element: &Element, attribute: &str| {
            folder.join(&element.attribute(attribute)?.value).canonicalize().ok()
        };
        let submissions = mission.elements().filter(|element| element.name == "submission");
        Self {
            system: named(mission, "system"),
            submissions: submissions.filter_map(|element| named(element, "ref")).collect(),
        }
    }
}

fn read_document(path: &Path) -> Result<(String, Document), String> {
    let bytes = armor_robotfile::read_bytes(path).map_err(|error| error.to_string())?;
    let text = String::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_owned())?;
    let document = Document::open(path, text.as_bytes());
    Ok((text, document.map_err(|_| "it is not well-formed XML".to_owned())?))
}

/// The file, if it names a component of the change; and what prevents the change there.
fn naming_file(path: &Path, change: &ComponentChange) -> Option<NamingFile> {
    let (_, mut document) = read_document(path).ok()?;
    let mentions =
        change.names().into_iter().map(|name| document.mentions(Item::Component(name)).len());
    let mentions = mentions.sum();
    if mentions == 0 {
        return None;
    }
    let is_read_only = fs::metadata(path).is_ok_and(|about| about.permissions().readonly());
    let obstacle = if is_read_only {
        Some("it is read-only".to_owned())
    } else {
        change.apply(&mut document).err().map(|why| why.to_string())
    };
    Some(NamingFile { path: path.to_path_buf(), mentions, obstacle })
}

/// The text of the file on the disk, and the file as it is changed.
fn changed_file(path: &Path, change: &ComponentChange) -> Result<(String, Arc<Document>), String> {
    let (text, mut document) = read_document(path)?;
    change.apply(&mut document).map_err(|why| why.to_string())?;
    if document.bytes() == text.as_bytes() {
        return Err("it was changed by another program and does not name it any more".into());
    }
    Ok((text, Arc::new(document)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SYSTEM: &str = "<armor version=\"1\"><system name=\"s\">\
        <component name=\"arm\" kind=\"k\"/><component name=\"eye\" kind=\"k\"/></system></armor>";

    fn mission(system: &str, inner: &str) -> String {
        format!(
            "<armor version=\"1\"><mission {system} goal=\"p\">{inner}\
             <place name=\"p\" components=\"arm eye\"/></mission></armor>"
        )
    }

    /// A system with two missions over it, one with a sub-mission below, and one of another system.
    fn folder(name: &str) -> PathBuf {
        let folder =
            std::env::temp_dir().join(format!("armor-elsewhere-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("parts")).unwrap();
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
        write("robot.xml", SYSTEM);
        write("other.xml", SYSTEM);
        write("one.xml", &mission("system=\"robot.xml\"", ""));
        write(
            "two.xml",
            &mission("system=\"robot.xml\"", "<submission ref=\"parts/inner.xml\" in=\"p\"/>"),
        );
        write("parts/inner.xml", &mission("", ""));
        write("parts/unused.xml", &mission("", ""));
        write("foreign.xml", &mission("system=\"other.xml\"", ""));
        folder.canonicalize().unwrap()
    }

    fn rename(project: &mut Project) -> ComponentChange {
        project
            .edit("rename", |documents| crate::system::rename(documents, "arm", "hand"))
            .unwrap();
        ComponentChange::Rename { old: "arm".into(), new: "hand".into() }
    }

    fn texts(project: &Project) -> Vec<String> {
        project.files().iter().map(|file| file.text().to_string()).collect()
    }

    #[test]
    fn files_over_the_same_system_are_changed_in_one_step() {
        let folder = folder("step");
        let mut project = Project::open(&folder.join("robot.xml"), Arc::default()).unwrap();
        let change = rename(&mut project);
        let elsewhere = project.find_elsewhere(change).expect("three files name it");
        let names: Vec<_> = elsewhere
            .files
            .iter()
            .map(|file| file.path.strip_prefix(&folder).unwrap().display().to_string())
            .collect();
        assert_eq!(names, ["one.xml", "parts/inner.xml", "two.xml"]);
        assert_eq!(project.change_elsewhere(&elsewhere).changed.len(), 3);
        assert!(
            texts(&project).iter().all(|text| text.contains("hand") && !text.contains("arm eye"))
        );
        assert_eq!(project.undo().as_deref(), Some("rename"));
        assert!(project.undo().is_none() && !project.is_dirty(), "it is one step");
        assert!(texts(&project).iter().all(|text| !text.contains("hand")));
        project.redo();
        project.save().unwrap();
        assert!(project.settle().is_some_and(|saved| saved.is_ok_and(|it| it.files.len() == 4)));
        let saved = fs::read_to_string(folder.join("parts/inner.xml")).unwrap();
        assert!(saved.contains("hand eye"));
        // The next change reaches them without a question.
        project.edit("again", |it| crate::system::rename(it, "hand", "fist")).unwrap();
        assert!(texts(&project).iter().all(|text| text.contains("fist")));
        // What is drawn and edited is still the file that was opened.
        assert!(project.document_with(Item::Mission).is_none());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_file_that_is_read_only_or_has_changed_is_left_with_the_reason() {
        let folder = folder("left");
        let mut project = Project::open(&folder.join("robot.xml"), Arc::default()).unwrap();
        let mut mode = fs::metadata(folder.join("one.xml")).unwrap().permissions();
        mode.set_readonly(true);
        fs::set_permissions(folder.join("one.xml"), mode).unwrap();
        let change = rename(&mut project);
        let elsewhere = project.find_elsewhere(change).unwrap();
        assert_eq!(elsewhere.files[0].obstacle.as_deref(), Some("it is read-only"));
        // Meanwhile another program changes one and removes another.
        let newer = mission("system=\"robot.xml\"", "").replace("<place", "<!-- new --><place");
        fs::write(folder.join("two.xml"), newer).unwrap();
        fs::remove_file(folder.join("parts/inner.xml")).unwrap();
        let result = project.change_elsewhere(&elsewhere);
        assert_eq!(result.changed, [folder.join("two.xml")]);
        let left: Vec<_> = result.left.iter().map(|(path, _)| path.clone()).collect();
        assert_eq!(left, [folder.join("parts/inner.xml"), folder.join("one.xml")]);
        let text = project.files().last().unwrap().text();
        assert!(text.contains("<!-- new -->") && text.contains("hand"));
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_a_mission_cannot_do_without_is_not_removed_there() {
        let folder = folder("remove");
        let needs = mission("system=\"robot.xml\"", "").replace(
            "<place",
            "<transition name=\"t\" from=\"p\" to=\"p\" on=\"arm.done\"/><place",
        );
        fs::write(folder.join("one.xml"), needs).unwrap();
        let mut project = Project::open(&folder.join("robot.xml"), Arc::default()).unwrap();
        let arm = crate::Item::component("arm");
        project.edit("remove", |documents| crate::system::remove(documents, [&arm])).unwrap();
        let elsewhere =
            project.find_elsewhere(ComponentChange::Remove(vec!["arm".into()])).unwrap();
        let obstacles: Vec<_> =
            elsewhere.files.iter().map(|file| file.obstacle.is_some()).collect();
        assert_eq!(obstacles, [true, false, false]);
        let result = project.change_elsewhere(&elsewhere);
        assert_eq!((result.changed.len(), result.left.len()), (2, 1));
        assert!(texts(&project).iter().all(|text| !text.contains("arm eye")));
        fs::remove_dir_all(folder).unwrap();
    }
}
