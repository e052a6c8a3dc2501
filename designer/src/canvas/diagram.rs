//! What is drawn, as plain data in the drawing's own units: one unit is one point at actual size.

use std::collections::BTreeMap;

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::detour::{Detour, detour};
use crate::canvas::edges::path;
use crate::canvas::snapped;
use crate::item::Item;

/// A line of the text beneath a bar is so high.
pub(super) const BAR_LINE: f32 = 14.0;
/// That text is at most so wide.
pub(super) const BAR_TEXT: f32 = 220.0;
/// A letter of it is about so wide.
const BAR_LETTER: f32 = 6.5;

/// A whole drawing.
#[derive(Clone, Debug, Default)]
pub struct Diagram {
    /// The nodes; later ones are drawn over earlier ones.
    pub nodes: Vec<Node>,
    /// The wires between their ports.
    pub wires: Vec<Wire>,
    /// Groups and notes; groups are drawn beneath everything.
    pub decorations: Vec<Decoration>,
    /// Number of each item's node.
    index: BTreeMap<Item, usize>,
    /// How each wire gets around the blocks between its ends.
    detours: Vec<Detour>,
}

/// A block, a place, a transition.
#[derive(Clone, Debug)]
pub struct Node {
    /// What it stands for.
    pub item: Item,
    /// Its name.
    pub title: String,
    /// What it is, in a word or two.
    pub subtitle: String,
    /// More lines of text in it.
    pub lines: Vec<Line>,
    /// Where it is.
    pub rect: Rect,
    /// Its form.
    pub shape: Shape,
    /// Where wires end.
    pub ports: Vec<Port>,
    /// A number that wants to be noticed.
    pub badge: Option<Badge>,
    /// Whether something is wrong with it.
    pub mark: Mark,
    /// How it is drawn.
    pub look: Look,
    /// What screen readers and tests call it, such as "component laser".
    pub label: String,
    /// What is said of it while the pointer rests on it.
    pub doc: String,
}

/// A line of text in a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// The text.
    pub text: String,
    /// Whether it matters less.
    pub is_weak: bool,
}

/// The form of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// A block with its title on top.
    #[default]
    Block,
    /// A circle or, if it is wider, a pill: a place; with so many tokens in it.
    Place {
        /// Tokens shown.
        tokens: u32,
        /// A second line around it: the goal.
        is_goal: bool,
        /// A hatched line: for safety.
        is_safety: bool,
    },
    /// A bar with its text beside it: a transition.
    Bar,
}

/// How a node is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// The colour of its upper edge or filling, by type, state or sort; none is neutral.
    pub tint: Option<eframe::egui::Color32>,
    /// The border.
    pub outline: Outline,
    /// Less visible than others.
    pub is_dim: bool,
}

/// The border of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outline {
    /// A thin line.
    #[default]
    Plain,
    /// A thick line.
    Strong,
    /// A broken line: what it stands for is not there.
    Dashed,
}

/// A number on a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Badge {
    /// The number, or a sign.
    pub text: String,
    /// What it means.
    pub doc: String,
    /// Its colour; none says that something is wrong.
    pub tint: Option<eframe::egui::Color32>,
}

/// Whether something is wrong with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// Nothing is.
    #[default]
    None,
    /// Probably.
    Warning,
    /// It is.
    Error,
}

/// Where a wire can end.
#[derive(Clone, Debug)]
pub struct Port {
    /// What is written beside it.
    pub name: String,
    /// Where it is, from the node's upper left corner.
    pub at: Vec2,
    /// Which way its wires leave.
    pub side: Side,
    /// Which way data or tokens go.
    pub direction: Direction,
    /// The number of its type among all, which its colour is from.
    pub colour: usize,
    /// Whether a wire ends there.
    pub is_wired: bool,
    /// Whether a wire has to end there.
    pub is_required: bool,
    /// Whether it is not there any more, or not yet known.
    pub is_missing: bool,
    /// What screen readers and tests call it, such as "output laser.scan".
    pub label: String,
    /// What is said of it while the pointer rests on it.
    pub doc: String,
}

/// The side of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// At the left edge.
    Left,
    /// At the right edge.
    Right,
    /// At the upper edge.
    Top,
    /// At the lower edge.
    Bottom,
    /// The node as a whole: its wires end at its border.
    Around,
}

impl Side {
    /// Which way wires leave.
    pub fn outward(self) -> Vec2 {
        match self {
            Self::Left => Vec2::new(-1.0, 0.0),
            Self::Right => Vec2::new(1.0, 0.0),
            Self::Top => Vec2::new(0.0, -1.0),
            Self::Bottom => Vec2::new(0.0, 1.0),
            Self::Around => Vec2::ZERO,
        }
    }
}

/// Which way data or tokens go at a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Into the node.
    In,
    /// Out of it.
    Out,
    /// Both.
    Both,
}

/// A port by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PortAt {
    /// The node's number.
    pub node: usize,
    /// The port's number in it.
    pub port: usize,
}

/// What stands at the end of a wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum End {
    /// Nothing.
    #[default]
    Plain,
    /// An arrowhead.
    Arrow,
    /// A small circle: an inhibitor.
    Circle,
    /// A double arrowhead: a reset.
    Double,
}

impl Node {
    /// Where it is with what is written beneath it.
    pub fn area(&self) -> Rect {
        if self.shape != Shape::Bar {
            return self.rect;
        }
        let texts = self.lines.iter().map(|line| line.text.as_str()).chain([self.title.as_str()]);
        let longest = texts.map(|text| text.chars().count()).max().unwrap_or(0);
        let width = (longest as f32 * BAR_LETTER).min(BAR_TEXT);
        let height = BAR_LINE * (1 + self.lines.len()) as f32;
        let top = self.rect.center_bottom() + Vec2::new(-width / 2.0, 3.0);
        self.rect.union(Rect::from_min_size(top, Vec2::new(width, height)))
    }
}

/// A line between two ports.
#[derive(Clone, Debug)]
pub struct Wire {
    /// What it stands for.
    pub item: Item,
    /// Where it comes from.
    pub from: PortAt,
    /// Where it goes.
    pub to: PortAt,
    /// What stands at its end.
    pub end: End,
    /// What is written on it; may be empty.
    pub text: String,
    /// Whether the line is broken.
    pub is_dashed: bool,
    /// Whether the line is thick.
    pub is_strong: bool,
    /// Its colour; none is neutral.
    pub tint: Option<eframe::egui::Color32>,
    /// Whether it can be taken by its ends and led elsewhere.
    pub is_led: bool,
    /// Whether something is wrong with it.
    pub mark: Mark,
    /// What screen readers and tests call it, such as "link laser.scan to slam.scan".
    pub label: String,
    /// What is said of it while the pointer rests on it.
    pub doc: String,
}

/// A group's frame, or a note.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoration {
    /// What it stands for.
    pub item: Item,
    /// Where it is.
    pub rect: Rect,
    /// The title of a group, the text of a note.
    pub text: String,
    /// Whether it is a note.
    pub is_note: bool,
}

impl Diagram {
    /// A drawing of these.
    pub fn new(nodes: Vec<Node>, wires: Vec<Wire>, decorations: Vec<Decoration>) -> Self {
        let index = nodes.iter().enumerate().map(|(n, node)| (node.item.clone(), n)).collect();
        let detours = wires.iter().enumerate().map(|(n, wire)| detour(&nodes, wire, n)).collect();
        Self { nodes, wires, decorations, index, detours }
    }

    /// How far down a wire has to go that leads back around blocks.
    pub(super) fn low(&self, wire: usize) -> f32 {
        self.detours.get(wire).map_or(f32::NEG_INFINITY, |detour| detour.low)
    }

    /// The points that a wire passes to get around blocks.
    pub(super) fn via(&self, wire: usize) -> &[Pos2] {
        self.detours.get(wire).map(|detour| detour.via.as_slice()).unwrap_or_default()
    }

    /// The number of an item's node.
    pub fn node(&self, item: &Item) -> Option<usize> {
        self.index.get(item).copied()
    }

    /// A port by number.
    pub fn port(&self, at: PortAt) -> Option<&Port> {
        self.nodes.get(at.node)?.ports.get(at.port)
    }

    /// What a port is called; one that is a whole node is called as the node.
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
    pub fn holds(&self, item: &Item) -> bool {
        self.index.contains_key(item)
            || self.wires.iter().any(|wire| wire.item == *item)
            || self.decorations.iter().any(|decoration| decoration.item == *item)
    }

    /// Where an item is.
    pub fn rect(&self, item: &Item) -> Option<Rect> {
        if let Some(node) = self.node(item) {
            return Some(self.nodes[node].rect);
        }
        if let Some(decoration) = self.decorations.iter().find(|d| d.item == *item) {
            return Some(decoration.rect);
        }
        let wire = self.wires.iter().find(|wire| wire.item == *item)?;
        Some(Rect::from_two_pos(self.port_position(wire.from)?, self.port_position(wire.to)?))
    }

    /// The spot nearest to this one, on the grid, around which there is room for a node.
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
        let nodes = self.nodes.iter().map(Node::area);
        nodes.chain(self.decorations.iter().map(|d| d.rect)).reduce(Rect::union)
    }

    /// The same with the wires.
    pub fn extent(&self) -> Option<Rect> {
        let points = (0..self.wires.len()).filter_map(|wire| path(self, wire, |_| Vec2::ZERO, 8));
        let wires = points.map(|points| Rect::from_points(&points));
        self.bounds().into_iter().chain(wires).reduce(Rect::union)
    }
}
