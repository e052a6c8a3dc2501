//! The net of a mission as it is analysed.

use armor_petri::{
    FiringClass, FiringInterval, Net, NetBuilder, NetError, NetTransition, PlaceId, TransitionId,
};
use armor_robotfile::mission::LostLink;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use crate::asking;
use crate::starts::DelayedStart;
use crate::unfolding::{Copy, Pair, TooMany, Unfolding};
use armor_plan::{Plan, PlannedTransition};

/// What comes behind the name of a transition whose components do not stop.
const ON_STOP_FAIL: &str = "/on-stop-fail";
/// What comes behind the name of a transition whose components do not start.
const ON_START_FAIL: &str = "/on-start-fail";
/// What comes behind the name of a place whose component fails.
const ON_FAILURE: &str = "/on-failure";
/// What comes behind the name of a transition that the mission's own default declines.
const DECLINED: &str = "/declined";
/// What comes behind the name of a declined transition whose gate may close and open once more.
const NEWLY_ENABLED: &str = "/newly-enabled";
/// What comes behind the name of a transition that would set a variable to what it cannot be.
const OUTSIDE: &str = "/outside";
/// A place that is never marked.
const NEVER: &str = "/never";

/// A mission's net as it is analysed. It ends where the goal or the safe place is marked. A
/// component may fail to stop, start or last at any time, where the file has a place for that; an
/// operator who is asked may not answer; the variables that transitions set are places.
#[derive(Clone, Debug)]
pub struct Analysed {
    /// The net. Its places are those of the mission, then two for each variable. Several of its
    /// transitions may be one of the mission, with other values of variables.
    pub net: Net,
    /// What each of its transitions is called in the mission; names that the mission does not have
    /// are `transition/on-stop-fail`, `transition/on-start-fail`, `transition/declined`,
    /// `transition/newly-enabled`, `transition/outside` and `place/on-failure`. The second half of
    /// a firing, where it is one of its own, has none.
    pub shown: Vec<String>,
    /// Which transition of the plan each of its transitions is, if it is one.
    pub(super) sources: Vec<Option<TransitionId>>,
    /// Those that would take a variable out of its domain, each with its transition of the plan.
    pub(super) outside: Vec<(TransitionId, TransitionId)>,
    /// The places of each variable; none if they are not followed.
    pub(super) pairs: Vec<Pair>,
    /// Why variables are not followed, if they are not.
    pub(super) open: Option<TooMany>,
    /// Transitions whose clocks keep running in a mission when another copy takes over, and restart
    /// here.
    pub(super) loosened: Vec<String>,
    /// Emergency exits: they lead from any marking to the safe place, but only if something is
    /// reported or ordered.
    pub(super) emergencies: BTreeSet<TransitionId>,
    /// Starts that may have to wait.
    pub(super) starts: Vec<DelayedStart>,
    /// How many of its places are the mission's.
    places: usize,
    names: Vec<String>,
}

impl Analysed {
    /// Of a plan.
    ///
    /// # Errors
    /// If weights add up to more than can be counted.
    pub fn of(plan: &Plan) -> Result<Self, NetError> {
        Self::keeping_apart(plan, &[])
    }

    /// The same with firings in two halves where the second may have to wait: it does not mark one
    /// place of a pair while the other is marked.
    pub(super) fn keeping_apart(plan: &Plan, pairs: &[[PlaceId; 2]]) -> Result<Self, NetError> {
        let ends = [plan.goal(), plan.safe()].into_iter().flatten().collect();
        Self::ending_at(plan, ends, pairs)
    }

    /// The same without an end and without emergencies: a net that only its arcs can stop.
    pub(super) fn endless(plan: &Plan, pairs: &[[PlaceId; 2]]) -> Result<Self, NetError> {
        Self::ending_at(plan, Vec::new(), pairs)
    }

    /// The tokens of the mission's places in a marking.
    pub fn tokens<'a>(&self, marking: &'a [u32]) -> &'a [u32] {
        &marking[..self.places]
    }

    /// The values of the variables that transitions set in a marking, by name; none of them if
    /// they are not followed.
    pub fn values(&self, marking: &[u32]) -> impl Iterator<Item = (&str, i64)> {
        let values: Vec<_> = self.pairs.iter().map(|pair| pair.value(marking)).collect();
        self.names.iter().map(String::as_str).zip(values)
    }

    /// What the tokens of a place, or the value of a variable, are counted by: a place of the net,
    /// and what is to be added to its tokens.
    pub(super) fn count_named(&self, plan: &Plan, name: &str) -> Option<(PlaceId, i64)> {
        if let Some(place) = plan.place_named(name) {
            return Some((place, 0));
        }
        let index = plan.counters().iter().position(|counter| counter.name == name)?;
        self.pairs.get(index).map(|pair| (pair.above, pair.minimum))
    }

    fn ending_at(
        plan: &Plan,
        ends: Vec<PlaceId>,
        apart: &[[PlaceId; 2]],
    ) -> Result<Self, NetError> {
        let mut builder = NetBuilder::default();
        for (name, tokens) in plan.net().places().iter().zip(plan.net().initial()) {
            builder.place(name.as_str(), *tokens);
        }
        let (unfolding, open) = match Unfolding::of(plan) {
            Ok(unfolding) => (unfolding, None),
            Err(why) => (Unfolding::open(plan), Some(why)),
        };
        let followed = plan.counters().iter().filter(|_| open.is_none());
        let pairs = followed.map(|counter| Pair::build(counter, &mut builder)).collect();
        let declined = asking::declined_places(plan, &mut builder);
        let never = ends.is_empty().then(|| builder.place(NEVER, 0));
        let mut building = Building {
            plan,
            builder,
            ends,
            apart,
            declined,
            never,
            starts: Vec::new(),
            pairs,
            shown: Vec::new(),
            sources: Vec::new(),
            outside: Vec::new(),
            loosened: Vec::new(),
            emergencies: BTreeSet::new(),
        };
        for id in plan.net().transition_ids() {
            building.transition(id, &unfolding.copies[id.index()]);
        }
        for place in plan.place_ids() {
            if let Some(refuge) = plan.place(place).on_failure {
                building.failure(place, refuge);
            }
        }
        let Building { shown, sources, outside, emergencies, .. } = building;
        let Building { builder, pairs, loosened, starts, .. } = building;
        let names = plan.counters().iter().map(|counter| counter.name.clone()).collect();
        let (net, places) = (builder.build()?, plan.places().len());
        Ok(Self {
            net,
            shown,
            sources,
            outside,
            pairs,
            open,
            loosened,
            emergencies,
            starts,
            places,
            names,
        })
    }
}

struct Building<'a> {
    plan: &'a Plan,
    builder: NetBuilder,
    ends: Vec<PlaceId>,
    /// Places that are never marked together.
    apart: &'a [[PlaceId; 2]],
    /// For each transition that silence declines: the place that is marked then.
    declined: BTreeMap<TransitionId, PlaceId>,
    /// In a net without an end: a place that is never marked.
    never: Option<PlaceId>,
    starts: Vec<DelayedStart>,
    pairs: Vec<Pair>,
    shown: Vec<String>,
    sources: Vec<Option<TransitionId>>,
    outside: Vec<(TransitionId, TransitionId)>,
    loosened: Vec<String>,
    emergencies: BTreeSet<TransitionId>,
}

impl Building<'_> {
    fn transition(&mut self, id: TransitionId, copies: &[Copy]) {
        let (plan, transition) = (self.plan, self.plan.net().transition(id));
        let planned = plan.transition(id);
        let mut interval = by_period(transition.interval, plan.period());
        if copies.len() > 1 && has_clock(interval) && self.may_be_overtaken(id) {
            self.loosened.push(transition.name.clone());
            interval.earliest = Duration::ZERO;
        }
        if let Some(latest) = asking::fires_by(plan, id) {
            interval =
                by_period(FiringInterval { latest: Some(latest), ..interval }, plan.period());
        }
        let redirected = |to: Option<PlaceId>, why| to.map(|to| (vec![(to, 1)], why));
        for copy in copies {
            let ways = match copy.effects {
                Some(_) => vec![
                    Some((transition.outputs.clone(), "")),
                    redirected(planned.on_stop_fail, ON_STOP_FAIL),
                    redirected(planned.on_start_fail, ON_START_FAIL),
                ],
                // The executive retreats instead.
                None => {
                    let safe = plan.safe().map(|safe| (safe, 1)).into_iter().collect();
                    vec![Some((safe, OUTSIDE))]
                }
            };
            let label = if copies.len() > 1 { copy.label(plan) } else { String::new() };
            for (outputs, why) in ways.into_iter().flatten() {
                let added = TransitionId(self.sources.len() as u32);
                let name = format!("{}{label}{why}", transition.name);
                let start = self.start_of(&name, &outputs);
                let put = start.as_ref().map_or(outputs, |start| vec![(start.place, 1)]);
                self.copy(id, copy, (&put, interval), name.clone());
                self.shown.push(format!("{}{why}", transition.name));
                self.sources.push(Some(id).filter(|_| why.is_empty()));
                if need_not_fire(planned, copy, interval) && is_emergency(plan, transition) {
                    self.emergencies.insert(added);
                }
                if copy.effects.is_none() {
                    self.outside.push((added, id));
                }
                self.second_half(&name, start);
            }
            self.silence(id, copy, interval.earliest, &label);
        }
    }

    fn copy(
        &mut self,
        id: TransitionId,
        copy: &Copy,
        (outputs, interval): (&[(PlaceId, u32)], FiringInterval),
        name: String,
    ) {
        let (transition, planned) = (self.plan.net().transition(id), self.plan.transition(id));
        let mut t = self.builder.transition(name);
        for &(place, weight) in &transition.inputs {
            t = t.input(place, weight);
        }
        for &(place, weight) in outputs {
            t = t.output(place, weight);
        }
        for &(place, weight) in &transition.reads {
            t = t.read(place, weight);
        }
        for &(place, weight) in &transition.inhibitors {
            t = t.inhibitor(place, weight);
        }
        for &place in &transition.resets {
            t = t.reset(place);
        }
        if is_emergency(self.plan, transition) && need_not_fire(planned, copy, interval) {
            t = self.never.into_iter().fold(t, |t, never| t.input(never, 1));
        }
        t = copy.arcs(t, &self.pairs);
        t = self.declined.get(&id).into_iter().fold(t, |t, place| t.inhibitor(*place, 1));
        let enabled_again =
            self.declined.iter().filter(|it| asking::disturbs(self.plan, id, *it.0));
        t = enabled_again.fold(t, |t, (_, place)| t.reset(*place));
        for end in &self.ends {
            t = t.inhibitor(*end, 1);
        }
        t = t.interval(interval);
        if is_gated(planned, copy) {
            t.gated();
        }
    }

    /// The second half of a firing, if it may have to wait.
    fn start_of(&mut self, name: &str, to: &[(PlaceId, u32)]) -> Option<DelayedStart> {
        let puts = |place: PlaceId| to.iter().any(|arc| arc.0 == place);
        let mut unless = BTreeSet::new();
        for &[one, other] in self.apart {
            unless.extend(Some(other).filter(|_| puts(one)));
            unless.extend(Some(one).filter(|_| puts(other)));
        }
        if unless.is_empty() {
            return None;
        }
        let place = self.builder.place(format!("{name}/started"), 0);
        let (unless, ends) = (unless.into_iter().collect(), self.ends.clone());
        Some(DelayedStart { place, unless, ends, to: to.to_vec() })
    }

    fn second_half(&mut self, name: &str, start: Option<DelayedStart>) {
        let Some(start) = start else { return };
        // It would mark both places: that half never comes.
        if !start.is_impossible() {
            let mut t = self.builder.transition(format!("{name}/started"));
            t = start.to.iter().fold(t.input(start.place, 1), |t, arc| t.output(arc.0, arc.1));
            t = start.unless.iter().chain(&self.ends).fold(t, |t, place| t.inhibitor(*place, 1));
            t.interval(FiringInterval::exactly(Duration::ZERO));
            self.shown.push(String::new());
            self.sources.push(None);
        }
        self.starts.push(start);
    }

    /// Adds the silence of the operator: no answer in time declines it, until it is newly enabled.
    fn silence(&mut self, id: TransitionId, copy: &Copy, earliest: Duration, label: &str) {
        let (plan, transition) = (self.plan, self.plan.net().transition(id));
        let (Some(declined), Some(within)) =
            (self.declined.get(&id).copied(), asking::declines_after(plan, id))
        else {
            return;
        };
        let planned = plan.transition(id);
        let is_gated = is_gated(planned, copy);
        let name = format!("{}{label}{DECLINED}", transition.name);
        let mut t = self.builder.transition(name).output(declined, 1).inhibitor(declined, 1);
        for (place, weight) in asking::needs(transition) {
            t = t.read(place, weight);
        }
        for &(place, weight) in &transition.inhibitors {
            t = t.inhibitor(place, weight);
        }
        t = Copy { effects: Some(Vec::new()), ..copy.clone() }.arcs(t, &self.pairs);
        t = self.ends.iter().fold(t, |t, end| t.inhibitor(*end, 1));
        let at = FiringInterval::exactly(earliest.saturating_add(within));
        t = t.interval(by_period(at, plan.period()));
        if is_gated || planned.lost_link == Some(LostLink::Wait) {
            t.gated();
        }
        self.shown.push(format!("{}{DECLINED}", transition.name));
        self.sources.push(None);
        if is_gated {
            let name = format!("{}{label}{NEWLY_ENABLED}", transition.name);
            let mut t = self.builder.transition(name).input(declined, 1);
            t = self.ends.iter().fold(t, |t, end| t.inhibitor(*end, 1));
            t.interval(FiringInterval::UNTIMED).gated();
            self.shown.push(format!("{}{NEWLY_ENABLED}", transition.name));
            self.sources.push(None);
        }
    }

    /// Whether another transition may set a variable that distinguishes the copies of this one.
    fn may_be_overtaken(&self, id: TransitionId) -> bool {
        let planned = self.plan.transition(id);
        let in_guard = planned.guard.iter().flat_map(|guard| &guard.operands);
        let in_guard = in_guard.filter_map(|operand| operand.counter());
        let in_values = planned.sets.iter().flat_map(|set| set.operands.iter().copied());
        let read: Vec<_> = in_guard.chain(in_values).collect();
        let others = self.plan.net().transition_ids().filter(|other| *other != id);
        let mut sets = others.flat_map(|other| &self.plan.transition(other).sets);
        sets.any(|set| read.contains(&set.counter))
    }

    fn failure(&mut self, place: PlaceId, refuge: PlaceId) {
        let name = format!("{}{ON_FAILURE}", self.plan.net().place(place));
        let start = self.start_of(&name, &[(refuge, 1)]);
        let put = start.as_ref().map_or(refuge, |start| start.place);
        let mut t = self.builder.transition(name.as_str()).input(place, 1).output(put, 1);
        let declined = self.declined.iter();
        let enabled_again = declined.filter(|it| asking::needs_token(self.plan, *it.0, place));
        t = enabled_again.fold(t, |t, (_, place)| t.reset(*place));
        for end in &self.ends {
            t = t.inhibitor(*end, 1);
        }
        t.interval(FiringInterval::UNTIMED);
        self.shown.push(name.clone());
        self.sources.push(None);
        self.second_half(&name, start);
    }
}

/// Whether more than tokens, variables and time decide that a copy is enabled.
fn is_gated(planned: &PlannedTransition, copy: &Copy) -> bool {
    let waits = planned.on.is_some() || planned.dates.is_some();
    waits || (planned.guard.is_some() && !copy.is_decided)
}

/// Whether nothing but a report, an order or the like makes it fire.
fn need_not_fire(planned: &PlannedTransition, copy: &Copy, interval: FiringInterval) -> bool {
    interval.latest.is_none() || is_gated(planned, copy)
}

/// Whether it leads to the safe place, whatever is marked.
fn is_emergency(plan: &Plan, transition: &NetTransition) -> bool {
    let is_safe = |arc: &(PlaceId, u32)| Some(arc.0) == plan.safe();
    let needs_nothing = transition.inputs.is_empty()
        && transition.reads.is_empty()
        && transition.inhibitors.is_empty();
    needs_nothing
        && transition.class == FiringClass::Safety
        && !transition.outputs.is_empty()
        && transition.outputs.iter().all(is_safe)
}

/// Whether it matters since when it is enabled.
fn has_clock(interval: FiringInterval) -> bool {
    !interval.earliest.is_zero() || interval.latest.is_some_and(|latest| !latest.is_zero())
}

/// A mission with a period fires at the next look at its net.
fn by_period(interval: FiringInterval, period: Option<Duration>) -> FiringInterval {
    let later = |latest: Duration| latest.saturating_add(period.unwrap_or_default());
    FiringInterval { latest: interval.latest.map(later), ..interval }
}
