//! The window: menus, panels, the view in the middle, and which of them runs a command.

mod commands;
mod dialogs;
mod disk;
mod lists;
mod menu_keys;
mod menus;
mod pages;
mod panels;
mod run;
mod running;
pub mod snapshot;

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;

use crate::canvas::Diagram;
use crate::disk::Keeper;
use crate::item::Item;
use crate::kinds::{Kinds, KindsWatch};
use crate::live::{LiveView, Session, is_recording};
use crate::map_view::MapView;
use crate::messages::Messages;
use crate::mission::MissionView;
use crate::pane::Pane;
use crate::project::Project;
use crate::settings::Settings;
use crate::system::SystemView;
use crate::view::View;
use crate::workspace::Workspace;
use armor_picture::theme::{self, Pointing};
use dialogs::Dialog;
use lists::{AllCommands, FindList};

/// How a designer starts.
#[derive(Debug, Default)]
pub struct Start {
    /// The file to open.
    pub file: Option<PathBuf>,
    /// Component directories in addition to the file's own.
    pub components: Vec<PathBuf>,
    /// The view at the start.
    pub view: View,
    /// Whether to watch a running system: the one whose registry listens there, or the only one.
    pub attach: Option<Option<String>>,
    /// The kinds, if they are known and `armor` is not to be asked for them.
    pub kinds: Option<Kinds>,
    /// The designer's own folder, where recent files and unsaved work are kept; none keeps nothing.
    pub own_folder: Option<PathBuf>,
    /// Whether the welcome page is shown at the start.
    pub first_page: bool,
}

/// The designer's window.
pub struct Designer {
    workspace: Workspace,
    view: View,
    panes: Vec<(View, Box<dyn Pane>)>,
    dialog: Option<Dialog>,
    find: Option<FindList>,
    /// The list of all commands, while it is open.
    commands: Option<AllCommands>,
    /// Whether the page of the examples is shown instead of a drawing.
    first_page: bool,
    /// Whether the page of the keys is shown.
    shortcuts: bool,
    menu_keys: menu_keys::MenuKeys,
    /// Whether the file for which a name is chosen is saved as a draft.
    saves_draft: bool,
    /// Whether the list of problems is open though it has only notes.
    shows_notes: bool,
    keeper: Keeper,
    /// None if the kinds were given.
    kinds: Option<KindsWatch>,
    /// The problem that was shown last.
    problem: usize,
    /// The title that the window has.
    title: String,
    /// Whether a text was being written when the last frame ended: egui takes the focus away on
    /// Escape before anyone is asked.
    writes: bool,
    /// Whether the user agreed to lose unsaved work.
    is_leaving: bool,
    /// What is to be done once the files are saved.
    after_saving: Option<dialogs::Then>,
    ctx: egui::Context,
}

impl Designer {
    /// A window on a file, or on a robot with nothing in it.
    pub fn new(ctx: &egui::Context, start: Start, settings: Settings) -> Self {
        theme::apply(ctx, Pointing::Mouse);
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        ctx.set_theme(settings.theme);
        let given = Arc::new(start.kinds.clone().unwrap_or_default());
        let mut messages = Messages::default();
        let (recording, file) = match start.file {
            Some(file) if is_recording(&file) => (Some(file), None),
            file => (None, file),
        };
        let opened = file.as_ref().map(|file| Project::open(file, Arc::clone(&given)));
        let project = match opened {
            Some(Ok(project)) => project,
            Some(Err(error)) => {
                messages.warn(error.to_string());
                Project::new(given)
            }
            None => Project::new(given),
        };
        let live = Session::new(ctx, start.components.clone());
        let kinds = start.kinds.is_none().then(|| {
            let ctx = ctx.clone();
            KindsWatch::start(project.folder(), start.components, move || ctx.request_repaint())
        });
        let mut keeper = Keeper::start(start.own_folder.as_deref(), ctx, &mut messages);
        project.path().into_iter().for_each(|path| keeper.remember_file(path));
        let mut workspace = Workspace {
            project,
            live,
            settings,
            palette: true,
            messages,
            commands: Vec::new(),
            shown: None,
            played: None,
            elsewhere: None,
            opened: None,
        };
        workspace.arrange_palette();
        let mut designer = Self {
            workspace,
            view: start.view,
            panes: panes(),
            dialog: None,
            find: None,
            commands: None,
            first_page: start.first_page,
            shortcuts: false,
            menu_keys: menu_keys::MenuKeys::default(),
            saves_draft: false,
            shows_notes: false,
            keeper,
            kinds,
            problem: 0,
            title: String::new(),
            writes: false,
            is_leaving: false,
            after_saving: None,
            ctx: ctx.clone(),
        };
        designer.receive_results();
        if let Some(registry) = start.attach {
            designer.attach_to_system(registry.as_deref());
        }
        if let Some(recording) = recording {
            designer.start_playback(&recording);
        }
        designer
    }

    /// What all views share: the files, the settings, the messages.
    pub fn workspace(&mut self) -> &mut Workspace {
        &mut self.workspace
    }

    /// Opens other files instead of those that are open.
    pub(crate) fn set_project(&mut self, project: Project) {
        self.workspace.project = project;
        self.workspace.arrange_palette();
        self.panes = panes();
        self.find = None;
        self.first_page = false;
        if let Some(kinds) = &self.kinds {
            kinds.set_folder(self.workspace.project.folder());
        }
        self.receive_results();
    }

    /// Has the window drawn again when something is found.
    fn receive_results(&mut self) {
        let ctx = self.ctx.clone();
        self.workspace.project.on_found(move || ctx.request_repaint());
    }

    fn take_news(&mut self) {
        match self.kinds.as_ref().and_then(KindsWatch::news) {
            Some(Ok(kinds)) => {
                if !kinds.troubles().is_empty() {
                    self.workspace.messages.warn(kinds.troubles());
                }
                self.workspace.project.set_kinds(Arc::new(kinds));
            }
            Some(Err(error)) => self.workspace.messages.warn(error.to_string()),
            None => {}
        }
        match self.workspace.project.poll() {
            Some(Ok(saved)) => {
                let names: Vec<_> =
                    saved.files.iter().map(|file| crate::text::path(file)).collect();
                let draft = if self.workspace.project.is_draft() { " as a draft" } else { "" };
                self.workspace.messages.report(format!("Saved {}{draft}", names.join(" and ")));
                self.workspace
                    .project
                    .path()
                    .into_iter()
                    .for_each(|path| self.keeper.remember_file(path));
                self.continue_after_saving();
            }
            Some(Err(refused)) => self.not_saved(&refused),
            None => {}
        }
    }

    /// Returns whether there is unsaved work, also in a field that is being edited.
    fn is_unsaved(&self) -> bool {
        self.workspace.project.is_dirty()
            || self.panes.iter().any(|(_, pane)| pane.field_draft().is_some())
    }

    /// The whole drawing of the view as it is now.
    pub fn drawing(&mut self) -> &Diagram<Item> {
        let (pane, workspace) = self.pane();
        pane.whole_drawing(workspace)
    }

    fn pane(&mut self) -> (&mut dyn Pane, &mut Workspace) {
        let number = self.panes.iter().position(|(view, _)| *view == self.view).unwrap_or(0);
        (self.panes[number].1.as_mut(), &mut self.workspace)
    }

    fn set_title(&mut self, ctx: &egui::Context) {
        let star = if self.is_unsaved() { "*" } else { "" };
        let title = match self.workspace.live.playback().filter(|_| self.view == View::Live) {
            Some(playback) => format!("{} - Armor designer", playback.name()),
            None => format!("{}{star} - Armor designer", self.workspace.project.name()),
        };
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }
}

/// The views of a project, each new.
fn panes() -> Vec<(View, Box<dyn Pane>)> {
    vec![
        (View::System, Box::new(SystemView::new())),
        (View::Mission, Box::new(MissionView::new())),
        (View::Map, Box::new(MapView::new())),
        (View::Live, Box::new(LiveView::new())),
    ]
}

impl Designer {
    /// Shows the whole window and does what is due.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        self.take_news();
        self.synchronize_disk(ui.ctx());
        self.workspace.live.poll();
        self.set_title(ui.ctx());
        self.handle_shortcuts(ui.ctx());
        self.menu_bar(ui);
        self.status_bar(ui);
        let middle = if self.first_page {
            self.show_first_page(ui)
        } else {
            self.side_panels(ui);
            let middle = egui::CentralPanel::default().frame(egui::Frame::NONE);
            let shown = middle.show(ui, |ui| {
                let (pane, workspace) = self.pane();
                pane.show_centre(ui, workspace);
                pane.drawing_area()
            });
            if shown.inner.is_positive() { shown.inner } else { shown.response.rect }
        };
        self.show_messages(ui.ctx(), middle);
        self.show_find(ui.ctx());
        self.show_commands(ui.ctx());
        self.show_shortcuts(ui.ctx());
        self.show_dialog(ui.ctx());
        self.ask_of_files(ui.ctx());
        self.run_orders(ui.ctx());
        self.watch_closing(ui.ctx());
        self.writes = ui.ctx().text_edit_focused();
    }
}

impl eframe::App for Designer {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.show(ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, "settings", &self.workspace.settings);
    }
}
