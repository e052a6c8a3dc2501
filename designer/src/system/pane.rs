//! The view of the system as a pane of the window.

use std::collections::BTreeSet;

use eframe::egui;

use super::choices::SystemPicker;
use super::palette::DraggedKind;
use super::properties::field::{Focus, write};
use super::run;
use super::state::SystemView;
use crate::canvas::{CanvasEvent, Diagram, snapped};
use crate::commands::Command;
use crate::desk::{Desk, Draft, Pane};
use crate::item::Item;
use crate::project::Documents;

/// From the pointer to the upper left corner of a block that is dropped.
const DROP_OFFSET: egui::Vec2 = egui::vec2(70.0, 30.0);

impl SystemView {
    fn take_event(&mut self, event: CanvasEvent<Item>, ui: &egui::Ui, desk: &mut Desk) {
        match event {
            CanvasEvent::Moved(by) => {
                let unplaced = self.unplaced();
                self.pane.move_selected(by, &self.drawing.diagram, &unplaced, desk);
            }
            CanvasEvent::Joined(from, to) => self.join(from, to, desk),
            CanvasEvent::Refused(why) => desk.messages.warn(format!("Not linked: {why}")),
            CanvasEvent::Loose { from, at } => {
                self.picker = Some(SystemPicker::for_port(&self.drawing, desk, from, at));
            }
            CanvasEvent::Rewired { wire, stays, to } => self.rewire(wire, stays, to, desk),
            CanvasEvent::Opened(item) => {
                self.pane.select([item]);
                desk.settings.properties = true;
                self.wants_focus = Focus::Value;
            }
            CanvasEvent::OpenedEmpty(at) => self.picker = Some(SystemPicker::to_add(desk, at)),
            CanvasEvent::Menu { of, at } => self.pane.menu = (of, at),
            CanvasEvent::Resized(item, rect) => self.pane.resize(item, rect, desk),
        }
        ui.ctx().request_repaint();
    }
}

impl Pane for SystemView {
    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk);
        if let Some(kind) = self.palette.show(ui, desk) {
            let at = self.pane.canvas.centre();
            self.add(&kind, at, desk);
        }
    }

    fn right(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk);
        self.show_properties(ui, desk);
    }

    fn centre(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk);
        let shown = self.pane.show(ui, &self.drawing.diagram, &self.drawing.joints, &desk.settings);
        self.pane.take_enter(ui, &shown, desk);
        self.show_empty_hint(ui, desk);
        if let Some((kind, at)) = self.pane.dropped::<DraggedKind>(ui, &shown) {
            self.add(&kind.0, snapped(at - DROP_OFFSET), desk);
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
        self.update(desk);
        self.run_command(command, ctx, desk);
    }

    fn finish(&mut self, desk: &mut Desk) -> bool {
        self.drafts.end();
        self.take_drafts(desk)
    }

    fn draft(&self) -> Option<Draft> {
        let (field, text, revision) = self.drafts.current()?;
        let (field, text) = (field.clone(), text.to_owned());
        let change = Box::new(move |documents: &mut Documents| write(documents, &field, &text));
        Some(Draft { revision, change })
    }

    fn drawing(&mut self, desk: &Desk) -> &Diagram<Item> {
        self.update(desk);
        &self.drawing.diagram
    }

    fn show_item(&mut self, item: Item, desk: &Desk) {
        self.update(desk);
        self.pane.show_item(item, &self.drawing.diagram);
    }

    fn select(&mut self, items: BTreeSet<Item>) {
        self.pane.select(items);
    }

    fn paste(&mut self, text: &str, desk: &mut Desk) {
        self.update(desk);
        self.paste_text(text, desk);
    }

    fn findable(&self, desk: &Desk) -> Vec<(Item, String)> {
        run::list_findable(desk)
    }
}
