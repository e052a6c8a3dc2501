//! Which places of two routes can be marked together, if all other routes do what they like.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use armor_petri::{PlaceId, TransitionId};

use super::machines::RouteMachines;

/// Per pair of routes, its states.
type KnownPairs = BTreeMap<(usize, usize), Rc<Vec<bool>>>;

/// The states of pairs of routes, found when they are asked for.
#[derive(Debug, Default)]
pub(super) struct PairStates {
    known: RefCell<KnownPairs>,
}

/// The moves of a route by where they begin: place numbers within the route, 0 is outside.
struct LocalMoves {
    /// How many places there are, with the outside.
    count: usize,
    moves: Vec<(TransitionId, usize, usize)>,
}

impl PairStates {
    /// Whether two places of different routes can be marked together.
    pub(super) fn can_be_together(
        &self,
        machines: &RouteMachines<'_>,
        one: PlaceId,
        other: PlaceId,
    ) -> bool {
        let numbers = [one, other].map(|place| machines.routes[place.index()]);
        let [Some(first), Some(second)] = numbers else { return true };
        let (low, high) = if first < second { (first, second) } else { (second, first) };
        let (of_low, of_high) = if first < second { (one, other) } else { (other, one) };
        let known = self.known.borrow().get(&(low, high)).cloned();
        let states = known.unwrap_or_else(|| {
            let found = Rc::new(explore_pair(machines, low, high));
            self.known.borrow_mut().insert((low, high), Rc::clone(&found));
            found
        });
        let width = machines.places[high].len() + 1;
        states[find_local(machines, low, of_low) * width + find_local(machines, high, of_high)]
    }
}

/// The number of a place within its route; 0 is outside.
fn find_local(machines: &RouteMachines<'_>, route: usize, place: PlaceId) -> usize {
    machines.places[route].binary_search(&place).map_or(0, |index| index + 1)
}

/// The states of two routes, one row of places of the second for each of the first.
fn explore_pair(machines: &RouteMachines<'_>, one: usize, other: usize) -> Vec<bool> {
    let (first, second) = (local_moves(machines, one), local_moves(machines, other));
    let of_second: HashMap<TransitionId, Vec<(usize, usize)>> =
        second.moves.iter().fold(HashMap::new(), |mut all, it| {
            all.entry(it.0).or_insert_with(Vec::new).push((it.1, it.2));
            all
        });
    let mut joint: HashMap<(usize, usize), Vec<(usize, usize)>> = HashMap::new();
    let mut is_joint = Vec::new();
    for (transition, from, to) in &first.moves {
        for (their_from, their_to) in of_second.get(transition).into_iter().flatten() {
            joint.entry((*from, *their_from)).or_default().push((*to, *their_to));
            is_joint.push(*transition);
        }
    }
    is_joint.sort_unstable();
    let alone = |route: &LocalMoves| {
        let mut next = vec![Vec::new(); route.count];
        for (transition, from, to) in &route.moves {
            if is_joint.binary_search(transition).is_err() {
                next[*from].push(*to);
            }
        }
        for targets in &mut next {
            targets.sort_unstable();
            targets.dedup();
        }
        next
    };
    let (next, their_next) = (alone(&first), alone(&second));
    let width = second.count;
    let mut states = vec![false; first.count * width];
    let start =
        |route: usize| machines.start(route).map_or(0, |place| find_local(machines, route, place));
    let mut open = vec![(start(one), start(other))];
    while let Some((here, there)) = open.pop() {
        if std::mem::replace(&mut states[here * width + there], true) {
            continue;
        }
        open.extend(next[here].iter().map(|to| (*to, there)));
        open.extend(their_next[there].iter().map(|to| (here, *to)));
        open.extend(joint.get(&(here, there)).into_iter().flatten());
    }
    states
}

fn local_moves(machines: &RouteMachines<'_>, route: usize) -> LocalMoves {
    let local = |place: Option<PlaceId>| place.map_or(0, |it| find_local(machines, route, it));
    let moves = machines.moves[route].iter();
    let moves = moves.map(|it| (it.transition, local(it.from), local(it.to))).collect();
    LocalMoves { count: machines.places[route].len() + 1, moves }
}
