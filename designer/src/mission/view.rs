//! The view of the mission: the net, its panels, and the mission played over the drawing.

mod choices;
mod commands;
mod fragment;
mod gestures;
mod menu;
mod motion;
mod palette;
mod part;
mod picker;
mod playing;
mod simulator;
mod state;
mod steps;

use std::collections::BTreeSet;

use eframe::egui;

use self::part::DraggedPart;
pub use self::state::{MissionView, net};
use self::state::{configuration_of, mission_of};
use super::drawing::NetRules;
use super::panel;
use super::panel::parts::{PanelRequest, PanelSource};
use crate::canvas::{Diagram, JoinRules, PortAt, snapped};
use crate::commands::Command;
use crate::help::pages::HelpPage;
use crate::item::Item;
use crate::mission::changes::Change;
use crate::pane::{Draft, Pane};
use crate::project::Documents;
use crate::workspace::Workspace;

impl MissionView {
    fn carry_out(&mut self, requests: Vec<PanelRequest>, workspace: &mut Workspace) {
        for request in requests {
            match request {
                PanelRequest::Show(item) => workspace.shown = Some(item),
                PanelRequest::Toggle(step) => self.toggle_steps(&[step].into(), workspace),
                PanelRequest::Play(trace) => self.play_trace(&trace, workspace),
                PanelRequest::Apply(offer) => workspace.apply_offer(&offer),
            }
        }
    }
}

impl Pane for MissionView {
    fn show_left_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace, ui.visuals().dark_mode);
        self.show_palette(ui, workspace);
    }

    fn show_right_panel(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace, ui.visuals().dark_mode);
        let selected: Vec<_> = self.pane.selected().into_iter().collect();
        let mut requests = Vec::new();
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if self.decoration_panel(ui, &selected) {
                return;
            }
            if let Some((configuration, mission)) = configuration_of(workspace) {
                let shown = PanelSource {
                    project: &workspace.project,
                    configuration,
                    mission,
                    kinds: workspace.project.kinds(),
                    marks: &self.marks,
                    is_checking: workspace.project.is_checking(),
                    opened: &self.opened,
                };
                requests = panel::show(ui, &shown, &selected, &mut self.form);
            } else {
                ui.weak("This file has no mission yet: add a place to begin one.");
            }
        });
        let changes = self.form.finish(&mut |change| try_change(change, workspace));
        self.make(changes, workspace);
        self.carry_out(requests, workspace);
    }

    fn show_centre(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        self.update(workspace, ui.visuals().dark_mode);
        if let Some(trace) = workspace.played.take() {
            self.play_trace(&trace, workspace);
        }
        self.simulation_panel(ui, workspace);
        self.update(workspace, ui.visuals().dark_mode);
        self.pane.canvas.is_editable = self.simulator.is_none();
        let diagram = std::mem::take(&mut self.diagram);
        let shown = match mission_of(workspace) {
            Some(mission) => {
                let rules = NetRules { mission, diagram: &diagram, kind: self.kind };
                self.pane.show(ui, &diagram, &rules, &workspace.settings)
            }
            None => self.pane.show(ui, &diagram, &EmptyRules, &workspace.settings),
        };
        self.diagram = diagram;
        self.pane.take_enter(ui, &shown, workspace);
        self.paint_motion(ui);
        self.show_empty_hint(ui, workspace);
        if let Some((part, at)) = self.pane.dropped::<DraggedPart>(ui, &shown) {
            self.add_part(&part, snapped(at), workspace);
        }
        if self.simulator.is_some() && shown.response.clicked() {
            self.fire_clicked(shown.hovered, workspace);
        }
        for event in shown.events {
            self.take_event(event, ui, workspace);
        }
        let (of, at) = self.pane.menu;
        shown.response.context_menu(|ui| self.show_menu(ui, workspace, of, at));
        self.show_picker(ui, workspace);
    }

    fn drawing_area(&self) -> egui::Rect {
        self.pane.canvas.rect()
    }

    fn is_asking(&self) -> bool {
        self.picker.is_some()
    }

    fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        self.can_run(command, workspace)
    }

    fn run_command(&mut self, command: Command, ctx: &egui::Context, workspace: &mut Workspace) {
        self.update(workspace, ctx.theme() == egui::Theme::Dark);
        self.run_command(command, ctx, workspace);
    }

    fn finish_field(&mut self, workspace: &mut Workspace) -> bool {
        let changes = self.form.end(&mut |change| try_change(change, workspace));
        self.make(changes, workspace)
    }

    fn field_draft(&self) -> Option<Draft> {
        let (revision, change) = self.form.draft()?;
        let change = Box::new(move |documents: &mut Documents| change.apply(documents));
        Some(Draft { revision, change })
    }

    fn help_page(&self, _: &Workspace, ctx: &egui::Context) -> Option<HelpPage> {
        let of_field = self.form.focused(ctx).and_then(HelpPage::of_mission_field);
        of_field.or_else(|| HelpPage::of_item(self.pane.only()?))
    }

    fn whole_drawing(&mut self, workspace: &Workspace) -> &Diagram<Item> {
        self.update(workspace, self.was_dark());
        &self.diagram
    }

    fn show_item(&mut self, item: Item, workspace: &Workspace) {
        self.open_step_of(item, workspace);
        self.update(workspace, self.was_dark());
        // What is not drawn leaves nothing selected: then the panel shows the whole mission, which
        // has it.
        self.pane.show_item(item, &self.diagram);
    }

    fn select_items(&mut self, items: BTreeSet<Item>) {
        self.pane.select(items);
    }

    fn paste_text(&mut self, text: &str, workspace: &mut Workspace) {
        self.paste_text(text, workspace);
    }

    fn findable_items(&self, workspace: &Workspace) -> Vec<(Item, String)> {
        commands::list_findable(workspace)
    }
}

/// Tries a change of a field: whether a value would be malformed with it.
fn try_change(change: &Change, workspace: &mut Workspace) -> Result<(), String> {
    workspace.project.try_edit(|documents| change.apply(documents))
}

/// The rules of a drawing without a mission.
struct EmptyRules;

impl JoinRules for EmptyRules {
    fn may_join(&self, _: PortAt, _: PortAt) -> Result<(), String> {
        Err("there is nothing to connect".into())
    }
}
