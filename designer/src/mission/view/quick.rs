//! The small list at the pointer: what can be added there, and what an arc that was let go over
//! nothing can lead to.

use eframe::egui::{self, Pos2, vec2};

use super::{MissionView, gestures, mission_of};
use crate::canvas::PortAt;
use crate::desk::Desk;
use crate::item::Item;
use crate::mission::drawing::{IN, WHOLE};
use crate::mission::edits;
use crate::panels::pick::{Entry, Picked, Picker};
use armor_robotfile::mission::ArcKind;

/// What is done with what is picked.
#[derive(Clone, Debug, PartialEq)]
enum Pick {
    /// A place, and the components that it activates.
    Place(Vec<String>),
    /// A transition.
    Transition,
    /// A transition that leads on to a new place.
    TransitionAndPlace(Vec<String>),
    /// These are joined.
    Join(PortAt, PortAt),
}

/// The list.
pub(super) struct Quick {
    picker: Picker,
    name: &'static str,
    entries: Vec<Entry<Pick>>,
    at: Pos2,
    /// What the arc comes from, and whether it is drawn backwards.
    from: Option<(Item, bool)>,
}

impl Quick {
    /// Everything that can be added.
    pub(super) fn to_add(desk: &Desk, at: Pos2) -> Self {
        let mut entries = vec![
            entry("place", "A state of the mission.", Pick::Place(Vec::new())),
            entry("transition", "A change of state.", Pick::Transition),
        ];
        entries.extend(components(desk).into_iter().map(|name| {
            let label = format!("place with {name}");
            entry(&label, "A place that activates it.", Pick::Place(vec![name]))
        }));
        Self { picker: Picker::default(), name: "Add to the mission", entries, at, from: None }
    }
}

fn entry(name: &str, about: &str, value: Pick) -> Entry<Pick> {
    Entry { name: name.to_owned(), about: about.to_owned(), value }
}

/// The components that a mission may control.
fn components(desk: &Desk) -> Vec<String> {
    let system = desk.project.configuration().map(|configuration| &configuration.system);
    let components = system.into_iter().flat_map(|system| &system.components);
    let may = components.filter(|component| component.controllable);
    may.map(|component| component.name.value.clone()).collect()
}

impl MissionView {
    /// What an arc that was let go over nothing can lead to.
    pub(super) fn quick_for(&self, from: PortAt, at: Pos2, desk: &Desk) -> Option<Quick> {
        let item = self.diagram.nodes.get(from.node)?.item.clone();
        let is_backwards = from.port == IN;
        let mut entries = Vec::new();
        match &item {
            Item::Place(_) => {
                entries.push(entry(
                    "transition and place",
                    "A transition that leads on to a new place.",
                    Pick::TransitionAndPlace(Vec::new()),
                ));
                entries.push(entry(
                    "transition",
                    "A transition that takes from it.",
                    Pick::Transition,
                ));
                entries.extend(components(desk).into_iter().map(|name| {
                    let label = format!("transition and place with {name}");
                    entry(&label, "", Pick::TransitionAndPlace(vec![name]))
                }));
            }
            Item::Transition(_) | Item::Submission(_) => {
                entries.push(entry("place", "A new place.", Pick::Place(Vec::new())));
                entries.extend(components(desk).into_iter().map(|name| {
                    let label = format!("place with {name}");
                    entry(&label, "A new place that activates it.", Pick::Place(vec![name]))
                }));
            }
            _ => return None,
        }
        entries.extend(self.joinable(from, desk));
        let from = Some((item, is_backwards));
        Some(Quick { picker: Picker::default(), name: "Lead the arc to", entries, at, from })
    }

    /// Everything that what is selected can be joined with.
    pub(super) fn quick_to_join(&self, desk: &Desk) -> Option<Quick> {
        let node = self.diagram.node(self.canvas.only()?)?;
        let from = PortAt { node, port: WHOLE };
        let at = self.diagram.nodes[node].rect.right_top() + vec2(20.0, 0.0);
        let mut quick = self.quick_for(from, at, desk)?;
        quick.name = "Join with";
        Some(quick)
    }

    fn joinable(&self, from: PortAt, desk: &Desk) -> Vec<Entry<Pick>> {
        let Some(mission) = mission_of(desk) else { return Vec::new() };
        let rules = self.rules(mission, &self.diagram);
        let nodes = (0..self.diagram.nodes.len()).map(|node| PortAt { node, port: WHOLE });
        let may = nodes.filter(|to| rules.join(from, *to).is_ok());
        may.map(|to| {
            let label = &self.diagram.nodes[to.node].label;
            entry(&format!("to {label}"), "", Pick::Join(from, to))
        })
        .collect()
    }

    pub(super) fn show_quick(&mut self, ui: &egui::Ui, desk: &mut Desk) {
        let Some(mut quick) = self.quick.take() else { return };
        let at = self.canvas.to_window(quick.at);
        match quick.picker.show_at(ui, quick.name, at, &quick.entries) {
            Picked::Open => self.quick = Some(quick),
            Picked::One(pick) => self.take_pick(pick, &quick, desk),
            Picked::Left => {}
        }
    }

    fn take_pick(&mut self, pick: Pick, quick: &Quick, desk: &mut Desk) {
        let names = |components: &[String]| -> Vec<String> { components.to_vec() };
        match (pick, &quick.from) {
            (Pick::Join(from, to), _) => {
                let Some(mission) = mission_of(desk) else { return };
                match self.rules(mission, &self.diagram).join(from, to) {
                    Ok(join) => self.make_join(join, desk),
                    Err(why) => desk.messages.warn(format!("not joined: {why}")),
                }
            }
            (Pick::Place(components), None) => {
                let components = names(&components);
                let list: Vec<_> = components.iter().map(String::as_str).collect();
                let wish = list.first().copied().unwrap_or("place");
                self.add_place(wish, &list, quick.at, desk);
            }
            (Pick::Transition, None) => self.add_transition(quick.at, desk),
            (Pick::TransitionAndPlace(_), None) => {}
            (pick, Some((from, is_backwards))) => {
                self.add_joined(&pick, from, *is_backwards, quick.at, desk);
            }
        }
    }

    /// Adds something with the arc that was drawn to it, in one step.
    fn add_joined(
        &mut self,
        pick: &Pick,
        from: &Item,
        is_backwards: bool,
        at: Pos2,
        desk: &mut Desk,
    ) {
        let mut added = None;
        let kind = self.kind;
        desk.edit(format!("lead {from} on"), |documents| {
            let document = documents.mission()?;
            let position = gestures::position;
            added = match (pick, from) {
                (Pick::Transition, Item::Place(place)) => {
                    let at = Some(position(at - vec2(6.0, 23.0)));
                    let name = edits::add_transition(document, "transition", &[], &[], at)?;
                    edits::add_arc(document, &name, place, kind)?;
                    Some(Item::Transition(name))
                }
                (Pick::TransitionAndPlace(components), Item::Place(place)) => {
                    let list: Vec<_> = components.iter().map(String::as_str).collect();
                    let wish = list.first().copied().unwrap_or("place");
                    let target =
                        edits::add_place(document, wish, &list, position(at + vec2(100.0, -22.0)))?;
                    let bar = Some(position(at - vec2(6.0, 23.0)));
                    let wish = format!("to-{target}");
                    edits::add_transition(document, &wish, &[place], &[&target], bar)?;
                    Some(Item::Place(target))
                }
                (Pick::Place(components), Item::Transition(transition)) => {
                    let list: Vec<_> = components.iter().map(String::as_str).collect();
                    let wish = list.first().copied().unwrap_or("place");
                    let at = position(at - vec2(48.0, 22.0));
                    let name = edits::add_place(document, wish, &list, at)?;
                    let kind = if is_backwards { kind } else { ArcKind::Put };
                    edits::add_arc(document, transition, &name, kind)?;
                    Some(Item::Place(name))
                }
                (Pick::Place(components), Item::Submission(number)) => {
                    let list: Vec<_> = components.iter().map(String::as_str).collect();
                    let wish = list.first().copied().unwrap_or("place");
                    let at = position(at - vec2(48.0, 22.0));
                    let name = edits::add_place(document, wish, &list, at)?;
                    edits::set_submission(document, *number, "out", Some(&name))?;
                    Some(Item::Place(name))
                }
                _ => None,
            };
            Ok(())
        });
        self.select_next = added.into_iter().collect();
    }
}
