//! Synchronizes the open project with the disk: unsaved work is backed up; a file that changed on
//! the disk is reloaded, merged, or shown as a conflict; work that a crash left is offered.

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
use crate::messages::Messages;
use crate::pane::Draft;
use crate::project::Project;
use questions::Question;

/// What connects a project with the disk.
#[derive(Default)]
pub struct Keeper {
    recovery: Option<Recovery>,
    /// The last seen revisions of the files and of the field that is being edited.
    seen: (u64, u64),
    /// Counts their changes: the revision of the unsaved work.
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
    /// The contents on the disk of files that count as never saved, since they were deleted there
    /// or are no text.
    odd: BTreeMap<PathBuf, OnDisk>,
    /// Trouble that has been reported.
    reported: BTreeSet<String>,
}

/// What the user requests of the window.
pub enum KeeperRequest {
    /// To open this work as it was when its designer died.
    Recover(Kept),
}

impl Keeper {
    /// Begins, with its own files in `folder`; without one nothing is kept.
    pub fn start(folder: Option<&Path>, ctx: &egui::Context, messages: &mut Messages) -> Self {
        let Some(folder) = folder else {
            return Self { watch: start_watch(ctx, messages), ..Self::default() };
        };
        let kept = folder.join("recovery");
        let recovery = Recovery::begin(&kept);
        if let Err(error) = &recovery {
            messages.warn(format!("Unsaved work cannot be backed up: {}: {error}", kept.display()));
        }
        let mut keeper = Self {
            orphans: orphans(&kept),
            recovery: recovery.ok(),
            watch: start_watch(ctx, messages),
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
    pub fn remember_file(&mut self, path: &Path) {
        let added = self.recent.as_ref().map_or(Ok(()), |recent| recent.add(path));
        if let Err(error) = added {
            tracing::warn!(%error, "the list of recent files cannot be written");
        }
        self.read_recent();
    }

    /// Forgets a file that cannot be opened any longer.
    pub fn forget_file(&mut self, path: &Path) {
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
    /// `has_written` states whether it is the running system that has written a file, as it was
    /// asked to from here.
    pub fn synchronize(
        &mut self,
        ctx: &egui::Context,
        project: &mut Project,
        draft: Option<Draft>,
        messages: &mut Messages,
        has_written: impl Fn() -> bool,
    ) {
        self.back_up(ctx, project, draft, messages);
        self.update_watch(project);
        let news = self.watch.as_ref().map(Watch::news).unwrap_or_default();
        let is_own = !news.is_empty() && has_written();
        for news in news {
            self.handle_news(news, project, messages, is_own);
        }
    }

    /// Shows what the user has to decide. Returns what they request of the window.
    pub fn show_questions(
        &mut self,
        ctx: &egui::Context,
        project: &mut Project,
    ) -> Option<KeeperRequest> {
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
        matches!(decision, questions::Offer::Recover(_)).then_some(KeeperRequest::Recover(kept))
    }

    /// Returns whether a question to the user is open.
    pub fn is_asking(&self) -> bool {
        self.question.is_some() || !self.orphans.is_empty()
    }

    /// Removes the backup, since the work was saved or discarded.
    pub fn let_go(&mut self) {
        if let Some(recovery) = &mut self.recovery {
            recovery.remove_backup();
        }
    }

    fn back_up(
        &mut self,
        ctx: &egui::Context,
        project: &Project,
        draft: Option<Draft>,
        messages: &mut Messages,
    ) {
        let Some(recovery) = &mut self.recovery else { return };
        if !project.is_dirty() && draft.is_none() {
            recovery.remove_backup();
            return;
        }
        let now = (project.revision(), draft.as_ref().map_or(0, |draft| draft.revision));
        if self.seen != now {
            self.seen = now;
            self.work += 1;
        }
        let unsaved = || unsaved(project, draft);
        if let Some(wait) = recovery.back_up(Instant::now(), self.work, unsaved) {
            ctx.request_repaint_after(wait);
        }
        if let Some(trouble) = recovery.trouble()
            && self.reported.insert(trouble.clone())
        {
            messages.warn(trouble);
        }
    }

    /// Passes the known contents of the files to the watch, when they changed.
    fn update_watch(&mut self, project: &Project) {
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
        watch.follow_files(of_open.chain(others.map(|path| (path.clone(), read(path)))));
    }

    /// Handles a file that changed on the disk; `is_own` if the change was requested from here.
    fn handle_news(
        &mut self,
        news: News,
        project: &mut Project,
        messages: &mut Messages,
        is_own: bool,
    ) {
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
            // Against an empty saved text every text is unsaved, so that saving creates the file
            // again.
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
                // Before the replacement, so that the reloaded file counts as saved. The
                // replacement is a step of the history: undo restores the version before.
                project.set_saved(n, Arc::clone(&theirs));
                project.replace_text(n, "use the version on disk", theirs);
                // A parameter that was set from here is reported in its own panel.
                if !is_own {
                    let text = format!("{name} was changed by another program and reloaded");
                    messages.report(text);
                }
            }
            (Answer::Merged(both), Ok(theirs)) => {
                // Their version is the base of the next merge, also if this one is undone.
                project.set_saved(n, theirs);
                project.replace_text(n, "merge with the version on disk", both.into());
                let who = if is_own { "the running system" } else { "another program" };
                messages.report(format!(
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

fn start_watch(ctx: &egui::Context, messages: &mut Messages) -> Option<Watch> {
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

/// Returns the unsaved work, with the field that is being edited; none if nothing is unsaved.
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

/// Restores backed-up work in a project that was opened again from the same files, as one step of
/// the history for each file. A version that the disk received meanwhile is merged. In a conflict
/// the backed-up work has priority, since undo brings back the version of the disk.
pub fn put_back(kept: &Kept, project: &mut Project) {
    for file in &kept.files {
        let Some(text) = &file.text else { continue };
        let path = file.path.as_ref().map(PathBuf::from);
        let is_it = |open: &crate::project::OpenFile| {
            let here =
                open.path().map(|path| std::path::absolute(path).unwrap_or(path.to_path_buf()));
            here == path
        };
        let opened = project.files().iter().position(is_it);
        // It was changed along with the others.
        let opened = opened.or_else(|| project.open_companion(path.as_ref()?).ok());
        let Some(n) = opened else { continue };
        let disk = Arc::clone(project.files()[n].saved());
        let merged = super::merge::merge(&file.saved, text, &disk);
        let text = merged.unwrap_or_else(|| text.clone());
        project.replace_text(n, "restore unsaved work", text.into());
    }
}
