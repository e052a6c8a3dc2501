//! The view of the system: components as blocks, links as wires between their ports.

mod docs;
mod drawing;
mod edits;
mod fragment;
mod menu;
mod palette;
mod properties;
mod quick;
mod repair;
mod rules;
mod run;

use eframe::egui::{self, Pos2};

pub use drawing::{Drawing, draw, unassigned};
pub use edits::{add_component, arrange_all, free_name, join, place, remove, rename, rewire};
pub use fragment::{copied, paste};
pub use rules::{Joint, Joints, types_fit};

use crate::canvas::{Canvas, Event};
use crate::commands::Command;
use crate::desk::{Desk, Draft, Pane};
use crate::item::Item;
use crate::panels::path::PathChoice;
use crate::project::Documents;
use properties::{Field, Focus};
use quick::Quick;

/// A kind that is dragged from the palette.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DraggedKind(pub String);

/// The view of the system.
pub struct SystemView {
    canvas: Canvas,
    drawing: Drawing,
    /// What the drawing was made of: the revision, and whether its findings were there.
    drawn: Option<(u64, u64, bool)>,
    palette: palette::Palette,
    drafts: crate::panels::fields::Drafts<Field>,
    quick: Option<Quick>,
    /// A file that is being chosen for a parameter.
    choosing: Option<(Field, PathChoice)>,
    /// What the open menu is about, and where in the drawing it was asked for.
    menu: (Option<Item>, Pos2),
    /// Which field of the properties is to get the focus.
    wants_focus: Focus,
    /// What is to be selected once it is drawn.
    select_next: Vec<Item>,
}

impl SystemView {
    /// A view that shows the whole system at first.
    pub fn new() -> Self {
        Self {
            canvas: Canvas::new("drawing of the system"),
            drawing: Drawing::default(),
            drawn: None,
            palette: palette::Palette::default(),
            drafts: Default::default(),
            quick: None,
            choosing: None,
            menu: (None, Pos2::ZERO),
            wants_focus: Focus::Nothing,
            select_next: Vec::new(),
        }
    }

    /// Draws the system again if it or what is known of it has changed.
    fn update(&mut self, desk: &Desk) {
        let checked = desk.project.checked();
        let now = (desk.project.revision(), checked.revision, checked.is_complete);
        if self.drawn == Some(now) {
            return;
        }
        self.drawing = draw(&desk.project);
        self.canvas.drawing_changed(&self.drawing.diagram);
        if desk.project.undoable().is_none() {
            // Nobody has edited it: its kinds are known by now, and blocks have grown by their ports.
            self.canvas.fit_again();
        }
        self.drawn = Some(now);
        let wanted: Vec<_> = std::mem::take(&mut self.select_next);
        let there: Vec<_> =
            wanted.into_iter().filter(|item| self.drawing.diagram.holds(item)).collect();
        if !there.is_empty() {
            self.canvas.selection = there.into_iter().collect();
        }
    }

    fn selected_components(&self) -> Vec<String> {
        let names = self.canvas.selection.iter().filter_map(|item| match item {
            Item::Component(name) => Some(name.clone()),
            _ => None,
        });
        names.collect()
    }

    fn take(&mut self, event: Event, ui: &egui::Ui, desk: &mut Desk) {
        match event {
            Event::Moved(by) => self.moved(by, desk),
            Event::Joined(from, to) => self.join(from, to, desk),
            Event::Refused(why) => desk.messages.warn(format!("not linked: {why}")),
            Event::Loose { from, at } => {
                self.quick = Some(Quick::for_port(&self.drawing, desk, from, at));
            }
            Event::Rewired { wire, stays, to } => self.rewire(wire, stays, to, desk),
            Event::Opened(item) => {
                self.canvas.selection = [item].into();
                desk.settings.properties = true;
                self.wants_focus = Focus::Value;
            }
            Event::OpenedEmpty(at) => self.quick = Some(Quick::to_add(desk, at)),
            Event::Menu { of, at } => self.menu = (of, at),
            Event::Resized(item, rect) => self.resized(&item, rect, desk),
        }
        ui.ctx().request_repaint();
    }
}

impl Default for SystemView {
    fn default() -> Self {
        Self::new()
    }
}

impl Pane for SystemView {
    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk);
        if let Some(kind) = self.palette.show(ui, desk) {
            let at = self.canvas.centre();
            self.add(&kind, at, desk);
        }
    }

    fn right(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk);
        self.properties(ui, desk);
    }

    fn centre(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk);
        self.canvas.minimap = desk.settings.minimap;
        self.canvas.snap = desk.settings.snap;
        let shown = self.canvas.show(ui, &self.drawing.diagram, &self.drawing.joints);
        self.canvas.explain(&shown, &self.drawing.diagram);
        self.empty_hint(ui, desk);
        if let Some(dragged) = shown.response.dnd_release_payload::<DraggedKind>()
            && let Some(at) = ui.input(|i| i.pointer.latest_pos())
        {
            let at = crate::canvas::snapped(self.canvas.to_drawing(at) - egui::vec2(70.0, 30.0));
            self.add(&dragged.0, at, desk);
        }
        if shown.response.has_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
            desk.order(Command::Properties);
        }
        for event in shown.events {
            self.take(event, ui, desk);
        }
        let (of, at) = self.menu.clone();
        shown.response.context_menu(|ui| self.show_menu(ui, desk, of.as_ref(), at));
        self.show_quick(ui, desk);
    }

    fn is_asking(&self) -> bool {
        self.quick.is_some()
    }

    fn may(&self, command: Command, desk: &Desk) -> Option<bool> {
        self.may_run(command, desk)
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
        let change =
            Box::new(move |documents: &mut Documents| properties::write(documents, &field, &text));
        Some(Draft { revision, change })
    }

    fn drawing(&mut self, desk: &Desk) -> &crate::canvas::Diagram {
        self.update(desk);
        &self.drawing.diagram
    }

    fn show_item(&mut self, item: &Item, desk: &Desk) {
        self.update(desk);
        if self.drawing.diagram.holds(item) {
            self.canvas.go_to(&self.drawing.diagram, item.clone());
        } else {
            self.canvas.selection.clear();
        }
    }

    fn select(&mut self, items: std::collections::BTreeSet<Item>) {
        self.canvas.selection = items;
    }

    fn paste(&mut self, text: &str, desk: &mut Desk) {
        self.update(desk);
        self.paste_text(text, desk);
    }

    fn findable(&self, desk: &Desk) -> Vec<(Item, String)> {
        run::findable(desk)
    }
}
