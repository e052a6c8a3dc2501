//! The net of a mission as it is analysed.

use armor_petri::{Interval, Net, NetBuilder, NetError, PlaceId, TransitionId};
use std::time::Duration;

use crate::plan::Plan;

/// What comes behind the name of a transition whose components do not stop.
const ON_STOP_FAIL: &str = "/on-stop-fail";
/// What comes behind the name of a transition whose components do not start.
const ON_START_FAIL: &str = "/on-start-fail";
/// What comes behind the name of a place whose component fails.
const ON_FAILURE: &str = "/on-failure";

/// A mission's net as it is analysed: it ends where the goal or the safe place is marked, and what
/// the file says of components that do not stop, start or last happens at any time.
#[derive(Clone, Debug)]
pub struct Analysed {
    /// The net. Names that the mission does not have are `transition/on-stop-fail`,
    /// `transition/on-start-fail` and `place/on-failure`.
    pub net: Net,
    /// Which transition of the plan each of its transitions is, if it is one.
    pub(super) sources: Vec<Option<TransitionId>>,
}

impl Analysed {
    /// Of a plan.
    ///
    /// # Errors
    /// If weights add up to more than can be counted.
    pub fn of(plan: &Plan) -> Result<Self, NetError> {
        Self::ending_at(plan, [plan.goal, plan.safe].into_iter().flatten().collect())
    }

    /// The same without an end: a net that goes on for all that its arcs say.
    pub(super) fn endless(plan: &Plan) -> Result<Self, NetError> {
        Self::ending_at(plan, Vec::new())
    }

    fn ending_at(plan: &Plan, ends: Vec<PlaceId>) -> Result<Self, NetError> {
        let mut building = Building { builder: NetBuilder::default(), ends, sources: Vec::new() };
        for (name, tokens) in plan.net().places().iter().zip(plan.net().initial()) {
            building.builder.place(name.as_str(), *tokens);
        }
        plan.net().transition_ids().for_each(|id| building.transition(plan, id));
        for place in plan.place_ids() {
            if let Some(refuge) = plan.place(place).on_failure {
                building.failure(plan, place, refuge);
            }
        }
        Ok(Self { net: building.builder.build()?, sources: building.sources })
    }
}

struct Building {
    builder: NetBuilder,
    ends: Vec<PlaceId>,
    sources: Vec<Option<TransitionId>>,
}

impl Building {
    fn transition(&mut self, plan: &Plan, id: TransitionId) {
        let transition = plan.net().transition(id);
        let planned = plan.transition(id);
        let redirected = |to: Option<PlaceId>, why| to.map(|to| (vec![(to, 1)], why));
        let ways = [
            Some((transition.outputs.clone(), "")),
            redirected(planned.on_stop_fail, ON_STOP_FAIL),
            redirected(planned.on_start_fail, ON_START_FAIL),
        ];
        for (outputs, why) in ways.into_iter().flatten() {
            let mut t = self.builder.transition(format!("{}{why}", transition.name));
            for &(place, weight) in &transition.inputs {
                t = t.input(place, weight);
            }
            for &(place, weight) in &outputs {
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
            for end in &self.ends {
                t = t.inhibitor(*end, 1);
            }
            t = t.interval(by_period(transition.interval, plan.period));
            if transition.gated {
                t.gated();
            }
            self.sources.push(Some(id).filter(|_| why.is_empty()));
        }
    }

    fn failure(&mut self, plan: &Plan, place: PlaceId, refuge: PlaceId) {
        let name = format!("{}{ON_FAILURE}", plan.net().place(place));
        let mut t = self.builder.transition(name).input(place, 1).output(refuge, 1);
        for end in &self.ends {
            t = t.inhibitor(*end, 1);
        }
        t.interval(Interval::UNTIMED);
        self.sources.push(None);
    }
}

/// A mission with a period looks at its net so often: it fires at the next look.
fn by_period(interval: Interval, period: Option<Duration>) -> Interval {
    let later = |latest: Duration| latest.saturating_add(period.unwrap_or_default());
    Interval { latest: interval.latest.map(later), ..interval }
}
