//! Places nodes so that wires lead from left to right: in layers by the longest path to each
//! (Sugiyama, Tagawa and Toda 1981), each layer sorted so that few wires cross, each node near the
//! middle of its neighbours. A large drawing gets about the shape of the window: high layers are
//! split, and a long row of layers is broken into several, one below the other.

mod shape;

use std::collections::HashMap;

use eframe::egui::{Vec2, vec2};
use petgraph::algo::toposort;
use petgraph::graph::{DiGraph, NodeIndex};
use petgraph::unionfind::UnionFind;
use petgraph::visit::DfsPostOrder;

use shape::{arrange_to_shape, extent};

/// Space between two layers, and between two nodes of one.
const ACROSS: f32 = 110.0;
const DOWN: f32 = 40.0;
/// The space kept for a link that passes a layer.
const PASSING: Vec2 = vec2(0.0, 6.0);
/// Most nodes and passing links that are arranged.
const MAX_NODES: usize = 20_000;
/// How many times the layers are sorted, forwards and backwards.
const SWEEPS: usize = 12;
/// The shape of a window, width to height, if it is not known.
pub const SHAPE: f32 = 1.6;
/// Parts that are not connected are put into rows; a row no longer than this is not broken.
const ROW: f32 = 1200.0;
/// Space between two parts.
const APART: Vec2 = vec2(ACROSS * 0.7, DOWN * 1.5);

/// Returns the positions of the upper left corners of the nodes `wanted`, in their order, the whole
/// beginning at the origin. `sizes` and `links` are of all nodes; links to others do not count.
/// `shape` is the width of the window to its height.
pub fn arrange(
    sizes: &[Vec2],
    links: &[(usize, usize)],
    wanted: &[usize],
    shape: f32,
) -> Vec<Vec2> {
    let mut number = vec![usize::MAX; sizes.len()];
    for (n, node) in wanted.iter().enumerate() {
        number[*node] = n;
    }
    let inner = |node: usize| number.get(node).copied().filter(|n| *n != usize::MAX);
    let mut next = vec![Vec::new(); wanted.len()];
    for (from, to) in links {
        if let (Some(from), Some(to)) = (inner(*from), inner(*to))
            && from != to
            && !next[from].contains(&to)
        {
            next[from].push(to);
        }
    }
    let own: Vec<Vec2> = wanted.iter().map(|node| sizes[*node]).collect();
    let mut positions = vec![Vec2::ZERO; wanted.len()];
    let forward = without_cycles(&next);
    let layer = layers(&forward);
    let parts: Vec<_> = connected_parts(&next)
        .into_iter()
        .map(|part| {
            let placed = arrange_to_shape(&own, &forward, &layer, &part, shape);
            let size = extent(&placed, &own, &part);
            (part, placed, size)
        })
        .collect();
    let sizes: Vec<_> = parts.iter().map(|(.., size)| *size).collect();
    for ((part, placed, _), corner) in parts.into_iter().zip(place_in_rows(&sizes, shape)) {
        for (n, at) in part.iter().zip(placed) {
            let at = corner + at;
            positions[*n] = vec2((at.x / 10.0).round() * 10.0, (at.y / 10.0).round() * 10.0);
        }
    }
    positions
}

/// The corners of parts of these sizes, put into rows one below the other.
fn place_in_rows(sizes: &[Vec2], shape: f32) -> Vec<Vec2> {
    let area: f32 = sizes.iter().map(|size| (size.x + APART.x) * (size.y + APART.y)).sum();
    let longest = (area * shape).sqrt().max(ROW);
    let (mut corner, mut row_height) = (Vec2::ZERO, 0.0_f32);
    let corners = sizes.iter().map(|size| {
        if corner.x > 0.0 && corner.x + size.x > longest {
            corner = vec2(0.0, corner.y + row_height + APART.y);
            row_height = 0.0;
        }
        let at = corner;
        corner.x += size.x + APART.x;
        row_height = row_height.max(size.y);
        at
    });
    corners.collect()
}

/// The nodes of each connected part, the largest part first.
fn connected_parts(next: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut joined = UnionFind::new(next.len());
    for (from, list) in next.iter().enumerate() {
        list.iter().for_each(|to| _ = joined.union(from, *to));
    }
    let mut number_of = HashMap::new();
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for (node, label) in joined.into_labeling().into_iter().enumerate() {
        let number = *number_of.entry(label).or_insert(parts.len());
        if number == parts.len() {
            parts.push(Vec::new());
        }
        parts[number].push(node);
    }
    parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
    parts
}

/// The nodes of each layer.
fn rows_of(layer: &[usize], own: &[usize]) -> Vec<Vec<usize>> {
    let last = own.iter().map(|node| layer[*node]).max();
    let mut rows = vec![Vec::new(); last.map_or(0, |last| last + 1)];
    for node in own {
        rows[layer[*node]].push(*node);
    }
    rows
}

/// Positions of the nodes of one part, in these layers; its links `forward` form no cycle.
fn arrange_part(
    sizes: &[Vec2],
    forward: &[Vec<usize>],
    mut rows: Vec<Vec<usize>>,
    own: &[usize],
) -> Vec<Vec2> {
    let mut layer = vec![0; forward.len()];
    for (number, row) in rows.iter().enumerate() {
        row.iter().for_each(|node| layer[*node] = number);
    }
    let (forward, sizes, part) = with_passing_nodes(forward, sizes, &layer, &mut rows, own);
    let (sizes, part) = (sizes.as_slice(), part.as_slice());
    let mut before = vec![Vec::new(); forward.len()];
    for node in part {
        forward[*node].iter().for_each(|to| before[*to].push(*node));
    }
    for sweep in 0..SWEEPS {
        if sweep % 2 == 0 {
            (1..rows.len()).for_each(|at| sort_layer(&mut rows, at, at - 1, &before));
        } else {
            (0..rows.len().saturating_sub(1))
                .rev()
                .for_each(|at| sort_layer(&mut rows, at, at + 1, &forward));
        }
    }
    let near = |node: usize| forward[node].iter().chain(&before[node]).copied();
    let heights = settle_heights(sizes, &rows, &near, forward.len());
    let mut x = 0.0;
    let mut at = vec![Vec2::ZERO; forward.len()];
    for row in &rows {
        let width = row.iter().map(|node| sizes[*node].x).fold(0.0, f32::max);
        for node in row {
            at[*node] = vec2(x, heights[*node]);
        }
        x += width + ACROSS;
    }
    let top = own.iter().map(|node| at[*node].y).fold(f32::INFINITY, f32::min);
    own.iter().map(|node| at[*node] - vec2(0.0, top)).collect()
}

/// Keeps room for links that pass a layer: each is led through a small node of its own there.
/// Returns the links, the sizes and the nodes, with these added.
fn with_passing_nodes(
    forward: &[Vec<usize>],
    sizes: &[Vec2],
    layer: &[usize],
    rows: &mut [Vec<usize>],
    own: &[usize],
) -> (Vec<Vec<usize>>, Vec<Vec2>, Vec<usize>) {
    let (mut led, mut sizes, mut part) = (forward.to_vec(), sizes.to_vec(), own.to_vec());
    for from in own {
        for (n, to) in forward[*from].iter().enumerate() {
            let mut before = (*from, n);
            let passed = rows.iter_mut().take(layer[*to]).skip(layer[*from] + 1);
            for row in passed {
                // In a large drawing there is not enough room for all of them.
                if led.len() > MAX_NODES {
                    break;
                }
                let passing = led.len();
                led[before.0][before.1] = passing;
                led.push(vec![*to]);
                sizes.push(PASSING);
                row.push(passing);
                part.push(passing);
                before = (passing, 0);
            }
        }
    }
    (led, sizes, part)
}

/// The links without those that close a cycle: in a depth-first search, such a link leads to a node
/// that is left after the node it comes from.
fn without_cycles(next: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let graph = graph_of(next);
    let mut fed = vec![0; next.len()];
    next.iter().flatten().for_each(|to| fed[*to] += 1);
    let mut starts: Vec<usize> = (0..next.len()).collect();
    // The search begins at nodes without inputs; in a cycle, at the first one in the file.
    starts.sort_by_key(|node| (fed[*node] > 0, *node));
    let mut search = DfsPostOrder::empty(&graph);
    let mut left_at = vec![0; next.len()];
    let mut count = 0;
    for start in starts {
        search.move_to(NodeIndex::new(start));
        while let Some(node) = search.next(&graph) {
            left_at[node.index()] = count;
            count += 1;
        }
    }
    let is_forward = |from: usize, to: usize| left_at[to] < left_at[from];
    let forward = next.iter().enumerate();
    forward
        .map(|(from, list)| list.iter().copied().filter(|to| is_forward(from, *to)).collect())
        .collect()
}

/// The layer of each node: the one after the last layer of a node that leads to it.
fn layers(forward: &[Vec<usize>]) -> Vec<usize> {
    let mut layer = vec![0; forward.len()];
    // Without cycles there is always an order.
    for node in toposort(&graph_of(forward), None).unwrap_or_default() {
        let node = node.index();
        for to in &forward[node] {
            layer[*to] = layer[*to].max(layer[node] + 1);
        }
    }
    layer
}

/// The links as a graph. A search takes the links of a node in the order of its list: the graph
/// yields the link added last first, and [`DfsPostOrder`] follows the last one that it was given.
fn graph_of(next: &[Vec<usize>]) -> DiGraph<(), (), usize> {
    let mut graph = DiGraph::with_capacity(next.len(), next.iter().map(Vec::len).sum());
    next.iter().for_each(|_| _ = graph.add_node(()));
    for (from, list) in next.iter().enumerate() {
        for to in list {
            graph.add_edge(NodeIndex::new(from), NodeIndex::new(*to), ());
        }
    }
    graph
}

/// Sorts a layer by the mean place of the neighbours in another one.
fn sort_layer(rows: &mut [Vec<usize>], at: usize, other: usize, near: &[Vec<usize>]) {
    let place: HashMap<usize, usize> =
        rows[other].iter().enumerate().map(|(n, node)| (*node, n)).collect();
    let mean = |node: usize| {
        let places: Vec<_> = near[node].iter().filter_map(|n| place.get(n).copied()).collect();
        let sum: usize = places.iter().sum();
        (!places.is_empty()).then(|| sum as f32 / places.len() as f32)
    };
    let mut keyed: Vec<(f32, usize)> = rows[at]
        .iter()
        .enumerate()
        .map(|(n, node)| (mean(*node).unwrap_or(n as f32), *node))
        .collect();
    keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
    rows[at] = keyed.into_iter().map(|(_, node)| node).collect();
}

/// Returns how far down each node is: near the middle of its neighbours, in the order of its layer.
fn settle_heights<I: Iterator<Item = usize>>(
    sizes: &[Vec2],
    rows: &[Vec<usize>],
    near: &dyn Fn(usize) -> I,
    count: usize,
) -> Vec<f32> {
    let mut top = vec![0.0; count];
    for row in rows {
        let mut y = 0.0;
        for node in row {
            top[*node] = y;
            y += sizes[*node].y + DOWN;
        }
    }
    for sweep in 0..SWEEPS {
        let order: Vec<&Vec<usize>> =
            if sweep % 2 == 0 { rows.iter().collect() } else { rows.iter().rev().collect() };
        for row in order {
            let wanted: Vec<f32> = row
                .iter()
                .map(|node| {
                    let middles: Vec<_> = near(*node).map(|n| top[n] + sizes[n].y / 2.0).collect();
                    if middles.is_empty() {
                        top[*node]
                    } else {
                        middles.iter().sum::<f32>() / middles.len() as f32 - sizes[*node].y / 2.0
                    }
                })
                .collect();
            spread_layer(sizes, row, &wanted, &mut top);
        }
    }
    top
}

/// Puts the nodes of a layer at their wanted positions as far as they do not overlap. Nodes that
/// would overlap form a group, which moves as one to the mean of the positions its nodes want.
fn spread_layer(sizes: &[Vec2], row: &[usize], wanted: &[f32], top: &mut [f32]) {
    // (first, count, sum of the wanted tops of the first, height)
    let mut groups: Vec<(usize, usize, f32, f32)> = Vec::new();
    for (n, node) in row.iter().enumerate() {
        let mut group = (n, 1, wanted[n], sizes[*node].y + DOWN);
        while let Some(above) = groups.last() {
            let (above_top, own_top) = (above.2 / above.1 as f32, group.2 / group.1 as f32);
            if above_top + above.3 <= own_top {
                break;
            }
            let sum = above.2 + group.2 - above.3 * group.1 as f32;
            group = (above.0, above.1 + group.1, sum, above.3 + group.3);
            groups.pop();
        }
        groups.push(group);
    }
    for (first, count, sum, _) in groups {
        let mut y = sum / count as f32;
        for node in &row[first..first + count] {
            top[*node] = y;
            y += sizes[*node].y + DOWN;
        }
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::Rect;

    use super::*;

    fn check(count: usize, links: &[(usize, usize)]) -> Vec<Vec2> {
        let sizes: Vec<_> = (0..count).map(|n| vec2(150.0, 60.0 + 20.0 * (n % 4) as f32)).collect();
        let wanted: Vec<_> = (0..count).collect();
        let at = arrange(&sizes, links, &wanted, SHAPE);
        let areas: Vec<_> = at
            .iter()
            .zip(&sizes)
            .map(|(at, size)| Rect::from_min_size(at.to_pos2(), *size))
            .collect();
        for (n, one) in areas.iter().enumerate() {
            assert!(one.min.x >= -0.1 && one.min.y >= -0.1, "{one:?}");
            for (m, other) in areas.iter().enumerate().skip(n + 1) {
                assert!(!one.expand(4.0).intersects(*other), "{n} {one:?} is over {m} {other:?}");
            }
        }
        at
    }

    #[test]
    fn a_chain_leads_to_the_right_on_one_line() {
        let at = check(4, &[(2, 0), (0, 3), (3, 1)]);
        assert!(at[2].x < at[0].x && at[0].x < at[3].x && at[3].x < at[1].x, "{at:?}");
    }

    #[test]
    fn circles_and_loops_and_loners_are_placed_too() {
        let at = check(6, &[(0, 1), (1, 2), (2, 0), (3, 3)]);
        assert!(at[0].x < at[1].x && at[1].x < at[2].x, "{at:?}");
        check(0, &[]);
    }

    #[test]
    fn separate_parts_get_the_shape_of_a_window() {
        for parts in [40, 250] {
            let links: Vec<_> =
                (0..parts).flat_map(|n| (0..3).map(move |m| (4 * n + m, 4 * n + m + 1))).collect();
            let at = check(4 * parts, &links);
            let far = at.iter().fold(Vec2::ZERO, |far, at| far.max(*at + vec2(150.0, 120.0)));
            let shape = far.x / far.y;
            assert!((1.0..2.5).contains(&shape), "{parts} parts: {far:?}");
        }
    }

    #[test]
    fn nothing_overlaps_in_a_large_drawing() {
        let links: Vec<_> = (0..300).map(|n| ((n * 7) % 200, (n * 13 + 5) % 200)).collect();
        check(200, &links);
    }
}
