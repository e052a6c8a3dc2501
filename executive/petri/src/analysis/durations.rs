//! The shortest and the longest time to a wanted marking.
//!
//! The firing domains include the beginning of the run as one more moment. For the shortest time
//! only the least elapsed time matters, and domains are searched in its order. For the longest time
//! no circle and no dead end may avoid the wanted markings; then there are finitely many sequences.

use super::budget::{AnalysisBudget, Exhausted};
use super::classes::{StateClasses, TimedRules};
use super::domain::{Domain, NEVER};
use super::runs::{Escape, find_escape};
use crate::net::{Net, TransitionId};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::time::Duration;

/// A firing sequence and how long it takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimedSequence {
    /// From the beginning to the last firing.
    pub time: Duration,
    /// The firings.
    pub sequence: Vec<TransitionId>,
}

/// The longest time to the first wanted marking.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Latest {
    /// Never later than this.
    At(TimedSequence),
    /// After these firings a transition may take unlimited time.
    WithoutEnd(Vec<TransitionId>),
    /// It can be avoided: after the first sequence, the second can repeat for ever.
    Circle(Vec<TransitionId>, Vec<TransitionId>),
    /// It can be avoided: after these firings no transition is enabled.
    DeadEnd(Vec<TransitionId>),
}

/// Returns the shortest time to a wanted marking; `None` if there is none. `classes` must be
/// complete.
///
/// # Errors
/// If a budget ran out.
pub fn shortest_time(
    net: &Net,
    classes: &StateClasses,
    wanted: impl Fn(&[u32]) -> bool,
    budget: &AnalysisBudget<'_>,
) -> Result<Option<TimedSequence>, Exhausted> {
    if !(0..classes.classes() as u32).any(|class| wanted(classes.marking(class))) {
        return Ok(None);
    }
    let mut search = DurationSearch::new(net)?;
    let mut domain = search.initial_domain(net);
    // Only the least elapsed time matters: without upper bounds, more domains are equal or
    // contained.
    domain.forget_latest();
    let mut waiting = BinaryHeap::new();
    search.enter_node(net.initial().into(), domain, None, &mut |elapsed, node| {
        waiting.push(Reverse((elapsed.0, node)));
    });
    while let Some(Reverse((elapsed, node))) = waiting.pop() {
        search.check_budget(budget)?;
        let (marking, domain) = search.nodes[node].clone();
        // Elapsed time never decreases along a run, and the queue returns the least first: no later
        // domain can be sooner.
        if wanted(&marking) {
            let time = search.firing.times.duration(elapsed);
            return Ok(Some(TimedSequence { time, sequence: search.path_to(node) }));
        }
        for (transition, marking, mut domain) in search.firing.first_firings(&marking, &domain)? {
            domain.forget_latest();
            search.enter_node(marking, domain, Some((node, transition)), &mut |elapsed, node| {
                waiting.push(Reverse((elapsed.0, node)));
            });
        }
    }
    Ok(None)
}

/// Returns the longest time to the first wanted marking. `classes` must be complete.
///
/// # Errors
/// If a budget ran out.
pub fn longest_time(
    net: &Net,
    classes: &StateClasses,
    wanted: impl Fn(&[u32]) -> bool,
    budget: &AnalysisBudget<'_>,
) -> Result<Latest, Exhausted> {
    match find_escape(classes, [0], &wanted, budget)? {
        Some(Escape::Circle(path, circle)) => return Ok(Latest::Circle(path, circle)),
        Some(Escape::DeadEnd(path)) => return Ok(Latest::DeadEnd(path)),
        None => {}
    }
    let mut search = DurationSearch::new(net)?;
    let mut domain = search.initial_domain(net);
    domain.forget_earliest();
    let mut waiting = Vec::new();
    let mut latest = (-1, 0);
    search.enter_node(net.initial().into(), domain, None, &mut |_, node| waiting.push(node));
    while let Some(node) = waiting.pop() {
        search.check_budget(budget)?;
        let (marking, domain) = search.nodes[node].clone();
        let elapsed = domain.elapsed_at_most();
        if elapsed == NEVER {
            return Ok(Latest::WithoutEnd(search.path_to(node)));
        }
        if wanted(&marking) {
            latest = latest.max((elapsed, node));
            continue;
        }
        for (transition, marking, mut domain) in search.firing.first_firings(&marking, &domain)? {
            domain.forget_earliest();
            let from = Some((node, transition));
            search.enter_node(marking, domain, from, &mut |_, node| waiting.push(node));
        }
    }
    let time = search.firing.times.duration(latest.0);
    Ok(Latest::At(TimedSequence { time, sequence: search.path_to(latest.1) }))
}

/// Stop is checked after this many domains.
const DOMAINS_BETWEEN_STOP_CHECKS: u64 = 256;
/// Bytes of a node besides its numbers: pointers and table entries.
const BYTES_OVERHEAD: u64 = 200;

/// A search over markings with domains that include the beginning, none of which contains another.
struct DurationSearch {
    firing: TimedRules,
    nodes: Vec<(Box<[u32]>, Domain)>,
    from: Vec<Option<(usize, TransitionId)>>,
    /// Per marking and domain without the beginning, the bounds of the beginning seen so far.
    known: HashMap<(Box<[u32]>, Domain), Vec<Beginning>>,
    bytes: u64,
    checks: u64,
}

/// The bounds of the beginning in a domain: its row and its column.
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

/// Least elapsed time, in units.
struct Elapsed(i64);

impl DurationSearch {
    fn new(net: &Net) -> Result<Self, Exhausted> {
        Ok(Self {
            firing: TimedRules::new(net)?,
            nodes: Vec::new(),
            from: Vec::new(),
            known: HashMap::new(),
            bytes: 0,
            checks: 0,
        })
    }

    fn initial_domain(&self, net: &Net) -> Domain {
        Domain::newly_enabled(
            &self.firing.times,
            &self.firing.enabled_transitions(net.initial()),
            true,
        )
    }

    fn enter_node(
        &mut self,
        marking: Box<[u32]>,
        domain: Domain,
        from: Option<(usize, TransitionId)>,
        entered: &mut dyn FnMut(Elapsed, usize),
    ) {
        let (core, row, column) = domain.split_beginning();
        let known = self.known.entry((marking.clone(), core)).or_default();
        let beginning = Beginning { row, column };
        // Every run from this domain is also one from the domain that contains it.
        if known.iter().any(|other| beginning.is_within(other)) {
            return;
        }
        known.push(beginning);
        let node = self.nodes.len();
        self.bytes += 3 * domain.bytes() + 8 * marking.len() as u64 + BYTES_OVERHEAD;
        entered(Elapsed(domain.elapsed_at_least()), node);
        self.nodes.push((marking, domain));
        self.from.push(from);
    }

    fn check_budget(&mut self, budget: &AnalysisBudget<'_>) -> Result<(), Exhausted> {
        self.checks += 1;
        budget.count_explored();
        if self.checks.is_multiple_of(DOMAINS_BETWEEN_STOP_CHECKS) && (budget.stop)() {
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

    fn path_to(&self, node: usize) -> Vec<TransitionId> {
        let steps = std::iter::successors(self.from[node], |(node, _)| self.from[*node]);
        let mut path: Vec<_> = steps.map(|(_, transition)| transition).collect();
        path.reverse();
        path
    }
}
