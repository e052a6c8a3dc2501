//! Who runs a command, and whether it can be run.

use std::collections::BTreeSet;

use eframe::egui;

use crate::app::Designer;
use crate::app::dialogs::{Dialog, Then};
use crate::app::lists::{AllCommands, FindList};
use crate::commands::Command;
use crate::item::Item;
use crate::project::{Project, SaveRefused};
use crate::view::View;

impl Designer {
    /// Whether a command can be run now.
    pub(super) fn may(&self, command: Command) -> bool {
        match command {
            Command::Undo => self.desk.project.undoable().is_some(),
            Command::Redo => self.desk.project.redoable().is_some(),
            Command::ShowSystem => self.has(View::System),
            Command::ShowMission => self.has(View::Mission),
            Command::ShowLive => self.has(View::Live),
            Command::NextProblem => !self.desk.project.checked().findings.is_empty(),
            Command::Run | Command::Stop | Command::Detach | Command::Pause | Command::Resume => {
                self.desk.live.may(command)
            }
            _ => {
                let pane = self.panes.iter().find(|(view, _)| *view == self.view);
                pane.and_then(|(_, pane)| pane.may(command, &self.desk)).unwrap_or(is_own(command))
            }
        }
    }

    fn has(&self, view: View) -> bool {
        self.panes.iter().any(|(known, _)| *known == view)
    }

    /// Ends what is being written into a field of any view. Returns whether it was taken.
    pub(super) fn finish_writing(&mut self) -> bool {
        let desk = &mut self.desk;
        self.panes.iter_mut().fold(true, |all, (_, pane)| pane.finish(desk) && all)
    }

    /// Runs what was ordered while the frame was drawn. What was being written belongs to what a
    /// command is about; where it is refused, nothing is saved or left without it.
    pub(super) fn run_orders(&mut self, ctx: &egui::Context) {
        let commands = std::mem::take(&mut self.desk.commands);
        let is_taken = commands.is_empty() || self.finish_writing();
        for command in commands {
            if self.may(command) && (is_taken || !concerns_file(command)) {
                self.run(command, ctx);
            }
        }
        if let Some(item) = self.desk.shown.take() {
            if self.has(item.view()) {
                self.view = item.view();
            }
            let (pane, desk) = self.pane();
            pane.show_item(item, desk);
            ctx.request_repaint();
        }
    }

    /// Runs one command.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        ctx.request_repaint();
        match command {
            Command::New => self.leave(Then::New, ctx),
            Command::Open => self.leave(Then::Open, ctx),
            Command::Quit => self.leave(Then::Quit, ctx),
            Command::Save => match self.desk.project.save() {
                Ok(()) => {}
                Err(SaveRefused::Nowhere) => {
                    self.dialog = Some(Dialog::save_as(&self.desk.project));
                }
                Err(refused) => self.not_saved(&refused),
            },
            Command::SaveAs => self.dialog = Some(Dialog::save_as(&self.desk.project)),
            Command::Undo | Command::Redo => self.through_history(command),
            Command::Find => self.find = Some(FindList::default()),
            Command::ShowSystem => self.turn_to(View::System),
            Command::ShowMission => self.turn_to(View::Mission),
            Command::ShowLive => self.turn_to(View::Live),
            Command::TogglePalette => toggle(&mut self.desk.settings.palette),
            Command::ToggleProperties => toggle(&mut self.desk.settings.properties),
            Command::ToggleProblems => toggle(&mut self.desk.settings.problems),
            Command::ToggleMinimap => toggle(&mut self.desk.settings.minimap),
            Command::ToggleSnap => toggle(&mut self.desk.settings.snap),
            Command::ToggleTheme => self.change_theme(ctx),
            Command::NextProblem => self.next_problem(),
            Command::Export => self.dialog = Some(Dialog::export(&self.desk.project, self.view)),
            Command::AllCommands => self.commands = Some(AllCommands::default()),
            Command::Shortcuts => self.shortcuts = !self.shortcuts,
            Command::FirstPage => self.first_page = true,
            Command::Run => self.ask_to_run(),
            Command::Stop | Command::Detach | Command::Pause | Command::Resume => {
                self.desk.live.run_command(command);
            }
            _ => {
                let (pane, desk) = self.pane();
                pane.run(command, ctx, desk);
            }
        }
    }

    fn turn_to(&mut self, view: View) {
        self.view = view;
        self.first_page = false;
    }

    /// Takes an edit back or makes it again, and selects what came with that.
    fn through_history(&mut self, command: Command) {
        let before = self.drawn();
        let project = &mut self.desk.project;
        let (done, word) = match command {
            Command::Undo => (project.undo(), "Undone"),
            _ => (project.redo(), "Redone"),
        };
        let Some(what) = done else { return };
        self.desk.messages.tell(format!("{word}: {what}"));
        let came: BTreeSet<_> = self.drawn().difference(&before).copied().collect();
        if !came.is_empty() {
            self.pane().0.select(came);
        }
    }

    /// What the view draws, but for the wires.
    fn drawn(&mut self) -> BTreeSet<Item> {
        let (pane, desk) = self.pane();
        let drawing = pane.drawing(desk);
        let nodes = drawing.nodes.iter().map(|node| node.item);
        nodes.chain(drawing.decorations.iter().map(|note| note.item)).collect()
    }

    fn change_theme(&mut self, ctx: &egui::Context) {
        let other = match ctx.theme() {
            egui::Theme::Dark => egui::ThemePreference::Light,
            egui::Theme::Light => egui::ThemePreference::Dark,
        };
        self.desk.settings.theme = other;
        ctx.set_theme(other);
    }

    fn next_problem(&mut self) {
        let findings = &self.desk.project.checked().findings;
        let places: Vec<_> = findings.iter().filter_map(|finding| finding.at.clone()).collect();
        if places.is_empty() {
            return;
        }
        self.problem = (self.problem + 1) % places.len();
        self.desk.settings.problems = true;
        self.desk.shown = self.desk.project.item_at(&places[self.problem]);
    }

    /// Does what means leaving the open files, once the user agrees to lose what is not saved.
    pub(super) fn leave(&mut self, then: Then, ctx: &egui::Context) {
        if !self.finish_writing() {
            return;
        }
        if self.desk.project.is_dirty() {
            self.dialog = Some(Dialog::Unsaved(then));
        } else {
            self.go(then, ctx);
        }
    }

    /// Leaves the open files.
    pub(super) fn go(&mut self, then: Then, ctx: &egui::Context) {
        match then {
            Then::New => {
                let kinds = std::sync::Arc::clone(self.desk.project.kinds());
                self.set_project(Project::new(kinds));
            }
            Then::Open => self.dialog = Some(Dialog::open(&self.desk.project)),
            Then::OpenThis(path) => self.open(&path),
            Then::Run => self.start_run(),
            Then::Quit if self.desk.live.run().is_some() => self.dialog = Some(Dialog::Running),
            Then::Quit => self.close(ctx),
        }
    }

    /// Closes the window without another question.
    pub(super) fn close(&mut self, ctx: &egui::Context) {
        self.is_leaving = true;
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }

    /// Opens a file once the user agrees to leave what is open.
    pub fn ask_to_open(&mut self, path: std::path::PathBuf, ctx: &egui::Context) {
        self.leave(Then::OpenThis(path), ctx);
    }

    /// Opens a file; what is open is left without being asked for.
    pub fn open(&mut self, path: &std::path::Path) {
        let kinds = std::sync::Arc::clone(self.desk.project.kinds());
        match Project::open(path, kinds) {
            Ok(project) => {
                self.set_project(project);
                self.keeper.remember(path);
            }
            Err(error) => {
                self.keeper.forget(path);
                self.desk.messages.warn(error.to_string());
            }
        }
    }
}

/// Whether a command takes the files as they are now: saves, runs or leaves them.
fn concerns_file(command: Command) -> bool {
    use Command as C;
    matches!(command, C::New | C::Open | C::Save | C::SaveAs | C::Quit | C::Run)
}

/// Whether a command is the window's own and can always be run.
fn is_own(command: Command) -> bool {
    use Command as C;
    matches!(
        command,
        C::New
            | C::Open
            | C::Save
            | C::SaveAs
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
            | C::Shortcuts
            | C::FirstPage
    )
}

fn toggle(setting: &mut bool) {
    *setting = !*setting;
}
