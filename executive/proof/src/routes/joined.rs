//! Whether the end of the mission stays in reach, by a net in which the free places of a route are one.

use armor_petri::analysis::{AnalysisBudget, ExplorationEnd, StateExploration, explore_states};
use armor_petri::{PlaceId, TransitionId};

use super::machines::{JoinedNet, RouteMachines};
use super::trace::RouteTarget;
use armor_petri::analysis::invariants::PlaceBounds;

/// What the joined net shows of the end of the mission.
#[derive(Debug)]
pub(super) enum EndShown {
    /// It is in reach wherever the routes are.
    Always,
    /// It is not from these, if the routes come there.
    NotFrom(Vec<RouteTarget>),
    /// Why it is open.
    Open(&'static str),
}

/// The states of the joined net.
#[derive(Debug)]
pub(super) struct JoinedStates {
    joined: JoinedNet,
    states: StateExploration,
    /// Per state, whether no firings lead to an end or to a free place.
    lost: Vec<bool>,
}

/// Most states from which the end is out of reach that are looked for in the mission.
const MOST_TARGETS: usize = 8;

impl RouteMachines<'_> {
    /// Whether goal or safe place is in reach wherever the routes are.
    pub(crate) fn keep_end_in_reach(&self, budget: &AnalysisBudget<'_>) -> bool {
        let joined = self.explore_joined(budget);
        joined.is_some_and(|mut joined| matches!(joined.keep_end(self), EndShown::Always))
    }

    pub(super) fn explore_joined(&self, budget: &AnalysisBudget<'_>) -> Option<JoinedStates> {
        let is_free = self.find_free();
        let mut joined = self.join_places(&|place| is_free[place.index()]).ok()?;
        // The number of times that a route begins is known, and would only make more states.
        joined.forget_entries()?;
        let mut most = vec![Some(1); joined.net.places().len()];
        for (place, of) in joined.places.iter().enumerate() {
            if self.routes[place].is_none() {
                most[of.index()] = self.bounds().of(place);
            }
        }
        let states = explore_states(&joined.net, &PlaceBounds::known(most), true, budget);
        if states.ending != ExplorationEnd::Complete {
            return None;
        }
        Some(JoinedStates { joined, states, lost: Vec::new() })
    }
}

impl JoinedNet {
    /// The same net with nothing put into the counters of entries.
    fn forget_entries(&mut self) -> Option<()> {
        let mut builder = armor_petri::NetBuilder::default();
        for (name, tokens) in self.net.places().iter().zip(self.net.initial()) {
            builder.place(name.as_str(), *tokens);
        }
        for transition in self.net.transitions() {
            let mut t = builder.transition(transition.name.as_str());
            t = transition.inputs.iter().fold(t, |t, arc| t.input(arc.0, arc.1));
            let outputs = transition.outputs.iter().filter(|arc| !self.entered.contains(&arc.0));
            t = outputs.fold(t, |t, arc| t.output(arc.0, arc.1));
            t = transition.reads.iter().fold(t, |t, arc| t.read(arc.0, arc.1));
            t = transition.inhibitors.iter().fold(t, |t, arc| t.inhibitor(arc.0, arc.1));
            transition.resets.iter().fold(t, |t, place| t.reset(*place));
        }
        self.net = builder.build().ok()?;
        Some(())
    }
}

impl JoinedStates {
    /// How many states the joined net has.
    pub(super) fn count(&self) -> u64 {
        self.states.space.states()
    }

    /// Whether the end stays in reach: while the token of some route is in a free place, it is. From all
    /// other states it must be by firings that nothing can forestall.
    pub(super) fn keep_end(&mut self, machines: &RouteMachines<'_>) -> EndShown {
        let ends: Vec<_> = machines.ends.iter().map(|it| self.joined.places[it.index()]).collect();
        let is_wanted = |marking: &[u32]| {
            let mut wanted = self.joined.running.iter().chain(&ends);
            wanted.any(|place| marking[place.index()] > 0)
        };
        let space = &self.states.space;
        let markings = (0..space.states() as u32).map(|state| space.marking(state));
        let wanted: Vec<_> = markings.map(|marking| is_wanted(&marking)).collect();
        let others = (0..wanted.len()).filter(|state| !wanted[*state]);
        let others: Vec<_> = others.map(|state| (state, space.successors(state as u32))).collect();
        let is_kept = self
            .spread(&others, &wanted, |firings, is_good| self.leads_on(machines, firings, is_good));
        if is_kept.iter().all(|is_kept| *is_kept) {
            return EndShown::Always;
        }
        let reaches = self.spread(&others, &wanted, |firings, is_good| {
            firings.iter().any(|firing| is_good[firing.1 as usize])
        });
        self.lost = reaches.iter().map(|reaches| !reaches).collect();
        let lost = (0..self.lost.len()).filter(|state| self.lost[*state]).take(MOST_TARGETS);
        let targets: Vec<_> = lost.map(|state| self.target(machines, state as u32)).collect();
        match targets.is_empty() {
            true => EndShown::Open("it depends on what fires first"),
            false => EndShown::NotFrom(targets),
        }
    }

    /// Adds states to the good ones until no more of the others lead on to them.
    fn spread(
        &self,
        others: &[(usize, Vec<(TransitionId, u32)>)],
        wanted: &[bool],
        leads_on: impl Fn(&[(TransitionId, u32)], &[bool]) -> bool,
    ) -> Vec<bool> {
        let mut is_good = wanted.to_vec();
        let mut open: Vec<_> = others.iter().collect();
        let mut count = usize::MAX;
        while open.len() < count {
            count = open.len();
            open.retain(|(state, firings)| {
                is_good[*state] = leads_on(firings, &is_good);
                !is_good[*state]
            });
        }
        is_good
    }

    /// Whether a marking of the mission is one from which the end cannot be reached.
    pub(super) fn is_lost(&self, marking: &[u32]) -> bool {
        let mut joined = vec![0; self.joined.net.places().len()];
        for (place, tokens) in self.joined.places.iter().zip(marking) {
            joined[place.index()] += tokens;
        }
        for place in &self.joined.entered {
            joined[place.index()] = self.joined.net.initial()[place.index()];
        }
        let state = self.states.space.state_of(&joined);
        state.is_some_and(|state| self.lost.get(state as usize) == Some(&true))
    }

    /// Whether a firing leads on that may be the next one at any time, or all do and one must come.
    fn leads_on(
        &self,
        machines: &RouteMachines<'_>,
        firings: &[(TransitionId, u32)],
        is_good: &[bool],
    ) -> bool {
        let source = |id: TransitionId| machines.net.transition(self.joined.sources[id.index()]);
        let at_once = |firing: &&(TransitionId, u32)| source(firing.0).interval.earliest.is_zero();
        let must_fire = |firing: &(TransitionId, u32)| {
            !source(firing.0).gated && source(firing.0).interval.latest.is_some()
        };
        let is_good = |firing: &(TransitionId, u32)| is_good[firing.1 as usize];
        firings.iter().filter(at_once).any(is_good)
            || (firings.iter().all(is_good) && firings.iter().any(must_fire))
    }

    /// The nearest state in which a place of the mission itself is marked.
    pub(super) fn nearest(
        &self,
        machines: &RouteMachines<'_>,
        place: PlaceId,
    ) -> Option<RouteTarget> {
        let space = &self.states.space;
        let place = self.joined.places[place.index()];
        let state = space.find(|marking| marking[place.index()] > 0)?;
        let path = space.path_to(state)?;
        // Where the routes are before the last firing, which the mission itself may do.
        let rules = armor_petri::analysis::rules::FiringRules::new(&self.joined.net);
        let before = rules.play(self.joined.net.initial(), path.split_last()?.1)?;
        let state = space.state_of(&before)?;
        Some(self.target(machines, state))
    }

    fn target(&self, machines: &RouteMachines<'_>, state: u32) -> RouteTarget {
        let marking = self.states.space.marking(state);
        let find = |route: usize| {
            if marking[self.joined.running[route].index()] > 0 {
                return None;
            }
            let mut places = machines.places[route].iter();
            // Where it is, or outside of the route.
            Some(places.find(|it| marking[self.joined.places[it.index()].index()] > 0).copied())
        };
        RouteTarget { places: (0..machines.places.len()).map(find).collect() }
    }
}
