//! The live view: the drawing of what runs in the middle, what is selected at the right, and
//! beneath them the log, plots and what has happened.

mod beneath;

use std::time::Duration;

use eframe::egui;

use super::comparison::{self, Comparison, RunningTexts};
use super::playback::PlaybackWish;
use super::playback::time_line::{TimeLine, TimeLineRequest};
use super::sheet::Sheet;
use super::split::{self, Split};
use super::systems::component_of;
use super::{blocks, hover, inspect, log, mission, net, parameters, plots, systems, words};
use crate::canvas::Diagram;
use crate::commands::Command;
use crate::diagram_pane::view_action_of;
use crate::item::Item;
use crate::pane::Pane;
use crate::project::Project;
use crate::workspace::Workspace;
use armor_picture::theme::ThemeColours;
use beneath::Tab;

/// Pause after which running clocks are drawn again.
const CLOCKS_EVERY: Duration = Duration::from_millis(100);

/// Which drawings are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Shows {
    #[default]
    Both,
    System,
    Mission,
}

impl Shows {
    const ALL: [Self; 3] = [Self::Both, Self::System, Self::Mission];

    fn name(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::System => "system",
            Self::Mission => "mission",
        }
    }
}

/// What the drawings were made of.
#[derive(Clone, Debug, PartialEq)]
struct DrawnFrom {
    revision: u64,
    checked: (u64, bool),
    /// The versions that the components run and the mission plays, and whether they are of the
    /// open file.
    versions: Option<(u64, Option<u64>, bool)>,
    is_dark: bool,
}

/// Shows a system while it runs.
pub struct LiveView {
    system: Sheet,
    net: Sheet,
    /// What the drawings were made of.
    drawn: Option<DrawnFrom>,
    /// The version that runs, compared with the text on the screen.
    comparison: Comparison,
    shows: Shows,
    /// A process that is not in the drawing, as the executive is not.
    process: Option<String>,
    tab: Tab,
    /// Whether the panel beneath is open; none if that follows from its room.
    is_beneath_open: Option<bool>,
    /// How the drawings share their height.
    split: Split,
    systems: systems::Panel,
    mission: mission::Panel,
    log: log::Panel,
    plots: plots::Plots,
    parameters: parameters::Panel,
    /// Beneath all, while a recording is played.
    time_line: TimeLine,
    /// The places of the mission, its sub-missions put in.
    places: Vec<String>,
    /// The hosts on which the file places components.
    hosts: blocks::FilePlaces,
}

impl Default for LiveView {
    fn default() -> Self {
        Self::new()
    }
}

impl LiveView {
    /// Creates a view that shows nothing yet.
    pub fn new() -> Self {
        Self {
            system: Sheet::new("drawing of the running system"),
            net: Sheet::new("drawing of the running mission"),
            drawn: None,
            comparison: Comparison::default(),
            shows: Shows::default(),
            process: None,
            tab: Tab::default(),
            is_beneath_open: None,
            split: Split::default(),
            systems: systems::Panel::default(),
            mission: mission::Panel::default(),
            log: log::Panel::default(),
            plots: plots::Plots::default(),
            parameters: parameters::Panel::default(),
            time_line: TimeLine::default(),
            places: Vec::new(),
            hosts: blocks::FilePlaces::new(),
        }
    }

    /// Draws the files if they have changed.
    fn update_drawings(&mut self, workspace: &Workspace, is_dark: bool) {
        let checked = workspace.project.checked();
        let running = RunningTexts::of(workspace);
        let drawn = DrawnFrom {
            revision: workspace.project.revision(),
            checked: (checked.revision, checked.is_complete),
            versions: running.as_ref().map(RunningTexts::key),
            is_dark,
        };
        if self.drawn.as_ref() != Some(&drawn) {
            self.drawn = Some(drawn);
            let colours = ThemeColours::of_theme(!is_dark);
            let drawings = comparison::draw_both(workspace, running.as_ref(), colours);
            self.system.set(drawings.system);
            self.net.set(drawings.net);
            self.comparison = drawings.comparison;
            let running = drawings.running.as_ref().unwrap_or(&workspace.project);
            self.hosts = hosts(running);
            self.places = places(drawings.played.as_ref().unwrap_or(running));
        }
    }

    /// Draws what runs in them.
    fn show_overlay(&mut self, ui: &egui::Ui, workspace: &Workspace) {
        let colours = ThemeColours::of(ui.visuals());
        let Some(watched) = workspace.live.watched() else {
            self.system.clear();
            self.net.clear();
            return;
        };
        let Sheet { diagram, base, .. } = &mut self.system;
        let presences = &self.comparison.presences;
        let picture = watched.watch.picture();
        let hosts = &self.hosts;
        blocks::show(diagram, base, &picture, hosts, presences, watched.is_recorded(), colours);
        let look = watched.mission.look();
        let Sheet { diagram, base, .. } = &mut self.net;
        match &look.marking {
            Some(marking) => {
                let now_s = watched.mission_s(&look);
                // Of a mission that is over, nothing fires any more.
                let ended = words::is_over(marking.stage).then(|| words::without_firings(marking));
                let marking = ended.as_ref().unwrap_or(marking);
                net::show(diagram, base, marking, now_s, presences, colours);
            }
            None => {
                self.net.clear();
                let Sheet { diagram, base, .. } = &mut self.net;
                net::mark_presences(diagram, base, presences, colours);
            }
        }
    }

    /// The system, the net, or one over the other.
    fn show_drawings(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        match self.shown_drawings() {
            Shows::System => self.show_system(ui, workspace),
            Shows::Mission => self.show_net(ui, workspace, workspace.settings.minimap),
            Shows::Both => {
                let [above, below] = self.split.divide(ui, self.system.size, self.net.size);
                ui.scope_builder(above, |ui| self.show_system(ui, workspace));
                ui.scope_builder(below, |ui| self.show_net(ui, workspace, false));
                self.split.show_border(ui);
            }
        }
    }

    /// Which drawings there are to show.
    fn shown_drawings(&self) -> Shows {
        let has_net = !self.net.base.nodes.is_empty();
        if has_net { self.shows } else { Shows::System }
    }

    /// The height that what is shown needs, so that it can be read.
    fn least_height(&self, width: f32) -> f32 {
        let [system, net] =
            [&self.system, &self.net].map(|sheet| split::least_height(width, sheet.size));
        match self.shown_drawings() {
            Shows::System => system,
            Shows::Mission => net,
            Shows::Both => system + net,
        }
    }

    fn show_system(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let (shown, is_new) = self.system.show(ui, workspace.settings.minimap);
        if is_new {
            self.net.select_none();
            self.process = None;
        }
        hover::show_tooltip(&shown, &self.system.diagram, workspace.live.watched());
    }

    fn show_net(&mut self, ui: &mut egui::Ui, workspace: &Workspace, minimap: bool) {
        let (shown, is_new) = self.net.show(ui, minimap);
        if is_new {
            self.system.select_none();
            self.process = None;
        }
        hover::show_tooltip(&shown, &self.net.diagram, workspace.live.watched());
    }

    /// What is selected, if it is one thing.
    fn selected(&self) -> Option<Item> {
        if let Some(process) = &self.process {
            return Some(Item::component(process));
        }
        self.system.canvas.selection.only().or(self.net.canvas.selection.only())
    }

    fn select_none(&mut self) {
        self.system.select_none();
        self.net.select_none();
        self.process = None;
    }

    /// Shows the time line, and does what it asks for.
    fn show_time_line(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        if workspace.live.playback().is_none() && workspace.live.player().is_none() {
            return;
        }
        let panel = egui::Panel::bottom("time line").resizable(false);
        let asked = panel.show(ui, |ui| {
            ui.add_space(armor_picture::theme::NEAR);
            let asked = self.time_line.show(ui, &workspace.live);
            ui.add_space(armor_picture::theme::NEAR);
            asked
        });
        for request in asked.inner {
            match request {
                TimeLineRequest::Wish(wish) => workspace.live.order_player(wish),
                TimeLineRequest::PlayAgain => {
                    let playback = workspace.live.playback();
                    workspace.opened = playback.map(|playback| playback.path().into());
                }
            }
        }
        let runs = workspace.live.player().is_some_and(|player| player.look().is_moving());
        if runs {
            ui.ctx().request_repaint_after(CLOCKS_EVERY);
        }
    }
}

/// The components of the open files that run on another host.
fn hosts(project: &Project) -> blocks::FilePlaces {
    let configuration = project.configuration();
    let components = configuration.into_iter().flat_map(|it| &it.system.components);
    let placed = components.filter_map(|one| {
        let host = one.host.as_ref()?;
        Some((one.name.value.clone(), host.value.clone()))
    });
    placed.collect()
}

/// The places of the mission of the open files, its sub-missions put in.
fn places(project: &Project) -> Vec<String> {
    let flattened = project.configuration().and_then(|it| it.flattened().ok().flatten());
    let places = flattened.map(|mission| mission.places).unwrap_or_default();
    places.into_iter().map(|place| place.name.value).collect()
}

impl Pane for LiveView {
    fn show_left_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        let selected = self.selected();
        let selected = selected.as_ref().and_then(component_of);
        if let Some(name) = self.systems.show(ui, workspace, selected) {
            let item = Item::component(&name);
            self.select_none();
            if self.system.base.holds(item) {
                self.system.canvas.selection.insert(item);
            } else {
                self.process = Some(name);
            }
        }
    }

    fn show_right_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        // Outside the scrolled area, so that it is always visible.
        self.mission.commands(ui, &workspace.live);
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            self.mission.show(ui, &mut workspace.live, &self.places);
            ui.separator();
            let selected = self.selected();
            if let Some(watched) = workspace.live.watched() {
                let (plots, panel) = (&mut self.plots, &mut self.parameters);
                match &selected {
                    Some(Item::Component(name)) => {
                        inspect::component(ui, watched, name, plots, panel);
                        let only = ui
                            .button("Show log")
                            .on_hover_text("Shows only the lines of this component.");
                        if only.clicked() {
                            self.log.only(Some(name));
                            self.open_beneath(Tab::Log);
                        }
                    }
                    Some(Item::Link { from, to }) => {
                        inspect::link(ui, watched, from, to, plots);
                    }
                    Some(item @ (Item::Place(_) | Item::Transition(_))) => {
                        if let Some(number) = self.net.diagram.node(*item) {
                            let node = &self.net.diagram.nodes[number];
                            ui.heading(&node.title);
                            ui.label(&node.doc);
                        }
                    }
                    _ => {
                        ui.weak("Select a block or a link to see its state.");
                    }
                }
            } else {
                ui.weak("Run the file, or choose a running system on the left.");
            }
        });
    }

    fn show_centre(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.show_time_line(ui, workspace);
        self.update_drawings(workspace, ui.visuals().dark_mode);
        self.show_beneath(ui, workspace);
        self.comparison.show(ui, workspace);
        self.show_overlay(ui, workspace);
        self.show_drawings(ui, workspace);
        if let Some(watched) = workspace.live.watched() {
            self.plots.keep(&watched.values);
            let marking = watched.mission.look().marking;
            // Clocks run between two reports; those of a system that is out of reach stand.
            let is_heard = watched.silence().is_none();
            if is_heard && marking.is_some_and(|marking| !words::is_over(marking.stage)) {
                ui.ctx().request_repaint_after(CLOCKS_EVERY);
            }
        }
    }

    fn drawing_area(&self) -> egui::Rect {
        let [system, net] = [self.system.canvas.rect(), self.net.canvas.rect()];
        match self.shows {
            Shows::Both => system.union(net),
            Shows::System => system,
            Shows::Mission => net,
        }
    }

    fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        use Command as C;
        Some(match command {
            C::ZoomIn | C::ZoomOut | C::ZoomActual | C::ZoomFit | C::SelectNone => true,
            C::ZoomSelected => self.selected().is_some(),
            C::SimulationRun | C::SimulationStep | C::SimulationRestart => {
                workspace.live.may_order_player()
            }
            _ => return None,
        })
    }

    fn run_command(&mut self, command: Command, _: &egui::Context, workspace: &mut Workspace) {
        let wish = match command {
            Command::SimulationRun => Some(PlaybackWish::PlayOrPause),
            Command::SimulationStep => Some(PlaybackWish::Step),
            Command::SimulationRestart => Some(PlaybackWish::GoTo(0.0)),
            _ => None,
        };
        if let Some(wish) = wish {
            return workspace.live.order_player(wish);
        }
        for sheet in [&mut self.system, &mut self.net] {
            if let Some(action) = view_action_of(command) {
                sheet.canvas.perform_action(action, &sheet.base);
            }
        }
        if command == Command::SelectNone {
            self.process = None;
        }
    }

    fn whole_drawing(&mut self, workspace: &Workspace) -> &Diagram<Item> {
        let is_dark = self.drawn.as_ref().is_none_or(|drawn| drawn.is_dark);
        self.update_drawings(workspace, is_dark);
        &self.system.diagram
    }

    fn show_item(&mut self, item: Item, _: &Workspace) {
        self.select_none();
        for sheet in [&mut self.system, &mut self.net] {
            if let Some(area) = sheet.base.rect(item) {
                sheet.canvas.selection.insert(item);
                sheet.canvas.fit_area(area);
            }
        }
    }

    fn paste_text(&mut self, _: &str, workspace: &mut Workspace) {
        workspace.messages.warn("The live view is read-only: paste in the system or mission view");
    }

    fn findable_items(&self, workspace: &Workspace) -> Vec<(Item, String)> {
        let Some(configuration) = workspace.project.configuration() else { return Vec::new() };
        let components = configuration.system.components.iter();
        components.map(|one| (Item::component(&one.name.value), one.kind.value.clone())).collect()
    }
}
