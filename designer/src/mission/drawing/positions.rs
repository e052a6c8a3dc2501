//! The positions of the nodes: those in the file, and computed ones for the others.

use std::collections::BTreeMap;

use armor_robotfile::mission::{ArcKind, Mission};
use eframe::egui::{Pos2, Rect, Vec2, vec2};

use super::scene::Scene;
use super::steps::{RouteSteps, arrange_steps};
use crate::canvas::{DiagramNode, NodeShape, arrange, snapped};
use crate::item::Item;

/// Distance between the nodes with a position and the others below them.
const BELOW: f32 = 60.0;
/// A sub-mission that the file shows nowhere is so far beneath the places it joins.
const BENEATH: f32 = 40.0;
/// Distance between a bar and its text.
const TEXT_GAP: f32 = 4.0;

/// Positions every node. Returns those without a position in the file.
pub(super) fn place(
    nodes: &mut [DiagramNode<Item>],
    scene: &Scene<'_>,
    steps: &RouteSteps<'_>,
) -> Vec<Item> {
    let mut lost = Vec::new();
    for (number, node) in nodes.iter_mut().enumerate() {
        match scene.position(&node.item) {
            Some(at) => move_to(node, at),
            None => lost.push(number),
        }
    }
    let unplaced: Vec<_> = lost.iter().map(|number| nodes[*number].item).collect();
    if lost.len() < nodes.len() {
        lost.retain(|number| !move_between_its_places(nodes, *number, scene));
        place_in_steps(nodes, scene, steps, &mut lost);
    }
    let top = match nodes.len() > lost.len() {
        true => {
            let shown = (0..nodes.len()).filter(|number| !lost.contains(number));
            let bottom = shown.map(|number| nodes[number].rect.max.y).fold(0.0, f32::max);
            bottom + BELOW
        }
        false => 0.0,
    };
    let items: Vec<_> = lost.iter().map(|number| nodes[*number].item).collect();
    let placed = arranged_of(nodes, scene.mission, &items, arrange::SHAPE, steps);
    for (number, (_, at)) in lost.iter().zip(placed) {
        move_to(&mut nodes[*number], at + vec2(0.0, top));
    }
    unplaced
}

/// Puts the nodes of an open step around its first place, if that is shown.
fn place_in_steps(
    nodes: &mut [DiagramNode<Item>],
    scene: &Scene<'_>,
    steps: &RouteSteps<'_>,
    lost: &mut Vec<usize>,
) {
    let items: Vec<_> = nodes.iter().map(|node| node.item).collect();
    for (step, block) in steps.blocks(&items) {
        let Some(first) = scene.position(&step) else { continue };
        let own: Vec<_> = block.iter().map(|number| items[*number]).collect();
        let placed = arranged_of(nodes, scene.mission, &own, arrange::SHAPE, steps);
        let Item::Step { route, step } = step else { continue };
        let anchor = Item::place(format!("{route}.{step}"));
        let Some((_, at)) = placed.iter().find(|(item, _)| *item == anchor) else { continue };
        let by = first - *at;
        for (number, (_, at)) in block.iter().zip(&placed) {
            if lost.contains(number) {
                move_to(&mut nodes[*number], *at + by);
            }
        }
        lost.retain(|number| !block.contains(number));
    }
}

fn move_to(node: &mut DiagramNode<Item>, at: Pos2) {
    node.rect = Rect::from_min_size(at, node.rect.size());
}

/// Between the places that it joins, if it is a sub-mission and they are shown.
fn move_between_its_places(
    nodes: &mut [DiagramNode<Item>],
    number: usize,
    scene: &Scene<'_>,
) -> bool {
    let Item::Submission(submission) = nodes[number].item else { return false };
    let submission = &scene.mission.submissions[submission];
    let of = |name: &Option<armor_robotfile::Spanned<String>>| {
        let item = Item::place(&name.as_ref()?.value);
        scene.position(&item)?;
        nodes.iter().find(|node| node.item == item).map(|node| node.rect)
    };
    let rects: Vec<_> =
        [of(&submission.enter), of(&submission.leave)].into_iter().flatten().collect();
    let Some(around) = rects.iter().copied().reduce(Rect::union) else { return false };
    let size = nodes[number].rect.size();
    let at = Pos2::new(around.center().x - size.x / 2.0, around.max.y + BENEATH);
    move_to(&mut nodes[number], snapped(at));
    true
}

/// Where these nodes, or all if there are none, read well from left to right.
pub fn arranged(
    nodes: &[DiagramNode<Item>],
    mission: &Mission,
    items: &[Item],
    shape: f32,
) -> Vec<(Item, Pos2)> {
    let all: Vec<_> = nodes.iter().map(|node| node.item).collect();
    let items = if items.is_empty() { &all } else { items };
    let steps = RouteSteps::of(mission, None);
    let placed = arranged_of(nodes, mission, items, shape, &steps);
    // Some of them stay where they are as a whole.
    let old = nodes.iter().filter(|node| items.contains(&node.item) && items.len() < all.len());
    let corner = old.map(|node| node.rect.min).reduce(|a, b| a.min(b)).unwrap_or_default();
    let moved = |at: Pos2| snapped(at + corner.to_vec2());
    placed.into_iter().map(|(item, at)| (item, moved(at))).collect()
}

fn arranged_of(
    nodes: &[DiagramNode<Item>],
    mission: &Mission,
    items: &[Item],
    shape: f32,
    steps: &RouteSteps<'_>,
) -> Vec<(Item, Pos2)> {
    let numbers: BTreeMap<_, _> = items.iter().enumerate().map(|(n, item)| (*item, n)).collect();
    let rooms: Vec<_> = items.iter().map(|item| room(nodes, item)).collect();
    let roots: Vec<_> = mission
        .places
        .iter()
        .filter(|place| place.initial > 0)
        .filter_map(|place| steps.number(&Item::place(&place.name.value), &numbers))
        .collect();
    let sizes: Vec<_> = rooms.iter().map(|(size, _)| *size).collect();
    let edges = edges(mission, &numbers, &roots, steps);
    let routes = steps.of_routes(mission, items);
    let corners = if routes.is_empty() {
        let all: Vec<_> = (0..items.len()).collect();
        arrange::arrange(&sizes, &edges, &all, shape)
    } else {
        arrange_steps(&sizes, &edges, &routes, shape)
    };
    let at = |n: usize| snapped(corners[n].to_pos2() + rooms[n].1);
    items.iter().enumerate().map(|(n, item)| (*item, at(n))).collect()
}

/// The room that a node takes with its texts, and where the node is in it.
fn room(nodes: &[DiagramNode<Item>], item: &Item) -> (Vec2, Vec2) {
    let Some(node) = nodes.iter().find(|node| node.item == *item) else {
        return (Vec2::ZERO, Vec2::ZERO);
    };
    let size = node.rect.size();
    if node.shape != NodeShape::Bar {
        return (size, Vec2::ZERO);
    }
    let text = node.text_size();
    let width = text.x.max(size.x);
    // The same space above and below, so that arcs lead to the middle.
    let beneath = text.y + TEXT_GAP;
    (vec2(width, size.y + 2.0 * beneath), vec2((width - size.x) / 2.0, beneath))
}

/// What leads where. What leads back to where the mission begins is turned, so that it begins at
/// the left.
fn edges(
    mission: &Mission,
    numbers: &BTreeMap<Item, usize>,
    roots: &[usize],
    steps: &RouteSteps<'_>,
) -> Vec<(usize, usize)> {
    let of_place = |name: &str| steps.number(&Item::place(name), numbers);
    let mut edges = Vec::new();
    for transition in &mission.transitions {
        let own = steps.number(&Item::transition(&transition.name.value), numbers);
        for arc in &transition.arcs {
            if let (Some(own), Some(place)) = (own, of_place(&arc.place.value)) {
                edges.push(if arc.kind == ArcKind::Put { (own, place) } else { (place, own) });
            }
        }
    }
    for (number, submission) in mission.submissions.iter().enumerate() {
        let Some(own) = numbers.get(&Item::Submission(number)) else { continue };
        let place = |name: &Option<armor_robotfile::Spanned<String>>| {
            name.as_ref().and_then(|name| of_place(&name.value))
        };
        edges.extend(place(&submission.enter).map(|from| (from, *own)));
        edges.extend(place(&submission.leave).map(|to| (*own, to)));
    }
    let forward = |(from, to)| if roots.contains(&to) { (to, from) } else { (from, to) };
    edges.into_iter().map(forward).collect()
}
