//! What is drawn, as plain data in the drawing's own units: one unit is one point at actual size.

use eframe::egui::{Color32, Rect, Vec2};

/// Height of a line of the text beneath a bar.
pub(super) const BAR_LINE: f32 = 14.0;
/// Largest width of that text.
pub(super) const BAR_TEXT: f32 = 220.0;
/// Approximate width of a letter of its first line, and of the others.
const TITLE_LETTER: f32 = 7.4;
const LINE_LETTER: f32 = 6.6;

/// A block, a place, a transition.
#[derive(Clone, Debug)]
pub struct DiagramNode<Id> {
    /// What it stands for.
    pub item: Id,
    /// Its name.
    pub title: String,
    /// What it is, in a word or two.
    pub subtitle: String,
    /// More lines of text in it.
    pub lines: Vec<NodeLine>,
    /// Where it is.
    pub rect: Rect,
    /// Its form.
    pub shape: NodeShape,
    /// Where wires end.
    pub ports: Vec<NodePort>,
    /// A number that needs attention.
    pub badge: Option<Badge>,
    /// Whether something is wrong with it.
    pub mark: Mark,
    /// How it is drawn.
    pub look: NodeLook,
    /// Its name for screen readers and tests, such as "component laser".
    pub label: String,
    /// Its tooltip.
    pub doc: String,
}

/// A line of text in a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeLine {
    /// The text.
    pub text: String,
    /// Whether it matters less.
    pub is_weak: bool,
}

/// The form of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NodeShape {
    /// A block with its title on top.
    #[default]
    Block,
    /// A circle or, if it is wider, a pill: a place, with this number of tokens.
    Place {
        /// Tokens shown.
        tokens: u32,
        /// A second line around it: the goal.
        is_goal: bool,
        /// A hatched line: for safety.
        is_safety: bool,
    },
    /// A bar with its text next to it: a transition.
    Bar,
}

/// How a node is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeLook {
    /// The colour of its upper edge or filling, by type, state or sort; none is neutral.
    pub tint: Option<Color32>,
    /// The border.
    pub outline: Outline,
    /// Less visible than others.
    pub is_dim: bool,
    /// Made from something else, which is changed in its place: a dotted border, a hollow bar.
    pub is_derived: bool,
}

/// The border of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outline {
    /// A thin line.
    #[default]
    Plain,
    /// A thick line.
    Strong,
    /// A broken line: what it stands for does not exist.
    Dashed,
}

/// A number on a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Badge {
    /// The number, or a sign.
    pub text: String,
    /// What it means.
    pub doc: String,
    /// Its colour; none states that something is wrong.
    pub tint: Option<Color32>,
}

/// Whether something is wrong with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// No problem.
    #[default]
    None,
    /// A warning.
    Warning,
    /// An error.
    Error,
}

/// Where a wire can end.
#[derive(Clone, Debug)]
pub struct NodePort {
    /// What is written next to it.
    pub name: String,
    /// Where it is, from the node's upper left corner.
    pub at: Vec2,
    /// The side on which its wires leave.
    pub side: PortSide,
    /// The direction of data or tokens.
    pub direction: Direction,
    /// The number of its type among all, which its colour is from.
    pub colour: usize,
    /// Whether a wire ends there.
    pub is_wired: bool,
    /// Whether a wire has to end there.
    pub is_required: bool,
    /// Whether it no longer exists, or not yet known.
    pub is_missing: bool,
    /// Its name for screen readers and tests, such as "output laser.scan".
    pub label: String,
    /// Its tooltip.
    pub doc: String,
}

/// The side of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortSide {
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

impl PortSide {
    /// The direction in which wires leave.
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

/// The direction of data or tokens at a port.
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
pub enum WireEnd {
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

impl<Id> DiagramNode<Id> {
    /// Where it is with what is written beneath it.
    pub fn area(&self) -> Rect {
        if self.shape != NodeShape::Bar {
            return self.rect;
        }
        let size = self.text_size();
        let top = self.rect.center_bottom() + Vec2::new(-size.x / 2.0, 3.0);
        self.rect.union(Rect::from_min_size(top, size))
    }

    /// The size of the text of a bar, at most.
    pub fn text_size(&self) -> Vec2 {
        let width = |text: &str, letter: f32| text.chars().count() as f32 * letter;
        let lines = self.lines.iter().map(|line| width(&line.text, LINE_LETTER));
        let longest = lines.fold(width(&self.title, TITLE_LETTER), f32::max);
        Vec2::new(longest.min(BAR_TEXT), BAR_LINE * (1 + self.lines.len()) as f32)
    }
}

/// A line between two ports.
#[derive(Clone, Debug)]
pub struct Wire<Id> {
    /// What it stands for.
    pub item: Id,
    /// Where it comes from.
    pub from: PortAt,
    /// Where it goes.
    pub to: PortAt,
    /// What stands at its end.
    pub end: WireEnd,
    /// What is written on it; may be empty.
    pub text: String,
    /// Whether the line is broken.
    pub is_dashed: bool,
    /// Whether the line is thick.
    pub is_strong: bool,
    /// Its colour; none is neutral.
    pub tint: Option<Color32>,
    /// Whether it can be taken by its ends and led elsewhere.
    pub is_led: bool,
    /// Whether something is wrong with it.
    pub mark: Mark,
    /// Its name for screen readers and tests, such as "link laser.scan to slam.scan".
    pub label: String,
    /// Its tooltip.
    pub doc: String,
}

/// A group's frame, or a note.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoration<Id> {
    /// What it stands for.
    pub item: Id,
    /// Where it is.
    pub rect: Rect,
    /// The title of a group, the text of a note.
    pub text: String,
    /// Whether it is a note.
    pub is_note: bool,
}
