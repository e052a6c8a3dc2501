//! The view of the mission: the net, its panels, and the mission played over the drawing.

mod commands;
mod fragment;
mod gestures;
mod menu;
mod motion;
mod palette;
mod playing;
mod quick;
mod simulator;

use std::sync::Arc;

use armor_robotfile::mission::{ArcKind, Mission};
use eframe::egui::{self, Pos2};

use super::changes::Change;
use super::drawing::{NetRules, Scene};
use super::form::{Form, Made};
use super::marks::Marks;
use super::panel::{self, Wish};
use crate::canvas::{Canvas, Diagram};
use crate::commands::Command;
use crate::desk::{Desk, Draft, Pane, View};
use crate::item::Item;
use crate::layout::{self, Layout};
use crate::project::Documents;
use crate::theme::Colours;
use palette::Dragged;
use quick::Quick;
use simulator::Simulator;

/// The view of the mission.
pub struct MissionView {
    canvas: Canvas,
    diagram: Diagram,
    /// Nodes that the file gives no position.
    unplaced: Vec<Item>,
    drawn: Option<Drawn>,
    /// What was found.
    marks: Marks,
    form: Form,
    simulator: Option<Simulator>,
    /// What an arc from a place to a transition does when it is drawn.
    kind: ArcKind,
    quick: Option<Quick>,
    /// What the open menu is about, and where in the drawing it was asked for.
    menu: (Option<Item>, Pos2),
    /// What is to be selected once it is drawn.
    select_next: Vec<Item>,
    /// The time of the last frame, in seconds of the window.
    canvas_time: f64,
}

/// What a drawing was made of.
#[derive(Clone, Debug, PartialEq)]
struct Drawn {
    revision: u64,
    checked: (u64, bool),
    /// Counts what happens in the simulation.
    moment: Option<u64>,
    is_dark: bool,
}

impl MissionView {
    /// A view that shows the whole mission at first.
    pub fn new() -> Self {
        Self {
            canvas: Canvas::new("drawing of the mission"),
            diagram: Diagram::default(),
            unplaced: Vec::new(),
            drawn: None,
            marks: Marks::default(),
            form: Form::default(),
            simulator: None,
            kind: ArcKind::Take,
            quick: None,
            menu: (None, Pos2::ZERO),
            select_next: Vec::new(),
            canvas_time: 0.0,
        }
    }

    /// Draws the mission again if it, what is known of it, or its tokens have changed.
    fn update(&mut self, desk: &Desk, is_dark: bool) {
        let revision = desk.project.revision();
        if let Some(simulator) = &mut self.simulator {
            simulator.keep_up(desk);
        }
        let checked = desk.project.checked();
        let now = Drawn {
            revision,
            checked: (checked.revision, checked.is_complete),
            moment: self.simulator.as_ref().map(Simulator::moment),
            is_dark,
        };
        let is_same_file = self.drawn.as_ref().is_some_and(|drawn| drawn.revision == revision);
        // New findings do not end a drag.
        if self.drawn.as_ref() == Some(&now) || (is_same_file && self.canvas.is_busy()) {
            return;
        }
        let is_known = self
            .drawn
            .as_ref()
            .is_some_and(|drawn| (drawn.revision, drawn.checked) == (now.revision, now.checked));
        if !is_known {
            self.marks = marks_of(desk);
        }
        self.draw(desk, is_dark);
        self.canvas.drawing_changed(&self.diagram);
        self.drawn = Some(now);
        let wanted = std::mem::take(&mut self.select_next);
        let there: Vec<_> = wanted.into_iter().filter(|item| self.diagram.holds(item)).collect();
        if !there.is_empty() {
            self.canvas.selection = there.into_iter().collect();
        }
    }

    fn draw(&mut self, desk: &Desk, is_dark: bool) {
        let Some(mission) = mission_of(desk) else {
            self.diagram = Diagram::default();
            return;
        };
        let colours = if is_dark { Colours::DARK } else { Colours::LIGHT };
        let layout = layout_of(desk);
        let scene = Scene {
            mission,
            marks: &self.marks,
            layout: &layout,
            play: self.simulator.as_ref().map(Simulator::play),
            in_flight: self.simulator.as_ref().map_or(&[], Simulator::in_flight),
            colours: &colours,
        };
        (self.diagram, self.unplaced) = scene.draw();
    }

    fn rules<'a>(&self, mission: &'a Mission, diagram: &'a Diagram) -> NetRules<'a> {
        NetRules { mission, diagram, kind: self.kind }
    }

    fn was_dark(&self) -> bool {
        self.drawn.as_ref().is_none_or(|drawn| drawn.is_dark)
    }

    /// Makes changes, each a step of the history, and keeps what was renamed selected. Answers
    /// whether all were made; why one is not is a message.
    fn make(&mut self, changes: Vec<Made>, desk: &mut Desk) -> bool {
        let mut are_made = true;
        for change in changes {
            let change = match change {
                Ok(change) => change,
                Err(why) => {
                    desk.messages.warn(why);
                    are_made = false;
                    continue;
                }
            };
            let is_made = desk.edit(change.what(), |documents| change.apply(documents));
            are_made &= is_made;
            match &change {
                Change::Rename(Item::Place(_), name) if is_made => {
                    self.select_next = vec![Item::Place(name.clone())];
                }
                Change::Rename(Item::Transition(_), name) if is_made => {
                    self.select_next = vec![Item::Transition(name.clone())];
                }
                Change::ArcKind(Item::Arc { transition, place, .. }, kind) if is_made => {
                    let (transition, place) = (transition.clone(), place.clone());
                    self.select_next = vec![Item::Arc { transition, place, kind: *kind }];
                }
                _ => {}
            }
        }
        are_made
    }

    fn fulfil(&mut self, wishes: Vec<Wish>, desk: &mut Desk) {
        for wish in wishes {
            match wish {
                Wish::Show(item) => desk.shown = Some(item),
                Wish::Play(way) => self.play_way(&way, desk),
            }
        }
    }
}

impl Default for MissionView {
    fn default() -> Self {
        Self::new()
    }
}

impl Pane for MissionView {
    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk, ui.visuals().dark_mode);
        self.palette(ui, desk);
    }

    fn right(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.update(desk, ui.visuals().dark_mode);
        let selected: Vec<_> = self.canvas.selection.iter().cloned().collect();
        let mut wishes = Vec::new();
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if self.decoration_panel(ui, &selected) {
                return;
            }
            if let Some((configuration, mission)) = configuration_of(desk) {
                let shown = panel::Shown {
                    project: &desk.project,
                    configuration,
                    mission,
                    kinds: desk.project.kinds(),
                    marks: &self.marks,
                    is_checking: desk.project.is_checking(),
                };
                wishes = panel::show(ui, &shown, &selected, &mut self.form);
            } else {
                ui.weak("There is no mission yet: add a place to begin one.");
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
        self.canvas.minimap = desk.settings.minimap;
        self.canvas.snap = desk.settings.snap;
        self.canvas.is_editable = self.simulator.is_none();
        let diagram = std::mem::take(&mut self.diagram);
        let shown = match mission_of(desk) {
            Some(mission) => {
                let rules = self.rules(mission, &diagram);
                self.canvas.show(ui, &diagram, &rules)
            }
            None => self.canvas.show(ui, &diagram, &Nothing),
        };
        self.diagram = diagram;
        self.paint_motion(ui);
        self.canvas.explain(&shown, &self.diagram);
        self.empty_hint(ui, desk);
        if let Some(dragged) = shown.response.dnd_release_payload::<Dragged>()
            && let Some(at) = ui.input(|i| i.pointer.latest_pos())
        {
            let at = crate::canvas::snapped(self.canvas.to_drawing(at));
            self.dropped(&dragged, at, desk);
        }
        if shown.response.has_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
            desk.order(Command::Properties);
        }
        if self.simulator.is_some() && shown.response.clicked() {
            self.fire_clicked(shown.hovered, desk);
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

    fn drawing(&mut self, desk: &Desk) -> &Diagram {
        self.update(desk, self.was_dark());
        &self.diagram
    }

    fn show_item(&mut self, item: &Item, desk: &Desk) {
        self.update(desk, self.was_dark());
        if self.diagram.holds(item) {
            self.canvas.go_to(&self.diagram, item.clone());
        } else {
            // The panel of the whole mission has it.
            self.canvas.selection.clear();
        }
    }

    fn select(&mut self, items: std::collections::BTreeSet<Item>) {
        self.canvas.selection = items;
    }

    fn paste(&mut self, text: &str, desk: &mut Desk) {
        self.paste_text(text, desk);
    }

    fn findable(&self, desk: &Desk) -> Vec<(Item, String)> {
        commands::findable(desk)
    }
}

/// Rules of a drawing in which there is nothing.
struct Nothing;

impl crate::canvas::Rules for Nothing {
    fn may_join(&self, _: crate::canvas::PortAt, _: crate::canvas::PortAt) -> Result<(), String> {
        Err("there is nothing to join".into())
    }
}

fn configuration_of(desk: &Desk) -> Option<(&armor_robotfile::Configuration, &Mission)> {
    let configuration = desk.project.configuration()?;
    Some((configuration, configuration.mission.as_ref()?))
}

fn mission_of(desk: &Desk) -> Option<&Mission> {
    configuration_of(desk).map(|(_, mission)| mission)
}

/// The net of the open files, with nothing of it played or complained of.
pub fn net(desk: &Desk, colours: &Colours) -> Diagram {
    let Some(mission) = mission_of(desk) else { return Diagram::default() };
    let (marks, layout) = (Marks::default(), layout_of(desk));
    let (marks, layout) = (&marks, &layout);
    let scene = Scene { mission, marks, layout, play: None, in_flight: &[], colours };
    scene.draw().0
}

fn layout_of(desk: &Desk) -> Layout {
    let document = desk.project.document_with(armor_robotfile::Item::Mission);
    document.map(|document| layout::read(document, View::Mission)).unwrap_or_default()
}

/// What was found of the current files; of older ones the places would be wrong.
fn marks_of(desk: &Desk) -> Marks {
    let checked = desk.project.checked();
    if checked.revision != desk.project.revision() {
        return Marks::default();
    }
    Marks::of(Arc::clone(&checked.findings), &|at| desk.project.item_at(at))
}
