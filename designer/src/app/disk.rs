//! What the window does with the disk: it backs up and restores unsaved work, opens dropped files,
//! shows the welcome page, and saves pictures of the drawing.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::{self, Align2, Area, CentralPanel, FontId, Id, Order};

use crate::app::Designer;
use crate::app::dialogs::Dialog;
use crate::disk::examples::{self, Example};
use crate::disk::recovery::Kept;
use crate::disk::{KeeperRequest, own, put_back};
use crate::help::welcome::{self, Chosen};
use crate::panels::path::{self, PathChoice};
use crate::project::Project;
use crate::view::View;
use crate::workspace::Workspace;

impl Dialog {
    pub(super) fn export(project: &Project, view: View) -> Self {
        let name = project.name();
        let stem = Path::new(&name).file_stem().unwrap_or_default().to_string_lossy();
        let view = match view {
            View::System => "system",
            View::Mission => "mission",
            View::Map => "map",
            View::Live => "live",
        };
        Self::Export(PathChoice::new(&project.folder(), &format!("{stem}-{view}.svg"), "svg", true))
    }
}

impl Designer {
    /// Backs up unsaved work, handles changes on the disk, and opens dropped files.
    pub(super) fn synchronize_disk(&mut self, ctx: &egui::Context) {
        let draft = self.panes.iter().find_map(|(_, pane)| pane.field_draft());
        let Workspace { project, messages, live, .. } = &mut self.workspace;
        self.keeper.synchronize(ctx, project, draft, messages, || live.has_written());
        self.take_dropped(ctx);
    }

    /// Shows the questions about files that only the user can answer.
    pub(super) fn ask_of_files(&mut self, ctx: &egui::Context) {
        match self.keeper.show_questions(ctx, &mut self.workspace.project) {
            Some(KeeperRequest::Recover(kept)) => self.recover_work(&kept),
            None => {}
        }
    }

    /// Opens the files of unsaved work and restores the work in them. Nothing is written.
    fn recover_work(&mut self, kept: &Kept) {
        let kinds = Arc::clone(self.workspace.project.kinds());
        let path = kept.files.first().and_then(|file| file.path.as_ref()).map(PathBuf::from);
        let opened = path.as_ref().map(|path| Project::open(path, Arc::clone(&kinds)));
        let project = match opened {
            Some(Ok(project)) => project,
            Some(Err(error)) => {
                self.workspace.messages.warn(format!("{error}; its text is open as a new robot"));
                Project::new(kinds)
            }
            None => Project::new(kinds),
        };
        self.set_project(project);
        put_back(kept, &mut self.workspace.project);
        self.workspace.messages.report("Unsaved work restored; save to write it to the file");
    }

    fn take_dropped(&mut self, ctx: &egui::Context) {
        let (dropped, hovers) = ctx.input(|input| {
            let dropped: Vec<_> =
                input.raw.dropped_files.iter().map(|file| file.path().to_path_buf()).collect();
            (dropped, !input.raw.hovered_files.is_empty())
        });
        if let Some(path) = dropped.first() {
            if dropped.len() > 1 {
                self.workspace
                    .messages
                    .warn("Only one file can be opened at a time; opened the first");
            }
            self.ask_to_open(path.clone(), ctx);
        } else if hovers {
            hint_to_drop(ctx);
        }
    }

    /// Shows the page of the examples, and shows where.
    pub(super) fn show_first_page(&mut self, ui: &mut egui::Ui) -> egui::Rect {
        let recent = self.keeper.recent();
        let has_drawing = self.has_drawing();
        let shown = CentralPanel::default().show(ui, |ui| welcome::show(ui, recent, has_drawing));
        let chosen = shown.inner;
        let ctx = ui.ctx().clone();
        match chosen {
            Some(Chosen::Run(crate::Command::New)) if !self.workspace.project.is_dirty() => {
                self.proceed(super::dialogs::Then::New, &ctx);
            }
            Some(Chosen::Run(command)) => self.workspace.order_command(command),
            Some(Chosen::Back) => self.first_page = false,
            Some(Chosen::Open(path)) => self.ask_to_open(path, &ctx),
            Some(Chosen::Example(example)) => self.open_example(example, &ctx),
            None => {}
        }
        shown.response.rect
    }

    /// Whether there is something to go back to from the first page.
    pub(super) fn has_drawing(&self) -> bool {
        let project = &self.workspace.project;
        let drawn = project.configuration();
        let is_drawn =
            drawn.is_none_or(|it| !it.system.components.is_empty() || it.mission.is_some());
        is_drawn || project.is_dirty() || project.path().is_some()
    }

    fn open_example(&mut self, example: &Example, ctx: &egui::Context) {
        let Some(data) = own::data_folder() else {
            self.workspace.messages.warn("Cannot copy the example: HOME is not set");
            return;
        };
        let folder = examples::folder(&data);
        match examples::unpack(&folder) {
            Ok(()) => self.ask_to_open(folder.join(example.file), ctx),
            Err(error) => {
                let folder = folder.display();
                self.workspace.messages.warn(format!("{folder} cannot be written: {error}"));
            }
        }
    }

    /// The files that were open before, as a menu.
    pub(super) fn recent_menu(&mut self, ui: &mut egui::Ui) {
        let recent = self.keeper.recent().to_vec();
        ui.add_enabled_ui(!recent.is_empty(), |ui| {
            ui.menu_button("Recent files", |ui| {
                for path in recent {
                    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
                    let name = crate::text::paintable(ui.ctx(), &name).into_owned();
                    let button = ui.button(name).on_hover_text(crate::text::path(&path));
                    if button.clicked() {
                        let ctx = ui.ctx().clone();
                        self.ask_to_open(path, &ctx);
                        ui.close();
                    }
                }
            });
        });
    }

    pub(super) fn ask_export(&mut self, ui: &mut egui::Ui, mut choice: PathChoice) {
        ui.heading("Export drawing");
        ui.weak(".svg saves lines and text, .png saves pixels.");
        match choice.show(ui, "Export") {
            path::Chosen::Open => self.dialog = Some(Dialog::Export(choice)),
            path::Chosen::Left => {}
            path::Chosen::File(path) if path.exists() => {
                self.dialog = Some(Dialog::OverwritePicture(path));
            }
            path::Chosen::File(path) => self.export_drawing(&path),
        }
    }

    pub(super) fn ask_overwrite_picture(&mut self, ui: &mut egui::Ui, path: PathBuf) {
        ui.heading("A file with this name exists");
        ui.label(crate::text::paintable(ui.ctx(), &path.to_string_lossy()));
        ui.horizontal(|ui| {
            if ui.button("Overwrite").clicked() {
                self.export_drawing(&path);
            } else if ui.button("Choose another name").clicked()
                || ui.input(|input| input.key_pressed(egui::Key::Escape))
            {
                self.dialog = Some(Dialog::export(&self.workspace.project, self.view));
            } else {
                self.dialog = Some(Dialog::OverwritePicture(path));
            }
        });
    }

    /// Saves the drawing that is shown as a picture of twice its size in points.
    fn export_drawing(&mut self, path: &Path) {
        const PIXELS_PER_POINT: f32 = 2.0;
        let is_dark = self.ctx.theme() == egui::Theme::Dark;
        let (pane, workspace) = self.pane();
        let saved = pane.export(workspace, path, is_dark, PIXELS_PER_POINT);
        match saved {
            Ok(()) => {
                let path = crate::text::path(path);
                self.workspace.messages.report(format!("Drawing saved as {path}"));
            }
            Err(error) => self.workspace.messages.warn(format!("Not exported: {error}")),
        }
    }
}

/// Shows what dropping a file would do.
fn hint_to_drop(ctx: &egui::Context) {
    let area = Area::new(Id::unique("drop")).order(Order::Foreground);
    area.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).interactable(false).show(ctx, |ui| {
        let window = ctx.content_rect();
        let colours = armor_picture::theme::ThemeColours::of(ui.visuals());
        ui.painter().rect_filled(window, 0.0, colours.background.gamma_multiply(0.8));
        let font = FontId::proportional(26.0);
        let text = "Drop to open the file";
        ui.painter().text(window.center(), Align2::CENTER_CENTER, text, font, colours.accent);
    });
}
