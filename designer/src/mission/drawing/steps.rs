//! The steps of routes in the drawing: of a large net each is one block, and a frame once it is
//! opened.

use std::collections::{BTreeMap, BTreeSet};

use armor_proof::time_in_words as time;
use armor_robotfile::drawn_route::RouteStep;
use armor_robotfile::mission::Mission;
use eframe::egui::{Pos2, Rect, Vec2, vec2};

use super::nodes::{LINE, LINE_WIDTH, TITLE_WIDTH, whole};
use super::scene::Scene;
use crate::canvas::{
    Badge, Decoration, Diagram, DiagramNode, NodeLine, NodeLook, NodeShape, Outline, arrange,
};
use crate::item::Item;
use crate::mission::derived::{find_step, source_of_step, step_of};
use crate::text::short;

/// Routes with at most this many places and transitions are drawn in full.
const MAX_IN_FULL: usize = 30;
/// Space between the frame of an open step and what is in it, at the upper left and at the lower
/// right.
const FRAME: [Vec2; 2] = [vec2(30.0, 50.0), vec2(30.0, 30.0)];
/// Space between two steps, and between these and the other nodes.
const BETWEEN: Vec2 = vec2(80.0, 70.0);
const APART: f32 = 180.0;
/// Characters of a line of a step.
const WIDTH: usize = 30;

/// Which step each place and transition is from, and which steps are one block.
pub(super) struct RouteSteps<'a> {
    of: BTreeMap<Item, Item>,
    /// The open ones; none: all.
    opened: Option<&'a BTreeSet<Item>>,
}

impl<'a> RouteSteps<'a> {
    pub(super) fn of(mission: &Mission, opened: Option<&'a BTreeSet<Item>>) -> Self {
        Self { of: steps_by_node(mission), opened }
    }

    /// The folded step that a place or transition is in.
    fn folded(&self, item: &Item) -> Option<Item> {
        let step = *self.of.get(item)?;
        self.opened.is_some_and(|opened| !opened.contains(&step)).then_some(step)
    }

    /// The number of the node that shows an item: its own, or that of its step.
    pub(super) fn number(&self, item: &Item, numbers: &BTreeMap<Item, usize>) -> Option<usize> {
        numbers.get(item).or_else(|| numbers.get(self.of.get(item)?)).copied()
    }

    /// The nodes of each step that are drawn one by one, by their numbers.
    pub(super) fn blocks(&self, items: &[Item]) -> Vec<(Item, Vec<usize>)> {
        let mut blocks: BTreeMap<Item, Vec<usize>> = BTreeMap::new();
        for (number, item) in items.iter().enumerate() {
            if let Some(step) = self.of.get(item) {
                blocks.entry(*step).or_default().push(number);
            }
        }
        blocks.into_iter().collect()
    }

    /// The numbers of the nodes of each step of each route, in the order of the file; none if the
    /// net is not divided into steps.
    pub(super) fn of_routes(&self, mission: &Mission, items: &[Item]) -> Vec<Vec<Vec<usize>>> {
        if self.of.is_empty() {
            return Vec::new();
        }
        let is_in = |item: &Item, step: &Item| item == step || self.of.get(item) == Some(step);
        let nodes = |step: Item| {
            let own = items.iter().enumerate().filter(|(_, item)| is_in(item, &step));
            own.map(|(number, _)| number).collect::<Vec<_>>()
        };
        let routes = mission.routes.iter().map(|route| {
            let steps = route.steps.iter();
            let steps = steps.map(|step| nodes(Item::step(&route.name.value, &step.name().value)));
            steps.filter(|nodes| !nodes.is_empty()).collect::<Vec<_>>()
        });
        routes.filter(|steps| !steps.is_empty()).collect()
    }

    /// Replaces the nodes of folded steps by a block for each.
    pub(super) fn fold(
        &self,
        scene: &Scene<'_>,
        nodes: Vec<DiagramNode<Item>>,
    ) -> Vec<DiagramNode<Item>> {
        let mut inside: BTreeMap<Item, Vec<DiagramNode<Item>>> = BTreeMap::new();
        let mut shown = Vec::new();
        for node in nodes {
            match self.folded(&node.item) {
                Some(step) => inside.entry(step).or_default().push(node),
                None => shown.push(node),
            }
        }
        for route in &scene.mission.routes {
            for step in &route.steps {
                let item = Item::step(&route.name.value, &step.name().value);
                if let Some(nodes) = inside.remove(&item) {
                    shown.push(block(scene, item, step, &nodes));
                }
            }
        }
        shown
    }

    /// The frames of the open steps.
    pub(super) fn frames(
        &self,
        mission: &Mission,
        diagram: &Diagram<Item>,
    ) -> Vec<Decoration<Item>> {
        let items: Vec<_> = diagram.nodes.iter().map(|node| node.item).collect();
        let frame = |(item, nodes): (Item, Vec<usize>)| {
            let area = nodes.into_iter().map(|node| diagram.area(node)).reduce(Rect::union)?;
            let rect = Rect::from_min_max(area.min - FRAME[0], area.max + FRAME[1]);
            let text = format!("{}: {}", title(&item), words(find_step(mission, &item)?));
            Some(Decoration { item, rect, text, is_note: false })
        };
        self.blocks(&items).into_iter().filter_map(frame).collect()
    }
}

/// The step of each place and transition, if the routes have more of them than are drawn in full.
fn steps_by_node(mission: &Mission) -> BTreeMap<Item, Item> {
    if mission.routes.is_empty() {
        return BTreeMap::new();
    }
    let places = mission.places.iter().map(|place| &place.name.value);
    let places = places.map(|name| (Item::place(name), name));
    let transitions = mission.transitions.iter().map(|transition| &transition.name.value);
    let transitions = transitions.map(|name| (Item::transition(name), name));
    let all = places.chain(transitions);
    let of: BTreeMap<_, _> =
        all.filter_map(|(item, name)| Some((item, step_of(mission, name)?))).collect();
    if of.len() > MAX_IN_FULL { of } else { BTreeMap::new() }
}

/// The steps that items are or are part of, and that can be folded.
pub fn foldable_steps(mission: &Mission, items: &BTreeSet<Item>) -> BTreeSet<Item> {
    let of = steps_by_node(mission);
    let foldable: BTreeSet<_> = of.values().collect();
    let step = |item: &Item| match item {
        Item::Arc { transition, .. } => of.get(&Item::Transition(*transition)).copied(),
        Item::Step { .. } => Some(*item).filter(|item| foldable.contains(item)),
        item => of.get(item).copied(),
    };
    items.iter().filter_map(step).collect()
}

/// Such as `red.l3`.
fn title(item: &Item) -> String {
    match item {
        Item::Step { route, step } => format!("{route}.{step}"),
        other => other.to_string(),
    }
}

/// What a step is, such as `leg to studio`.
fn words(step: &RouteStep) -> String {
    match step {
        RouteStep::Leg(leg) => format!("leg to {}", leg.to.value),
        RouteStep::Stay(stay) => match (&stay.duration, &stay.on) {
            (Some(duration), _) => format!("stay for {}", time(duration.value)),
            (None, Some(on)) => format!("stay until {}.{}", on.component.value, on.port.value),
            (None, None) => "stay".into(),
        },
        RouteStep::Meet(meet) => format!("meeting with {}", meet.with.value),
    }
}

/// The speed and the time limit of a leg.
fn limits(step: &RouteStep) -> Option<String> {
    let RouteStep::Leg(leg) = step else { return None };
    let speed = leg.speed.as_ref().map(|speed| speed.value.clone());
    let by = leg.by.as_ref().map(|by| format!("by {}", time(by.value)));
    let all: Vec<_> = speed.into_iter().chain(by).collect();
    (!all.is_empty()).then(|| all.join(", "))
}

/// The block of a folded step.
fn block(
    scene: &Scene<'_>,
    item: Item,
    step: &RouteStep,
    nodes: &[DiagramNode<Item>],
) -> DiagramNode<Item> {
    let prefix = format!("{}.", title(&item));
    let inner = |node: &DiagramNode<Item>| node.title.strip_prefix(&prefix).map(str::to_owned);
    let marked = nodes
        .iter()
        .filter(|node| matches!(node.shape, NodeShape::Place { tokens, .. } if tokens > 0));
    let marked: Vec<_> = marked.collect();
    let places = nodes.iter().filter(|node| matches!(node.item, Item::Place(_))).count();
    let count = |count: usize, word: &str| match count {
        1 => format!("1 {word}"),
        count => format!("{count} {word}s"),
    };
    let inside =
        format!("{}, {}", count(places, "place"), count(nodes.len() - places, "transition"));
    let state = marked.first().map(|node| match (scene.play, inner(node)) {
        (None, _) => "begins here".to_owned(),
        (Some(_), None) => "marked".into(),
        (Some(_), Some(name)) => format!("marked: {name}"),
    });
    let lines = limits(step).into_iter().chain([inside]).map(|text| (text, true));
    let lines = lines.chain(state.map(|text| (text, false)));
    let lines: Vec<_> = lines
        .map(|(text, is_weak)| NodeLine { text: short(&text, WIDTH).into_owned(), is_weak })
        .collect();
    let subtitle = short(&words(step), WIDTH).into_owned();
    let title = title(&item);
    let texts = lines.iter().map(|line| &line.text).chain([&subtitle]);
    let width = texts.map(|text| text.chars().count() as f32 * LINE_WIDTH);
    let width = width.fold(title.chars().count() as f32 * TITLE_WIDTH, f32::max);
    let size = vec2(width + 30.0, (2 + lines.len()) as f32 * LINE + 22.0);
    let is_marked = scene.play.is_some() && !marked.is_empty();
    let tint = marked.first().and_then(|node| node.look.tint).filter(|_| is_marked);
    let source = source_of_step(scene.mission, &item).unwrap_or_default();
    let found: String = nodes.iter().map(|node| scene.marks.messages(&node.item)).collect();
    DiagramNode {
        title,
        subtitle,
        lines,
        rect: Rect::from_min_size(Pos2::ZERO, size),
        shape: NodeShape::Block,
        ports: vec![whole(size)],
        badge: nodes.iter().find_map(|node| {
            let badge = node.badge.as_ref()?;
            let doc = format!("{}: {}", node.title, badge.doc);
            Some(Badge { doc, ..badge.clone() })
        }),
        mark: nodes.iter().map(|node| node.mark).max().unwrap_or_default(),
        look: NodeLook { tint, outline: Outline::Strong, is_dim: false, is_derived: true },
        label: format!("{item}, folded{}", if is_marked { ", marked" } else { "" }),
        doc: format!(
            "{item}: places and transitions derived from {source}. \
             Double-click or Ctrl+Shift+G opens it.{found}"
        ),
        item,
    }
}

/// Positions of all nodes: the steps of each route in rows, in their order, and the other nodes at
/// their right, where the arcs of all lead to.
pub(super) fn arrange_steps(
    sizes: &[Vec2],
    edges: &[(usize, usize)],
    routes: &[Vec<Vec<usize>>],
    shape: f32,
) -> Vec<Vec2> {
    let units: Vec<Vec<StepUnit>> = routes
        .iter()
        .map(|steps| steps.iter().map(|it| unit(sizes, edges, it)).collect())
        .collect();
    let is_other = |n: &usize| !routes.iter().flatten().flatten().any(|own| own == n);
    let others: Vec<_> = (0..sizes.len()).filter(is_other).collect();
    let placed = arrange::arrange(sizes, edges, &others, shape);
    let other_ends = others.iter().zip(&placed).map(|(n, at)| *at + sizes[*n]);
    let other_size = other_ends.fold(Vec2::ZERO, Vec2::max);
    let whole = |rows: Vec2| vec2(rows.x + APART + other_size.x, rows.y.max(other_size.y));
    let shown = |rows: Vec2| (shape / whole(rows).x).min(1.0 / whole(rows).y);
    let longest = units.iter().map(Vec::len).max().unwrap_or(1).max(1);
    let tried = (1..=longest).map(|columns| rows(&units, columns));
    let best = tried.max_by(|(_, one), (_, other)| shown(*one).total_cmp(&shown(*other)));
    let (corners, size) = best.unwrap_or_default();
    let mut positions = vec![Vec2::ZERO; sizes.len()];
    for (unit, corner) in units.iter().flatten().zip(corners) {
        unit.nodes.iter().for_each(|(n, at)| positions[*n] = corner + *at);
    }
    let corner = match size.x > 0.0 {
        true => vec2(size.x + APART, ((size.y - other_size.y) / 2.0).max(0.0)),
        false => Vec2::ZERO,
    };
    others.iter().zip(placed).for_each(|(n, at)| positions[*n] = corner + at);
    positions
}

/// A step with what is drawn of it.
struct StepUnit {
    size: Vec2,
    nodes: Vec<(usize, Vec2)>,
}

/// The nodes of an open step with room for its frame, or the block of a folded one.
fn unit(sizes: &[Vec2], edges: &[(usize, usize)], nodes: &[usize]) -> StepUnit {
    if let [node] = nodes {
        return StepUnit { size: sizes[*node], nodes: vec![(*node, Vec2::ZERO)] };
    }
    let placed = arrange::arrange(sizes, edges, nodes, arrange::SHAPE);
    let ends = nodes.iter().zip(&placed).map(|(n, at)| *at + sizes[*n]);
    let end = ends.fold(Vec2::ZERO, Vec2::max);
    let nodes = nodes.iter().copied().zip(placed.into_iter().map(|at| FRAME[0] + at));
    StepUnit { size: FRAME[0] + end + FRAME[1], nodes: nodes.collect() }
}

/// The corners of the steps in rows of so many, each route beginning a row, and the size of all.
fn rows(routes: &[Vec<StepUnit>], columns: usize) -> (Vec<Vec2>, Vec2) {
    let (mut corners, mut size, mut top) = (Vec::new(), Vec2::ZERO, 0.0);
    for row in routes.iter().flat_map(|steps| steps.chunks(columns)) {
        let mut left = 0.0;
        for unit in row {
            corners.push(vec2(left, top));
            size = size.max(vec2(left, top) + unit.size);
            left += unit.size.x + BETWEEN.x;
        }
        top = size.y + BETWEEN.y;
    }
    (corners, size)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Project;
    use crate::layout::Layout;
    use crate::mission::{Marks, net};
    use armor_picture::theme::ThemeColours;

    fn drawn() -> Project {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/drawn.xml");
        Project::open(&file, std::sync::Arc::default()).unwrap()
    }

    fn expect_room(diagram: &Diagram<Item>) {
        let areas: Vec<_> = (0..diagram.nodes.len()).map(|node| diagram.area(node)).collect();
        for (n, one) in areas.iter().enumerate() {
            for (m, other) in areas.iter().enumerate().skip(n + 1) {
                let (a, b) = (&diagram.nodes[n].title, &diagram.nodes[m].title);
                assert!(!one.intersects(*other), "{a} {one:?} is over {b} {other:?}");
            }
        }
    }

    #[test]
    fn open_steps_have_frames_of_their_own_and_every_text_its_room() {
        let diagram = net(&drawn(), ThemeColours::of_theme(true));
        assert!(diagram.nodes.len() > 80, "{}", diagram.nodes.len());
        expect_room(&diagram);
        let frames: Vec<_> = diagram.decorations.iter().map(|it| (it.item, it.rect)).collect();
        assert_eq!(frames.len(), 6);
        for (n, (item, frame)) in frames.iter().enumerate() {
            assert!(frames[n + 1..].iter().all(|(_, other)| !frame.intersects(*other)), "{item}");
            for node in &diagram.nodes {
                let is_own = node.title == title(item)
                    || node.title.starts_with(&format!("{}.", title(item)));
                assert_eq!(frame.contains_rect(node.rect), is_own, "{} in {item}", node.title);
            }
        }
    }

    #[test]
    fn folded_steps_are_a_row_of_blocks_that_lead_to_the_end() {
        let project = drawn();
        let mission = project.configuration().unwrap().mission.as_ref().unwrap();
        let opened = BTreeSet::new();
        let (marks, layout) = (Marks::default(), Layout::default());
        let scene = Scene {
            mission,
            marks: &marks,
            layout: &layout,
            play: None,
            in_flight: &[],
            colours: ThemeColours::of_theme(true),
            opened: Some(&opened),
        };
        let (diagram, _) = scene.draw();
        expect_room(&diagram);
        let mut titles: Vec<_> = diagram.nodes.iter().map(|node| node.title.as_str()).collect();
        titles.sort_unstable();
        let expected = ["hold", "over", "red.l1", "red.l2", "red.l3", "red.l4", "red.l5", "red.s1"];
        assert_eq!(titles, expected);
        let ends = diagram.wires.iter().map(|wire| {
            let title = |at: crate::canvas::PortAt| diagram.nodes[at.node].title.as_str();
            (title(wire.from), title(wire.to))
        });
        let ends: BTreeSet<_> = ends.collect();
        for pair in [("red.l1", "red.l2"), ("red.l3", "red.s1"), ("red.l5", "over")] {
            assert!(ends.contains(&pair), "{pair:?}");
        }
        assert_eq!((ends.len(), diagram.wires.len()), (12, 12), "one line for each pair");
    }
}
