//! The directed graphs that checks ask for circles and paths: components and their links, places
//! and their transitions, missions and their sub-missions. The algorithms are `petgraph`'s; those
//! used here do not recurse, so a chain of thousands of components needs no deep stack.

use std::collections::{BTreeMap, BTreeSet};

use petgraph::algo::{astar, kosaraju_scc};
use petgraph::graph::{DiGraph, EdgeReference, NodeIndex};
use petgraph::visit::{Dfs, EdgeRef};

/// A graph of nodes `N`, joined by edges that each carry an `E`.
pub(super) struct CheckGraph<N, E> {
    graph: DiGraph<N, E>,
    indices: BTreeMap<N, NodeIndex>,
}

impl<N: Copy + Ord, E: Copy> CheckGraph<N, E> {
    /// Builds the graph. An edge from or to something that is not among `nodes` is left out.
    pub(super) fn new(
        nodes: impl Iterator<Item = N>,
        edges: impl Iterator<Item = (N, N, E)>,
    ) -> Self {
        let mut graph = DiGraph::new();
        let indices: BTreeMap<_, _> = nodes.map(|node| (node, graph.add_node(node))).collect();
        for (from, to, edge) in edges {
            if let (Some(from), Some(to)) = (indices.get(&from), indices.get(&to)) {
                graph.add_edge(*from, *to, edge);
            }
        }
        Self { graph, indices }
    }

    /// Finds at most `max` circles, such that without the last edge of each of them no circle is
    /// left. Each is given by its edges, beginning at the node of it that was added first.
    pub(super) fn find_circles(mut self, max: usize) -> Vec<Vec<E>> {
        let mut circles = Vec::new();
        loop {
            let starts = self.first_nodes_of_circles();
            if starts.is_empty() {
                return circles;
            }
            for start in starts {
                if circles.len() == max {
                    return circles;
                }
                circles.extend(self.take_circle(start));
            }
        }
    }

    /// Returns whether a circle can be reached from `start`.
    pub(super) fn has_circle_below(&self, start: N) -> bool {
        let Some(start) = self.indices.get(&start) else { return false };
        let on_circles: BTreeSet<_> = self.circular_components().into_iter().flatten().collect();
        let mut below = Dfs::new(&self.graph, *start);
        while let Some(node) = below.next(&self.graph) {
            if on_circles.contains(&node) {
                return true;
            }
        }
        false
    }

    /// Returns the sets of nodes that reach each other and that no edge leads to from elsewhere, each
    /// followed by the nodes that are reached from it and from no earlier one. The nodes of a set are
    /// in the order in which they were added.
    pub(super) fn find_first_groups(&self) -> Vec<Vec<N>> {
        let mut components = kosaraju_scc(&self.graph);
        // They come in reverse topological order.
        components.reverse();
        let mut group_of = vec![None; self.graph.node_count()];
        let mut groups: Vec<Vec<N>> = Vec::new();
        for mut component in components {
            component.sort();
            let before = component.iter().flat_map(|node| {
                self.graph.neighbors_directed(*node, petgraph::Direction::Incoming)
            });
            let group = before.filter_map(|node| group_of[node.index()]).next();
            let group = group.unwrap_or_else(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            for node in component {
                group_of[node.index()] = Some(group);
                groups[group].push(self.graph[node]);
            }
        }
        groups
    }

    /// Returns the nodes of the cheapest circle through `start`, which is the first of them; none if
    /// it is on no circle. Each node costs what `cost` returns.
    pub(super) fn cheapest_circle(&self, start: N, cost: impl Fn(N) -> usize) -> Option<Vec<N>> {
        let start = *self.indices.get(&start)?;
        let closes = |node| self.graph.contains_edge(node, start);
        let cost = |edge: EdgeReference<'_, E>| cost(self.graph[edge.target()]);
        let (_, nodes) = astar(&self.graph, start, closes, cost, |_| 0)?;
        Some(nodes.into_iter().map(|node| self.graph[node]).collect())
    }

    /// Returns the sets of nodes that reach each other.
    fn circular_components(&self) -> Vec<Vec<NodeIndex>> {
        let mut components = kosaraju_scc(&self.graph);
        components.retain(|nodes| match nodes.as_slice() {
            [only] => self.graph.contains_edge(*only, *only),
            _ => true,
        });
        components
    }

    fn first_nodes_of_circles(&self) -> Vec<NodeIndex> {
        let components = self.circular_components();
        let mut first: Vec<_> = components.iter().filter_map(|nodes| nodes.iter().min()).collect();
        first.sort_unstable();
        first.into_iter().copied().collect()
    }

    /// Returns a shortest circle through `start`, and removes the edge that closes it.
    fn take_circle(&mut self, start: NodeIndex) -> Option<Vec<E>> {
        let closes = |node| self.graph.contains_edge(node, start);
        let (_, mut nodes) = astar(&self.graph, start, closes, |_| 1_usize, |_| 0)?;
        nodes.push(start);
        // Of several edges between two nodes, the one that was added first.
        let edge = |ends: &[NodeIndex]| {
            let edges = self.graph.edges_connecting(ends[0], ends[1]);
            edges.map(|edge| edge.id()).min()
        };
        let edges: Vec<_> = nodes.windows(2).filter_map(edge).collect();
        let circle = edges.iter().map(|edge| self.graph[*edge]).collect();
        self.graph.remove_edge(*edges.last()?);
        Some(circle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(edges: &[(usize, usize)]) -> CheckGraph<usize, (usize, usize)> {
        CheckGraph::new(0..6, edges.iter().map(|(from, to)| (*from, *to, (*from, *to))))
    }

    #[test]
    fn a_circle_is_given_by_its_edges_from_its_first_node() {
        let circles = graph(&[(2, 1), (1, 3), (3, 2), (0, 1), (5, 5), (9, 0)]).find_circles(8);
        assert_eq!(circles, [vec![(1, 3), (3, 2), (2, 1)], vec![(5, 5)]]);
        assert!(graph(&[(0, 1), (1, 2), (0, 2)]).find_circles(8).is_empty());
    }

    #[test]
    fn without_the_last_edge_of_each_circle_none_is_left() {
        let mut edges = vec![(0, 1), (1, 0), (1, 2), (2, 0), (2, 1), (0, 2), (2, 3), (3, 2)];
        let circles = graph(&edges).find_circles(usize::MAX);
        let closing: Vec<_> = circles.iter().filter_map(|circle| circle.last()).collect();
        edges.retain(|edge| !closing.contains(&edge));
        assert!(graph(&edges).find_circles(1).is_empty(), "{circles:?}");
        assert_eq!(graph(&[(0, 1), (1, 0), (2, 3), (3, 2)]).find_circles(1).len(), 1);
    }

    #[test]
    fn a_circle_counts_only_where_it_can_be_reached() {
        let graph = graph(&[(0, 1), (1, 2), (2, 1), (3, 0)]);
        assert!(graph.has_circle_below(3) && graph.has_circle_below(2));
        assert!(!graph.has_circle_below(4));
    }
}
