//! The commands of the view.

use eframe::egui::{self, Pos2, Rect};

use super::choices::MissionPicker;
use super::fragment;
use super::gestures::NODE_SPACE;
use super::simulator::MissionSimulator;
use super::state::{MissionView, mission_of};
use crate::commands::Command;
use crate::item::Item;
use crate::mission::changes::Change;
use crate::mission::derived::{refusal, step_refusal};
use crate::mission::drawing::arranged;
use crate::mission::words::conditions;
use crate::workspace::Workspace;

impl MissionView {
    pub(super) fn can_run(&self, command: Command, workspace: &Workspace) -> Option<bool> {
        use Command as C;
        let is_editable = self.simulator.is_none();
        Some(match command {
            C::Rename | C::Link => {
                let is_node =
                    matches!(self.pane.only(), Some(Item::Place(_) | Item::Transition(_)));
                is_editable && is_node
            }
            C::Simulate => mission_of(workspace).is_some(),
            C::Fold => !self.selected_steps(workspace).is_empty(),
            C::SimulationStep | C::SimulationRun | C::SimulationRestart => !is_editable,
            C::SimulationBack => {
                self.simulator.as_ref().is_some_and(|simulator| simulator.play().can_go_back())
            }
            _ => return self.pane.can_run(command, workspace, is_editable),
        })
    }

    pub(super) fn run_command(
        &mut self,
        command: Command,
        ctx: &egui::Context,
        workspace: &mut Workspace,
    ) {
        use Command as C;
        match command {
            C::Cut => {
                if !self.refuse_derived(workspace) && self.copy(ctx, workspace) {
                    self.delete(workspace);
                }
            }
            C::Copy => {
                self.copy(ctx, workspace);
            }
            C::Duplicate => self.duplicate(workspace),
            C::Delete => self.delete(workspace),
            C::Rename if self.refuse_derived(workspace) => {}
            C::Rename | C::Properties => {
                workspace.settings.properties = true;
                self.form.take_focus();
            }
            C::Add => {
                let at = self.diagram.free_spot(self.pane.canvas.spot(), NODE_SPACE);
                self.picker = Some(MissionPicker::to_add(workspace, at));
            }
            C::Link => self.picker = self.picker_to_connect(workspace),
            C::Group | C::Note => {
                if self.pane.decorate(command == C::Note, &self.diagram, workspace) {
                    self.form.take_focus();
                }
            }
            C::Arrange => self.arrange(workspace),
            C::Fold => self.toggle_steps(&self.selected_steps(workspace), workspace),
            C::Simulate => self.toggle_simulation(workspace),
            C::SimulationStep => self.simulate(ctx, MissionSimulator::step),
            C::SimulationBack => self.simulate(ctx, |simulator, _| simulator.back()),
            C::SimulationRestart => self.simulate(ctx, |simulator, _| simulator.restart()),
            C::SimulationRun => self.simulate(ctx, |simulator, _| {
                simulator.is_running = !simulator.is_running;
            }),
            _ => self.pane.run(command, ctx, &self.diagram, workspace),
        }
    }

    fn copy_text(&self, workspace: &Workspace) -> Option<String> {
        fragment::copied(workspace, &self.diagram, &self.pane.selected())
    }

    fn copy(&self, ctx: &egui::Context, workspace: &mut Workspace) -> bool {
        let text = self.copy_text(workspace);
        self.pane.copy(text, ctx, workspace)
    }

    pub(super) fn paste_text(&mut self, text: &str, workspace: &mut Workspace) {
        let corner = self.pane.paste_corner();
        self.add_fragment(text, "paste", &corner, workspace);
    }

    fn duplicate(&mut self, workspace: &mut Workspace) {
        let offset = self.pane.copy_offset();
        match self.copy_text(workspace) {
            Some(text) => {
                self.add_fragment(&text, "duplicate", &|whole| whole.min + offset, workspace);
            }
            None if self.refuse_derived(workspace) => {}
            None => self.pane.warn_not_duplicated(workspace),
        }
    }

    fn add_fragment(
        &mut self,
        text: &str,
        what: &str,
        at: &dyn Fn(Rect) -> Pos2,
        workspace: &mut Workspace,
    ) {
        let mut added = Vec::new();
        workspace.edit(what, |documents| {
            added = fragment::paste(documents, text, at)?;
            Ok(())
        });
        self.pane.select_when_drawn(added);
    }

    /// Warns if what is selected is derived from a route, and returns whether it is.
    fn refuse_derived(&self, workspace: &mut Workspace) -> bool {
        let refusal = mission_of(workspace).and_then(|mission| {
            self.pane.selected().iter().find_map(|item| match item {
                Item::Place(name) | Item::Transition(name) => refusal(mission, name),
                Item::Arc { transition, .. } => refusal(mission, transition),
                Item::Step { .. } => step_refusal(mission, item),
                _ => None,
            })
        });
        let is_refused = refusal.is_some();
        if let Some(refusal) = refusal {
            workspace.messages.warn(refusal);
        }
        is_refused
    }

    pub(super) fn delete(&mut self, workspace: &mut Workspace) {
        if self.refuse_derived(workspace) {
            return;
        }
        let items: Vec<_> = self.pane.selected().into_iter().collect();
        let change = Change::Remove(items);
        if workspace.edit(change.what(), |documents| change.apply(documents)) {
            self.pane.canvas.selection.clear();
            if let Some(change) = change.name_change(None) {
                workspace.ask_elsewhere(change);
            }
        }
    }

    fn arrange(&mut self, workspace: &mut Workspace) {
        let Some(mission) = mission_of(workspace) else { return };
        // A frame of an open step has no position of its own.
        let is_node = |item: &Item| match item {
            Item::Place(_) | Item::Transition(_) => true,
            step => matches!(step, Item::Step { .. }) && self.diagram.node(*step).is_some(),
        };
        let selected: Vec<_> = self.pane.selected().into_iter().filter(is_node).collect();
        let only = if selected.len() > 1 { &selected[..] } else { &[] };
        let places = arranged(&self.diagram.nodes, mission, only, self.pane.canvas.shape());
        self.pane.place("arrange", &places, workspace);
        if only.is_empty() {
            self.pane.canvas.fit_everything();
        }
    }
}

/// Every place, transition, variable, check and sub-mission, with its words.
pub(super) fn list_findable(workspace: &Workspace) -> Vec<(Item, String)> {
    let Some(mission) = mission_of(workspace) else { return Vec::new() };
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
