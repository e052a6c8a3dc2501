//! What the user does in the drawing, as edits of the file.

use armor_robotfile::Position;
use armor_robotfile::mission::ArcKind;
use eframe::egui::{self, Pos2, Vec2, vec2};

use super::choices::MissionPicker;
use super::part::DraggedPart;
use super::state::{MissionView, mission_of};
use crate::canvas::{CanvasEvent, Hit, PortAt, snapped};
use crate::item::Item;
use crate::mission::edits;
use crate::mission::rules::Join;
use crate::project::{Documents, Refused};
use crate::workspace::Workspace;

/// The space that a place or a transition needs with its texts.
pub(super) const NODE_SPACE: Vec2 = vec2(100.0, 70.0);

impl MissionView {
    pub(super) fn take_event(
        &mut self,
        event: CanvasEvent<Item>,
        ui: &egui::Ui,
        workspace: &mut Workspace,
    ) {
        match event {
            CanvasEvent::Moved(by) => {
                let unplaced = self.unplaced.iter();
                let position = |item: &Item| Some((*item, self.diagram.rect(*item)?.min));
                let unplaced: Vec<_> = unplaced.filter_map(position).collect();
                self.pane.move_selected(by, &self.diagram, &unplaced, workspace);
            }
            CanvasEvent::Joined(from, to) => self.connect(from, to, workspace),
            CanvasEvent::Refused(why) => workspace.messages.warn(format!("Not connected: {why}")),
            CanvasEvent::Loose { from, at } => self.picker = self.picker_for(from, at, workspace),
            CanvasEvent::Rewired { wire, stays, to } => self.reconnect(wire, stays, to, workspace),
            CanvasEvent::Opened(item @ Item::Step { .. }) => {
                self.toggle_steps(&[item].into(), workspace);
            }
            CanvasEvent::Opened(item) => {
                self.pane.select([item]);
                workspace.settings.properties = true;
                self.form.take_focus();
            }
            CanvasEvent::OpenedEmpty(at) => {
                self.picker = Some(MissionPicker::to_add(workspace, at));
            }
            CanvasEvent::Menu { of, at } => self.pane.menu = (of, at),
            CanvasEvent::Resized(item, rect) => self.pane.resize(item, rect, workspace),
        }
        ui.ctx().request_repaint();
    }

    /// In a simulation a click on a transition fires it.
    pub(super) fn fire_clicked(&mut self, hovered: Option<Hit>, workspace: &mut Workspace) {
        let node = match hovered {
            Some(Hit::Node(node) | Hit::Port(PortAt { node, .. })) => node,
            _ => return,
        };
        if let Some(Item::Transition(name)) = self.diagram.nodes.get(node).map(|n| n.item) {
            self.fire(&name, workspace);
        }
    }

    fn connect(&mut self, from: PortAt, to: PortAt, workspace: &mut Workspace) {
        let Some(mission) = mission_of(workspace) else { return };
        match self.rules(mission, &self.diagram).join(from, to) {
            Ok(join) => self.make_join(join, workspace),
            Err(why) => workspace.messages.warn(format!("Not connected: {why}")),
        }
    }

    /// An end of an arc was dragged elsewhere; dropped on the background, the arc is removed.
    fn reconnect(
        &mut self,
        wire: usize,
        stays: PortAt,
        to: Option<PortAt>,
        workspace: &mut Workspace,
    ) {
        let item = self.diagram.wires.get(wire).map(|wire| wire.item);
        let Some(Item::Arc { transition, place, kind }) = item else { return };
        let Some(to) = to else {
            workspace.edit(format!("remove the arc of {transition} and {place}"), |documents| {
                Ok(edits::remove_arc(documents.mission()?, &transition, &place, kind)?)
            });
            return;
        };
        let Some(mission) = mission_of(workspace) else { return };
        let (new, at) = match self.rules(mission, &self.diagram).led(wire, stays, to) {
            Ok((transition, place)) => (transition.to_owned(), place.to_owned()),
            Err(why) => return workspace.messages.warn(format!("Not connected: {why}")),
        };
        let what = format!("reconnect the arc of {transition} and {place}");
        let is_led = workspace.edit(what, |documents| {
            let document = documents.mission()?;
            Ok(edits::lead_arc(document, (&transition, &place), (&new, &at), kind)?)
        });
        if is_led {
            self.pane.select_when_drawn([Item::arc(new, at, kind)]);
        }
    }

    /// Joins two things; between two of a sort, what is missing is put halfway.
    pub(super) fn make_join(&mut self, join: Join, workspace: &mut Workspace) {
        let mut added = None;
        let between = |one: Item, other: Item| {
            let middle = |item| self.diagram.rect(item).map(|rect| rect.center());
            let (one, other) = (middle(one)?, middle(other)?);
            Some(one.lerp(other, 0.5))
        };
        let what = match &join {
            Join::Arc { transition, place, .. } => format!("connect {transition} and {place}"),
            Join::Transition { from, to } => format!("add a transition from {from} to {to}"),
            Join::Place { from, to } => format!("add a place between {from} and {to}"),
            Join::Enter { place, .. } => format!("enter the sub-mission from {place}"),
            Join::Leave { place, .. } => format!("leave the sub-mission to {place}"),
        };
        let at = match &join {
            Join::Transition { from, to } if from == to => {
                // A loop goes out of the place and comes back.
                let place = self.diagram.rect(Item::place(from));
                place.map(|rect| rect.center_bottom() + vec2(0.0, 60.0))
            }
            Join::Transition { from, to } => between(Item::place(from), Item::place(to)),
            Join::Place { from, to } => between(Item::transition(from), Item::transition(to)),
            _ => None,
        };
        let at = at.map(|at| self.diagram.free_spot(at, NODE_SPACE)).unwrap_or_default();
        workspace.edit(what, |documents| {
            added = Some(joined(documents, &join, at)?);
            Ok(())
        });
        self.pane.select_when_drawn(added);
    }

    /// An entry of the palette was dropped on the drawing.
    pub(super) fn add_part(&mut self, dragged: &DraggedPart, at: Pos2, workspace: &mut Workspace) {
        match dragged {
            DraggedPart::Place => self.add_place("place", &[], at - vec2(48.0, 22.0), workspace),
            DraggedPart::Transition => self.add_transition(at - vec2(6.0, 23.0), workspace),
            DraggedPart::Active(component) => {
                self.add_place(component, &[component], at - vec2(60.0, 30.0), workspace);
            }
        }
    }

    pub(super) fn add_place(
        &mut self,
        preferred: &str,
        components: &[&str],
        at: Pos2,
        workspace: &mut Workspace,
    ) {
        let mut added = None;
        workspace.edit("add a place", |documents| {
            let at = position(snapped(at));
            added = Some(edits::add_place(documents.mission()?, preferred, components, at)?);
            Ok(())
        });
        self.pane.select_when_drawn(added.map(Item::place));
        workspace.settings.properties = true;
    }

    pub(super) fn add_transition(&mut self, at: Pos2, workspace: &mut Workspace) {
        let mut added = None;
        workspace.edit("add a transition", |documents| {
            let at = Some(position(snapped(at)));
            added = Some(edits::add_transition(documents.mission()?, "transition", &[], &[], at)?);
            Ok(())
        });
        self.pane.select_when_drawn(added.map(Item::transition));
        workspace.settings.properties = true;
    }
}

fn joined(documents: &mut Documents, join: &Join, at: Pos2) -> Result<Item, Refused> {
    let document = documents.mission()?;
    Ok(match join {
        Join::Arc { transition, place, kind } => {
            edits::add_arc(document, transition, place, *kind)?;
            Item::arc(transition, place, *kind)
        }
        Join::Transition { from, to } => {
            let at = Some(position(at - vec2(6.0, 23.0)));
            let preferred = format!("to-{to}");
            let preferred =
                if armor_wire::name::is_name(&preferred) { preferred } else { "transition".into() };
            Item::transition(edits::add_transition(document, &preferred, &[from], &[to], at)?)
        }
        Join::Place { from, to } => {
            let at = position(at - vec2(48.0, 22.0));
            let name = edits::add_place(document, "place", &[], at)?;
            edits::add_arc(document, from, &name, ArcKind::Put)?;
            edits::add_arc(document, to, &name, ArcKind::Take)?;
            Item::place(name)
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

pub(super) fn position(at: Pos2) -> Position {
    Position { x: at.x.into(), y: at.y.into() }
}
