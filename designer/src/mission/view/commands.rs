//! The commands of the view.

use eframe::egui::{self, Pos2, Rect};

use super::choices::MissionPicker;
use super::fragment;
use super::gestures::NODE_SPACE;
use super::simulator::MissionSimulator;
use super::state::{MissionView, mission_of};
use crate::commands::Command;
use crate::desk::Desk;
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::drawing::arranged;
use crate::mission::words::conditions;

impl MissionView {
    pub(super) fn can_run(&self, command: Command, desk: &Desk) -> Option<bool> {
        use Command as C;
        let is_editable = self.simulator.is_none();
        Some(match command {
            C::Rename | C::Link => {
                let is_node =
                    matches!(self.pane.only(), Some(Item::Place(_) | Item::Transition(_)));
                is_editable && is_node
            }
            C::Simulate => mission_of(desk).is_some(),
            C::SimulationStep | C::SimulationRun | C::SimulationRestart => !is_editable,
            C::SimulationBack => {
                self.simulator.as_ref().is_some_and(|simulator| simulator.play().can_go_back())
            }
            _ => return self.pane.can_run(command, desk, is_editable),
        })
    }

    pub(super) fn run_command(&mut self, command: Command, ctx: &egui::Context, desk: &mut Desk) {
        use Command as C;
        match command {
            C::Cut => {
                if self.copy(ctx, desk) {
                    self.delete(desk);
                }
            }
            C::Copy => {
                self.copy(ctx, desk);
            }
            C::Duplicate => self.duplicate(desk),
            C::Delete => self.delete(desk),
            C::Rename | C::Properties => {
                desk.settings.properties = true;
                self.form.take_focus();
            }
            C::Add => {
                let at = self.diagram.free_spot(self.pane.canvas.spot(), NODE_SPACE);
                self.picker = Some(MissionPicker::to_add(desk, at));
            }
            C::Link => self.picker = self.picker_to_connect(desk),
            C::Group | C::Note => {
                if self.pane.decorate(command == C::Note, &self.diagram, desk) {
                    self.form.take_focus();
                }
            }
            C::Arrange => self.arrange(desk),
            C::Simulate => self.toggle_simulation(desk),
            C::SimulationStep => self.simulate(ctx, MissionSimulator::step),
            C::SimulationBack => self.simulate(ctx, |simulator, _| simulator.back()),
            C::SimulationRestart => self.simulate(ctx, |simulator, _| simulator.restart()),
            C::SimulationRun => self.simulate(ctx, |simulator, _| {
                simulator.is_running = !simulator.is_running;
            }),
            _ => self.pane.run(command, ctx, &self.diagram, desk),
        }
    }

    fn copy_text(&self, desk: &Desk) -> Option<String> {
        fragment::copied(desk, &self.diagram, &self.pane.selected())
    }

    fn copy(&self, ctx: &egui::Context, desk: &mut Desk) -> bool {
        let text = self.copy_text(desk);
        self.pane.copy(text, ctx, desk)
    }

    pub(super) fn paste_text(&mut self, text: &str, desk: &mut Desk) {
        let corner = self.pane.paste_corner();
        self.add_fragment(text, "paste", &corner, desk);
    }

    fn duplicate(&mut self, desk: &mut Desk) {
        let offset = self.pane.copy_offset();
        match self.copy_text(desk) {
            Some(text) => self.add_fragment(&text, "duplicate", &|whole| whole.min + offset, desk),
            None => self.pane.warn_not_duplicated(desk),
        }
    }

    fn add_fragment(&mut self, text: &str, what: &str, at: &dyn Fn(Rect) -> Pos2, desk: &mut Desk) {
        let mut added = Vec::new();
        desk.edit(what, |documents| {
            added = fragment::paste(documents, text, at)?;
            Ok(())
        });
        self.pane.select_when_drawn(added);
    }

    pub(super) fn delete(&mut self, desk: &mut Desk) {
        let items: Vec<_> = self.pane.selected().into_iter().collect();
        let change = Change::Remove(items);
        if desk.edit(change.what(), |documents| change.apply(documents)) {
            self.pane.canvas.selection.clear();
        }
    }

    fn arrange(&mut self, desk: &mut Desk) {
        let Some(mission) = mission_of(desk) else { return };
        let is_node = |item: &Item| matches!(item, Item::Place(_) | Item::Transition(_));
        let selected: Vec<_> = self.pane.selected().into_iter().filter(is_node).collect();
        let only = if selected.len() > 1 { &selected[..] } else { &[] };
        let places = arranged(&self.diagram.nodes, mission, only);
        self.pane.place("arrange", &places, desk);
        if only.is_empty() {
            self.pane.canvas.fit_everything();
        }
    }
}

/// Every place, transition, variable, check and sub-mission, with its words.
pub(super) fn list_findable(desk: &Desk) -> Vec<(Item, String)> {
    let Some(mission) = mission_of(desk) else { return Vec::new() };
    let places = mission.places.iter().map(|place| {
        let components = place.components.iter().map(|name| name.value.as_str());
        let words = components.collect::<Vec<_>>().join(" ");
        (Item::place(&place.name.value), words)
    });
    let transitions = mission.transitions.iter().map(|transition| {
        (Item::transition(&transition.name.value), conditions(transition).join(" "))
    });
    let variables = mission.variables.iter().map(|variable| {
        let source = variable.source.as_ref().map_or("", |source| source.value.as_str());
        (Item::variable(&variable.name.value), source.to_owned())
    });
    let checks = mission.checks.iter().enumerate();
    let checks = checks.map(|(number, check)| (Item::Check(number), check.value.clone()));
    let inner = mission.submissions.iter().enumerate();
    let inner = inner.map(|(number, inner)| (Item::Submission(number), inner.file.value.clone()));
    places.chain(transitions).chain(variables).chain(checks).chain(inner).collect()
}
