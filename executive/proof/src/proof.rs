//! A mission with its state space, and the questions that every examination asks of it.

use std::cell::{Cell, OnceCell};

use crate::analysed::Analysed;
use crate::marked_pairs::MarkedPairs;
use crate::routes::{RouteMachines, RouteProof};
use crate::witness::Witness;
use armor_petri::analysis::classes::{StateClasses, find_state_classes, is_possible};
use armor_petri::analysis::invariants::{PlaceBounds, Semiflows, place_semiflows};
use armor_petri::analysis::runs::MarkingGraph;
use armor_petri::analysis::{
    AnalysisBudget, Exhausted, ExplorationEnd, StateExploration, explore_states,
};
use armor_petri::{Net, PlaceId};
use armor_plan::Plan;
use armor_robotfile::{Findings, Location, Mission};

/// Most states of a mission that are looked at.
pub const MAX_STATES: u64 = 500_000;
/// Most state classes, which are states with times.
pub const MAX_CLASSES: u64 = 100_000;
/// Most memory that either may take, in bytes.
pub const MAX_BYTES: u64 = 256 << 20;
/// With at most this many untimed states, times are examined even if no check needs them.
const FEW_STATES: u64 = 20_000;
/// How many times a cycle that fills a place is repeated before times count as allowing it.
const ROUNDS: usize = 4;
/// States of the whole mission that are looked at in addition to routes that are proven one by one.
const STATES_WITH_ROUTES: u64 = 2_000;

/// How much is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProofEffort {
    /// States as far as tokens go.
    pub(crate) states: u64,
    /// States with their times.
    pub(crate) classes: u64,
    /// Whether the plan starts where a mission stands that has begun.
    pub(crate) has_begun: bool,
    /// Whether it suffices to know that there are no errors and warnings.
    pub(crate) skips_notes: bool,
    /// Whether all states of the routes are explored together where there are few enough, also for
    /// what can be shown of them one by one.
    pub(crate) explores_routes: bool,
}

impl Default for ProofEffort {
    fn default() -> Self {
        Self {
            states: MAX_STATES,
            classes: MAX_CLASSES,
            has_begun: false,
            skips_notes: false,
            explores_routes: false,
        }
    }
}

/// A mission, its net, and what has been found out about the net.
pub(crate) struct Proof<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) mission: &'a Mission,
    pub(crate) analysed: &'a Analysed,
    pub(crate) net: &'a Net,
    /// Places that are kept apart by letting starts wait.
    pub(crate) apart: &'a [[PlaceId; 2]],
    pub(crate) bounds: PlaceBounds,
    /// The states as far as tokens go.
    pub(crate) exploration: StateExploration,
    timed: OnceCell<(StateClasses, Option<Exhausted>)>,
    untimed_alone: OnceCell<bool>,
    sums: OnceCell<Semiflows<PlaceId>>,
    pairs: OnceCell<MarkedPairs>,
    pub(crate) effort: ProofEffort,
    /// What is shown of the routes, or why they are not proven one by one.
    pub(crate) routes: Result<RouteProof<'a>, Option<String>>,
    /// The routes of a mission that is explored as a whole.
    explored_routes: Option<RouteMachines<'a>>,
    end_by_routes: OnceCell<bool>,
    pub(crate) stop: &'a dyn Fn() -> bool,
    /// How many states and state classes were explored.
    explored: Cell<u64>,
}

/// Whether a marking of some kind can come.
pub(crate) enum Possible {
    No,
    Yes(Witness),
    /// It could not be decided, and why.
    Unknown(String),
}

impl<'a> Proof<'a> {
    pub(crate) fn new(
        plan: &'a Plan,
        mission: &'a Mission,
        analysed: &'a Analysed,
        effort: ProofEffort,
        stop: &'a dyn Fn() -> bool,
    ) -> Self {
        let net = &analysed.net;
        let explored = Cell::new(0);
        let machines = RouteMachines::find(plan, mission, analysed, stop);
        let bounds = match &machines {
            Ok(machines) => machines.bounds(),
            Err(_) => PlaceBounds::of_net(net, stop),
        };
        let sums = OnceCell::new();
        let mut explored_routes = None;
        let routes = machines.and_then(|machines| {
            if machines.product() <= effort.states {
                explored_routes = Some(machines).filter(|_| !effort.explores_routes);
                return Err(None);
            }
            // To search the whole net would take long, and find little more.
            let _ = sums.set(machines.sums().clone());
            if machines.count() < 2 {
                return Err(None);
            }
            let budget = AnalysisBudget {
                states: effort.states,
                memory_bytes: MAX_BYTES,
                stop,
                explored: Some(&explored),
            };
            RouteProof::of(plan, machines, &budget).map_err(Some)
        });
        let states = match &routes {
            Ok(_) => effort.states.min(STATES_WITH_ROUTES),
            Err(_) => effort.states,
        };
        let effort = ProofEffort { states, ..effort };
        let budget = AnalysisBudget {
            states: effort.states,
            memory_bytes: MAX_BYTES,
            stop,
            explored: Some(&explored),
        };
        let exploration = explore_states(net, &bounds, true, &budget);
        let timed = OnceCell::new();
        let untimed_alone = OnceCell::new();
        Self {
            plan,
            mission,
            analysed,
            net,
            apart: &[],
            bounds,
            exploration,
            timed,
            untimed_alone,
            pairs: OnceCell::new(),
            sums,
            effort,
            routes,
            explored_routes,
            end_by_routes: OnceCell::new(),
            stop,
            explored,
        }
    }

    /// Calls `go_on` with the proof of the net in which starts wait for the components that exclude
    /// them, and with this proof, in which no start waits. If no start can be blocked, calls it
    /// with this proof alone.
    pub(crate) fn with_waits(self, go_on: &mut dyn FnMut(&Proof<'_>, Option<&Proof<'_>>)) {
        // That starts wait is not examined where routes are proven one by one, which is reported.
        if self.one_by_one().is_some() {
            return go_on(&self, None);
        }
        let pairs = self.meeting_places();
        let waiting = Analysed::keeping_apart(self.plan, &pairs);
        let Some(analysed) = waiting.ok().filter(|_| !pairs.is_empty()) else {
            return go_on(&self, None);
        };
        let proof = Proof::new(self.plan, self.mission, &analysed, self.effort, self.stop);
        go_on(&Proof { apart: &pairs, ..proof }, Some(&self));
    }

    /// Examines what is examined in every mission.
    pub(crate) fn examine_in_general(&self, findings: &mut Findings) {
        if let Some(over) = self.over_at_start().filter(|_| !self.effort.has_begun) {
            return findings.push(over);
        }
        match &self.exploration.ending {
            ExplorationEnd::Complete => self.complete(findings),
            ExplorationEnd::Unbounded(pumping) => self.without_bounds(pumping, findings),
            ExplorationEnd::Undecided(why) => self.too_large(*why, findings),
        }
    }

    /// Whether tokens alone would let places fill without end, by firings that times do not allow.
    pub(crate) fn grows_untimed_alone(&self) -> bool {
        *self.untimed_alone.get_or_init(|| {
            let ExplorationEnd::Unbounded(pumping) = &self.exploration.ending else { return false };
            let rounds = std::iter::repeat_n(&pumping.cycle, ROUNDS).flatten();
            let path: Vec<_> = pumping.prefix.iter().chain(rounds).copied().collect();
            is_possible(self.net, &path) == Ok(false)
        })
    }

    /// Whether tokens alone would let places fill without end, and times do not.
    pub(crate) fn times_bound_it(&self) -> bool {
        self.grows_untimed_alone() && self.timed().is_ok()
    }

    /// For states as far as tokens go.
    pub(crate) fn untimed_budget(&self) -> AnalysisBudget<'_> {
        self.budget_of(self.effort.states)
    }

    /// For states with their times.
    pub(crate) fn budget(&self) -> AnalysisBudget<'_> {
        // Without checks in the file a person waits for the rest of the findings, not for times.
        let is_asked = !self.mission.checks.is_empty();
        let states =
            if is_asked { self.effort.classes } else { self.effort.classes.min(FEW_STATES) };
        self.budget_of(states)
    }

    fn budget_of(&self, states: u64) -> AnalysisBudget<'_> {
        let explored = Some(&self.explored);
        AnalysisBudget { states, memory_bytes: MAX_BYTES, stop: self.stop, explored }
    }

    /// How many states were explored, with their times and without.
    pub(crate) fn explored_states(&self) -> u64 {
        self.explored.get()
    }

    /// Whether all states were explored, as far as tokens go.
    pub(crate) fn is_whole(&self) -> bool {
        self.exploration.ending == ExplorationEnd::Complete
    }

    /// Returns the states with their times, if all of them were explored.
    pub(crate) fn timed(&self) -> Result<&StateClasses, Exhausted> {
        let (classes, exhausted) = self.timed_so_far();
        exhausted.map_or(Ok(classes), Err)
    }

    /// The states with their times, as many as the budget allows.
    pub(crate) fn timed_so_far(&self) -> (&StateClasses, Option<Exhausted>) {
        let (found, exhausted) =
            self.timed.get_or_init(|| find_state_classes(self.net, &self.budget()));
        (found, *exhausted)
    }

    /// The same where it is cheap.
    pub(crate) fn timed_if_small(&self) -> Option<&StateClasses> {
        let is_small = self.is_whole() && self.exploration.space.states() <= FEW_STATES;
        if is_small || self.times_bound_it() { self.timed().ok() } else { None }
    }

    /// The sums of tokens that no firing changes.
    pub(crate) fn token_sums(&self) -> &Semiflows<PlaceId> {
        self.sums.get_or_init(|| place_semiflows(self.net, self.stop))
    }

    /// The nearest marking as asked in a run, or else, as far as tokens go.
    pub(crate) fn find_witness(&self, asked: &dyn Fn(&[u32]) -> bool) -> Option<Witness> {
        let space = &self.exploration.space;
        if matches!(self.exploration.ending, ExplorationEnd::Unbounded(_)) {
            // It stopped where a place was seen to fill: more is seen with times.
            let (classes, _) = self.timed_so_far();
            return classes.nearest(asked).map(|class| Witness::of(classes, class));
        }
        space.find(asked).and_then(|state| self.with_times(state, asked))
    }

    /// The nearest marking as asked in a run, if the mission is small; otherwise that of the state.
    fn with_times(&self, state: u32, asked: &dyn Fn(&[u32]) -> bool) -> Option<Witness> {
        let nearest = Witness::of(&self.exploration.space, state);
        if is_possible(self.net, &nearest.path) == Ok(true) {
            // None is nearer with times, which only exclude firings.
            return Some(nearest);
        }
        match self.timed_if_small() {
            Some(classes) => classes.nearest(asked).map(|class| Witness::of(classes, class)),
            None => Some(nearest),
        }
    }

    /// What is shown of the routes, unless all states of the mission were explored.
    pub(crate) fn one_by_one(&self) -> Option<&RouteProof<'a>> {
        self.routes.as_ref().ok().filter(|_| !self.is_whole())
    }

    /// Whether goal or safe place stays in reach, as far as the routes one by one show it: no states of the
    /// whole mission with their times are needed for that.
    pub(crate) fn keeps_end(&self) -> bool {
        if let Some(routes) = self.one_by_one() {
            return routes.keeps_end();
        }
        // That starts wait is not followed there.
        let Some(routes) = self.explored_routes.as_ref().filter(|_| self.apart.is_empty()) else {
            return false;
        };
        let has_goal = self.plan.goal().is_some();
        // Where it does not go quickly, the whole mission shows it.
        let budget = self.budget_of(self.effort.states.min(FEW_STATES));
        *self.end_by_routes.get_or_init(|| has_goal && routes.keep_end_in_reach(&budget))
    }

    /// The nearest marking with a token in both places.
    pub(crate) fn find_together(&self, one: PlaceId, other: PlaceId) -> Option<Witness> {
        if let Some(routes) = self.one_by_one() {
            // What is neither known to be apart nor among these is reported as open.
            let met = routes.met.iter().find(|it| it.places == [one, other]);
            return met.map(|met| met.seen.clone());
        }
        let asked = |marking: &[u32]| marking[one.index()] > 0 && marking[other.index()] > 0;
        if matches!(self.exploration.ending, ExplorationEnd::Unbounded(_)) {
            return self.find_witness(&asked);
        }
        self.nearest_together(one, other).and_then(|state| self.with_times(state, &asked))
    }

    /// The nearest state with a token in both places.
    pub(crate) fn nearest_together(&self, one: PlaceId, other: PlaceId) -> Option<u32> {
        let space = &self.exploration.space;
        let pairs = self.pairs.get_or_init(|| MarkedPairs::of(space, self.net.places().len()));
        pairs.nearest(one, other)
    }

    /// Whether a marking as asked comes in some run; `excluded` returns whether sums exclude it.
    pub(crate) fn find_possible(
        &self,
        asked: &dyn Fn(&[u32]) -> bool,
        excluded: impl Fn() -> bool,
    ) -> Possible {
        let space = &self.exploration.space;
        let found = space.find(asked);
        if found.is_none() && (self.is_whole() || excluded()) {
            return Possible::No;
        }
        let seen = found.map(|state| Witness::of(space, state));
        if let Some(seen) = seen
            && is_possible(self.net, &seen.path) == Ok(true)
        {
            return Possible::Yes(seen);
        }
        let (classes, exhausted) = self.timed_so_far();
        match (classes.nearest(asked), exhausted) {
            (Some(class), _) => Possible::Yes(Witness::of(classes, class)),
            (None, None) => Possible::No,
            (None, Some(why)) => Possible::Unknown(self.budget_ran_out(why)),
        }
    }

    /// Where a place is written.
    pub(crate) fn at(&self, place: PlaceId) -> &Location {
        let name = self.net.place(place);
        let written = self.mission.places.iter().find(|written| written.name.value == name);
        written.map_or(&self.mission.at, |place| &place.name.at)
    }

    /// Where a transition is written.
    pub(crate) fn at_transition(&self, name: &str) -> &Location {
        let written = self.mission.transitions.iter().find(|t| t.name.value == name);
        written.map_or(&self.mission.at, |t| &t.name.at)
    }

    /// Whether the mission is over: well, or in its safe place.
    pub(crate) fn is_over(&self, marking: &[u32]) -> bool {
        let ends = [self.plan.goal(), self.plan.safe()];
        ends.into_iter().flatten().any(|place| marking[place.index()] > 0)
    }
}
