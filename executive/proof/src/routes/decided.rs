//! What is shown of routes one by one, before the mission as a whole is explored.

use armor_petri::PlaceId;
use armor_petri::analysis::AnalysisBudget;
use armor_petri::analysis::classes::is_possible;
use armor_petri::analysis::invariants::excluding_sum;
use armor_plan::Plan;

use super::joined::{EndShown, JoinedStates};
use super::machines::RouteMachines;
use super::trace::RouteTarget;
use crate::exclusive::list_exclusive_places;
use crate::witness::Witness;

/// A mission whose routes are proven one by one.
#[derive(Debug)]
pub(crate) struct RouteProof<'a> {
    pub(crate) machines: RouteMachines<'a>,
    /// Whether the end stays in reach, or else firings after which it is not.
    pub(crate) lost: Option<Witness>,
    /// Places that must not be marked together, and are.
    pub(crate) met: Vec<Met>,
    /// How many states were explored for it.
    pub(crate) states: u64,
}

/// Two places that must not be marked together, and firings after which they are.
#[derive(Debug)]
pub(crate) struct Met {
    pub(crate) places: [PlaceId; 2],
    pub(crate) seen: Witness,
}

/// Most pairs of places that are marked together, and most that are looked for.
const MOST_MET: usize = 4;

impl<'a> RouteProof<'a> {
    /// Shows what can be shown of the routes.
    ///
    /// # Errors
    /// What stays open, so that the mission has to be explored as a whole.
    pub(crate) fn of(
        plan: &Plan,
        machines: RouteMachines<'a>,
        budget: &AnalysisBudget<'_>,
    ) -> Result<Self, String> {
        let mut proof = Self { machines, lost: None, met: Vec::new(), states: 0 };
        proof.show_apart(plan, budget)?;
        let Some(goal) = plan.goal() else { return Ok(proof) };
        let joined = proof.machines.explore_joined(budget);
        let mut joined = joined.ok_or("what they share has too many states")?;
        proof.states = joined.count();
        proof.show_end(&mut joined, budget)?;
        if proof.lost.is_none() {
            proof.show_goal(&joined, goal, budget)?;
        }
        Ok(proof)
    }

    /// Whether goal or safe place stays in reach.
    pub(crate) fn keeps_end(&self) -> bool {
        self.states > 0 && self.lost.is_none() && self.met.is_empty()
    }

    fn show_end(
        &mut self,
        joined: &mut JoinedStates,
        budget: &AnalysisBudget<'_>,
    ) -> Result<(), String> {
        let targets = match joined.keep_end(&self.machines) {
            EndShown::Always => return Ok(()),
            EndShown::Open(why) => {
                return Err(format!("whether the goal stays in reach is open: {why}"));
            }
            EndShown::NotFrom(targets) => targets,
        };
        for target in &targets {
            let asked = |marking: &[u32]| joined.is_lost(marking);
            if let Some(seen) = self.play(target, &asked, budget) {
                self.lost = Some(seen);
                return Ok(());
            }
        }
        Err("the goal may become unreachable, but no firings were found that lead there".into())
    }

    /// What is taken as arbitrary may do more than it does, so that the goal is reached is shown by
    /// firings.
    fn show_goal(
        &self,
        joined: &JoinedStates,
        goal: PlaceId,
        budget: &AnalysisBudget<'_>,
    ) -> Result<(), String> {
        let at_goal = |marking: &[u32]| marking[goal.index()] > 0;
        let target = joined.nearest(&self.machines, goal);
        let seen = target.and_then(|target| self.play(&target, &at_goal, budget));
        seen.map(|_| ()).ok_or_else(|| "no firings were found that lead to the goal".into())
    }

    /// Exclusive components, and those that are given two values, in places of different routes.
    fn show_apart(&mut self, plan: &Plan, budget: &AnalysisBudget<'_>) -> Result<(), String> {
        let exclusive = list_exclusive_places(plan).into_iter().map(|pair| pair.1);
        let contradictions = plan.contradictions().into_iter().map(|it| it.places);
        let sums = self.machines.sums();
        let net = self.machines.net;
        let is_open = |[one, other]: &[PlaceId; 2]| {
            !self.machines.are_apart(*one, *other)
                && excluding_sum(sums, net, *one, *other).is_none()
        };
        let open: Vec<_> = exclusive.chain(contradictions).filter(is_open).collect();
        for &[one, other] in open.iter().take(MOST_MET) {
            let mut target = RouteTarget { places: vec![None; self.machines.places.len()] };
            for place in [one, other] {
                if let Some(route) = self.machines.routes[place.index()] {
                    target.places[route] = Some(Some(place));
                }
            }
            let asked = |it: &[u32]| it[one.index()] > 0 && it[other.index()] > 0;
            let Some(seen) = self.play(&target, &asked, budget) else {
                let names = [one, other].map(|place| net.place(place)).join(" and ");
                return Err(format!("{names} may be marked together"));
            };
            self.met.push(Met { places: [one, other], seen });
        }
        Ok(())
    }

    /// Firings that times allow.
    fn play(
        &self,
        target: &RouteTarget,
        asked: &dyn Fn(&[u32]) -> bool,
        budget: &AnalysisBudget<'_>,
    ) -> Option<Witness> {
        let seen = self.machines.find_trace(target, asked, budget.stop)?;
        (is_possible(self.machines.net, &seen.path) == Ok(true)).then_some(seen)
    }
}
