//! Where the text of a bar is: beneath it, or where it covers no other text, bar or place.

use eframe::egui::{Align, Pos2, Rect, Vec2};

use crate::canvas::node::{DiagramNode, NodeShape};

/// Distance between a bar and its text.
const GAP: f32 = 3.0;
/// How many times a text that covers another one is moved.
const SWEEPS: usize = 3;

/// The text of a bar.
#[derive(Clone, Copy, Debug)]
pub(super) struct BarText {
    /// Where it is, at most: letters are of different widths.
    pub(super) area: Rect,
    /// The side on which its lines begin or end together.
    pub(super) align: Align,
}

/// Returns the text of each node that is a bar.
pub(super) fn place_texts<Id>(nodes: &[DiagramNode<Id>]) -> Vec<Option<BarText>> {
    let is_bar = |node: &DiagramNode<Id>| node.shape == NodeShape::Bar;
    let first = |node: &DiagramNode<Id>| is_bar(node).then(|| spots(node)[0]);
    let mut texts: Vec<Option<BarText>> = nodes.iter().map(first).collect();
    for _ in 0..SWEEPS {
        let mut is_moved = false;
        for (n, node) in nodes.iter().enumerate().filter(|(_, node)| is_bar(node)) {
            let covered = |text: &BarText| covered_area(nodes, &texts, n, text.area);
            let Some(current) = texts[n].filter(|text| covered(text) > 0.0) else { continue };
            let best = spots(node).into_iter().map(|text| (covered(&text), text));
            let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((less, best)) = best.filter(|(less, _)| *less < covered(&current)) {
                debug_assert!(less >= 0.0);
                texts[n] = Some(best);
                is_moved = true;
            }
        }
        if !is_moved {
            break;
        }
    }
    texts
}

/// Where the text of a bar may be, the best first.
fn spots<Id>(node: &DiagramNode<Id>) -> [BarText; 6] {
    let (bar, size) = (node.rect, node.text_size());
    let (below, above) = (bar.max.y + GAP, bar.min.y - GAP - size.y);
    let spot = |top: f32, align: Align| {
        let left = match align {
            Align::Min => bar.min.x,
            Align::Center => bar.center().x - size.x / 2.0,
            Align::Max => bar.max.x - size.x,
        };
        BarText { area: Rect::from_min_size(Pos2::new(left, top), size), align }
    };
    [
        spot(below, Align::Center),
        spot(above, Align::Center),
        spot(below, Align::Min),
        spot(below, Align::Max),
        spot(above, Align::Min),
        spot(above, Align::Max),
    ]
}

/// How much of the nodes and of the other texts an area covers.
fn covered_area<Id>(
    nodes: &[DiagramNode<Id>],
    texts: &[Option<BarText>],
    own: usize,
    area: Rect,
) -> f32 {
    let others = nodes.iter().map(|node| node.rect).enumerate();
    let texts = texts.iter().enumerate().filter_map(|(n, text)| Some((n, (*text)?.area)));
    let others = others.chain(texts).filter(|(n, _)| *n != own);
    let common = others.map(|(_, other)| other.intersect(area).size().max(Vec2::ZERO));
    common.map(|size| size.x * size.y).sum()
}
