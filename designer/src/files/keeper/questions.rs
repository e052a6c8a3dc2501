//! What only the user can decide: whose change of a file counts, and what is to become of work that
//! a crash left.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use eframe::egui::{self, Align, Id, Layout, Modal, Ui};

use super::shown;
use crate::files::recovery::{Kept, Orphan};
use crate::project::Project;
use crate::text;

/// Points from left to right.
const WIDTH: f32 = 460.0;

/// A file was changed in the window and on the disk in the same place.
pub(super) struct Question {
    pub(super) file: usize,
    pub(super) path: PathBuf,
    pub(super) theirs: Arc<str>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decision {
    Mine,
    Theirs,
}

impl Question {
    pub(super) fn show(&self, ctx: &egui::Context) -> Option<Decision> {
        let modal = Modal::new(Id::unique("changed on the disk")).show(ctx, |ui| {
            ui.set_width(WIDTH);
            ui.heading(format!("{} was changed by another program", shown(&self.path)));
            ui.label("You changed it too, in the same place. Which version is to go on?");
            ui.weak(text::path(&self.path));
            ui.weak("Undo brings the other one back, as long as the window is open.");
            ui.add_space(6.0);
            buttons(ui, |ui| {
                let mine = ui.button("Keep mine").on_hover_text(
                    "The drawing stays as it is. Saving replaces what is on the disk.",
                );
                let theirs = ui
                    .button("Take the disk's")
                    .on_hover_text("The drawing becomes what is on the disk.");
                let mine = mine.clicked().then_some(Decision::Mine);
                mine.or(theirs.clicked().then_some(Decision::Theirs))
            })
        });
        modal.inner
    }

    /// Does what was decided. Either way the disk's version counts as the one known.
    pub(super) fn settle(&self, decision: Decision, project: &mut Project) {
        let Some(file) = project.files().get(self.file) else { return };
        let mine = Arc::clone(file.text());
        project.set_saved(self.file, Arc::clone(&self.theirs));
        let theirs = Arc::clone(&self.theirs);
        project.replace_text(self.file, "taking what is on the disk", theirs);
        if decision == Decision::Mine {
            project.replace_text(self.file, "keeping one's own version", mine);
        }
    }
}

/// What to do with one of the works offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Offer {
    Recover(usize),
    Discard(usize),
    Later,
}

/// Offers what dead designers left, if they left something.
pub(super) fn offer(ctx: &egui::Context, orphans: &[Orphan]) -> Option<Offer> {
    if orphans.is_empty() {
        return None;
    }
    let modal = Modal::new(Id::unique("unsaved work")).show(ctx, |ui| {
        ui.set_width(WIDTH);
        ui.heading("Unsaved work was found");
        ui.label("The designer ended without saving it. Nothing of it is in your files yet.");
        ui.separator();
        let mut offer = None;
        for (n, orphan) in orphans.iter().enumerate() {
            offer = offer.or(ui.push_id(n, |ui| one(ui, n, &orphan.kept)).inner);
        }
        ui.separator();
        let later = buttons(ui, |ui| {
            ui.button("Later").on_hover_text("It is offered again at the next start.").clicked()
        });
        offer.or(later.then_some(Offer::Later))
    });
    modal.inner
}

fn one(ui: &mut Ui, n: usize, kept: &Kept) -> Option<Offer> {
    let names = kept.files.iter().map(|file| match &file.path {
        Some(path) => text::path(Path::new(path)),
        None => "a new robot, not saved yet".to_owned(),
    });
    let names: Vec<_> = names.collect();
    ui.label(names.join("\n"));
    ui.horizontal(|ui| {
        ui.weak(ago(kept.at));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let recover = ui.button("Recover").clicked().then_some(Offer::Recover(n));
            recover.or(ui.button("Discard").clicked().then_some(Offer::Discard(n)))
        })
        .inner
    })
    .inner
}

fn buttons<T>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> T) -> T {
    ui.with_layout(Layout::right_to_left(Align::Min), add).inner
}

/// How long ago that is, as one says it.
fn ago(at: u64) -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    in_words(now.saturating_sub(at))
}

fn in_words(seconds: u64) -> String {
    let (count, unit) = match seconds {
        0..90 => return "a moment ago".to_owned(),
        90..5400 => (seconds.div_ceil(60), "minutes"),
        5400..172_800 => (seconds.div_ceil(3600), "hours"),
        _ => (seconds.div_ceil(86_400), "days"),
    };
    format!("{count} {unit} ago")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_said_as_one_says_them() {
        let said = [5, 600, 7200, 260_000].map(in_words);
        assert_eq!(said, ["a moment ago", "10 minutes ago", "2 hours ago", "4 days ago"]);
    }
}
