//! Questions that the window asks before it continues.

use std::path::PathBuf;

use armor_picture::theme::{self, ThemeColours};
use eframe::egui::{self, Id, Key, Modal};

use crate::app::Designer;
use crate::help::pages::HelpPage;
use crate::panels::path::{Chosen, PathChoice};
use crate::project::elsewhere::Elsewhere;
use crate::project::{Project, SaveRefused};

/// A question.
pub(super) enum Dialog {
    /// Which file to open.
    Open(PathChoice),
    /// Which recording to play.
    OpenRecording(PathChoice),
    /// Where to save.
    SaveAs(PathChoice),
    /// Whether to overwrite a file.
    Overwrite(PathBuf),
    /// Where to save the drawing as a picture.
    Export(PathChoice),
    /// Whether to overwrite a picture.
    OverwritePicture(PathBuf),
    /// What to do with unsaved work.
    Unsaved(Then),
    /// Whether to stop what runs and leave.
    Running,
    /// Whether to stop what runs and play this recording.
    StopAndPlay(PathBuf),
    /// The version, and the programs in use.
    About,
    /// A page of the documentation.
    Page(HelpPage),
    /// Whether to change other files too, that name what was renamed or removed.
    Elsewhere(Elsewhere),
}

/// What follows after the open files are closed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Then {
    /// A robot from nothing.
    New,
    /// The question which file to open.
    Open,
    /// This file.
    OpenThis(PathBuf),
    /// A run of the open file.
    Run,
    /// The window closes.
    Quit,
}

impl Dialog {
    pub(super) fn open(project: &Project) -> Self {
        Self::Open(PathChoice::new(&project.folder(), "", "xml", false))
    }

    pub(super) fn open_recording(project: &Project) -> Self {
        Self::OpenRecording(PathChoice::new(&project.folder(), "", "mcap", false))
    }

    pub(super) fn save_as(project: &Project) -> Self {
        let name = if project.path().is_some() { project.name() } else { "robot.xml".into() };
        Self::SaveAs(PathChoice::new(&project.folder(), &name, "xml", true))
    }
}

impl Designer {
    pub(super) fn show_dialog(&mut self, ctx: &egui::Context) {
        let Some(dialog) = self.dialog.take() else { return };
        let modal = Modal::new(Id::unique("dialog"));
        let left = modal.show(ctx, |ui| {
            ui.set_width(460.0);
            match dialog {
                Dialog::Open(choice) => self.ask_open(ui, choice),
                Dialog::OpenRecording(choice) => self.ask_recording(ui, choice),
                Dialog::SaveAs(choice) => self.ask_save(ui, choice),
                Dialog::Overwrite(path) => self.ask_overwrite(ui, path),
                Dialog::Export(choice) => self.ask_export(ui, choice),
                Dialog::OverwritePicture(path) => self.ask_overwrite_picture(ui, path),
                Dialog::Unsaved(then) => self.ask_unsaved(ui, then),
                Dialog::Running => self.ask_running(ui),
                Dialog::StopAndPlay(recording) => self.ask_stop_and_play(ui, recording),
                Dialog::About => self.show_about(ui),
                Dialog::Page(page) => self.show_page(ui, page),
                Dialog::Elsewhere(elsewhere) => self.ask_elsewhere(ui, elsewhere),
            }
        });
        if left.backdrop_response.clicked() {
            self.dialog = None;
        }
    }

    fn ask_open(&mut self, ui: &mut egui::Ui, mut choice: PathChoice) {
        ui.heading("Open a robot or a mission");
        match choice.show(ui, "Open") {
            Chosen::Open => self.dialog = Some(Dialog::Open(choice)),
            Chosen::Left => {}
            Chosen::File(path) => self.open(&path),
        }
    }

    fn ask_recording(&mut self, ui: &mut egui::Ui, mut choice: PathChoice) {
        ui.heading("Open a recording");
        ui.weak("What `armor record` has written, or another MCAP file.");
        match choice.show(ui, "Open") {
            Chosen::Open => self.dialog = Some(Dialog::OpenRecording(choice)),
            Chosen::Left => {}
            Chosen::File(path) => self.ask_to_play(path),
        }
    }

    fn ask_save(&mut self, ui: &mut egui::Ui, mut choice: PathChoice) {
        ui.heading("Save as");
        match choice.show(ui, "Save") {
            Chosen::Open => self.dialog = Some(Dialog::SaveAs(choice)),
            Chosen::Left => self.after_saving = None,
            Chosen::File(path) if path.exists() && self.workspace.project.path() != Some(&path) => {
                self.dialog = Some(Dialog::Overwrite(path));
            }
            Chosen::File(path) => self.save_there(path),
        }
    }

    fn save_there(&mut self, path: PathBuf) {
        let folder = path.parent().map(ToOwned::to_owned);
        if std::mem::take(&mut self.saves_draft) {
            self.workspace.project.save_draft_as(path);
        } else {
            self.workspace.project.save_as(path);
        }
        if let (Some(kinds), Some(folder)) = (&self.kinds, folder) {
            kinds.set_folder(folder);
        }
    }

    fn ask_overwrite(&mut self, ui: &mut egui::Ui, path: PathBuf) {
        ui.heading("A file with this name exists");
        ui.label(crate::text::paintable(ui.ctx(), &path.to_string_lossy()));
        ui.horizontal(|ui| {
            if ui.button("Overwrite").clicked() {
                self.save_there(path);
            } else if ui.button("Choose another name").clicked() || pressed_escape(ui) {
                self.dialog = Some(Dialog::save_as(&self.workspace.project));
            } else {
                self.dialog = Some(Dialog::Overwrite(path));
            }
        });
    }

    fn ask_unsaved(&mut self, ui: &mut egui::Ui, then: Then) {
        ui.heading("Unsaved changes");
        let name = self.workspace.project.name();
        ui.label(format!("{} has unsaved changes.", crate::text::paintable(ui.ctx(), &name)));
        ui.horizontal(|ui| {
            let save = theme::main_button(ThemeColours::of(ui.visuals()), "Save");
            if ui.add(save).clicked() {
                self.after_saving = Some(then);
                self.workspace.order_command(crate::commands::Command::Save);
            } else if ui.button("Leave without saving").clicked() {
                let ctx = ui.ctx().clone();
                self.proceed(then, &ctx);
            } else if ui.button("Stay").clicked() || pressed_escape(ui) {
                self.after_saving = None;
            } else {
                self.dialog = Some(Dialog::Unsaved(then));
            }
        });
    }

    fn ask_running(&mut self, ui: &mut egui::Ui) {
        ui.heading("The robot is running");
        ui.label("It was started from this window and stops with it.");
        ui.horizontal(|ui| {
            if ui.button("Stop and leave").clicked() {
                self.close(&ui.ctx().clone());
            } else if !ui.button("Stay").clicked() && !pressed_escape(ui) {
                self.dialog = Some(Dialog::Running);
            }
        });
    }

    fn ask_stop_and_play(&mut self, ui: &mut egui::Ui, recording: PathBuf) {
        ui.heading("The robot is running");
        ui.label("It was started from this window, which shows one system at a time.");
        ui.horizontal(|ui| {
            let name = recording.file_name().unwrap_or_default().to_string_lossy();
            let name = crate::text::paintable(ui.ctx(), &name);
            if ui.button(format!("Stop it and play {name}")).clicked() {
                self.start_playback(&recording);
            } else if !ui.button("Let it run").clicked() && !pressed_escape(ui) {
                self.dialog = Some(Dialog::StopAndPlay(recording));
            }
        });
    }

    fn ask_elsewhere(&mut self, ui: &mut egui::Ui, elsewhere: Elsewhere) {
        let what = elsewhere.change.names();
        ui.heading(format!("Other files name {what}"));
        let why = match elsewhere.change.is_of_mission() {
            true => "They include this mission.",
            false => "They use the same system.",
        };
        ui.label(format!(
            "{why} Changed too, they are open and not saved yet; undo reverts all files in one \
             step."
        ));
        let folder = self.workspace.project.folder().canonicalize().unwrap_or_default();
        egui::ScrollArea::vertical().max_height(220.0).show(ui, |ui| {
            for file in &elsewhere.files {
                let path = file.path.strip_prefix(&folder).unwrap_or(&file.path);
                let mut text = format!("{}: named {} times", path.display(), file.mentions);
                if file.mentions == 1 {
                    text = format!("{}: named once", path.display());
                }
                if let Some(obstacle) = &file.obstacle {
                    text += &format!("; it cannot be changed: {obstacle}");
                }
                ui.label(crate::text::paintable(ui.ctx(), &text).into_owned());
            }
        });
        if elsewhere.is_cut {
            ui.weak("The folder has more entries than were searched.");
        }
        let may = elsewhere.files.iter().any(|file| file.obstacle.is_none());
        ui.horizontal(|ui| {
            let change = theme::main_button(ThemeColours::of(ui.visuals()), "Change them too");
            let change = ui.add_enabled(may, change);
            if change.clicked() {
                self.change_elsewhere(&elsewhere);
            } else if ui.button("Leave them").clicked() || pressed_escape(ui) {
                let text = match elsewhere.files.len() {
                    1 => format!("1 other file still names {what}"),
                    count => format!("{count} other files still name {what}"),
                };
                self.workspace.messages.warn(text);
            } else {
                self.dialog = Some(Dialog::Elsewhere(elsewhere));
            }
        });
    }

    fn show_about(&mut self, ui: &mut egui::Ui) {
        ui.heading("Armor designer");
        ui.label(concat!("Version ", env!("CARGO_PKG_VERSION")));
        let armor = crate::kinds::find_armor().map(|path| crate::text::path(&path));
        let armor = armor.unwrap_or_else(|| "not found: set ARMOR".to_owned());
        ui.label(format!("Program armor: {armor}"));
        ui.label("Licence: MIT or Apache 2.0");
        if !ui.button("Close").clicked() && !pressed_escape(ui) {
            self.dialog = Some(Dialog::About);
        }
    }

    fn change_elsewhere(&mut self, elsewhere: &Elsewhere) {
        let result = self.workspace.project.change_elsewhere(elsewhere);
        let name = |path: &PathBuf| {
            path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
        };
        if !result.changed.is_empty() {
            let names: Vec<_> = result.changed.iter().map(name).collect();
            let text = format!("Changed too, not saved yet: {}", names.join(", "));
            self.workspace.messages.report(text);
        }
        for (path, why) in &result.left {
            self.workspace.messages.warn(format!("{} is unchanged: {why}", name(path)));
        }
    }

    /// Asks before the window closes with unsaved work or a running robot.
    pub(super) fn watch_closing(&mut self, ctx: &egui::Context) {
        let asks = ctx.input(|i| i.viewport().close_requested());
        if !asks || self.is_leaving {
            return;
        }
        let is_taken = self.finish_writing();
        let is_dirty = self.workspace.project.is_dirty();
        if is_dirty || !is_taken {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
        }
        if is_dirty {
            self.dialog = Some(Dialog::Unsaved(Then::Quit));
        } else if self.runs_robot() {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.dialog = Some(Dialog::Running);
        }
    }

    /// Continues what was waiting for the files to be saved.
    pub(super) fn continue_after_saving(&mut self) {
        if let Some(then) = self.after_saving.take() {
            let ctx = self.ctx.clone();
            self.proceed(then, &ctx);
        }
    }

    /// Shows why the files were not saved, and the place of the first error.
    pub(super) fn not_saved(&mut self, refused: &SaveRefused) {
        self.workspace.settings.problems = true;
        let project = &self.workspace.project;
        let (is_draft, is_dirty) = (project.is_draft(), project.is_dirty());
        let mut text = refused.to_string();
        if matches!(self.after_saving, Some(Then::Run)) && (is_draft || !is_dirty) {
            let reasons = text.strip_prefix("Not saved: ").unwrap_or(&text);
            let what = if is_draft { "draft" } else { "file" };
            text = format!("Not run, since this {what} has errors: {reasons}");
        }
        if matches!(refused, SaveRefused::Wrong(_)) && !is_draft && is_dirty {
            text += ". File, Save as draft keeps it";
        }
        self.workspace.messages.warn(text);
        self.after_saving = None;
        if let SaveRefused::Wrong(errors) = refused
            && let Some(at) = errors.iter().find_map(|finding| finding.at.as_ref())
        {
            self.workspace.shown = self.workspace.project.item_at(at);
        }
    }
}

fn pressed_escape(ui: &egui::Ui) -> bool {
    ui.input(|i| i.key_pressed(Key::Escape))
}
