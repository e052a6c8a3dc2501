//! The commands of the view.

use eframe::egui::{self, Rect, Vec2, vec2};

use super::gestures::{ROOM, place};
use super::quick::Quick;
use super::{MissionView, mission_of};
use crate::canvas::{Alignment, align, snapped};
use crate::commands::Command;
use crate::desk::{Desk, View};
use crate::item::Item;
use crate::layout;
use crate::mission::changes::Change;
use crate::mission::drawing::arranged;
use crate::mission::words::conditions;

/// Copies are put down so far from what they are copies of.
const BESIDE: Vec2 = vec2(40.0, 40.0);
/// Left free around what a group is drawn around.
const AROUND: f32 = 25.0;

impl MissionView {
    pub(super) fn may_run(&self, command: Command, desk: &Desk) -> Option<bool> {
        use Command as C;
        let selected = self.canvas.selection.len();
        let is_still = self.simulator.is_none();
        let is_there = desk.project.configuration().is_some();
        let plays = self.simulator.is_some();
        Some(match command {
            C::Cut | C::Duplicate | C::Delete => selected > 0 && is_still,
            C::Copy | C::ZoomSelected => selected > 0,
            C::Arrange => is_there && is_still,
            C::SelectAll | C::ZoomFit => is_there,
            C::Rename | C::Link => {
                is_still && matches!(self.canvas.only(), Some(Item::Place(_) | Item::Transition(_)))
            }
            C::Properties => selected == 1,
            C::AlignLeft | C::AlignRight | C::AlignTop | C::AlignBottom => selected > 1 && is_still,
            C::SpaceAcross | C::SpaceDown => selected > 2 && is_still,
            C::Group => selected > 0 && is_still,
            C::Add | C::Note | C::Paste => is_there && is_still,
            C::SelectNone | C::ZoomIn | C::ZoomOut | C::ZoomActual => true,
            C::Simulate => mission_of(desk).is_some(),
            C::SimulationStep | C::SimulationRun | C::SimulationRestart => plays,
            C::SimulationBack => {
                self.simulator.as_ref().is_some_and(|simulator| simulator.play().can_go_back())
            }
            _ => return None,
        })
    }

    pub(super) fn run_command(&mut self, command: Command, ctx: &egui::Context, desk: &mut Desk) {
        use Command as C;
        match command {
            C::Cut => {
                let is_copied = self.copy(ctx, desk);
                if is_copied {
                    self.delete(desk);
                }
            }
            C::Copy => {
                self.copy(ctx, desk);
            }
            C::Paste => ctx.send_viewport_cmd(egui::ViewportCommand::RequestPaste),
            C::Duplicate => self.duplicate(desk),
            C::Delete => self.delete(desk),
            C::Rename | C::Properties => {
                desk.settings.properties = true;
                self.form.take_focus();
            }
            C::Add => {
                let at = self.diagram.free_spot(self.canvas.spot(), ROOM);
                self.quick = Some(Quick::to_add(desk, at));
            }
            C::Link => self.quick = self.quick_to_join(desk),
            C::Group | C::Note => self.decorate(command == C::Note, desk),
            C::Arrange => self.arrange(desk),
            C::Simulate => self.toggle_simulation(desk),
            C::SimulationStep => self.simulate(ctx, super::simulator::Simulator::step),
            C::SimulationBack => self.simulate(ctx, |simulator, _| simulator.back()),
            C::SimulationRestart => self.simulate(ctx, |simulator, _| simulator.restart()),
            C::SimulationRun => self.simulate(ctx, |simulator, _| {
                simulator.is_running = !simulator.is_running;
            }),
            _ => match Alignment::of(command) {
                Some(how) => self.align(how, desk),
                None => self.canvas.run(command, &self.diagram),
            },
        }
    }

    fn copy(&self, ctx: &egui::Context, desk: &mut Desk) -> bool {
        match super::fragment::copied(desk, &self.diagram, &self.canvas.selection) {
            Some(text) => {
                ctx.copy_text(text);
                true
            }
            None => {
                desk.messages.warn("nothing copied: select places, transitions or notes");
                false
            }
        }
    }

    pub(super) fn paste_text(&mut self, text: &str, desk: &mut Desk) {
        let middle = self.canvas.spot();
        self.put(text, "paste", &|whole: Rect| snapped(middle - whole.size() / 2.0), desk);
    }

    fn duplicate(&mut self, desk: &mut Desk) {
        match super::fragment::copied(desk, &self.diagram, &self.canvas.selection) {
            Some(text) => self.put(&text, "duplicate", &|whole: Rect| whole.min + BESIDE, desk),
            None => desk.messages.warn("nothing duplicated: select places, transitions or notes"),
        }
    }

    fn put(&mut self, text: &str, what: &str, at: &dyn Fn(Rect) -> egui::Pos2, desk: &mut Desk) {
        let mut added = Vec::new();
        desk.edit(what, |documents| {
            added = super::fragment::paste(documents, text, at)?;
            Ok(())
        });
        self.select_next = added;
    }

    pub(super) fn delete(&mut self, desk: &mut Desk) {
        let items: Vec<_> = self.canvas.selection.iter().cloned().collect();
        let change = Change::Remove(items);
        if desk.edit(change.what(), |documents| change.apply(documents)) {
            self.canvas.selection.clear();
        }
    }

    fn decorate(&mut self, is_note: bool, desk: &mut Desk) {
        let areas = self.selected_areas();
        let selected = areas.iter().map(|(_, area)| *area).reduce(Rect::union);
        let (rect, text) = if is_note {
            let at = selected.map_or(self.canvas.spot(), |area| area.left_bottom() + BESIDE);
            (Rect::from_min_size(at, vec2(220.0, 90.0)), "Note")
        } else {
            let Some(area) = selected else { return };
            let mut area = area.expand(AROUND);
            area.min.y -= AROUND;
            (area, "Group")
        };
        let number = self.diagram.decorations.len();
        let what = if is_note { "add a note" } else { "draw a group" };
        let added = desk.edit(what, |documents| {
            layout::add_decoration(documents.mission()?, View::Mission, is_note, rect, text)
        });
        if added {
            self.select_next = vec![Item::Decoration { view: View::Mission, number }];
            desk.settings.properties = true;
            self.form.take_focus();
        }
    }

    fn arrange(&mut self, desk: &mut Desk) {
        let Some(mission) = mission_of(desk) else { return };
        let is_node = |item: &&Item| matches!(item, Item::Place(_) | Item::Transition(_));
        let selected: Vec<_> = self.canvas.selection.iter().filter(is_node).cloned().collect();
        let only = if selected.len() > 1 { &selected[..] } else { &[] };
        let places = arranged(&self.diagram.nodes, mission, only);
        desk.edit("arrange", |documents| place(documents, &places));
        if only.is_empty() {
            self.canvas.fit_everything();
        }
    }

    fn align(&mut self, how: Alignment, desk: &mut Desk) {
        let places = align(&self.selected_areas(), how);
        desk.edit("bring into line", |documents| place(documents, &places));
    }
}

/// Every place, transition, variable, check and sub-mission, with its words.
pub(super) fn findable(desk: &Desk) -> Vec<(Item, String)> {
    let Some(mission) = mission_of(desk) else { return Vec::new() };
    let places = mission.places.iter().map(|place| {
        let components = place.components.iter().map(|name| name.value.as_str());
        let words = components.collect::<Vec<_>>().join(" ");
        (Item::Place(place.name.value.clone()), words)
    });
    let transitions = mission.transitions.iter().map(|transition| {
        (Item::Transition(transition.name.value.clone()), conditions(transition).join(" "))
    });
    let variables = mission.variables.iter().map(|variable| {
        let source = variable.source.as_ref().map_or("", |source| source.value.as_str());
        (Item::Variable(variable.name.value.clone()), source.to_owned())
    });
    let checks = mission.checks.iter().enumerate();
    let checks = checks.map(|(number, check)| (Item::Check(number), check.value.clone()));
    let inner = mission.submissions.iter().enumerate();
    let inner = inner.map(|(number, inner)| (Item::Submission(number), inner.file.value.clone()));
    places.chain(transitions).chain(variables).chain(checks).chain(inner).collect()
}
