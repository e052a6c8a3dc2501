//! The panel beneath the drawings: the log, plots, what has happened. Where the drawings need its
//! room, it is one line with the newest line of the log, until a person opens it.

use eframe::egui::{self, Align, Layout};

use super::{LiveView, Shows};
use crate::item::Item;
use crate::live::firings;
use crate::live::playback::PlaybackWish;
use crate::live::playback::list as mark_list;
use crate::live::playback::marks::MarkKind;
use crate::workspace::Workspace;

/// Its height at first, and the least one.
const HEIGHT: f32 = 150.0;
const LEAST_HEIGHT: f32 = 70.0;
/// The height of the line above the drawings, and of borders.
const LINES: f32 = 36.0;

/// What is shown in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Tab {
    #[default]
    Log,
    Plots,
    Fired,
    Orders,
}

impl Tab {
    const ALL: [Self; 4] = [Self::Log, Self::Plots, Self::Fired, Self::Orders];

    fn name(self) -> &'static str {
        match self {
            Self::Log => "Log",
            Self::Plots => "Plots",
            Self::Fired => "Fired",
            Self::Orders => "Orders",
        }
    }
}

impl LiveView {
    /// Opens it at this tab.
    pub(super) fn open_beneath(&mut self, tab: Tab) {
        (self.tab, self.is_beneath_open) = (tab, Some(true));
    }

    /// Shows it, folded or open.
    pub(super) fn show_beneath(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let is_open = self.is_beneath_open.unwrap_or_else(|| {
            let least = self.least_height(ui.available_width());
            ui.available_height() - HEIGHT - LINES >= least
        });
        if is_open {
            let panel = egui::Panel::bottom("live beneath").resizable(true);
            let panel = panel.default_size(HEIGHT).min_size(LEAST_HEIGHT);
            panel.show(ui, |ui| self.show_bottom_panel(ui, workspace));
        } else {
            let panel = egui::Panel::bottom("live beneath, folded").resizable(false);
            panel.show(ui, |ui| self.show_choices(ui, workspace, false));
        }
    }

    /// Shows the line above it: its tabs, which drawings are shown, and the button that folds it.
    fn show_choices(&mut self, ui: &mut egui::Ui, workspace: &Workspace, is_open: bool) {
        ui.horizontal(|ui| {
            for tab in Tab::ALL {
                let is_marks = tab == Tab::Fired && workspace.live.playback().is_some();
                let name = if is_marks { "Marks" } else { tab.name() };
                let label = ui.selectable_label(is_open && self.tab == tab, name);
                if label.accessible_name(format!("live: {name}")).clicked() {
                    self.open_beneath(tab);
                }
            }
            ui.separator();
            ui.weak("Above");
            for shows in Shows::ALL {
                let label = ui.selectable_label(self.shows == shows, shows.name());
                if label.accessible_name(format!("above: {}", shows.name())).clicked() {
                    self.shows = shows;
                }
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let (word, name) =
                    if is_open { ("Fold", "live: fold") } else { ("Open", "live: open") };
                if ui.button(word).accessible_name(name).clicked() {
                    self.is_beneath_open = Some(!is_open);
                }
                if !is_open {
                    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                        self.log.show_newest(ui, &workspace.live);
                    });
                }
            });
        });
    }

    fn show_bottom_panel(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        // Otherwise the height of the panel would change with the tab.
        ui.expand_to_include_rect(ui.max_rect());
        self.show_choices(ui, workspace, true);
        match (self.tab, workspace.live.watched()) {
            (Tab::Log, _) => self.log.show(ui, &workspace.live),
            (Tab::Fired, _) if workspace.live.playback().is_some() => {
                self.show_marks(ui, workspace);
            }
            (Tab::Plots, Some(watched)) => self.plots.show(ui, &watched.values),
            (Tab::Fired, Some(watched)) => firings::fired(ui, watched),
            (Tab::Orders, Some(watched)) => firings::ordered(ui, watched),
            (_, None) => {
                ui.weak("Not watching a system.");
            }
        }
    }

    /// Lists the marks of the recording; one that is chosen is gone to, and its transition selected.
    fn show_marks(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let Some(playback) = workspace.live.playback() else { return };
        let found = playback.found();
        let look = workspace.live.player().map(|player| player.look());
        let state = look.as_ref().and_then(|look| look.state());
        let from_s = state.map(|state| state.from).or(found.span_s.map(|span_s| span_s.0));
        let from_s = from_s.unwrap_or_default();
        let at_s = from_s + look.as_ref().and_then(|look| look.at_s()).unwrap_or_default();
        let chosen = mark_list::show(ui, &found, &self.time_line.hidden, from_s, at_s);
        if let Some(mark) = chosen {
            workspace.live.order_player(PlaybackWish::GoTo(mark.seek_s - from_s));
            self.time_line.has_been_focused = false;
            let item = Item::transition(&mark.text);
            if mark.kind == MarkKind::Firing && self.net.base.holds(item) {
                self.select_none();
                self.net.canvas.selection.insert(item);
            }
        }
    }
}
