//! Saving: refused, with the reasons, while the files have errors; otherwise each file is written
//! whole or not at all. Files with errors can be saved as drafts, which are checked but never run.

use std::path::PathBuf;
use std::sync::Arc;

use armor_files::SaveError;
use armor_robotfile::{Code, Document, Finding, Severity};

use crate::project::files::OpenFile;
use crate::project::{Project, Refused};

/// Why the files were not saved.
#[derive(Debug, thiserror::Error)]
pub enum SaveRefused {
    /// They have errors.
    #[error("Not saved: {}", reasons(.0))]
    Wrong(Vec<Finding>),
    /// The file has no path yet.
    #[error("The file has no name yet: choose where to save it")]
    Nowhere,
    /// Another program changed a file, and its version has not been reloaded or merged yet.
    #[error(
        "Not saved: another program has just changed {}. It is being reloaded: save again \
         afterwards", .0.display()
    )]
    Changed(PathBuf),
    /// A file cannot be marked as a draft, or its mark not be removed.
    #[error("Not saved: {0}")]
    Unmarked(Refused),
    /// The disk refuses it.
    #[error(transparent)]
    Disk(#[from] SaveError),
}

fn reasons(errors: &[Finding]) -> String {
    let first = errors.first().map(|finding| finding.message.as_str()).unwrap_or_default();
    match errors.len() {
        0 | 1 => first.to_owned(),
        2 => format!("{first}, and 1 more problem"),
        n => format!("{first}, and {} more problems", n - 1),
    }
}

/// The attribute of the outermost element of a draft.
const DRAFT: &str = "draft";

fn is_draft(document: &Document) -> bool {
    let mark = document.tree().root().attribute(DRAFT);
    mark.is_some_and(|mark| mark.value == "true")
}

/// What was saved.
#[derive(Debug, PartialEq, Eq)]
pub struct Saved {
    /// The files that were written.
    pub files: Vec<PathBuf>,
}

/// A save that waits until the files have been checked.
pub(super) struct Pending {
    /// The path of the new file, for *save as*.
    to: Option<PathBuf>,
    /// Files with errors are saved, too.
    as_draft: bool,
}

impl Project {
    /// Requests that the files are saved as soon as they have been checked; [`Project::poll`]
    /// returns the result. Edits made until then are saved too.
    ///
    /// # Errors
    /// If the file has no path yet. Known errors are returned first, since the file could not be
    /// saved under any path.
    pub fn save(&mut self) -> Result<(), SaveRefused> {
        if self.path().is_none() {
            let is_known = self.checked.revision == self.revision;
            let errors = if is_known { self.errors() } else { Vec::new() };
            let nowhere = errors.is_empty();
            return Err(if nowhere { SaveRefused::Nowhere } else { SaveRefused::Wrong(errors) });
        }
        self.saving = Some(Pending { to: None, as_draft: false });
        Ok(())
    }

    /// The same under another name, which the file has from then on.
    pub fn save_as(&mut self, path: PathBuf) {
        self.saving = Some(Pending { to: Some(path), as_draft: false });
    }

    /// Saves the files although they have errors: each that has unsaved changes is marked as a
    /// draft, which `armor run` refuses; if none has, each that has errors. Without errors this is
    /// [`Project::save`].
    ///
    /// # Errors
    /// If the file has no path yet, or is no XML and therefore cannot be marked.
    pub fn save_draft(&mut self) -> Result<(), SaveRefused> {
        if self.path().is_none() {
            return Err(SaveRefused::Nowhere);
        }
        if self.is_broken() {
            return Err(SaveRefused::Wrong(self.errors()));
        }
        self.saving = Some(Pending { to: None, as_draft: true });
        Ok(())
    }

    /// The same under a name.
    pub fn save_draft_as(&mut self, path: PathBuf) {
        self.saving = Some(Pending { to: Some(path), as_draft: true });
    }

    /// Returns whether a file is marked as a draft.
    pub fn is_draft(&self) -> bool {
        self.files().iter().any(|file| file.document().is_some_and(is_draft))
    }

    /// Marks the files that are to be written as drafts, or removes the marks of all files.
    fn mark_drafts(&mut self, as_draft: bool, is_elsewhere: bool) -> Result<(), Refused> {
        let mut dirty: Vec<_> = self.files().iter().map(OpenFile::is_dirty).collect();
        dirty[0] |= is_elsewhere;
        if as_draft && !dirty.contains(&true) {
            // They were opened with their errors.
            let errors = self.errors();
            let paths = || errors.iter().filter_map(|error| Some(error.at.as_ref()?.source.path()));
            let has_errors = |file: &OpenFile| paths().any(|path| file.path() == Some(path));
            dirty = self.files().iter().map(has_errors).collect();
            let is_elsewhere_wrong = !dirty.contains(&true);
            dirty[0] |= is_elsewhere_wrong;
        }
        let what = if as_draft { "mark as draft" } else { "complete the draft" };
        self.edit(what, |documents| {
            for (document, is_dirty) in documents.all().zip(dirty) {
                let value = as_draft.then_some("true");
                if is_draft(document) != as_draft && (is_dirty || !as_draft) {
                    document.set_attribute_at(&[], DRAFT, value)?;
                }
            }
            Ok(())
        })
    }

    /// Returns whether a save waits for the files to be checked.
    pub fn is_saving(&self) -> bool {
        self.saving.is_some()
    }

    pub(super) fn finish_saving(&mut self) -> Option<Result<Saved, SaveRefused>> {
        // An edit after the request moves `revision` on: the save then waits for the check of that
        // revision, so that no unchecked text is written.
        let pending = self
            .saving
            .take_if(|_| self.checked.revision == self.revision && self.checked.is_complete)?;
        let errors = self.errors();
        let has_errors = !errors.is_empty();
        if has_errors && !pending.as_draft {
            return Some(Err(SaveRefused::Wrong(errors)));
        }
        if has_errors != self.is_draft() {
            let revision = self.revision;
            if let Err(refused) = self.mark_drafts(has_errors, pending.to.is_some()) {
                return Some(Err(SaveRefused::Unmarked(refused)));
            }
            // With a mark there is an error more, and without it none: nothing else has changed.
            if self.revision != revision && !has_errors {
                self.saving = Some(pending);
                return None;
            }
        }
        Some(self.write(pending.to))
    }

    /// Returns whether the files are known to have errors.
    pub fn has_errors(&self) -> bool {
        self.checked.revision == self.revision && !self.errors().is_empty()
    }

    fn errors(&self) -> Vec<Finding> {
        let findings = self.checked.findings.iter();
        // The mark of a draft is no reason of its own.
        let errors = findings.filter(|finding| finding.severity() == Severity::Error);
        errors.filter(|finding| finding.code != Code::Draft).cloned().collect()
    }

    fn write(&mut self, to: Option<PathBuf>) -> Result<Saved, SaveRefused> {
        // The watch looks only once a second: compare with the disk directly before writing, so
        // that a change made since its last look is not overwritten.
        if let Some(path) = self.changed_meanwhile(to.is_some()) {
            return Err(SaveRefused::Changed(path));
        }
        let is_elsewhere = to.is_some();
        if let Some(path) = to {
            armor_files::save_atomically(&path, self.files[0].text().as_bytes())?;
            let text = Arc::clone(self.files[0].text());
            self.files[0].set_path(path);
            self.files[0].set_saved(text);
        }
        let mut saved = Saved { files: Vec::new() };
        for (number, file) in self.files.iter_mut().enumerate() {
            let Some(path) = file.path().map(ToOwned::to_owned) else { continue };
            if file.is_dirty() {
                armor_files::save_atomically(&path, file.text().as_bytes())?;
                file.set_saved(Arc::clone(file.text()));
                saved.files.push(path);
            } else if number == 0 {
                saved.files.push(path);
            }
        }
        if is_elsewhere {
            // Its relative paths are relative to another folder now, so it is checked again.
            self.changed();
        }
        Ok(saved)
    }

    /// Returns a file that would be overwritten and whose version on the disk is not the one last
    /// read, reloaded or saved. The first file is not overwritten when it is saved `elsewhere`.
    fn changed_meanwhile(&self, elsewhere: bool) -> Option<PathBuf> {
        let overwritten = self.files.iter().skip(usize::from(elsewhere));
        let mut paths = overwritten.filter(|file| file.is_dirty()).filter_map(|file| {
            let path = file.path()?;
            // A file that is no text was reported, with the warning that saving replaces it; a
            // deleted file is created again.
            let disk = String::from_utf8(std::fs::read(path).ok()?).ok()?;
            (disk != **file.saved() && disk != **file.text()).then(|| path.to_path_buf())
        });
        paths.next()
    }
}
