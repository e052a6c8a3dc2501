//! What all runs have in common, asked of a graph of markings: whether something can get out of
//! reach, and whether a run can avoid it for ever.

use super::budget::{Budget, Exhausted};
use super::classes::Classes;
use super::space::Space;
use crate::net::TransitionId;
use std::borrow::Cow;

/// A complete graph of markings: node 0 is the beginning, the nearer a node the lower its number.
pub trait Graph {
    /// How many nodes there are.
    fn nodes(&self) -> u32;
    /// Tokens per place.
    fn tokens(&self, node: u32) -> Cow<'_, [u32]>;
    /// The firings, each with the node after it.
    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]>;
    /// A shortest firing sequence to a node.
    fn way(&self, node: u32) -> Vec<TransitionId>;

    /// The nearest node whose marking is as asked.
    fn nearest(&self, asked: &dyn Fn(&[u32]) -> bool) -> Option<u32> {
        (0..self.nodes()).find(|node| asked(&self.tokens(*node)))
    }
}

impl Graph for Classes {
    fn nodes(&self) -> u32 {
        self.classes() as u32
    }

    fn tokens(&self, node: u32) -> Cow<'_, [u32]> {
        self.marking(node).into()
    }

    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]> {
        self.successors(node).into()
    }

    fn way(&self, node: u32) -> Vec<TransitionId> {
        self.way_to(node)
    }
}

/// Its ways are empty if the exploration was not asked to remember them.
impl Graph for Space {
    fn nodes(&self) -> u32 {
        self.states() as u32
    }

    fn tokens(&self, node: u32) -> Cow<'_, [u32]> {
        self.marking(node).into()
    }

    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]> {
        self.successors(node).into()
    }

    fn way(&self, node: u32) -> Vec<TransitionId> {
        self.way_to(node).unwrap_or_default()
    }
}

/// A run that avoids something, from the beginning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Escape {
    /// After the first firings the second can go on for ever.
    Circle(Vec<TransitionId>, Vec<TransitionId>),
    /// After these firings nothing can fire.
    DeadEnd(Vec<TransitionId>),
}

const STEPS_BETWEEN_QUESTIONS: u32 = 1 << 12;

/// Asks now and then whether to stop.
struct Patience<'a> {
    budget: &'a Budget<'a>,
    steps: u32,
}

impl Patience<'_> {
    fn step(&mut self) -> Result<(), Exhausted> {
        self.steps = self.steps.wrapping_add(1);
        let is_asked = self.steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS);
        if is_asked && (self.budget.stop)() { Err(Exhausted::Time) } else { Ok(()) }
    }
}

/// The nearest node from which no node as asked can be reached; itself counts.
///
/// # Errors
/// If memory or time ran out.
pub fn lost(
    graph: &dyn Graph,
    asked: &dyn Fn(&[u32]) -> bool,
    budget: &Budget<'_>,
) -> Result<Option<u32>, Exhausted> {
    let mut patience = Patience { budget, steps: 0 };
    let mut before: Vec<Vec<u32>> = vec![Vec::new(); graph.nodes() as usize];
    let mut can = vec![false; graph.nodes() as usize];
    let mut waiting = Vec::new();
    let mut bytes = u64::from(graph.nodes()) * 25;
    for node in 0..graph.nodes() {
        patience.step()?;
        for (_, next) in graph.firings(node).iter() {
            before[*next as usize].push(node);
            bytes += 4;
        }
        if asked(&graph.tokens(node)) {
            can[node as usize] = true;
            waiting.push(node);
        }
        if bytes > budget.memory_bytes {
            return Err(Exhausted::Memory);
        }
    }
    while let Some(node) = waiting.pop() {
        patience.step()?;
        for from in std::mem::take(&mut before[node as usize]) {
            if !std::mem::replace(&mut can[from as usize], true) {
                waiting.push(from);
            }
        }
    }
    Ok((0..graph.nodes()).find(|node| !can[*node as usize]))
}

const ON_THE_WAY: u8 = 1;
const DONE: u8 = 2;

/// A run through one of `starts` that never comes to what is asked, then or later: into a circle,
/// or to a dead end.
///
/// # Errors
/// If time ran out.
pub fn escape(
    graph: &dyn Graph,
    starts: impl IntoIterator<Item = u32>,
    asked: &dyn Fn(&[u32]) -> bool,
    budget: &Budget<'_>,
) -> Result<Option<Escape>, Exhausted> {
    let mut search = Search {
        graph,
        asked,
        patience: Patience { budget, steps: 0 },
        marks: vec![0; graph.nodes() as usize],
    };
    for start in starts {
        search.patience.step()?;
        if search.marks[start as usize] == 0
            && let Some(escape) = search.from(start)?
        {
            let lead = graph.way(start);
            let after = |way: Vec<_>| lead.iter().copied().chain(way).collect();
            return Ok(Some(match escape {
                Escape::Circle(way, circle) => Escape::Circle(after(way), circle),
                Escape::DeadEnd(way) => Escape::DeadEnd(after(way)),
            }));
        }
    }
    Ok(None)
}

struct Search<'a> {
    graph: &'a dyn Graph,
    asked: &'a dyn Fn(&[u32]) -> bool,
    patience: Patience<'a>,
    marks: Vec<u8>,
}

/// A node on the way, its firings, how many of them were followed, and the one that led here.
struct Visit<'a> {
    node: u32,
    firings: Cow<'a, [(TransitionId, u32)]>,
    followed: usize,
    by: TransitionId,
}

impl<'a> Search<'a> {
    fn from(&mut self, start: u32) -> Result<Option<Escape>, Exhausted> {
        let mut way = Vec::new();
        self.enter(start, TransitionId(0), &mut way);
        while let Some(last) = way.last_mut() {
            self.patience.step()?;
            let Some(&(transition, next)) = last.firings.get(last.followed) else {
                if last.firings.is_empty() {
                    return Ok(Some(Escape::DeadEnd(fired(&way[1..]))));
                }
                self.marks[last.node as usize] = DONE;
                way.pop();
                continue;
            };
            last.followed += 1;
            match self.marks[next as usize] {
                ON_THE_WAY => {
                    let entry = way.iter().position(|visit| visit.node == next).unwrap_or(0);
                    let mut circle = fired(&way[entry + 1..]);
                    circle.push(transition);
                    return Ok(Some(Escape::Circle(fired(&way[1..=entry]), circle)));
                }
                DONE => {}
                _ => self.enter(next, transition, &mut way),
            }
        }
        Ok(None)
    }

    fn enter(&mut self, node: u32, by: TransitionId, way: &mut Vec<Visit<'a>>) {
        let is_asked = (self.asked)(&self.graph.tokens(node));
        self.marks[node as usize] = if is_asked { DONE } else { ON_THE_WAY };
        if !is_asked {
            let firings = self.graph.firings(node);
            way.push(Visit { node, firings, followed: 0, by });
        }
    }
}

fn fired(way: &[Visit<'_>]) -> Vec<TransitionId> {
    way.iter().map(|visit| visit.by).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::explore;
    use crate::analysis::invariants::Bounds;
    use crate::net::Net;

    /// One token that goes along these edges.
    fn walker(places: usize, edges: &[(usize, usize)]) -> Space {
        let mut net = Net::builder();
        let places: Vec<_> =
            (0..places).map(|p| net.place(format!("p{p}"), u32::from(p == 0))).collect();
        for (index, &(from, to)) in edges.iter().enumerate() {
            net.transition(format!("t{index}")).input(places[from], 1).output(places[to], 1);
        }
        let net = net.build().unwrap();
        explore(&net, &Bounds::of_net(&net, &|| false), true, &Budget::UNLIMITED).space
    }

    fn ids(numbers: &[u32]) -> Vec<TransitionId> {
        numbers.iter().copied().map(TransitionId).collect()
    }

    #[test]
    fn a_run_escapes_into_a_circle_or_to_a_dead_end_or_not_at_all() {
        let check = |edges: &[(usize, usize)], expected: Option<Escape>| {
            let space = walker(4, edges);
            let starts = space.nearest(&|m| m[1] > 0);
            let found = escape(&space, starts, &|m| m[3] > 0, &Budget::UNLIMITED);
            assert_eq!(found.unwrap(), expected, "{edges:?}");
        };
        check(&[(0, 1), (1, 3), (3, 1)], None);
        check(&[(0, 1), (1, 2)], Some(Escape::DeadEnd(ids(&[0, 1]))));
        check(&[(0, 1), (1, 3), (1, 2), (2, 1)], Some(Escape::Circle(ids(&[0]), ids(&[2, 3]))));
        check(&[(0, 1), (1, 3), (0, 2)], None);
        check(&[(0, 2), (2, 0)], None);
    }

    #[test]
    fn what_is_out_of_reach_is_found_at_its_nearest() {
        let check = |edges: &[(usize, usize)], expected: Option<&[TransitionId]>| {
            let space = walker(4, edges);
            let found = lost(&space, &|m| m[3] > 0, &Budget::UNLIMITED).unwrap();
            assert_eq!(found.map(|node| space.way(node)).as_deref(), expected, "{edges:?}");
        };
        check(&[(0, 1), (1, 0), (1, 3)], None);
        check(&[(0, 1), (1, 2), (2, 2), (0, 3), (1, 3)], Some(&ids(&[0, 1])));
        check(&[(0, 1)], Some(&[]));
    }
}
