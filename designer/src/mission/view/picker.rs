//! The small list at the pointer, and what is done with what is picked from it.

use armor_robotfile::mission::ArcKind;
use eframe::egui::{self, Pos2, vec2};

use super::choices::{MissionChoice, MissionPicker, components, entry};
use super::gestures;
use super::state::{MissionView, mission_of};
use crate::canvas::PortAt;
use crate::item::Item;
use crate::mission::drawing::{IN, WHOLE};
use crate::mission::edits;
use crate::panels::pick::{Entry, Picked, Picker};
use crate::workspace::Workspace;

impl MissionView {
    /// What an arc dropped on the background can lead to.
    pub(super) fn picker_for(
        &self,
        from: PortAt,
        at: Pos2,
        workspace: &Workspace,
    ) -> Option<MissionPicker> {
        let item = self.diagram.nodes.get(from.node)?.item;
        let is_backwards = from.port == IN;
        let mut entries = Vec::new();
        match &item {
            Item::Place(_) => {
                entries.push(entry(
                    "transition and place",
                    "A transition that leads on to a new place.",
                    MissionChoice::TransitionAndPlace(Vec::new()),
                ));
                entries.push(entry(
                    "transition",
                    "A transition that takes from it.",
                    MissionChoice::Transition,
                ));
                entries.extend(components(workspace).into_iter().map(|name| {
                    let label = format!("transition and place with {name}");
                    entry(&label, "", MissionChoice::TransitionAndPlace(vec![name]))
                }));
            }
            Item::Transition(_) | Item::Submission(_) => {
                entries.push(entry("place", "A new place.", MissionChoice::Place(Vec::new())));
                entries.extend(components(workspace).into_iter().map(|name| {
                    let label = format!("place with {name}");
                    entry(
                        &label,
                        "A new place that activates it.",
                        MissionChoice::Place(vec![name]),
                    )
                }));
            }
            _ => return None,
        }
        entries.extend(self.joinable(from, workspace));
        let from = Some((item, is_backwards));
        Some(MissionPicker {
            picker: Picker::default(),
            name: "Connect the arc to",
            entries,
            at,
            from,
        })
    }

    /// Everything that what is selected can be joined with.
    pub(super) fn picker_to_connect(&self, workspace: &Workspace) -> Option<MissionPicker> {
        let node = self.diagram.node(self.pane.only()?)?;
        let from = PortAt { node, port: WHOLE };
        let at = self.diagram.nodes[node].rect.right_top() + vec2(20.0, 0.0);
        let mut picker = self.picker_for(from, at, workspace)?;
        picker.name = "Connect with";
        Some(picker)
    }

    fn joinable(&self, from: PortAt, workspace: &Workspace) -> Vec<Entry<MissionChoice>> {
        let Some(mission) = mission_of(workspace) else { return Vec::new() };
        let rules = self.rules(mission, &self.diagram);
        let nodes = (0..self.diagram.nodes.len()).map(|node| PortAt { node, port: WHOLE });
        let may = nodes.filter(|to| rules.join(from, *to).is_ok());
        may.map(|to| {
            let label = &self.diagram.nodes[to.node].label;
            entry(&format!("to {label}"), "", MissionChoice::Join(from, to))
        })
        .collect()
    }

    pub(super) fn show_picker(&mut self, ui: &egui::Ui, workspace: &mut Workspace) {
        let Some(mut picker) = self.picker.take() else { return };
        let at = self.pane.canvas.to_window(picker.at);
        match picker.picker.show_at(ui, picker.name, at, &picker.entries) {
            Picked::Open => self.picker = Some(picker),
            Picked::One(pick) => self.take_choice(pick, &picker, workspace),
            Picked::Left => {}
        }
    }

    fn take_choice(
        &mut self,
        pick: MissionChoice,
        picker: &MissionPicker,
        workspace: &mut Workspace,
    ) {
        let names = |components: &[String]| -> Vec<String> { components.to_vec() };
        match (pick, &picker.from) {
            (MissionChoice::Join(from, to), _) => {
                let Some(mission) = mission_of(workspace) else { return };
                match self.rules(mission, &self.diagram).join(from, to) {
                    Ok(join) => self.make_join(join, workspace),
                    Err(why) => workspace.messages.warn(format!("Not connected: {why}")),
                }
            }
            (MissionChoice::Place(components), None) => {
                let components = names(&components);
                let list: Vec<_> = components.iter().map(String::as_str).collect();
                let preferred = list.first().copied().unwrap_or("place");
                self.add_place(preferred, &list, picker.at, workspace);
            }
            (MissionChoice::Transition, None) => self.add_transition(picker.at, workspace),
            (MissionChoice::TransitionAndPlace(_), None) => {}
            (pick, Some((from, is_backwards))) => {
                self.add_joined(&pick, from, *is_backwards, picker.at, workspace);
            }
        }
    }

    /// Adds something with the arc that was drawn to it, in one step.
    fn add_joined(
        &mut self,
        pick: &MissionChoice,
        from: &Item,
        is_backwards: bool,
        at: Pos2,
        workspace: &mut Workspace,
    ) {
        let mut added = None;
        let kind = self.kind;
        workspace.edit(format!("continue from {from}"), |documents| {
            let document = documents.mission()?;
            let position = gestures::position;
            added = match (pick, from) {
                (MissionChoice::Transition, Item::Place(place)) => {
                    let at = Some(position(at - vec2(6.0, 23.0)));
                    let name = edits::add_transition(document, "transition", &[], &[], at)?;
                    edits::add_arc(document, &name, place, kind)?;
                    Some(Item::transition(name))
                }
                (MissionChoice::TransitionAndPlace(components), Item::Place(place)) => {
                    let list: Vec<_> = components.iter().map(String::as_str).collect();
                    let preferred = list.first().copied().unwrap_or("place");
                    let target = edits::add_place(
                        document,
                        preferred,
                        &list,
                        position(at + vec2(100.0, -22.0)),
                    )?;
                    let bar = Some(position(at - vec2(6.0, 23.0)));
                    let preferred = format!("to-{target}");
                    edits::add_transition(document, &preferred, &[place], &[&target], bar)?;
                    Some(Item::place(target))
                }
                (MissionChoice::Place(components), Item::Transition(transition)) => {
                    let list: Vec<_> = components.iter().map(String::as_str).collect();
                    let preferred = list.first().copied().unwrap_or("place");
                    let at = position(at - vec2(48.0, 22.0));
                    let name = edits::add_place(document, preferred, &list, at)?;
                    let kind = if is_backwards { kind } else { ArcKind::Put };
                    edits::add_arc(document, transition, &name, kind)?;
                    Some(Item::place(name))
                }
                (MissionChoice::Place(components), Item::Submission(number)) => {
                    let list: Vec<_> = components.iter().map(String::as_str).collect();
                    let preferred = list.first().copied().unwrap_or("place");
                    let at = position(at - vec2(48.0, 22.0));
                    let name = edits::add_place(document, preferred, &list, at)?;
                    edits::set_submission(document, *number, "out", Some(&name))?;
                    Some(Item::place(name))
                }
                _ => None,
            };
            Ok(())
        });
        self.pane.select_when_drawn(added);
    }
}
