//! Which part of the window runs a command, and whether it can be run.

use std::collections::BTreeSet;

use eframe::egui;

use crate::app::Designer;
use crate::app::dialogs::{Dialog, Then};
use crate::app::lists::{AllCommands, FindList};
use crate::commands::Command;
use crate::item::Item;
use crate::live::is_recording;
use crate::project::{Project, SaveRefused};
use crate::view::View;

impl Designer {
    /// Whether a command can be run now.
    pub(super) fn may(&self, command: Command) -> bool {
        match command {
            Command::Undo => self.workspace.project.undoable().is_some(),
            Command::Redo => self.workspace.project.redoable().is_some(),
            Command::ShowSystem => self.has(View::System),
            Command::ShowMission => self.has(View::Mission),
            Command::ShowMap => self.has(View::Map),
            Command::ShowLive => self.has(View::Live),
            Command::NextProblem => !self.workspace.project.checked().findings.is_empty(),
            Command::Run | Command::Stop | Command::Detach | Command::Pause | Command::Resume => {
                self.workspace.live.may(command)
            }
            _ => {
                let pane = self.panes.iter().find(|(view, _)| *view == self.view);
                pane.and_then(|(_, pane)| pane.can_run(command, &self.workspace))
                    .unwrap_or(is_own(command))
            }
        }
    }

    fn has(&self, view: View) -> bool {
        self.panes.iter().any(|(known, _)| *known == view)
    }

    /// Applies the field that is being edited in any view. Returns whether it was accepted.
    pub(super) fn finish_writing(&mut self) -> bool {
        let workspace = &mut self.workspace;
        self.panes.iter_mut().fold(true, |all, (_, pane)| pane.finish_field(workspace) && all)
    }

    /// Runs the commands ordered while the frame was drawn. The field that is being edited is
    /// applied first; if it is refused, a command that saves or closes the files is not run.
    pub(super) fn run_orders(&mut self, ctx: &egui::Context) {
        let commands = std::mem::take(&mut self.workspace.commands);
        let is_taken = commands.is_empty() || self.finish_writing();
        for command in commands {
            if self.may(command) && (is_taken || !concerns_file(command)) {
                self.run(command, ctx);
            }
        }
        if let Some(elsewhere) = self.workspace.elsewhere.take() {
            self.dialog = Some(Dialog::Elsewhere(elsewhere));
            ctx.request_repaint();
        }
        if let Some(path) = self.workspace.opened.take() {
            self.ask_to_open(path, ctx);
        }
        if let Some(item) = self.workspace.shown.take() {
            if self.has(item.view()) {
                self.view = item.view();
            }
            let (pane, workspace) = self.pane();
            pane.show_item(item, workspace);
            ctx.request_repaint();
        }
    }

    /// Runs one command.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        ctx.request_repaint();
        match command {
            Command::New => self.leave_project(Then::New, ctx),
            Command::Open => self.leave_project(Then::Open, ctx),
            Command::OpenRecording => {
                self.dialog = Some(Dialog::open_recording(&self.workspace.project));
            }
            Command::Quit => self.leave_project(Then::Quit, ctx),
            Command::Save => match self.workspace.project.save() {
                Ok(()) => {}
                Err(SaveRefused::Nowhere) => {
                    self.dialog = Some(Dialog::save_as(&self.workspace.project));
                    self.saves_draft = false;
                }
                Err(refused) => self.not_saved(&refused),
            },
            Command::SaveDraft => match self.workspace.project.save_draft() {
                Ok(()) => {}
                Err(SaveRefused::Nowhere) => {
                    self.dialog = Some(Dialog::save_as(&self.workspace.project));
                    self.saves_draft = true;
                }
                Err(refused) => self.not_saved(&refused),
            },
            Command::SaveAs => {
                self.dialog = Some(Dialog::save_as(&self.workspace.project));
                self.saves_draft = false;
            }
            Command::Undo | Command::Redo => self.through_history(command),
            Command::Find => self.find = Some(FindList::default()),
            Command::ShowSystem => self.turn_to(View::System),
            Command::ShowMission => self.turn_to(View::Mission),
            Command::ShowMap => self.turn_to(View::Map),
            Command::ShowLive => self.turn_to(View::Live),
            Command::TogglePalette => {
                let is_open = !self.is_palette_open();
                self.workspace.set_palette(is_open);
            }
            Command::ToggleProperties => toggle_setting(&mut self.workspace.settings.properties),
            Command::ToggleProblems => toggle_setting(&mut self.workspace.settings.problems),
            Command::ToggleMinimap => toggle_setting(&mut self.workspace.settings.minimap),
            Command::ToggleSnap => toggle_setting(&mut self.workspace.settings.snap),
            Command::ToggleTheme => self.change_theme(ctx),
            Command::NextProblem => self.next_problem(),
            Command::Export => {
                self.dialog = Some(Dialog::export(&self.workspace.project, self.view));
            }
            Command::AllCommands => self.commands = Some(AllCommands::default()),
            Command::Help => self.show_help(),
            Command::Shortcuts => self.shortcuts = !self.shortcuts,
            Command::FirstPage => self.first_page = true,
            Command::About => self.dialog = Some(Dialog::About),
            Command::Run => self.ask_to_run(),
            Command::Stop | Command::Detach | Command::Pause | Command::Resume => {
                self.workspace.live.run_command(command);
            }
            _ => {
                let (pane, workspace) = self.pane();
                pane.run_command(command, ctx, workspace);
            }
        }
    }

    fn turn_to(&mut self, view: View) {
        self.view = view;
        self.first_page = false;
    }

    /// Undoes or redoes an edit, and selects what it added.
    fn through_history(&mut self, command: Command) {
        let before = self.drawn();
        let project = &mut self.workspace.project;
        let (done, word) = match command {
            Command::Undo => (project.undo(), "Undone"),
            _ => (project.redo(), "Redone"),
        };
        let Some(what) = done else { return };
        self.workspace.messages.report(format!("{word}: {what}"));
        let came: BTreeSet<_> = self.drawn().difference(&before).copied().collect();
        if !came.is_empty() {
            self.pane().0.select_items(came);
        }
    }

    /// What the view draws.
    fn drawn(&mut self) -> BTreeSet<Item> {
        let (pane, workspace) = self.pane();
        pane.drawn_items(workspace)
    }

    fn change_theme(&mut self, ctx: &egui::Context) {
        let other = match ctx.theme() {
            egui::Theme::Dark => egui::ThemePreference::Light,
            egui::Theme::Light => egui::ThemePreference::Dark,
        };
        self.workspace.settings.theme = other;
        ctx.set_theme(other);
    }

    fn next_problem(&mut self) {
        let findings = &self.workspace.project.checked().findings;
        let places: Vec<_> = findings.iter().filter_map(|finding| finding.at.clone()).collect();
        if places.is_empty() {
            return;
        }
        self.problem = (self.problem + 1) % places.len();
        self.workspace.settings.problems = true;
        self.shows_notes = true;
        self.workspace.shown = self.workspace.project.item_at(&places[self.problem]);
    }

    /// Closes the open files, after the user has agreed to lose unsaved work.
    pub(super) fn leave_project(&mut self, then: Then, ctx: &egui::Context) {
        if !self.finish_writing() {
            return;
        }
        if self.workspace.project.is_dirty() {
            self.dialog = Some(Dialog::Unsaved(then));
        } else {
            self.proceed(then, ctx);
        }
    }

    /// Leaves the open files.
    pub(super) fn proceed(&mut self, then: Then, ctx: &egui::Context) {
        match then {
            Then::New => {
                let kinds = std::sync::Arc::clone(self.workspace.project.kinds());
                self.set_project(Project::new(kinds));
            }
            Then::Open => self.dialog = Some(Dialog::open(&self.workspace.project)),
            Then::OpenThis(path) => self.open(&path),
            Then::Run => self.start_run(),
            Then::Quit if self.runs_robot() => {
                self.dialog = Some(Dialog::Running);
            }
            Then::Quit => self.close(ctx),
        }
    }

    /// Closes the window without another question.
    pub(super) fn close(&mut self, ctx: &egui::Context) {
        self.is_leaving = true;
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }

    /// Opens a file, after the user has agreed to close the open ones.
    pub fn ask_to_open(&mut self, path: std::path::PathBuf, ctx: &egui::Context) {
        if is_recording(&path) {
            // It is shown next to the open files, which stay.
            return self.ask_to_play(path);
        }
        self.leave_project(Then::OpenThis(path), ctx);
    }

    /// Opens a file; the open ones are closed without a question.
    pub fn open(&mut self, path: &std::path::Path) {
        if is_recording(path) {
            return self.ask_to_play(path.into());
        }
        let kinds = std::sync::Arc::clone(self.workspace.project.kinds());
        match Project::open(path, kinds) {
            Ok(project) => {
                self.set_project(project);
                self.keeper.remember_file(path);
            }
            Err(error) => {
                self.keeper.forget_file(path);
                self.workspace.messages.warn(error.to_string());
            }
        }
    }
}

/// Returns whether a command uses the current text of the files: saves, runs or closes them.
fn concerns_file(command: Command) -> bool {
    use Command as C;
    matches!(command, C::New | C::Open | C::Save | C::SaveAs | C::SaveDraft | C::Quit | C::Run)
}

/// Whether a command is the window's own and can always be run.
fn is_own(command: Command) -> bool {
    use Command as C;
    matches!(
        command,
        C::New
            | C::Open
            | C::OpenRecording
            | C::Save
            | C::SaveAs
            | C::SaveDraft
            | C::Quit
            | C::Find
            | C::TogglePalette
            | C::ToggleProperties
            | C::ToggleProblems
            | C::ToggleMinimap
            | C::ToggleSnap
            | C::ToggleTheme
            | C::Export
            | C::AllCommands
            | C::Help
            | C::Shortcuts
            | C::FirstPage
            | C::About
    )
}

fn toggle_setting(setting: &mut bool) {
    *setting = !*setting;
}
