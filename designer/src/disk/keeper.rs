//! Keeps the open project and the disk in step: unsaved work is kept apart, a file that changed on
//! the disk is taken, merged or asked about, and what a crash left is offered.

mod questions;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use eframe::egui;

use super::merge::{Answer, answer};
use super::recent::Recent;
use super::recovery::{Kept, KeptFile, Orphan, Recovery, orphans};
use super::watch::{News, OnDisk, Watch};
use crate::desk::{Draft, Messages};
use crate::project::Project;
use questions::Question;

/// What connects a project with the disk.
#[derive(Default)]
pub struct Keeper {
    recovery: Option<Recovery>,
    /// The revisions of the files and of what is being written, as they were seen last.
    seen: (u64, u64),
    /// Counts how many times they were others.
    work: u64,
    watch: Option<Watch>,
    recent: Option<Recent>,
    /// The list as it was read last.
    recent_paths: Vec<PathBuf>,
    question: Option<Question>,
    orphans: Vec<Orphan>,
    /// The open files that the watch follows, as they were saved.
    followed: Vec<(PathBuf, Arc<str>)>,
    /// The revision whose other files are followed.
    followed_revision: Option<u64>,
    /// What the disk holds of files that count as not saved because it is gone or no text.
    odd: BTreeMap<PathBuf, OnDisk>,
    /// Trouble that has been told.
    told: BTreeSet<String>,
}

/// What the user wants of the window.
pub enum Wish {
    /// This work is to be opened as it was when its designer died.
    Recover(Kept),
}

impl Keeper {
    /// Begins, with its own files in `folder`; without one nothing is kept.
    pub fn start(folder: Option<&Path>, ctx: &egui::Context, messages: &mut Messages) -> Self {
        let Some(folder) = folder else {
            return Self { watch: watch(ctx, messages), ..Self::default() };
        };
        let kept = folder.join("recovery");
        let recovery = Recovery::begin(&kept);
        if let Err(error) = &recovery {
            messages.warn(format!("Unsaved work cannot be backed up: {}: {error}", kept.display()));
        }
        let mut keeper = Self {
            orphans: orphans(&kept),
            recovery: recovery.ok(),
            watch: watch(ctx, messages),
            recent: Some(Recent::in_folder(folder)),
            ..Self::default()
        };
        keeper.read_recent();
        keeper
    }

    /// The files that were open last, newest first.
    pub fn recent(&self) -> &[PathBuf] {
        &self.recent_paths
    }

    /// Remembers that a file was opened or saved.
    pub fn remember(&mut self, path: &Path) {
        let added = self.recent.as_ref().map_or(Ok(()), |recent| recent.add(path));
        if let Err(error) = added {
            tracing::warn!(%error, "the list of recent files cannot be written");
        }
        self.read_recent();
    }

    /// Forgets a file that cannot be opened any longer.
    pub fn forget(&mut self, path: &Path) {
        let forgotten = self.recent.as_ref().map_or(Ok(()), |recent| recent.forget(path));
        if let Err(error) = forgotten {
            tracing::warn!(%error, "the list of recent files cannot be written");
        }
        self.read_recent();
    }

    fn read_recent(&mut self) {
        self.recent_paths = self.recent.as_ref().map(Recent::paths).unwrap_or_default();
    }

    /// Does what is due; to be called with each frame. `draft` is what is being written;
    /// `has_written` states whether it is the running system that has written a file, as it was asked
    /// to from here.
    pub fn tick(
        &mut self,
        ctx: &egui::Context,
        project: &mut Project,
        draft: Option<Draft>,
        messages: &mut Messages,
        has_written: impl Fn() -> bool,
    ) {
        self.keep(ctx, project, draft, messages);
        self.follow(project);
        let news = self.watch.as_ref().map(Watch::news).unwrap_or_default();
        let is_own = !news.is_empty() && has_written();
        for news in news {
            self.take(news, project, messages, is_own);
        }
    }

    /// Shows what is to be decided by the user, and states what they want of the window.
    pub fn ask(&mut self, ctx: &egui::Context, project: &mut Project) -> Option<Wish> {
        if let Some(question) = &self.question {
            if let Some(decision) = question.show(ctx, project) {
                question.settle(decision, project);
                self.question = None;
            }
            return None;
        }
        let decision = questions::offer(ctx, &self.orphans)?;
        let orphan = match decision {
            questions::Offer::Later => {
                self.orphans.clear();
                return None;
            }
            questions::Offer::Recover(n) | questions::Offer::Discard(n) => self.orphans.remove(n),
        };
        let kept = orphan.kept.clone();
        orphan.discard();
        matches!(decision, questions::Offer::Recover(_)).then_some(Wish::Recover(kept))
    }

    /// Whether something is being asked.
    pub fn is_asking(&self) -> bool {
        self.question.is_some() || !self.orphans.is_empty()
    }

    /// The work was saved or is not wanted: nothing of it is kept any longer.
    pub fn let_go(&mut self) {
        if let Some(recovery) = &mut self.recovery {
            recovery.forget();
        }
    }

    fn keep(
        &mut self,
        ctx: &egui::Context,
        project: &Project,
        draft: Option<Draft>,
        messages: &mut Messages,
    ) {
        let Some(recovery) = &mut self.recovery else { return };
        if !project.is_dirty() && draft.is_none() {
            recovery.forget();
            return;
        }
        let now = (project.revision(), draft.as_ref().map_or(0, |draft| draft.revision));
        if self.seen != now {
            self.seen = now;
            self.work += 1;
        }
        let unsaved = || unsaved(project, draft);
        if let Some(wait) = recovery.keep(Instant::now(), self.work, unsaved) {
            ctx.request_repaint_after(wait);
        }
        if let Some(trouble) = recovery.trouble()
            && self.told.insert(trouble.clone())
        {
            messages.warn(trouble);
        }
    }

    /// Tells the watch the status of the disk, when that changed.
    fn follow(&mut self, project: &Project) {
        let Some(watch) = &self.watch else { return };
        let open = || {
            project.files().iter().filter_map(|file| Some((file.path()?, Arc::clone(file.saved()))))
        };
        let known = |file: &crate::project::OpenFile| {
            let path = file.path()?.to_path_buf();
            let odd = self.odd.get(&path).filter(|_| file.saved().is_empty());
            let known = odd.cloned().unwrap_or_else(|| Some(file.on_disk()));
            Some((path, known))
        };
        let is_same = open().count() == self.followed.len()
            && open()
                .zip(&self.followed)
                .all(|((path, saved), (known, text))| path == known && Arc::ptr_eq(&saved, text));
        if is_same && self.followed_revision == Some(project.revision()) {
            return;
        }
        self.followed_revision = Some(project.revision());
        self.followed = open().map(|(path, saved)| (path.to_path_buf(), saved)).collect();
        let of_open = project.files().iter().filter_map(known);
        // Files that are named but not open: sub-missions, or a system file that is missing.
        let others = project.reading().files.iter();
        let others = others.filter(|path| open().all(|(known, _)| known != path.as_path()));
        let read = |path: &PathBuf| armor_robotfile::read_bytes(path).ok().map(Into::into);
        watch.follow(of_open.chain(others.map(|path| (path.clone(), read(path)))));
    }

    /// Returns to a file that changed on the disk; `is_own` if that was wished here.
    fn take(&mut self, news: News, project: &mut Project, messages: &mut Messages, is_own: bool) {
        self.followed_revision = None;
        let is_it = |file: &crate::project::OpenFile| file.path() == Some(&news.path);
        let Some(n) = project.files().iter().position(is_it) else {
            // A sub-mission, or a system file that was missing.
            project.read_again();
            return;
        };
        let name = shown(&news.path);
        self.odd.insert(news.path.clone(), news.now.clone());
        let Some(bytes) = news.now else {
            project.set_saved(n, "".into());
            messages.warn(format!("{name} was deleted on disk; saving creates it again"));
            return;
        };
        let file = &project.files()[n];
        let (base, ours) = (Arc::clone(file.saved()), Arc::clone(file.text()));
        let theirs = std::str::from_utf8(&bytes).map(Arc::<str>::from);
        match (answer(&news.path, &base, &ours, &bytes), theirs) {
            (Answer::Same, Ok(theirs)) => project.set_saved(n, theirs),
            (Answer::Take, Ok(theirs)) => {
                project.set_saved(n, Arc::clone(&theirs));
                project.replace_text(n, "use the version on disk", theirs);
                // Who set a parameter is told of it where that was done.
                if !is_own {
                    let text = format!("{name} was changed by another program and reloaded");
                    messages.tell(text);
                }
            }
            (Answer::Merged(both), Ok(theirs)) => {
                project.set_saved(n, theirs);
                project.replace_text(n, "merge with the version on disk", both.into());
                let who = if is_own { "the running system" } else { "another program" };
                messages.tell(format!(
                    "{name} was changed by {who}; both changes are merged, not saved yet"
                ));
            }
            (Answer::Ask, Ok(theirs)) => {
                self.question = Some(Question { file: n, path: news.path, theirs });
            }
            (_, Err(_)) => {
                project.set_saved(n, "".into());
                messages.warn(format!(
                    "{name} was changed by another program and is not UTF-8 text any more; \
                     saving replaces it"
                ));
            }
        }
    }
}

fn watch(ctx: &egui::Context, messages: &mut Messages) -> Option<Watch> {
    let ctx = ctx.clone();
    match Watch::begin(move || ctx.request_repaint()) {
        Ok(watch) => Some(watch),
        Err(error) => {
            messages
                .warn(format!("Changes made to files by other programs are not detected: {error}"));
            None
        }
    }
}

fn shown(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// What is not saved, with what is being written; none if that changes nothing.
fn unsaved(project: &Project, draft: Option<Draft>) -> Option<Kept> {
    let drafted = draft.and_then(|draft| project.texts_with(draft.change));
    let own = || project.files().iter().map(|file| Arc::clone(file.text())).collect();
    let texts: Vec<Arc<str>> = drafted.unwrap_or_else(own);
    let file = |(file, text): (&crate::project::OpenFile, Arc<str>)| {
        let path = file.path().map(|path| std::path::absolute(path).unwrap_or(path.to_path_buf()));
        KeptFile {
            path: path.map(PathBuf::into_os_string),
            saved: file.saved().to_string(),
            text: (text != *file.saved()).then(|| text.to_string()),
        }
    };
    let files: Vec<_> = project.files().iter().zip(texts).map(file).collect();
    files.iter().any(|file| file.text.is_some()).then(|| Kept::now(files))
}

/// Puts kept work over a project that was opened again from the same files, as one change for each
/// file: what the disk states by now is merged where that can be, and else gives way, since it can be
/// had again by undo.
pub fn put_back(kept: &Kept, project: &mut Project) {
    for file in &kept.files {
        let Some(text) = &file.text else { continue };
        let path = file.path.as_ref().map(PathBuf::from);
        let is_it = |open: &crate::project::OpenFile| {
            let here =
                open.path().map(|path| std::path::absolute(path).unwrap_or(path.to_path_buf()));
            here == path
        };
        let Some(n) = project.files().iter().position(is_it) else { continue };
        let disk = Arc::clone(project.files()[n].saved());
        let merged = super::merge::merge(&file.saved, text, &disk);
        let text = merged.unwrap_or_else(|| text.clone());
        project.replace_text(n, "restore unsaved work", text.into());
    }
}
