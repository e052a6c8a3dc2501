//! What the user does in the drawing, as edits of the file.

use armor_robotfile::Position;
use armor_robotfile::mission::ArcKind;
use eframe::egui::{self, Pos2, Rect, Vec2, vec2};

use super::palette::Dragged;
use super::quick::Quick;
use super::{MissionView, mission_of};
use crate::canvas::{Event, Hit, PortAt, snapped};
use crate::desk::{Desk, View};
use crate::item::Item;
use crate::layout;
use crate::mission::edits;
use crate::mission::rules::Join;
use crate::project::{Documents, Refused};

/// A place or a transition with its texts needs about so much.
pub(super) const ROOM: Vec2 = vec2(100.0, 70.0);

impl MissionView {
    pub(super) fn take(&mut self, event: Event, ui: &egui::Ui, desk: &mut Desk) {
        match event {
            Event::Moved(by) => self.moved(by, desk),
            Event::Joined(from, to) => self.join(from, to, desk),
            Event::Refused(why) => desk.messages.warn(format!("not joined: {why}")),
            Event::Loose { from, at } => self.quick = self.quick_for(from, at, desk),
            Event::Rewired { wire, stays, to } => self.lead(wire, stays, to, desk),
            Event::Opened(item) => {
                self.canvas.selection = [item].into();
                desk.settings.properties = true;
                self.form.take_focus();
            }
            Event::OpenedEmpty(at) => self.quick = Some(Quick::to_add(desk, at)),
            Event::Menu { of, at } => self.menu = (of, at),
            Event::Resized(item, rect) => resized(&item, rect, desk),
        }
        ui.ctx().request_repaint();
    }

    /// In a simulation a click on a transition fires it.
    pub(super) fn fire_clicked(&mut self, hovered: Option<Hit>, desk: &mut Desk) {
        let node = match hovered {
            Some(Hit::Node(node) | Hit::Port(PortAt { node, .. })) => node,
            _ => return,
        };
        if let Some(Item::Transition(name)) = self.diagram.nodes.get(node).map(|n| n.item.clone()) {
            self.fire(&name, desk);
        }
    }

    fn join(&mut self, from: PortAt, to: PortAt, desk: &mut Desk) {
        let Some(mission) = mission_of(desk) else { return };
        match self.rules(mission, &self.diagram).join(from, to) {
            Ok(join) => self.make_join(join, desk),
            Err(why) => desk.messages.warn(format!("not joined: {why}")),
        }
    }

    /// An arc was taken by its end and let go elsewhere; nowhere, it is removed.
    fn lead(&mut self, wire: usize, stays: PortAt, to: Option<PortAt>, desk: &mut Desk) {
        let item = self.diagram.wires.get(wire).map(|wire| wire.item.clone());
        let Some(Item::Arc { transition, place, kind }) = item else { return };
        let Some(to) = to else {
            desk.edit(format!("remove the arc of {transition} and {place}"), |documents| {
                Ok(edits::remove_arc(documents.mission()?, &transition, &place, kind)?)
            });
            return;
        };
        let Some(mission) = mission_of(desk) else { return };
        let (new, at) = match self.rules(mission, &self.diagram).led(wire, stays, to) {
            Ok((transition, place)) => (transition.to_owned(), place.to_owned()),
            Err(why) => return desk.messages.warn(format!("not joined: {why}")),
        };
        let what = format!("lead the arc of {transition} and {place} elsewhere");
        let is_led = desk.edit(what, |documents| {
            let document = documents.mission()?;
            Ok(edits::lead_arc(document, (&transition, &place), (&new, &at), kind)?)
        });
        if is_led {
            self.select_next = vec![Item::Arc { transition: new, place: at, kind }];
        }
    }

    /// Joins two things; between two of a sort, what is missing is put halfway.
    pub(super) fn make_join(&mut self, join: Join, desk: &mut Desk) {
        let mut added = None;
        let between = |one: &Item, other: &Item| {
            let middle = |item| self.diagram.rect(item).map(|rect| rect.center());
            let (one, other) = (middle(one)?, middle(other)?);
            Some(one.lerp(other, 0.5))
        };
        let what = match &join {
            Join::Arc { transition, place, .. } => format!("join {transition} and {place}"),
            Join::Transition { from, to } => format!("add a transition from {from} to {to}"),
            Join::Place { from, to } => format!("add a place between {from} and {to}"),
            Join::Enter { place, .. } => format!("enter the sub-mission from {place}"),
            Join::Leave { place, .. } => format!("leave the sub-mission to {place}"),
        };
        let at = match &join {
            Join::Transition { from, to } if from == to => {
                // A loop goes out of the place and comes back.
                let place = self.diagram.rect(&Item::Place(from.clone()));
                place.map(|rect| rect.center_bottom() + vec2(0.0, 60.0))
            }
            Join::Transition { from, to } => {
                between(&Item::Place(from.clone()), &Item::Place(to.clone()))
            }
            Join::Place { from, to } => {
                between(&Item::Transition(from.clone()), &Item::Transition(to.clone()))
            }
            _ => None,
        };
        let at = at.map(|at| self.diagram.free_spot(at, ROOM)).unwrap_or_default();
        desk.edit(what, |documents| {
            added = Some(joined(documents, &join, at)?);
            Ok(())
        });
        self.select_next = added.into_iter().collect();
    }

    /// What is selected was dragged. What had no place in the file gets one with the first drag, so
    /// that nothing else moves.
    fn moved(&mut self, by: Vec2, desk: &mut Desk) {
        let selected = self.selected_areas();
        let count = selected.len();
        let mut places: Vec<_> =
            selected.into_iter().map(|(item, area)| (item, area.min + by)).collect();
        let rest = self.unplaced.iter().filter(|item| !self.canvas.selection.contains(item));
        let rest: Vec<_> = rest.cloned().collect();
        for item in rest {
            if let Some(area) = self.diagram.rect(&item) {
                places.push((item, area.min));
            }
        }
        let what = match self.canvas.only() {
            Some(item) => format!("move {item}"),
            None => format!("move {count} things"),
        };
        desk.edit(what, |documents| place(documents, &places));
    }

    /// Where what is selected is drawn; arcs have no place of their own.
    pub(super) fn selected_areas(&self) -> Vec<(Item, Rect)> {
        let items = self.canvas.selection.iter();
        let items = items.filter(|item| !matches!(item, Item::Arc { .. } | Item::Submission(_)));
        items.filter_map(|item| Some((item.clone(), self.diagram.rect(item)?))).collect()
    }

    /// Something of the palette was let go over the drawing.
    pub(super) fn dropped(&mut self, dragged: &Dragged, at: Pos2, desk: &mut Desk) {
        match dragged {
            Dragged::Place => self.add_place("place", &[], at - vec2(48.0, 22.0), desk),
            Dragged::Transition => self.add_transition(at - vec2(6.0, 23.0), desk),
            Dragged::Active(component) => {
                self.add_place(component, &[component], at - vec2(60.0, 30.0), desk);
            }
        }
    }

    pub(super) fn add_place(&mut self, wish: &str, components: &[&str], at: Pos2, desk: &mut Desk) {
        let mut added = None;
        desk.edit("add a place", |documents| {
            let at = position(snapped(at));
            added = Some(edits::add_place(documents.mission()?, wish, components, at)?);
            Ok(())
        });
        self.select_next = added.into_iter().map(Item::Place).collect();
        desk.settings.properties = true;
    }

    pub(super) fn add_transition(&mut self, at: Pos2, desk: &mut Desk) {
        let mut added = None;
        desk.edit("add a transition", |documents| {
            let at = Some(position(snapped(at)));
            added = Some(edits::add_transition(documents.mission()?, "transition", &[], &[], at)?);
            Ok(())
        });
        self.select_next = added.into_iter().map(Item::Transition).collect();
        desk.settings.properties = true;
    }
}

fn joined(documents: &mut Documents, join: &Join, at: Pos2) -> Result<Item, Refused> {
    let document = documents.mission()?;
    Ok(match join {
        Join::Arc { transition, place, kind } => {
            edits::add_arc(document, transition, place, *kind)?;
            Item::Arc { transition: transition.clone(), place: place.clone(), kind: *kind }
        }
        Join::Transition { from, to } => {
            let at = Some(position(at - vec2(6.0, 23.0)));
            let wish = format!("to-{to}");
            let wish = if armor_wire::name::is_name(&wish) { wish } else { "transition".into() };
            Item::Transition(edits::add_transition(document, &wish, &[from], &[to], at)?)
        }
        Join::Place { from, to } => {
            let at = position(at - vec2(48.0, 22.0));
            let name = edits::add_place(document, "place", &[], at)?;
            edits::add_arc(document, from, &name, ArcKind::Put)?;
            edits::add_arc(document, to, &name, ArcKind::Take)?;
            Item::Place(name)
        }
        Join::Enter { submission, place } => {
            edits::set_submission(document, *submission, "in", Some(place))?;
            Item::Submission(*submission)
        }
        Join::Leave { submission, place } => {
            edits::set_submission(document, *submission, "out", Some(place))?;
            Item::Submission(*submission)
        }
    })
}

/// Puts places, transitions, groups and notes where they are to be shown.
pub(super) fn place(documents: &mut Documents, places: &[(Item, Pos2)]) -> Result<(), Refused> {
    layout::place(documents.mission()?, View::Mission, places)
}

fn resized(item: &Item, rect: Rect, desk: &mut Desk) {
    if let Item::Decoration { view, number } = item {
        desk.edit("change a size", |documents| {
            layout::place_decoration(documents.mission()?, *view, *number, rect)
        });
    }
}

pub(super) fn position(at: Pos2) -> Position {
    Position { x: at.x.into(), y: at.y.into() }
}
