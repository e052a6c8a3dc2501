//! The mission as a drawing: places as pills, transitions as bars, sub-missions as blocks.

mod arcs;
mod nodes;
mod positions;
mod scene;
mod steps;

use armor_robotfile::mission::{ArcKind, Mission};
use eframe::egui::Pos2;

use self::steps::RouteSteps;
use super::derived::{refusal, step_refusal};
use super::rules::{self, Join};
use crate::canvas::{Diagram, JoinRules, PortAt};
use crate::item::Item;
pub use positions::arranged;
pub use scene::Scene;
pub use steps::foldable_steps;

/// The port that is the node as a whole.
pub(super) const WHOLE: usize = 0;
/// The handle at the right edge.
pub(super) const OUT: usize = 1;
/// The left edge of a bar.
pub(super) const IN: usize = 2;

impl Scene<'_> {
    /// The drawing, and what the file gives no position.
    pub fn draw(&self) -> (Diagram<Item>, Vec<Item>) {
        let steps = RouteSteps::of(self.mission, self.opened);
        let mut nodes = steps.fold(self, self.nodes());
        let unplaced = positions::place(&mut nodes, self, &steps);
        let wires = self.wires(&nodes, &steps);
        let mut diagram = Diagram::new(nodes, wires, self.layout.decorations.clone());
        let frames = steps.frames(self.mission, &diagram);
        diagram.decorations.extend(frames);
        (diagram, unplaced)
    }

    /// Where the file shows a node.
    fn position(&self, item: &Item) -> Option<Pos2> {
        match item {
            Item::Place(name) => self.layout.blocks.get(name.as_str()).copied(),
            Item::Transition(name) => self.layout.transitions.get(name.as_str()).copied(),
            // That of its first place.
            Item::Step { route, step } => {
                self.layout.blocks.get(format!("{route}.{step}").as_str()).copied()
            }
            _ => None,
        }
    }
}

/// What may be joined in the drawing of a mission.
pub struct NetRules<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// Its drawing.
    pub diagram: &'a Diagram<Item>,
    /// What an arc from a place to a transition does.
    pub kind: ArcKind,
}

impl NetRules<'_> {
    /// What is drawn when two ports are joined, whichever the drag began at.
    ///
    /// # Errors
    /// Why they may not be.
    pub fn join(&self, from: PortAt, to: PortAt) -> Result<Join, String> {
        // What is drawn from the left edge of a bar is drawn backwards.
        let (from, to) = if from.port == IN { (to, from) } else { (from, to) };
        rules::join(self.mission, self.own_end(from)?, self.own_end(to)?, self.kind)
    }

    /// The transition and the place of an arc once its other end is at `to`.
    ///
    /// # Errors
    /// Why it may not be led there.
    pub fn led(&self, wire: usize, stays: PortAt, to: PortAt) -> Result<(&str, &str), String> {
        match self.diagram.wires.get(wire).map(|wire| &wire.item) {
            Some(Item::Arc { kind, .. }) => {
                rules::lead(self.mission, self.own_end(stays)?, self.own_end(to)?, *kind)
            }
            _ => Err("only arcs can be reconnected by their ends".to_owned()),
        }
    }

    /// An end that may be changed: the arcs of a derived transition are those of its route.
    fn own_end(&self, at: PortAt) -> Result<rules::End<'_>, String> {
        let end = self.end(at)?;
        let derived = match end {
            rules::End::Transition(name) => refusal(self.mission, name),
            _ => None,
        };
        derived.map_or(Ok(end), Err)
    }

    fn end(&self, at: PortAt) -> Result<rules::End<'_>, String> {
        match self.diagram.nodes.get(at.node).map(|node| &node.item) {
            Some(Item::Place(name)) => Ok(rules::End::Place(name)),
            Some(Item::Transition(name)) => Ok(rules::End::Transition(name)),
            Some(Item::Submission(number)) => Ok(rules::End::Submission(*number)),
            Some(item @ Item::Step { .. }) => Err(step_refusal(self.mission, item)
                .unwrap_or_else(|| "arcs connect places and transitions".to_owned())),
            _ => Err("arcs connect places and transitions".to_owned()),
        }
    }
}

impl JoinRules for NetRules<'_> {
    fn may_join(&self, from: PortAt, to: PortAt) -> Result<(), String> {
        self.join(from, to).map(|_| ())
    }

    fn may_lead(&self, wire: usize, stays: PortAt, to: PortAt) -> Result<(), String> {
        self.led(wire, stays, to).map(|_| ())
    }
}
