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
use crate::desk::{Desk, Draft, Pane};
use crate::item::Item;
use crate::project::Documents;

impl MissionView {
    fn fulfil(&mut self, wishes: Vec<PanelRequest>, desk: &mut Desk) {
        for wish in wishes {
            match wish {
                PanelRequest::Show(item) => desk.shown = Some(item),
                PanelRequest::Play(way) => self.play_way(&way, desk),
            }
        }
    }
}

impl Pane for MissionView {
    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk, ui.visuals().dark_mode);
        self.show_palette(ui, desk);
    }

    fn right(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk, ui.visuals().dark_mode);
        let selected: Vec<_> = self.pane.selected().into_iter().collect();
        let mut wishes = Vec::new();
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if self.decoration_panel(ui, &selected) {
                return;
            }
            if let Some((configuration, mission)) = configuration_of(desk) {
                let shown = PanelSource {
                    project: &desk.project,
                    configuration,
                    mission,
                    kinds: desk.project.kinds(),
                    marks: &self.marks,
                    is_checking: desk.project.is_checking(),
                };
                wishes = panel::show(ui, &shown, &selected, &mut self.form);
            } else {
                ui.weak("This file has no mission yet: add a place to begin one.");
            }
        });
        let changes = self.form.finish();
        self.make(changes, desk);
        self.fulfil(wishes, desk);
    }

    fn centre(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk, ui.visuals().dark_mode);
        self.simulation_panel(ui, desk);
        self.update(desk, ui.visuals().dark_mode);
        self.pane.canvas.is_editable = self.simulator.is_none();
        let diagram = std::mem::take(&mut self.diagram);
        let shown = match mission_of(desk) {
            Some(mission) => {
                let rules = NetRules { mission, diagram: &diagram, kind: self.kind };
                self.pane.show(ui, &diagram, &rules, &desk.settings)
            }
            None => self.pane.show(ui, &diagram, &EmptyRules, &desk.settings),
        };
        self.diagram = diagram;
        self.pane.take_enter(ui, &shown, desk);
        self.paint_motion(ui);
        self.show_empty_hint(ui, desk);
        if let Some((part, at)) = self.pane.dropped::<DraggedPart>(ui, &shown) {
            self.add_part(&part, snapped(at), desk);
        }
        if self.simulator.is_some() && shown.response.clicked() {
            self.fire_clicked(shown.hovered, desk);
        }
        for event in shown.events {
            self.take_event(event, ui, desk);
        }
        let (of, at) = self.pane.menu;
        shown.response.context_menu(|ui| self.show_menu(ui, desk, of, at));
        self.show_picker(ui, desk);
    }

    fn is_asking(&self) -> bool {
        self.picker.is_some()
    }

    fn may(&self, command: Command, desk: &Desk) -> Option<bool> {
        self.can_run(command, desk)
    }

    fn run(&mut self, command: Command, ctx: &egui::Context, desk: &mut Desk) {
        self.update(desk, ctx.theme() == egui::Theme::Dark);
        self.run_command(command, ctx, desk);
    }

    fn finish(&mut self, desk: &mut Desk) -> bool {
        let changes = self.form.end();
        self.make(changes, desk)
    }

    fn draft(&self) -> Option<Draft> {
        let (revision, change) = self.form.draft()?;
        let change = Box::new(move |documents: &mut Documents| change.apply(documents));
        Some(Draft { revision, change })
    }

    fn drawing(&mut self, desk: &Desk) -> &Diagram<Item> {
        self.update(desk, self.was_dark());
        &self.diagram
    }

    fn show_item(&mut self, item: Item, desk: &Desk) {
        self.update(desk, self.was_dark());
        // What is not drawn leaves nothing selected: then the panel shows the whole mission, which
        // has it.
        self.pane.show_item(item, &self.diagram);
    }

    fn select(&mut self, items: BTreeSet<Item>) {
        self.pane.select(items);
    }

    fn paste(&mut self, text: &str, desk: &mut Desk) {
        self.paste_text(text, desk);
    }

    fn findable(&self, desk: &Desk) -> Vec<(Item, String)> {
        commands::list_findable(desk)
    }
}

/// The rules of a drawing without a mission.
struct EmptyRules;

impl JoinRules for EmptyRules {
    fn may_join(&self, _: PortAt, _: PortAt) -> Result<(), String> {
        Err("there is nothing to connect".into())
    }
}
