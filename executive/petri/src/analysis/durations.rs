//! How soon a marking of some kind can be reached, and how late it must have been.
//!
//! The beginning is one more moment in the firing domains. For the shortest time only the least
//! time gone by matters, so domains are searched by it, the nearest first; for the longest one
//! there must be no circle and no dead end on the way, and then the ways are finitely many.

use super::budget::{Budget, Exhausted};
use super::classes::{Classes, Firing};
use super::domain::{Domain, NEVER};
use crate::net::{Net, TransitionId};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::time::Duration;

/// A firing sequence and how long it takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Timed {
    /// From the beginning to the last firing.
    pub time: Duration,
    /// The firings.
    pub sequence: Vec<TransitionId>,
}

/// How late the first marking of the kind comes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Latest {
    /// Never later than this.
    At(Timed),
    /// After these firings something may be waited for without end.
    WithoutEnd(Vec<TransitionId>),
    /// It need not come: after the first firings the second can go on for ever.
    Circle(Vec<TransitionId>, Vec<TransitionId>),
    /// It need not come: after these firings nothing can fire.
    DeadEnd(Vec<TransitionId>),
}

/// The shortest time to a marking that `asked` accepts; `None` if there is none. `classes` are all
/// of the net's.
///
/// # Errors
/// If a budget ran out.
pub fn shortest(
    net: &Net,
    classes: &Classes,
    asked: impl Fn(&[u32]) -> bool,
    budget: &Budget<'_>,
) -> Result<Option<Timed>, Exhausted> {
    if !(0..classes.classes() as u32).any(|class| asked(classes.marking(class))) {
        return Ok(None);
    }
    let mut search = Search::new(net)?;
    let mut domain = search.beginning(net);
    domain.forget_latest();
    let mut waiting = BinaryHeap::new();
    search.enter(net.initial().into(), domain, None, &mut |elapsed, node| {
        waiting.push(Reverse((elapsed.0, node)));
    });
    while let Some(Reverse((elapsed, node))) = waiting.pop() {
        search.ask(budget)?;
        let (marking, domain) = search.nodes[node].clone();
        if asked(&marking) {
            let time = search.firing.times.duration(elapsed);
            return Ok(Some(Timed { time, sequence: search.way_to(node) }));
        }
        for (transition, marking, mut domain) in search.firing.all(&marking, &domain)? {
            domain.forget_latest();
            search.enter(marking, domain, Some((node, transition)), &mut |elapsed, node| {
                waiting.push(Reverse((elapsed.0, node)));
            });
        }
    }
    Ok(None)
}

/// How late the first marking that `asked` accepts can come. `classes` are all of the net's.
///
/// # Errors
/// If a budget ran out.
pub fn longest(
    net: &Net,
    classes: &Classes,
    asked: impl Fn(&[u32]) -> bool,
    budget: &Budget<'_>,
) -> Result<Latest, Exhausted> {
    if let Some(escape) = escape(classes, &asked) {
        return Ok(escape);
    }
    let mut search = Search::new(net)?;
    let mut domain = search.beginning(net);
    domain.forget_earliest();
    let mut waiting = Vec::new();
    let mut latest = (-1, 0);
    search.enter(net.initial().into(), domain, None, &mut |_, node| waiting.push(node));
    while let Some(node) = waiting.pop() {
        search.ask(budget)?;
        let (marking, domain) = search.nodes[node].clone();
        let elapsed = domain.elapsed_at_most();
        if elapsed == NEVER {
            return Ok(Latest::WithoutEnd(search.way_to(node)));
        }
        if asked(&marking) {
            latest = latest.max((elapsed, node));
            continue;
        }
        for (transition, marking, mut domain) in search.firing.all(&marking, &domain)? {
            domain.forget_earliest();
            let from = Some((node, transition));
            search.enter(marking, domain, from, &mut |_, node| waiting.push(node));
        }
    }
    let time = search.firing.times.duration(latest.0);
    Ok(Latest::At(Timed { time, sequence: search.way_to(latest.1) }))
}

/// A way that never comes to what is asked: into a circle, or to a dead end.
fn escape(classes: &Classes, asked: impl Fn(&[u32]) -> bool) -> Option<Latest> {
    const ON_THE_WAY: u8 = 1;
    const DONE: u8 = 2;
    let mut marks = vec![0u8; classes.classes() as usize];
    // Class, next firing, and the firing that led here.
    let mut way: Vec<(u32, usize, TransitionId)> = Vec::new();
    let enter = |class: u32, by, way: &mut Vec<_>, marks: &mut Vec<u8>| {
        let end = asked(classes.marking(class));
        marks[class as usize] = if end { DONE } else { ON_THE_WAY };
        if !end {
            way.push((class, 0, by));
        }
    };
    enter(0, TransitionId(0), &mut way, &mut marks);
    while let Some((class, next, _)) = way.last_mut() {
        let successors = classes.successors(*class);
        let Some(&(transition, successor)) = successors.get(*next) else {
            if successors.is_empty() {
                return Some(Latest::DeadEnd(way[1..].iter().map(|step| step.2).collect()));
            }
            marks[*class as usize] = DONE;
            way.pop();
            continue;
        };
        *next += 1;
        match marks[successor as usize] {
            ON_THE_WAY => {
                let start = way.iter().position(|step| step.0 == successor).unwrap_or(0);
                let fired = |steps: &[(u32, usize, TransitionId)]| -> Vec<TransitionId> {
                    steps.iter().map(|step| step.2).collect()
                };
                let mut circle = fired(&way[start + 1..]);
                circle.push(transition);
                return Some(Latest::Circle(fired(&way[1..=start]), circle));
            }
            DONE => {}
            _ => enter(successor, transition, &mut way, &mut marks),
        }
    }
    None
}

/// Markings with domains that know the beginning, none within another.
struct Search {
    firing: Firing,
    nodes: Vec<(Box<[u32]>, Domain)>,
    from: Vec<Option<(usize, TransitionId)>>,
    /// Per marking and domain without the beginning, what is known of that.
    known: HashMap<(Box<[u32]>, Domain), Vec<Beginning>>,
    bytes: u64,
    asked: u64,
}

/// The row and the column of the beginning in a domain.
struct Beginning {
    row: Vec<i64>,
    column: Vec<i64>,
}

impl Beginning {
    fn is_within(&self, other: &Self) -> bool {
        let lower = |mine: &[i64], theirs: &[i64]| mine.iter().zip(theirs).all(|(m, t)| m <= t);
        lower(&self.row, &other.row) && lower(&self.column, &other.column)
    }
}

/// Time gone by, at least.
struct Elapsed(i64);

impl Search {
    fn new(net: &Net) -> Result<Self, Exhausted> {
        Ok(Self {
            firing: Firing::new(net)?,
            nodes: Vec::new(),
            from: Vec::new(),
            known: HashMap::new(),
            bytes: 0,
            asked: 0,
        })
    }

    fn beginning(&self, net: &Net) -> Domain {
        Domain::fresh(&self.firing.times, &self.firing.enabled(net.initial()), true)
    }

    fn enter(
        &mut self,
        marking: Box<[u32]>,
        domain: Domain,
        from: Option<(usize, TransitionId)>,
        entered: &mut dyn FnMut(Elapsed, usize),
    ) {
        let (core, row, column) = domain.split_beginning();
        let known = self.known.entry((marking.clone(), core)).or_default();
        let beginning = Beginning { row, column };
        if known.iter().any(|other| beginning.is_within(other)) {
            return;
        }
        known.push(beginning);
        let node = self.nodes.len();
        self.bytes += 3 * domain.bytes() + 8 * marking.len() as u64 + 200;
        entered(Elapsed(domain.elapsed_at_least()), node);
        self.nodes.push((marking, domain));
        self.from.push(from);
    }

    fn ask(&mut self, budget: &Budget<'_>) -> Result<(), Exhausted> {
        self.asked += 1;
        if self.asked.is_multiple_of(256) && (budget.stop)() {
            return Err(Exhausted::Time);
        }
        if self.bytes > budget.memory_bytes {
            return Err(Exhausted::Memory);
        }
        match self.nodes.len() as u64 > budget.states {
            true => Err(Exhausted::States),
            false => Ok(()),
        }
    }

    fn way_to(&self, node: usize) -> Vec<TransitionId> {
        let steps = std::iter::successors(self.from[node], |(node, _)| self.from[*node]);
        let mut way: Vec<_> = steps.map(|(_, transition)| transition).collect();
        way.reverse();
        way
    }
}
