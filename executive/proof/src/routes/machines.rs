//! The routes of a mission as state machines.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use armor_petri::analysis::invariants::{PlaceBounds, Semiflow, Semiflows, place_semiflows};
use armor_petri::{Net, NetBuilder, NetTransition, PlaceId, TransitionId};
use armor_plan::Plan;
use armor_robotfile::Mission;

use super::apart::PairStates;
use crate::analysed::Analysed;

/// How a transition moves the token of a route; [`None`] is outside of the route.
#[derive(Clone, Copy, Debug)]
pub(super) struct RouteMove {
    pub(super) transition: TransitionId,
    pub(super) from: Option<PlaceId>,
    pub(super) to: Option<PlaceId>,
    /// Whether the route alone decides on it: it needs only this token, and no end of the mission.
    pub(super) is_own: bool,
}

/// The routes of a mission, of which each never has more than one token.
#[derive(Debug)]
pub(crate) struct RouteMachines<'a> {
    pub(super) net: &'a Net,
    /// Goal and safe place.
    pub(super) ends: Vec<PlaceId>,
    pub(super) emergencies: &'a BTreeSet<TransitionId>,
    /// The number of the route of each place; none of a place of the mission itself.
    pub(super) routes: Vec<Option<usize>>,
    /// Per route, the places and the moves of its token.
    pub(super) places: Vec<Vec<PlaceId>>,
    pub(super) moves: Vec<Vec<RouteMove>>,
    /// Per route, whether its token enters it once at most.
    pub(super) enters_once: Vec<bool>,
    bounds: Vec<Option<u64>>,
    sums: Semiflows<PlaceId>,
    pairs: PairStates,
}

/// A net in which some places of each route are one place.
#[derive(Debug)]
pub(super) struct JoinedNet {
    pub(super) net: Net,
    /// The place of each place of the mission.
    pub(super) places: Vec<PlaceId>,
    /// Per route, the one place.
    pub(super) running: Vec<PlaceId>,
    /// Per route, a place that counts the entries of its token.
    pub(super) entered: Vec<PlaceId>,
    /// Per transition, one of the mission that it is.
    pub(super) sources: Vec<TransitionId>,
}

/// What a transition needs and does, to omit it if another one does the same.
type Arcs = [Vec<(PlaceId, u32)>; 4];
/// Its earliest and latest moment, and whether it is gated, where these are known.
type Timing = Option<(Duration, Option<Duration>, bool)>;

impl<'a> RouteMachines<'a> {
    /// Of a mission with routes.
    ///
    /// # Errors
    /// Why its routes cannot be proven one by one; none if it has no route.
    pub(crate) fn find(
        plan: &Plan,
        mission: &Mission,
        analysed: &'a Analysed,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, Option<String>> {
        let (net, count) = (&analysed.net, mission.routes.len());
        if count == 0 {
            return Err(None);
        }
        let ends: Vec<_> = [plan.goal(), plan.safe()].into_iter().flatten().collect();
        let numbers: BTreeMap<&str, usize> =
            mission.routes.iter().enumerate().map(|(n, it)| (it.name.value.as_str(), n)).collect();
        let find_route = |name: &String| numbers.get(name.split_once('.')?.0).copied();
        let mut routes: Vec<_> = net.places().iter().map(find_route).collect();
        for end in &ends {
            routes[end.index()] = None;
        }
        let mut places = vec![Vec::new(); count];
        for (index, route) in routes.iter().enumerate() {
            if let Some(route) = route {
                places[*route].push(PlaceId(index as u32));
            }
        }
        let mut machines = Self {
            net,
            ends,
            emergencies: &analysed.emergencies,
            routes,
            places,
            moves: vec![Vec::new(); count],
            enters_once: vec![false; count],
            bounds: Vec::new(),
            sums: Semiflows { semiflows: Vec::new(), complete: false },
            pairs: PairStates::default(),
        };
        machines.refuse_tests()?;
        machines.refuse_instant_circles()?;
        let joined = machines.join_places(&|_| true)?;
        let bounds = PlaceBounds::of_net(&joined.net, stop);
        let most = |place: PlaceId| bounds.of(place.index());
        let name = |route: usize| mission.routes[route].name.value.as_str();
        if let Some(route) = (0..count).find(|it| most(joined.running[*it]).is_none_or(|n| n > 1)) {
            return Err(Some(format!("{} may get a second token", name(route))));
        }
        machines.enters_once =
            joined.entered.iter().map(|place| most(*place).is_some_and(|n| n < 2)).collect();
        machines.bounds = joined.places.iter().map(|place| most(*place)).collect();
        machines.sums = machines.expand_sums(&joined, stop);
        machines.moves = (0..count).map(|route| machines.list_moves(route)).collect();
        Ok(machines)
    }

    /// How many routes there are.
    pub(crate) fn count(&self) -> usize {
        self.places.len()
    }

    /// The number of states that the routes may have together: one for each combination of places.
    pub(crate) fn product(&self) -> u64 {
        let counts = self.places.iter().map(|places| places.len() as u64);
        counts.fold(1, u64::saturating_mul)
    }

    /// The most tokens of each place, as far as they are known.
    pub(crate) fn bounds(&self) -> PlaceBounds {
        PlaceBounds::known(self.bounds.clone())
    }

    /// Sums of tokens that no firing changes.
    pub(crate) fn sums(&self) -> &Semiflows<PlaceId> {
        &self.sums
    }

    /// Whether it is known that two places are never marked together: they are of one route, or the
    /// two routes have no such state even if all others do what they like.
    pub(crate) fn are_apart(&self, one: PlaceId, other: PlaceId) -> bool {
        match (self.routes[one.index()], self.routes[other.index()]) {
            (Some(first), Some(second)) if first == second => one != other,
            (Some(_), Some(_)) => !self.pairs.can_be_together(self, one, other),
            _ => false,
        }
    }

    /// No transition may look at a place of a route but by taking a token or finding one there.
    fn refuse_tests(&self) -> Result<(), Option<String>> {
        let is_inside = |place: &PlaceId| self.routes[place.index()].is_some();
        for transition in self.net.transitions() {
            let inhibitors = transition.inhibitors.iter().map(|arc| arc.0);
            let mut tested = inhibitors.chain(transition.resets.iter().copied());
            if let Some(place) = tested.find(is_inside) {
                let (name, place) = (&transition.name, self.net.place(place));
                let what = format!("{name} has an inhibitor arc or a reset arc at {place}");
                return Err(Some(what));
            }
        }
        Ok(())
    }

    /// Firings that follow each other without end in no time would let no time pass for the others.
    fn refuse_instant_circles(&self) -> Result<(), Option<String>> {
        let is_instant = |it: &&NetTransition| {
            !it.gated && it.interval.latest.is_some_and(|latest| latest.is_zero())
        };
        let instant: Vec<_> = self.net.transitions().iter().filter(is_instant).collect();
        let mut next = vec![Vec::new(); self.net.places().len()];
        let mut before = vec![0_u32; self.net.places().len()];
        for transition in instant {
            let needed = transition.inputs.iter().chain(&transition.reads);
            for ((from, _), (to, _)) in
                needed.flat_map(|from| transition.outputs.iter().map(move |to| (from, to)))
            {
                next[from.index()].push(*to);
                before[to.index()] += 1;
            }
        }
        let mut open: Vec<usize> = (0..before.len()).filter(|it| before[*it] == 0).collect();
        while let Some(place) = open.pop() {
            for to in &next[place] {
                before[to.index()] -= 1;
                if before[to.index()] == 0 {
                    open.push(to.index());
                }
            }
        }
        let circle = before.iter().position(|count| *count > 0);
        circle.map_or(Ok(()), |place| {
            let place = self.net.place(PlaceId(place as u32));
            Err(Some(format!("firings can follow each other without end in no time at {place}")))
        })
    }

    fn list_moves(&self, route: usize) -> Vec<RouteMove> {
        let is_of = |arc: &&(PlaceId, u32)| self.routes[arc.0.index()] == Some(route);
        let ids = self.net.transition_ids().filter(|id| !self.emergencies.contains(id));
        let of_one = |id: TransitionId| {
            let transition = self.net.transition(id);
            let taken: Vec<_> = transition.inputs.iter().filter(is_of).collect();
            let put = transition.outputs.iter().find(is_of).map(|arc| arc.0);
            let tokens: u32 = taken.iter().map(|arc| arc.1).sum();
            // With more than one it never fires; with none at all the token does not move.
            if tokens > 1 || (tokens == 0 && put.is_none()) {
                return None;
            }
            let from = taken.first().map(|arc| arc.0);
            let is_own = from.is_some()
                && transition.inputs.len() == 1
                && transition.reads.is_empty()
                && transition.inhibitors.iter().all(|arc| self.ends.contains(&arc.0));
            Some(RouteMove { transition: id, from, to: put, is_own })
        };
        ids.filter_map(of_one).collect()
    }

    /// The place where the token of a route is at first.
    pub(super) fn start(&self, route: usize) -> Option<PlaceId> {
        let mut places = self.places[route].iter();
        places.find(|place| self.net.initial()[place.index()] > 0).copied()
    }

    /// Whether a firing marks an end of the mission.
    pub(super) fn leads_to_end(&self, transition: TransitionId) -> bool {
        let outputs = &self.net.transition(transition).outputs;
        outputs.iter().any(|arc| self.ends.contains(&arc.0))
    }

    /// The net in which those places of each route are one that `is_joined`, without emergencies. It
    /// can do all that the mission can do: what a transition requires of a place, it requires of the
    /// place that it is part of.
    pub(super) fn join_places(
        &self,
        is_joined: &dyn Fn(PlaceId) -> bool,
    ) -> Result<JoinedNet, Option<String>> {
        let mut builder = NetBuilder::default();
        let joins = |place: PlaceId, route: usize| {
            self.routes[place.index()] == Some(route) && is_joined(place)
        };
        let tokens = |places: &dyn Fn(PlaceId) -> bool| -> u32 {
            let initial = (0..).map(PlaceId).zip(self.net.initial());
            initial.filter(|it| places(it.0)).map(|it| *it.1).sum()
        };
        let count = self.places.len();
        let running: Vec<_> = (0..count)
            .map(|route| builder.place(format!("/running {route}"), tokens(&|it| joins(it, route))))
            .collect();
        let entered: Vec<_> = (0..count)
            .map(|route| {
                let is_of = |it: PlaceId| self.routes[it.index()] == Some(route);
                builder.place(format!("/entered {route}"), tokens(&is_of))
            })
            .collect();
        let mut places = Vec::new();
        for (index, name) in self.net.places().iter().enumerate() {
            let place = PlaceId(index as u32);
            places.push(match self.routes[index] {
                Some(route) if is_joined(place) => running[route],
                _ => builder.place(name.as_str(), self.net.initial()[index]),
            });
        }
        let joined = |arcs: &[(PlaceId, u32)]| {
            let mut sums: BTreeMap<PlaceId, u32> = BTreeMap::new();
            for (place, weight) in arcs {
                let sum = sums.entry(places[place.index()]).or_default();
                *sum = sum.saturating_add(*weight);
            }
            sums.into_iter().collect::<Vec<_>>()
        };
        let mut known: BTreeSet<(Arcs, Vec<PlaceId>, Timing)> = BTreeSet::new();
        let mut sources = Vec::new();
        for id in self.net.transition_ids().filter(|id| !self.emergencies.contains(id)) {
            let transition = self.net.transition(id);
            let inputs = joined(&transition.inputs);
            let mut outputs = joined(&transition.outputs);
            if inputs == outputs && transition.resets.is_empty() {
                continue;
            }
            let is_in = |arcs: &[(PlaceId, u32)], route: usize| {
                arcs.iter().any(|arc| self.routes[arc.0.index()] == Some(route))
            };
            for (route, counter) in entered.iter().enumerate() {
                if is_in(&transition.outputs, route) && !is_in(&transition.inputs, route) {
                    outputs.push((*counter, 1));
                }
            }
            let resets: Vec<_> =
                transition.resets.iter().map(|place| places[place.index()]).collect();
            // When the token of a route comes to where it is needed is not known.
            let needs_running = inputs.iter().any(|arc| running.contains(&arc.0));
            let interval = transition.interval;
            let timing =
                (!needs_running).then_some((interval.earliest, interval.latest, transition.gated));
            let arcs = [inputs, outputs, joined(&transition.reads), joined(&transition.inhibitors)];
            if !known.insert((arcs.clone(), resets.clone(), timing)) {
                continue;
            }
            let [inputs, outputs, reads, inhibitors] = arcs;
            let mut t = builder.transition(transition.name.as_str());
            t = inputs.iter().fold(t, |t, arc| t.input(arc.0, arc.1));
            t = outputs.iter().fold(t, |t, arc| t.output(arc.0, arc.1));
            t = reads.iter().fold(t, |t, arc| t.read(arc.0, arc.1));
            t = inhibitors.iter().fold(t, |t, arc| t.inhibitor(arc.0, arc.1));
            resets.iter().fold(t, |t, place| t.reset(*place));
            sources.push(id);
        }
        let net = builder.build().map_err(|why| Some(why.to_string()))?;
        Ok(JoinedNet { net, places, running, entered, sources })
    }

    /// The sums of the net in which each route is one place are sums of the mission's net.
    fn expand_sums(&self, joined: &JoinedNet, stop: &dyn Fn() -> bool) -> Semiflows<PlaceId> {
        let found = place_semiflows(&joined.net, stop);
        let expand = |flow: &Semiflow<PlaceId>| {
            // What a counter of entries weighs does not change with the marking of a place.
            if flow.weights.iter().any(|it| joined.entered.contains(&it.0)) {
                return None;
            }
            let weight = |place: &PlaceId| {
                let of = flow.weights.iter().find(|weighed| weighed.0 == *place);
                of.map(|weighed| weighed.1)
            };
            let all = (0..).map(PlaceId).zip(&joined.places);
            let weights = all.filter_map(|(place, of)| Some((place, weight(of)?))).collect();
            Some(Semiflow { weights })
        };
        let semiflows = found.semiflows.iter().filter_map(expand).collect();
        Semiflows { semiflows, complete: false }
    }
}
