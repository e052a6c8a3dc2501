//! Firings of the whole mission that bring its routes to given places, found by going straight for them.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use armor_petri::analysis::rules::FiringRules;
use armor_petri::{PlaceId, TransitionId};

use super::machines::RouteMachines;
use crate::witness::Witness;

/// Where the token of each route is to be: anywhere, in a place, or (`Some(None)`) outside.
#[derive(Clone, Debug)]
pub(super) struct RouteTarget {
    pub(super) places: Vec<Option<Option<PlaceId>>>,
}

/// Most markings that are looked at.
const MOST_MARKINGS: usize = 50_000;
/// Farther than any place.
const FAR: u32 = 1 << 20;

/// The marked places with their tokens, in order.
type Marked = Box<[(u32, u32)]>;

struct Step {
    marked: Marked,
    parent: u32,
    transition: TransitionId,
}

struct TraceSearch<'a> {
    machines: &'a RouteMachines<'a>,
    rules: FiringRules,
    /// Per place, the transitions that need a token there; of several only at the first.
    needing: Vec<Vec<TransitionId>>,
    needing_nothing: Vec<TransitionId>,
    /// Per route with a target, the firings that each place is away from it; the last is the outside.
    distances: Vec<Option<Vec<u32>>>,
    marking: Vec<u32>,
    steps: Vec<Step>,
    known: HashSet<Marked>,
    open: BinaryHeap<(Reverse<u32>, u32)>,
}

impl RouteMachines<'_> {
    /// Firings to a marking as asked in which the routes are at their targets.
    pub(super) fn find_trace(
        &self,
        target: &RouteTarget,
        asked: &dyn Fn(&[u32]) -> bool,
        stop: &dyn Fn() -> bool,
    ) -> Option<Witness> {
        TraceSearch::new(self, target).run(asked, stop)
    }

    fn measure(&self, route: usize, target: Option<PlaceId>) -> Vec<u32> {
        let outside = self.net.places().len();
        let index = |place: Option<PlaceId>| place.map_or(outside, PlaceId::index);
        let mut before = vec![Vec::new(); outside + 1];
        // Where the mission ends, nothing fires any more.
        for it in self.moves[route].iter().filter(|it| !self.leads_to_end(it.transition)) {
            before[index(it.to)].push(index(it.from));
        }
        let mut distances = vec![FAR; outside + 1];
        distances[index(target)] = 0;
        let mut open = std::collections::VecDeque::from([index(target)]);
        while let Some(place) = open.pop_front() {
            for from in &before[place] {
                if distances[*from] == FAR {
                    distances[*from] = distances[place] + 1;
                    open.push_back(*from);
                }
            }
        }
        distances
    }
}

impl<'a> TraceSearch<'a> {
    fn new(machines: &'a RouteMachines<'a>, target: &RouteTarget) -> Self {
        let net = machines.net;
        let mut needing = vec![Vec::new(); net.places().len()];
        let mut needing_nothing = Vec::new();
        for id in net.transition_ids().filter(|id| !machines.emergencies.contains(id)) {
            let transition = net.transition(id);
            match transition.inputs.first().or(transition.reads.first()) {
                Some(arc) => needing[arc.0.index()].push(id),
                None => needing_nothing.push(id),
            }
        }
        let of = target.places.iter().enumerate();
        let distances = of.map(|(route, to)| to.map(|to| machines.measure(route, to))).collect();
        Self {
            machines,
            rules: FiringRules::new(net),
            needing,
            needing_nothing,
            distances,
            marking: vec![0; net.places().len()],
            steps: Vec::new(),
            known: HashSet::new(),
            open: BinaryHeap::new(),
        }
    }

    fn run(mut self, asked: &dyn Fn(&[u32]) -> bool, stop: &dyn Fn() -> bool) -> Option<Witness> {
        let initial = (0..).zip(self.machines.net.initial().iter().copied());
        let marked: Marked = initial.filter(|it| it.1 > 0).collect();
        self.add(marked, 0, TransitionId(0));
        while let Some((_, number)) = self.open.pop() {
            if self.steps.len() > MOST_MARKINGS || stop() {
                return None;
            }
            let marked = self.steps[number as usize].marked.clone();
            self.write(&marked);
            if asked(&self.marking) {
                let marking = std::mem::take(&mut self.marking);
                return Some(Witness { path: self.path(number), marking });
            }
            let there = marked.iter().flat_map(|it| &self.needing[it.0 as usize]);
            let candidates: Vec<_> = there.chain(&self.needing_nothing).copied().collect();
            for transition in candidates {
                if self.rules.enabled(&self.marking, transition) {
                    self.fire(&marked, number, transition, asked);
                }
            }
            marked.iter().for_each(|it| self.marking[it.0 as usize] = 0);
        }
        None
    }

    fn write(&mut self, marked: &Marked) {
        marked.iter().for_each(|it| self.marking[it.0 as usize] = it.1);
    }

    /// Adds the marking after a firing, and leaves the one before it as it was.
    fn fire(
        &mut self,
        marked: &Marked,
        number: u32,
        transition: TransitionId,
        asked: &dyn Fn(&[u32]) -> bool,
    ) {
        let arcs = self.machines.net.transition(transition);
        let fired = self.rules.fire(&mut self.marking, transition);
        let is_of_use =
            fired.is_some() && (!self.machines.leads_to_end(transition) || asked(&self.marking));
        let mut touched: Vec<u32> = marked.iter().map(|it| it.0).collect();
        touched.extend(arcs.outputs.iter().map(|arc| arc.0.0));
        touched.extend(arcs.resets.iter().map(|place| place.0));
        touched.sort_unstable();
        touched.dedup();
        let tokens = |place: &u32| (*place, self.marking[*place as usize]);
        let after: Marked = touched.iter().map(tokens).filter(|it| it.1 > 0).collect();
        touched.iter().for_each(|place| self.marking[*place as usize] = 0);
        self.write(marked);
        if is_of_use {
            self.add(after, number, transition);
        }
    }

    fn add(&mut self, marked: Marked, parent: u32, transition: TransitionId) {
        let distance = self.distance(&marked);
        if distance >= FAR || !self.known.insert(marked.clone()) {
            return;
        }
        self.steps.push(Step { marked, parent, transition });
        self.open.push((Reverse(distance), self.steps.len() as u32 - 1));
    }

    /// How many firings of the routes are left at least, if they did not have to wait for each other.
    fn distance(&self, marked: &Marked) -> u32 {
        let routes = &self.machines.routes;
        let mut at = vec![routes.len(); self.distances.len()];
        for (place, _) in marked {
            if let Some(route) = routes[*place as usize] {
                at[route] = *place as usize;
            }
        }
        let all = self.distances.iter().zip(&at);
        all.filter_map(|(distances, at)| distances.as_ref().map(|it| it[*at])).sum()
    }

    fn path(&self, number: u32) -> Vec<TransitionId> {
        let mut path = Vec::new();
        let mut number = number;
        while number != 0 {
            let step = &self.steps[number as usize];
            path.push(step.transition);
            number = step.parent;
        }
        path.reverse();
        path
    }
}
