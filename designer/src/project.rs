//! The open files: the one given, and the system file that its mission names. An edit is one step
//! of the history over both; what is read from them is always of their current texts.

mod added_fault;
mod checker;
mod documents;
pub mod elsewhere;
mod files;
mod history;
mod saving;
mod unread;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_robotfile::{Configuration, Findings, Location, Reading};

use crate::item::Item;
use crate::kinds::Kinds;
use checker::{Checker, Wanted};
pub use documents::{Documents, Refused};
pub use files::OpenFile;
use files::{Disk, NEW_FILE};
use history::{History, Step};
pub use saving::{SaveRefused, Saved};

/// Why a file was not opened.
#[derive(Debug, thiserror::Error)]
#[error("{path} cannot be opened: {reason}", path = path.display())]
pub struct OpenError {
    /// The file.
    pub path: PathBuf,
    /// Why not.
    pub reason: std::io::Error,
}

/// The findings of one revision of the files.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// Which one.
    pub revision: u64,
    /// All findings, sorted by file and line.
    pub findings: Arc<Findings>,
    /// Whether the mission has been proven too, as far as that was possible.
    pub is_complete: bool,
}

/// The open files, their history, and their status.
pub struct Project {
    files: Vec<OpenFile>,
    disk: Disk,
    history: History,
    revision: u64,
    reading: Reading,
    kinds: Arc<Kinds>,
    checker: Checker,
    checked: Checked,
    saving: Option<saving::Pending>,
}

impl Project {
    /// An empty robot without a file.
    pub fn new(kinds: Arc<Kinds>) -> Self {
        Self::over(vec![OpenFile::untitled(NEW_FILE)], kinds, Checker::start())
    }

    /// Opens a file, and the system file that its mission names. A file that is no XML is opened
    /// too: its findings are shown, and nothing can be edited.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn open(path: &Path, kinds: Arc<Kinds>) -> Result<Self, OpenError> {
        let failed = |reason| OpenError { path: path.to_path_buf(), reason };
        let mut files = vec![OpenFile::read(path).map_err(failed)?];
        // A system file that cannot be read is a finding of the file that names it.
        let named = files[0].named_system();
        files.extend(named.and_then(|path| OpenFile::read(&path).ok()));
        Ok(Self::over(files, kinds, Checker::start()))
    }

    /// Files with these texts, the one that is given first, to be drawn only: nothing is checked.
    pub fn still(files: &[(PathBuf, String)], kinds: Arc<Kinds>) -> Self {
        let mut files: Vec<_> =
            files.iter().map(|(path, text)| OpenFile::given(path, text)).collect();
        if files.is_empty() {
            files.push(OpenFile::untitled(NEW_FILE));
        }
        Self::over(files, kinds, Checker::idle())
    }

    fn over(files: Vec<OpenFile>, kinds: Arc<Kinds>, checker: Checker) -> Self {
        let mut disk = Disk::default();
        let reading = disk.read(&files);
        let mut project = Self {
            files,
            disk,
            history: History::default(),
            revision: 0,
            reading,
            kinds,
            checker,
            checked: Checked::default(),
            saving: None,
        };
        project.changed();
        project
    }

    /// The files, the one that was given first.
    pub fn files(&self) -> &[OpenFile] {
        &self.files
    }

    /// The path of the file that was given; none until it is saved.
    pub fn path(&self) -> Option<&Path> {
        self.files[0].path()
    }

    /// The folder that the file's relative paths start from.
    pub fn folder(&self) -> PathBuf {
        let of_file = self.path().and_then(Path::parent).map(Path::to_path_buf);
        let given = of_file.filter(|folder| !folder.as_os_str().is_empty());
        given.or_else(|| std::env::current_dir().ok()).unwrap_or_default()
    }

    /// The name of the project in the window's title.
    pub fn name(&self) -> String {
        let file = self.path().and_then(Path::file_name);
        file.map_or_else(|| "untitled".to_owned(), |name| name.to_string_lossy().into_owned())
    }

    /// Counts every change of the files or of the kinds.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns whether a file has unsaved changes.
    pub fn is_dirty(&self) -> bool {
        self.files.iter().any(OpenFile::is_dirty)
    }

    /// The parsed files, as far as they could be understood, before the check.
    pub fn reading(&self) -> &Reading {
        &self.reading
    }

    /// The typed model, if there is a system.
    pub fn configuration(&self) -> Option<&Configuration> {
        self.reading.configuration.as_ref()
    }

    /// Whether some file is no XML, so that it can be neither drawn as it is nor edited.
    pub fn is_broken(&self) -> bool {
        self.files.iter().any(|file| file.document().is_none())
    }

    /// The available kinds of components.
    pub fn kinds(&self) -> &Arc<Kinds> {
        &self.kinds
    }

    /// Takes the kinds as they are now.
    pub fn set_kinds(&mut self, kinds: Arc<Kinds>) {
        self.kinds = kinds;
        self.changed();
    }

    /// The last findings; those of an older revision while the current one is being checked.
    pub fn checked(&self) -> &Checked {
        &self.checked
    }

    /// Returns whether the current revision is still being checked.
    pub fn is_checking(&self) -> bool {
        self.checked.revision != self.revision || !self.checked.is_complete
    }

    /// Calls `wake` at every result of the check.
    pub fn on_found(&mut self, wake: impl Fn() + Send + Sync + 'static) {
        self.checker.on_found(Arc::new(wake));
    }

    /// Takes the new results of the check, and finishes a save that waited for them.
    pub fn poll(&mut self) -> Option<Result<Saved, SaveRefused>> {
        for checked in self.checker.take_results() {
            if checked.revision == self.revision {
                self.checked = checked;
            }
        }
        self.finish_saving()
    }

    /// Waits until the check of the current revision is complete.
    pub fn settle(&mut self) -> Option<Result<Saved, SaveRefused>> {
        let mut saved = self.poll();
        while self.is_checking() {
            self.checker.wait_for_result();
            saved = saved.or(self.poll());
        }
        saved
    }

    /// Makes one edit, which is one step of the history: all of it happens, or nothing.
    ///
    /// # Errors
    /// If the edit is refused, or the files cannot be edited.
    pub fn edit(
        &mut self,
        what: impl Into<String>,
        edit: impl FnOnce(&mut Documents) -> Result<(), Refused>,
    ) -> Result<(), Refused> {
        let mut documents = Documents::of(&self.files)?;
        edit(&mut documents)?;
        let before = self.texts();
        documents.give_back(&mut self.files);
        let after = self.texts();
        if before.iter().zip(&after).all(|(a, b)| Arc::ptr_eq(a, b) || a == b) {
            return Ok(());
        }
        self.history.push(Step { what: what.into(), before, after });
        self.changed();
        Ok(())
    }

    /// The texts of the files as an edit would make them; nothing if it is refused.
    pub fn texts_with(
        &self,
        edit: impl FnOnce(&mut Documents) -> Result<(), Refused>,
    ) -> Option<Vec<Arc<str>>> {
        let mut documents = Documents::of(&self.files).ok()?;
        edit(&mut documents).ok()?;
        Some(documents.texts())
    }

    /// Tries an edit without making it. Returns why it is refused, or which value or name of the
    /// files it would make malformed.
    pub fn try_edit(
        &mut self,
        edit: impl FnOnce(&mut Documents) -> Result<(), Refused>,
    ) -> Result<(), String> {
        let mut documents = Documents::of(&self.files).map_err(|refused| refused.to_string())?;
        edit(&mut documents).map_err(|refused| refused.to_string())?;
        let paths = self.files.iter().map(|file| file.shown_path().to_path_buf());
        let bytes = documents.texts().into_iter().map(Arc::<[u8]>::from);
        let reading = self.disk.read_snapshot(&paths.zip(bytes).collect::<Vec<_>>());
        added_fault::find_added_fault(&self.reading, &reading).map_or(Ok(()), Err)
    }

    /// Undoes the last edit; returns what it did.
    pub fn undo(&mut self) -> Option<String> {
        let step = self.history.undo()?.clone();
        self.set_texts(&step.before);
        Some(step.what)
    }

    /// Makes the edit again that was undone last; returns what it does.
    pub fn redo(&mut self) -> Option<String> {
        let step = self.history.redo()?.clone();
        self.set_texts(&step.after);
        Some(step.what)
    }

    /// What undo would revert.
    pub fn undoable(&self) -> Option<&str> {
        self.history.undoable().map(|step| step.what.as_str())
    }

    /// What redo would apply.
    pub fn redoable(&self) -> Option<&str> {
        self.history.redoable().map(|step| step.what.as_str())
    }

    /// Replaces the text of a file by one from outside, as one step of the history.
    pub fn replace_text(&mut self, file: usize, what: impl Into<String>, text: Arc<str>) {
        let before = self.texts();
        let Some(open) = self.files.get_mut(file) else { return };
        open.set_text(text);
        let after = self.texts();
        self.history.push(Step { what: what.into(), before, after });
        self.changed();
    }

    /// Reads the files again that the open ones name, since one of them changed on the disk.
    pub fn read_again(&mut self) {
        self.changed();
    }

    /// Records that the file has this text on the disk, so that this text counts as saved.
    pub fn set_saved(&mut self, file: usize, text: Arc<str>) {
        if let Some(open) = self.files.get_mut(file) {
            open.set_saved(text);
        }
    }

    /// Returns the item at a location of the current files.
    pub fn item_at(&self, at: &Location) -> Option<Item> {
        let file = self.files.iter().find(|file| file.shown_path() == at.source.path())?;
        Item::at(file.document()?.tree(), at.span.start())
    }

    /// Where the item of a drawing is, if the file gives it.
    pub fn position(&self, item: armor_robotfile::Item<'_>) -> Option<armor_robotfile::Position> {
        self.own_files().find_map(|file| file.document()?.position(item))
    }

    /// The file that holds the system, or the mission.
    pub fn document_with(
        &self,
        owner: armor_robotfile::Item<'_>,
    ) -> Option<&armor_robotfile::Document> {
        let documents = self.own_files().filter_map(OpenFile::document);
        documents.into_iter().find(|document| document.find(owner).is_some())
    }

    /// The files that are drawn and edited.
    fn own_files(&self) -> impl Iterator<Item = &OpenFile> {
        self.files.iter().filter(|file| !file.is_companion)
    }

    fn texts(&self) -> Vec<Arc<str>> {
        self.files.iter().map(|file| Arc::clone(file.text())).collect()
    }

    fn set_texts(&mut self, texts: &[Arc<str>]) {
        for (file, text) in self.files.iter_mut().zip(texts) {
            file.set_text(Arc::clone(text));
        }
        self.changed();
    }

    /// Parses the files again and requests their check.
    fn changed(&mut self) {
        self.revision += 1;
        self.reading = self.disk.read(&self.files);
        self.checker.request_check(Wanted {
            revision: self.revision,
            files: self.files.iter().map(OpenFile::snapshot).collect(),
            kinds: Arc::clone(&self.kinds),
        });
    }
}

#[cfg(test)]
mod tests;
