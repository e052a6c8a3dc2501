//! A whole drawing: its nodes, wires and decorations, and where each of them is.

use std::collections::HashMap;
use std::hash::Hash;

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::bar_text::{BarText, place_texts};
use crate::canvas::bundle::{Bundle, bundles};
use crate::canvas::edges::route_ends;
use crate::canvas::node::{Decoration, DiagramNode, NodePort, PortAt, Wire};
use crate::canvas::route::{Route, route};
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
    routes: Vec<Route>,
    /// The text of each node that is a bar.
    texts: Vec<Option<BarText>>,
    /// Links that are drawn as one.
    bundles: Vec<Bundle>,
    /// The bundle of each wire that is in one.
    bundle_of: HashMap<usize, usize>,
}

impl<Id: DiagramId> Diagram<Id> {
    /// A drawing of these.
    pub fn new(
        nodes: Vec<DiagramNode<Id>>,
        wires: Vec<Wire<Id>>,
        decorations: Vec<Decoration<Id>>,
    ) -> Self {
        let index = nodes.iter().enumerate().map(|(n, node)| (node.item, n)).collect();
        let texts = place_texts(&nodes);
        let areas = nodes.iter().map(|node| node.rect).enumerate();
        let text_areas = texts.iter().enumerate().filter_map(|(n, text)| Some((n, (*text)?.area)));
        let obstacles: Vec<_> = areas.chain(text_areas).collect();
        let ends = wires.iter().map(|wire| route_ends(&nodes, wire)).enumerate();
        let routes = ends.map(|(n, ends)| match ends {
            Some(ends) => route(&obstacles, &ends, n),
            None => Route::Curve,
        });
        let routes = routes.collect();
        let bundles = bundles(&nodes, &wires, &obstacles);
        let numbered = bundles.iter().enumerate();
        let bundle_of =
            numbered.flat_map(|(n, bundle)| bundle.wires.iter().map(move |wire| (*wire, n)));
        let bundle_of = bundle_of.collect();
        Self { nodes, wires, decorations, index, routes, texts, bundles, bundle_of }
    }

    /// How a wire gets around the blocks between its ends.
    pub(super) fn route(&self, wire: usize) -> &Route {
        self.routes.get(wire).unwrap_or(&Route::Curve)
    }

    /// The text of a node, if it is a bar.
    pub(super) fn bar_text(&self, node: usize) -> Option<BarText> {
        self.texts.get(node).copied().flatten()
    }

    /// The links that are drawn as one with a wire, itself among them.
    pub(super) fn bundle(&self, wire: usize) -> Option<&Bundle> {
        self.bundles.get(*self.bundle_of.get(&wire)?)
    }

    /// All bundles.
    pub(super) fn bundles(&self) -> &[Bundle] {
        &self.bundles
    }

    /// Where a node is with its text.
    pub fn area(&self, node: usize) -> Rect {
        let rect = self.nodes.get(node).map_or(Rect::NOTHING, |node| node.rect);
        self.bar_text(node).map_or(rect, |text| rect.union(text.area))
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

    /// The position nearest to this one, on the grid, with room for a node or a note. In a group
    /// there is room.
    pub fn free_spot(&self, at: Pos2, room: Vec2) -> Pos2 {
        let steps = || (-8..=8).map(|step| step as f32 * 50.0);
        let mut ways: Vec<_> =
            steps().flat_map(|x| steps().map(move |y| Vec2::new(x, y))).collect();
        ways.sort_by(|one, other| one.length().total_cmp(&other.length()));
        let is_free = |way: &Vec2| {
            let wanted = Rect::from_center_size(at + *way, room);
            let notes = self.decorations.iter().filter(|it| it.is_note).map(|it| it.rect);
            let nodes = (0..self.nodes.len()).map(|node| self.area(node));
            !nodes.chain(notes).any(|taken| taken.intersects(wanted))
        };
        snapped(at + ways.into_iter().find(is_free).unwrap_or_default())
    }

    /// The smallest area with everything in it but the wires; none if there is nothing.
    pub fn bounds(&self) -> Option<Rect> {
        let nodes = (0..self.nodes.len()).map(|node| self.area(node));
        nodes.chain(self.decorations.iter().map(|d| d.rect)).reduce(Rect::union)
    }
}

impl<Id: DiagramId> Default for Diagram<Id> {
    fn default() -> Self {
        Self::new(Vec::new(), Vec::new(), Vec::new())
    }
}
