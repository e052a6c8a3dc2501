//! Folded groups: each is one block, whose ports are the ends of the links that cross its border.

use std::collections::BTreeMap;

use eframe::egui::{Rect, vec2};

use super::drawing::{FIRST_PORT, PORT_STEP, SystemDrawing, block_size, draw};
use super::rules::Joint;
use crate::canvas::{
    Badge, Diagram, DiagramNode, Direction, Mark, NodeLook, NodeShape, Outline, PortAt, PortSide,
    Wire,
};
use crate::item::Item;
use crate::layout::{self, FoldedGroup, Layout};
use crate::project::Project;
use crate::view::View;

/// What a drawing with folded groups does not show.
#[derive(Debug, Default)]
pub struct Hidden {
    /// The folded group that each hidden component, link, group or note is in.
    pub within: BTreeMap<Item, Item>,
    /// The ports of hidden components.
    pub joints: Vec<Joint>,
}

/// Draws the system of a project with its groups folded as the file has them.
pub fn draw_folded(project: &Project) -> SystemDrawing {
    let whole = draw(project);
    let document = project.document_with(armor_robotfile::Item::System);
    let layout = document.map(|document| layout::read(document, View::System)).unwrap_or_default();
    if layout.folded.is_empty() {
        return whole;
    }
    Folder::new(&whole, &layout).fold(&whole, &layout)
}

/// Turns a drawing into one with folded groups.
struct Folder {
    /// By node of the whole drawing: the folded group that it is in.
    groups: Vec<Option<usize>>,
    /// By node of the whole drawing: its number in the folded one, if it is shown.
    numbers: Vec<Option<usize>>,
    /// By folded group: its block, its joints, and the ends of the whole drawing at its ports.
    blocks: Vec<FoldedBlock>,
}

struct FoldedBlock {
    node: usize,
    /// The port of the whole drawing that each of its ports shows.
    ends: Vec<PortAt>,
}

impl Folder {
    fn new(whole: &SystemDrawing, layout: &Layout) -> Self {
        let nodes = &whole.diagram.nodes;
        let group_of = |node: &DiagramNode<Item>| {
            layout.folded.iter().position(|group| group.members.contains(&node.title))
        };
        let groups: Vec<_> = nodes.iter().map(group_of).collect();
        let mut count = 0;
        let mut number = |group: &Option<usize>| {
            let shown = group.is_none().then_some(count);
            count += usize::from(shown.is_some());
            shown
        };
        let numbers = groups.iter().map(&mut number).collect();
        let blocks = (0..layout.folded.len())
            .map(|n| FoldedBlock { node: count + n, ends: Vec::new() })
            .collect();
        Self { groups, numbers, blocks }
    }

    fn fold(mut self, whole: &SystemDrawing, layout: &Layout) -> SystemDrawing {
        let mut hidden = Hidden::default();
        let mut wires = Vec::new();
        // Ports in the order of the members, not of the links.
        let mut ends: Vec<_> =
            whole.diagram.wires.iter().filter(|wire| self.crosses(wire)).collect();
        ends.sort_by_key(|wire| (wire.from, wire.to));
        for wire in ends {
            self.add_end(wire.from);
            self.add_end(wire.to);
        }
        for wire in &whole.diagram.wires {
            let group = |at: PortAt| self.groups.get(at.node).copied().flatten();
            match (group(wire.from), group(wire.to)) {
                (Some(one), Some(other)) if one == other => {
                    hidden.within.insert(wire.item, item_of(&layout.folded[one]));
                }
                _ => wires.push(Wire {
                    from: self.moved(wire.from),
                    to: self.moved(wire.to),
                    ..wire.clone()
                }),
            }
        }
        let mut drawing = SystemDrawing::default();
        let mut nodes = Vec::new();
        for (n, node) in whole.diagram.nodes.iter().enumerate() {
            let joints = &whole.joints.ports[n];
            match self.groups[n] {
                None => {
                    nodes.push(node.clone());
                    drawing.joints.ports.push(joints.clone());
                }
                Some(group) => {
                    hidden.within.insert(node.item, item_of(&layout.folded[group]));
                    hidden.joints.extend(joints.iter().cloned());
                }
            }
        }
        for (block, group) in self.blocks.iter().zip(&layout.folded) {
            nodes.push(self.block(block, group, whole, layout));
            let joints = block.ends.iter().map(|at| whole.joints.ports[at.node][at.port].clone());
            drawing.joints.ports.push(joints.collect());
            let within = |number: &usize| {
                (Item::Decoration { view: View::System, number: *number }, item_of(group))
            };
            hidden.within.extend(group.inner.iter().map(within));
        }
        drawing.unplaced =
            whole.unplaced.iter().filter_map(|n| self.numbers.get(*n).copied().flatten()).collect();
        let is_shown = |item: Item| !hidden.within.contains_key(&item);
        let is_folded = |item: Item| layout.folded.iter().any(|group| item_of(group) == item);
        let decorations = whole.diagram.decorations.iter();
        let decorations = decorations.filter(|it| is_shown(it.item) && !is_folded(it.item));
        drawing.diagram = Diagram::new(nodes, wires, decorations.cloned().collect());
        number_feeds(&mut drawing);
        drawing.hidden = hidden;
        drawing
    }

    fn crosses(&self, wire: &Wire<Item>) -> bool {
        let group = |at: PortAt| self.groups.get(at.node).copied().flatten();
        group(wire.from) != group(wire.to)
    }

    fn add_end(&mut self, at: PortAt) {
        if let Some(group) = self.groups[at.node] {
            let ends = &mut self.blocks[group].ends;
            if !ends.contains(&at) {
                ends.push(at);
            }
        }
    }

    /// The port of the folded drawing that shows one of the whole drawing.
    fn moved(&self, at: PortAt) -> PortAt {
        match self.groups[at.node] {
            Some(group) => {
                let block = &self.blocks[group];
                let port = block.ends.iter().position(|end| *end == at).unwrap_or_default();
                PortAt { node: block.node, port }
            }
            None => PortAt { node: self.numbers[at.node].unwrap_or_default(), port: at.port },
        }
    }

    fn block(
        &self,
        block: &FoldedBlock,
        group: &FoldedGroup,
        whole: &SystemDrawing,
        layout: &Layout,
    ) -> DiagramNode<Item> {
        let members: Vec<_> =
            whole.diagram.nodes.iter().filter(|node| group.members.contains(&node.title)).collect();
        let frame = &layout.decorations[group.number];
        let title = if frame.text.trim().is_empty() { "Group" } else { frame.text.trim() };
        let mut rows = [0_usize; 2];
        let mut ports = Vec::new();
        for end in &block.ends {
            let joint = &whole.joints.ports[end.node][end.port];
            let Some(port) = whole.diagram.port(*end) else { continue };
            let row = &mut rows[usize::from(joint.direction == Direction::Out)];
            let mut port = port.clone();
            port.name = joint.data();
            port.at = vec2(0.0, FIRST_PORT + PORT_STEP * *row as f32);
            *row += 1;
            ports.push(port);
        }
        let subtitle = match members.len() {
            1 => "1 component".to_owned(),
            count => format!("{count} components"),
        };
        let size = block_size(title, &subtitle, &ports, rows[0].max(rows[1]));
        for port in &mut ports {
            port.at.x = if port.side == PortSide::Right { size.x } else { 0.0 };
        }
        let unassigned =
            members.iter().filter_map(|node| node.badge.as_ref()?.text.parse::<usize>().ok());
        let unassigned: usize = unassigned.sum();
        let names: Vec<_> = members.iter().map(|node| node.title.as_str()).collect();
        DiagramNode {
            item: item_of(group),
            title: title.to_owned(),
            subtitle,
            lines: Vec::new(),
            rect: Rect::from_min_size(frame.rect.min, size),
            shape: NodeShape::Block,
            ports,
            badge: (unassigned > 0).then(|| Badge {
                text: unassigned.to_string(),
                doc: format!("parameters in it that need a value: {unassigned}"),
                tint: None,
            }),
            mark: self.mark(group, whole),
            look: NodeLook { outline: Outline::Strong, ..NodeLook::default() },
            label: format!("group {title}, folded"),
            doc: format!(
                "A folded group of {}. Double-click or Ctrl+Shift+G unfolds it.",
                names.join(", ")
            ),
        }
    }

    /// The worst mark of what is hidden in a group.
    fn mark(&self, group: &FoldedGroup, whole: &SystemDrawing) -> Mark {
        let is_in = |node: usize| {
            whole.diagram.nodes.get(node).is_some_and(|node| group.members.contains(&node.title))
        };
        let nodes = whole.diagram.nodes.iter().enumerate().filter(|(n, _)| is_in(*n));
        let wires = whole.diagram.wires.iter();
        let wires = wires.filter(|wire| is_in(wire.from.node) && is_in(wire.to.node));
        let marks = nodes.map(|(_, node)| node.mark).chain(wires.map(|wire| wire.mark));
        marks.max().unwrap_or_default()
    }
}

/// The item of a folded group.
fn item_of(group: &FoldedGroup) -> Item {
    Item::Decoration { view: View::System, number: group.number }
}

/// Gives the feeds of inputs the numbers that their wires have in this drawing. One that is hidden
/// keeps its output, with a number that no wire has.
fn number_feeds(drawing: &mut SystemDrawing) {
    let numbers: BTreeMap<_, _> =
        drawing.diagram.wires.iter().enumerate().map(|(n, wire)| (wire.item, n)).collect();
    for joint in drawing.joints.ports.iter_mut().flatten() {
        let input = joint.data();
        for (wire, output) in &mut joint.fed_by {
            let link = Item::link(output.as_str(), input.as_str());
            *wire = numbers.get(&link).copied().unwrap_or(usize::MAX);
        }
    }
}
