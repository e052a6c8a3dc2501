//! Questions about all runs, answered on a graph of markings: whether a marking can become
//! unreachable, and whether a run can avoid it for ever.
//!
//! [`find_escape`] has its own depth-first search, because petgraph's `depth_first_search` recurses
//! and would overflow the stack on long runs.

use super::budget::{AnalysisBudget, Exhausted};
use super::classes::StateClasses;
use super::space::Space;
use crate::net::TransitionId;
use petgraph::graph::{DiGraph, NodeIndex};
use petgraph::visit::{Dfs, VisitMap, Visitable};
use std::borrow::Cow;

/// A complete graph of markings. Node 0 is the initial one; nodes are numbered by distance from it.
pub trait MarkingGraph {
    /// Returns the number of nodes.
    fn nodes(&self) -> u32;
    /// Returns the tokens per place.
    fn tokens(&self, node: u32) -> Cow<'_, [u32]>;
    /// Returns the firings of a node, each with the node after it.
    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]>;
    /// Returns a shortest firing sequence to a node.
    fn path(&self, node: u32) -> Vec<TransitionId>;

    /// Returns the nearest node whose marking is wanted.
    fn nearest(&self, wanted: &dyn Fn(&[u32]) -> bool) -> Option<u32> {
        (0..self.nodes()).find(|node| wanted(&self.tokens(*node)))
    }
}

impl MarkingGraph for StateClasses {
    fn nodes(&self) -> u32 {
        self.classes() as u32
    }

    fn tokens(&self, node: u32) -> Cow<'_, [u32]> {
        self.marking(node).into()
    }

    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]> {
        self.successors(node).into()
    }

    fn path(&self, node: u32) -> Vec<TransitionId> {
        self.path_to(node)
    }
}

/// Firing sequences are empty if the exploration did not record them.
impl MarkingGraph for Space {
    fn nodes(&self) -> u32 {
        self.states() as u32
    }

    fn tokens(&self, node: u32) -> Cow<'_, [u32]> {
        self.marking(node).into()
    }

    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]> {
        self.successors(node).into()
    }

    fn path(&self, node: u32) -> Vec<TransitionId> {
        self.path_to(node).unwrap_or_default()
    }
}

/// A run from the initial marking that avoids the wanted markings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Escape {
    /// After the first sequence, the second can repeat for ever.
    Circle(Vec<TransitionId>, Vec<TransitionId>),
    /// After these firings no transition is enabled.
    DeadEnd(Vec<TransitionId>),
}

const STEPS_BETWEEN_STOP_CHECKS: u32 = 1 << 12;

/// Checks regularly whether to stop.
struct Patience<'a> {
    budget: &'a AnalysisBudget<'a>,
    steps: u32,
}

impl Patience<'_> {
    fn check_budget(&mut self) -> Result<(), Exhausted> {
        self.steps = self.steps.wrapping_add(1);
        let is_due = self.steps.is_multiple_of(STEPS_BETWEEN_STOP_CHECKS);
        if is_due && (self.budget.stop)() { Err(Exhausted::Time) } else { Ok(()) }
    }
}

/// Bytes that petgraph takes per node and per edge, and a place on the stack of the search.
const BYTES_PER_NODE: u64 = 13;
const BYTES_PER_FIRING: u64 = 16;

/// Returns the nearest node from which no wanted node is reachable; a wanted node reaches itself.
///
/// # Errors
/// If memory or time ran out.
pub fn nearest_lost(
    graph: &dyn MarkingGraph,
    wanted: &dyn Fn(&[u32]) -> bool,
    budget: &AnalysisBudget<'_>,
) -> Result<Option<u32>, Exhausted> {
    let mut patience = Patience { budget, steps: 0 };
    let nodes = graph.nodes();
    let mut backwards = DiGraph::<(), ()>::with_capacity(nodes as usize, 0);
    for _ in 0..nodes {
        backwards.add_node(());
    }
    let mut starts = Vec::new();
    let mut bytes = u64::from(nodes) * BYTES_PER_NODE;
    for node in 0..nodes {
        patience.check_budget()?;
        let firings = graph.firings(node);
        for (_, next) in firings.iter() {
            backwards.add_edge(NodeIndex::from(*next), NodeIndex::from(node), ());
        }
        bytes += firings.len() as u64 * BYTES_PER_FIRING;
        if wanted(&graph.tokens(node)) {
            starts.push(NodeIndex::from(node));
        }
        if bytes > budget.memory_bytes {
            return Err(Exhausted::Memory);
        }
    }
    let mut search = Dfs::from_parts(starts, backwards.visit_map());
    while search.next(&backwards).is_some() {
        patience.check_budget()?;
    }
    Ok((0..nodes).find(|node| !search.discovered.is_visited(&NodeIndex::from(*node))))
}

const ON_PATH: u8 = 1;
const DONE: u8 = 2;

/// Returns a run through one of `starts` that never reaches a wanted marking from there on: it
/// enters a circle or a dead end.
///
/// # Errors
/// If time ran out.
pub fn find_escape(
    graph: &dyn MarkingGraph,
    starts: impl IntoIterator<Item = u32>,
    wanted: &dyn Fn(&[u32]) -> bool,
    budget: &AnalysisBudget<'_>,
) -> Result<Option<Escape>, Exhausted> {
    let mut search = EscapeSearch {
        graph,
        wanted,
        patience: Patience { budget, steps: 0 },
        marks: vec![0; graph.nodes() as usize],
    };
    for start in starts {
        search.patience.check_budget()?;
        if search.marks[start as usize] == 0
            && let Some(escape) = search.find_escape(start)?
        {
            let lead = graph.path(start);
            let after = |path: Vec<_>| lead.iter().copied().chain(path).collect();
            return Ok(Some(match escape {
                Escape::Circle(path, circle) => Escape::Circle(after(path), circle),
                Escape::DeadEnd(path) => Escape::DeadEnd(after(path)),
            }));
        }
    }
    Ok(None)
}

struct EscapeSearch<'a> {
    graph: &'a dyn MarkingGraph,
    wanted: &'a dyn Fn(&[u32]) -> bool,
    patience: Patience<'a>,
    marks: Vec<u8>,
}

/// A node on the search path, its firings, how many of them were followed, and the one that led
/// here.
struct Visit<'a> {
    node: u32,
    firings: Cow<'a, [(TransitionId, u32)]>,
    followed: usize,
    by: TransitionId,
}

impl<'a> EscapeSearch<'a> {
    fn find_escape(&mut self, start: u32) -> Result<Option<Escape>, Exhausted> {
        let mut path = Vec::new();
        self.enter_node(start, TransitionId(0), &mut path);
        while let Some(last) = path.last_mut() {
            self.patience.check_budget()?;
            let Some(&(transition, next)) = last.firings.get(last.followed) else {
                if last.firings.is_empty() {
                    return Ok(Some(Escape::DeadEnd(fired_transitions(&path[1..]))));
                }
                self.marks[last.node as usize] = DONE;
                path.pop();
                continue;
            };
            last.followed += 1;
            match self.marks[next as usize] {
                ON_PATH => {
                    let entry = path.iter().position(|visit| visit.node == next).unwrap_or(0);
                    let mut circle = fired_transitions(&path[entry + 1..]);
                    circle.push(transition);
                    return Ok(Some(Escape::Circle(fired_transitions(&path[1..=entry]), circle)));
                }
                DONE => {}
                _ => self.enter_node(next, transition, &mut path),
            }
        }
        Ok(None)
    }

    fn enter_node(&mut self, node: u32, by: TransitionId, path: &mut Vec<Visit<'a>>) {
        let is_wanted = (self.wanted)(&self.graph.tokens(node));
        self.marks[node as usize] = if is_wanted { DONE } else { ON_PATH };
        if !is_wanted {
            let firings = self.graph.firings(node);
            path.push(Visit { node, firings, followed: 0, by });
        }
    }
}

fn fired_transitions(path: &[Visit<'_>]) -> Vec<TransitionId> {
    path.iter().map(|visit| visit.by).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::walker::space_of_walker;

    fn ids(numbers: &[u32]) -> Vec<TransitionId> {
        numbers.iter().copied().map(TransitionId).collect()
    }

    #[test]
    fn a_run_escapes_into_a_circle_or_to_a_dead_end_or_not_at_all() {
        let check = |edges: &[(usize, usize)], expected: Option<Escape>| {
            let space = space_of_walker(4, edges);
            let starts = space.nearest(&|m| m[1] > 0);
            let found = find_escape(&space, starts, &|m| m[3] > 0, &AnalysisBudget::UNLIMITED);
            assert_eq!(found.unwrap(), expected, "{edges:?}");
        };
        check(&[(0, 1), (1, 3), (3, 1)], None);
        check(&[(0, 1), (1, 2)], Some(Escape::DeadEnd(ids(&[0, 1]))));
        check(&[(0, 1), (1, 3), (1, 2), (2, 1)], Some(Escape::Circle(ids(&[0]), ids(&[2, 3]))));
        check(&[(0, 1), (1, 3), (0, 2)], None);
        check(&[(0, 2), (2, 0)], None);
    }

    #[test]
    fn the_nearest_node_that_cannot_reach_a_wanted_one_is_found() {
        let check = |edges: &[(usize, usize)], expected: Option<&[TransitionId]>| {
            let space = space_of_walker(4, edges);
            let found = nearest_lost(&space, &|m| m[3] > 0, &AnalysisBudget::UNLIMITED).unwrap();
            assert_eq!(found.map(|node| space.path(node)).as_deref(), expected, "{edges:?}");
        };
        check(&[(0, 1), (1, 0), (1, 3)], None);
        check(&[(0, 1), (1, 2), (2, 2), (0, 3), (1, 3)], Some(&ids(&[0, 1])));
        check(&[(0, 1)], Some(&[]));
    }
}
