//! A whole drawing: its nodes, wires and decorations, and where each of them is.

use std::collections::HashMap;
use std::hash::Hash;

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::detour::{Detour, detour};
use crate::canvas::node::{Decoration, DiagramNode, NodePort, PortAt, Wire};
use crate::canvas::snap::snapped;

/// What identifies a thing that is drawn, to the caller that made the drawing.
pub trait DiagramId: Copy + Eq + Hash {}

impl<Id: Copy + Eq + Hash> DiagramId for Id {}

/// A whole drawing.
#[derive(Clone, Debug)]
pub struct Diagram<Id> {
    /// The nodes; later ones are drawn over earlier ones.
    pub nodes: Vec<DiagramNode<Id>>,
    /// The wires between their ports.
    pub wires: Vec<Wire<Id>>,
    /// Groups and notes; groups are drawn beneath everything.
    pub decorations: Vec<Decoration<Id>>,
    /// Number of each item's node.
    index: HashMap<Id, usize>,
    /// How each wire gets around the blocks between its ends.
    detours: Vec<Detour>,
}

impl<Id: DiagramId> Diagram<Id> {
    /// A drawing of these.
    pub fn new(
        nodes: Vec<DiagramNode<Id>>,
        wires: Vec<Wire<Id>>,
        decorations: Vec<Decoration<Id>>,
    ) -> Self {
        let index = nodes.iter().enumerate().map(|(n, node)| (node.item, n)).collect();
        let detours = wires.iter().enumerate().map(|(n, wire)| detour(&nodes, wire, n)).collect();
        Self { nodes, wires, decorations, index, detours }
    }

    /// The lower edge of the blocks that a wire leading back has to pass below.
    pub(super) fn low(&self, wire: usize) -> f32 {
        self.detours.get(wire).map_or(f32::NEG_INFINITY, |detour| detour.low)
    }

    /// The points that a wire passes to get around blocks.
    pub(super) fn via(&self, wire: usize) -> &[Pos2] {
        self.detours.get(wire).map(|detour| detour.via.as_slice()).unwrap_or_default()
    }

    /// The number of an item's node.
    pub fn node(&self, item: Id) -> Option<usize> {
        self.index.get(&item).copied()
    }

    /// A port by number.
    pub fn port(&self, at: PortAt) -> Option<&NodePort> {
        self.nodes.get(at.node)?.ports.get(at.port)
    }

    /// The name of a port; a port that is a whole node has the name of the node.
    pub fn name(&self, at: PortAt) -> &str {
        match self.port(at) {
            Some(port) if !port.label.is_empty() => &port.label,
            _ => self.nodes.get(at.node).map_or("", |node| &node.label),
        }
    }

    /// Where a port is.
    pub fn port_position(&self, at: PortAt) -> Option<Pos2> {
        let node = self.nodes.get(at.node)?;
        Some(node.rect.min + node.ports.get(at.port)?.at)
    }

    /// Whether an item is in the drawing.
    pub fn holds(&self, item: Id) -> bool {
        self.index.contains_key(&item)
            || self.wires.iter().any(|wire| wire.item == item)
            || self.decorations.iter().any(|decoration| decoration.item == item)
    }

    /// Where an item is.
    pub fn rect(&self, item: Id) -> Option<Rect> {
        if let Some(node) = self.node(item) {
            return Some(self.nodes[node].rect);
        }
        if let Some(decoration) = self.decorations.iter().find(|d| d.item == item) {
            return Some(decoration.rect);
        }
        let wire = self.wires.iter().find(|wire| wire.item == item)?;
        Some(Rect::from_two_pos(self.port_position(wire.from)?, self.port_position(wire.to)?))
    }

    /// The position nearest to this one, on the grid, with room for a node.
    pub fn free_spot(&self, at: Pos2, room: Vec2) -> Pos2 {
        let steps = || (-8..=8).map(|step| step as f32 * 50.0);
        let mut ways: Vec<_> =
            steps().flat_map(|x| steps().map(move |y| Vec2::new(x, y))).collect();
        ways.sort_by(|one, other| one.length().total_cmp(&other.length()));
        let is_free = |way: &Vec2| {
            let wanted = Rect::from_center_size(at + *way, room);
            !self.nodes.iter().any(|node| node.area().intersects(wanted))
        };
        snapped(at + ways.into_iter().find(is_free).unwrap_or_default())
    }

    /// The smallest area with everything in it but the wires; none if there is nothing.
    pub fn bounds(&self) -> Option<Rect> {
        let nodes = self.nodes.iter().map(DiagramNode::area);
        nodes.chain(self.decorations.iter().map(|d| d.rect)).reduce(Rect::union)
    }
}

impl<Id: DiagramId> Default for Diagram<Id> {
    fn default() -> Self {
        Self::new(Vec::new(), Vec::new(), Vec::new())
    }
}
