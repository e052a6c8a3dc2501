//! What only the user can decide: whose change of a file counts, and what is to become of work that
//! a crash left.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use armor_picture::theme::{self, ThemeColours};
use eframe::egui::{self, Align, Id, Key, Layout, Modal, Ui};

use super::shown;
use crate::disk::recovery::{Kept, Orphan};
use crate::project::Project;
use crate::text;

/// Points from left to right.
const WIDTH: f32 = 460.0;

/// Lines of each version that are shown.
const MAX_LINES: usize = 5;
/// Letters of a line that are shown.
const MAX_LETTERS: usize = 56;

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
    pub(super) fn show(&self, ctx: &egui::Context, project: &Project) -> Option<Decision> {
        let mine = project.files().get(self.file).map(|file| file.text().as_ref());
        let modal = Modal::new(Id::unique("changed on disk")).show(ctx, |ui| {
            ui.set_width(WIDTH);
            ui.heading(format!("{} was changed by another program", shown(&self.path)));
            ui.label("You changed the same place. Which version do you want to keep?");
            ui.weak(text::path(&self.path));
            compare(ui, &apart(mine.unwrap_or_default(), &self.theirs));
            ui.weak("Undo restores the other one while the window is open.");
            ui.add_space(theme::NEAR);
            buttons(ui, |ui| {
                let mine = ui.button("Keep mine").on_hover_text(
                    "The drawing stays as it is (Escape). Saving replaces the file on disk.",
                );
                let theirs = ui
                    .button("Use the version on disk")
                    .on_hover_text("The drawing is replaced by the file on disk.");
                // Undo restores the other version, so that nothing is lost by Escape.
                let keeps = mine.clicked() || ui.input(|input| input.key_pressed(Key::Escape));
                let mine = keeps.then_some(Decision::Mine);
                mine.or(theirs.clicked().then_some(Decision::Theirs))
            })
        });
        modal.inner
    }

    /// Carries out the decision. In both cases the version of the disk counts as known.
    pub(super) fn settle(&self, decision: Decision, project: &mut Project) {
        let Some(file) = project.files().get(self.file) else { return };
        let mine = Arc::clone(file.text());
        project.set_saved(self.file, Arc::clone(&self.theirs));
        let theirs = Arc::clone(&self.theirs);
        project.replace_text(self.file, "use the version on disk", theirs);
        if decision == Decision::Mine {
            project.replace_text(self.file, "keep own version", mine);
        }
    }
}

/// Where two texts differ: the first line that does, and the lines of each.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Apart<'a> {
    line: usize,
    mine: Vec<&'a str>,
    theirs: Vec<&'a str>,
}

fn apart<'a>(mine: &'a str, theirs: &'a str) -> Apart<'a> {
    let (mine, theirs): (Vec<_>, Vec<_>) = (mine.lines().collect(), theirs.lines().collect());
    let is_same = |(one, other): &(&&str, &&str)| one == other;
    let before = mine.iter().zip(&theirs).take_while(is_same).count();
    let (mine, theirs) = (&mine[before..], &theirs[before..]);
    let after = mine.iter().rev().zip(theirs.iter().rev()).take_while(is_same).count();
    Apart {
        line: before + 1,
        mine: mine[..mine.len() - after].to_vec(),
        theirs: theirs[..theirs.len() - after].to_vec(),
    }
}

/// Shows both, so that the user need not choose blindly.
fn compare(ui: &mut Ui, apart: &Apart<'_>) {
    for (whose, lines) in [("Yours", &apart.mine), ("The disk's", &apart.theirs)] {
        ui.label(format!("{whose}, from line {}:", apart.line));
        if lines.is_empty() {
            ui.weak("nothing");
        }
        for line in lines.iter().take(MAX_LINES) {
            let line = text::short(line.trim_end(), MAX_LETTERS);
            ui.monospace(text::paintable(ui.ctx(), &line).into_owned());
        }
        if lines.len() > MAX_LINES {
            ui.weak(format!("and {} more", lines.len() - MAX_LINES));
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

/// Offers the work of designers that have died, if there is any.
pub(super) fn offer(ctx: &egui::Context, orphans: &[Orphan]) -> Option<Offer> {
    if orphans.is_empty() {
        return None;
    }
    let modal = Modal::new(Id::unique("unsaved work")).show(ctx, |ui| {
        ui.set_width(WIDTH);
        ui.heading("Unsaved work was found");
        ui.label("The designer ended without saving it. Your files do not contain it yet.");
        ui.separator();
        let mut offer = None;
        for (n, orphan) in orphans.iter().enumerate() {
            offer = offer.or(ui.push_id(n, |ui| one(ui, n, &orphan.kept)).inner);
        }
        ui.separator();
        let later = buttons(ui, |ui| {
            ui.button("Later")
                .on_hover_text("It will be offered again at the next start (Escape).")
                .clicked()
        });
        let later = later || ui.input(|input| input.key_pressed(Key::Escape));
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
            let recover = ui.add(theme::main_button(ThemeColours::of(ui.visuals()), "Recover"));
            let recover = recover.clicked().then_some(Offer::Recover(n));
            recover.or(ui.button("Discard").clicked().then_some(Offer::Discard(n)))
        })
        .inner
    })
    .inner
}

fn buttons<T>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> T) -> T {
    ui.with_layout(Layout::right_to_left(Align::Min), add).inner
}

/// How long ago that is, for people.
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
    fn texts_are_told_apart_by_their_lines() {
        let check = |mine, theirs, line, of_mine: &[&str], of_theirs: &[&str]| {
            let (own, other) = (of_mine.to_vec(), of_theirs.to_vec());
            assert_eq!(apart(mine, theirs), Apart { line, mine: own, theirs: other });
        };
        check("a\nb\nc\n", "a\nx\ny\nc\n", 2, &["b"], &["x", "y"]);
        check("a\nc\n", "a\nb\nc\n", 2, &[], &["b"]);
        check("a\na\n", "a\n", 2, &["a"], &[]);
        check("", "a", 1, &[], &["a"]);
    }

    #[test]
    fn times_are_said_as_one_says_them() {
        let ages = [5, 600, 7200, 260_000].map(in_words);
        assert_eq!(ages, ["a moment ago", "10 minutes ago", "2 hours ago", "4 days ago"]);
    }
}
