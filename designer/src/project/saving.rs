//! Saving: refused, with the reasons, while the files have errors; otherwise each file is written
//! whole or not at all.

use std::path::PathBuf;
use std::sync::Arc;

use armor_files::SaveError;
use armor_robotfile::{Finding, Severity};

use crate::project::Project;

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
        self.saving = Some(Pending { to: None });
        Ok(())
    }

    /// The same under another name, which the file has from then on.
    pub fn save_as(&mut self, path: PathBuf) {
        self.saving = Some(Pending { to: Some(path) });
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
        Some(self.write(pending.to))
    }

    fn errors(&self) -> Vec<Finding> {
        let findings = self.checked.findings.iter();
        findings.filter(|finding| finding.severity() == Severity::Error).cloned().collect()
    }

    fn write(&mut self, to: Option<PathBuf>) -> Result<Saved, SaveRefused> {
        let errors = self.errors();
        if !errors.is_empty() {
            return Err(SaveRefused::Wrong(errors));
        }
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
