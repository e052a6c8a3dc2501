//! Whether each statement of a check holds.

use std::time::Duration;

use armor_petri::analysis::durations::{Latest, longest_time, shortest_time};
use armor_petri::analysis::rules::FiringRules;
use armor_petri::analysis::runs::{Escape, MarkingGraph, find_escape, nearest_lost};
use armor_petri::analysis::{Exhausted, ExplorationEnd};
use armor_petri::{PlaceId, TransitionId};
use armor_robotfile::claim::{Formula, Relation, Statement};
use armor_robotfile::{FiringTrace, Location};

use crate::formula::PlaceFormula;
use crate::proof::{Possible, Proof};
use crate::sums::{are_apart, exclude};
use crate::witness::Witness;
use armor_robotfile::time_in_words as time;

/// What comes of a check.
#[derive(Debug)]
pub(super) enum ClaimVerdict {
    Holds,
    Fails(ClaimFailure),
    /// Why it could not be found out.
    Undecided(String),
}

/// Why a check does not hold.
#[derive(Debug)]
pub(super) struct ClaimFailure {
    pub(super) reason: String,
    /// What to do.
    pub(super) remedy: String,
    /// The firings that show it.
    pub(super) trace: Option<FiringTrace>,
    /// The transition after which it is so, with what it does.
    pub(super) blamed: Option<(Location, String)>,
}

/// Most transitions that are named as waited for.
const MAX_WAITS: usize = 4;

fn failed(
    reason: impl Into<String>,
    remedy: impl Into<String>,
    trace: Option<FiringTrace>,
) -> ClaimVerdict {
    let (reason, remedy) = (reason.into(), remedy.into());
    ClaimVerdict::Fails(ClaimFailure { reason, remedy, trace, blamed: None })
}

const CHANGE_EITHER: &str = "change the mission, or what the check asks of it";

impl Proof<'_> {
    /// None if it names what is not there.
    pub(super) fn decide_statement(&self, statement: &Statement) -> Option<ClaimVerdict> {
        let formula = |formula| PlaceFormula::of(formula, self.plan, self.analysed);
        let transition = |name: &str| self.plan.transition_named(name);
        Some(match statement {
            Statement::Always(wanted) => self.decide_never(&formula(wanted)?.negated()),
            Statement::Never(unwanted) => self.decide_never(&formula(unwanted)?),
            Statement::Reachable(wanted) => self.decide_reachable(&formula(wanted)?),
            Statement::AlwaysReachable(wanted) => self.always_reachable(&formula(wanted)?),
            Statement::Eventually(wanted) => self.decide_eventually(&formula(wanted)?),
            Statement::LeadsTo(from, to) => {
                let verdict = self.leads_to(&formula(from)?, &formula(to)?);
                self.turn_from_end(from, to, verdict)
            }
            Statement::Duration { until, relation, limit } => {
                self.decide_duration(&formula(until)?, *relation, *limit)
            }
            Statement::Fires(name) => self.decide_fires(transition(name.as_str())?),
            Statement::Dead(name) => self.decide_dead(transition(name.as_str())?),
            Statement::Bounded(place, most) => {
                self.decide_bounded(self.plan.place_named(place.as_str())?, *most)
            }
        })
    }

    fn fails(
        &self,
        reason: String,
        path: &[TransitionId],
        circle: &[TransitionId],
    ) -> ClaimVerdict {
        failed(reason, CHANGE_EITHER, Some(self.trace_of(path, circle)))
    }

    fn undecided(&self, why: Exhausted) -> ClaimVerdict {
        ClaimVerdict::Undecided(self.budget_ran_out(why))
    }

    /// Whether it holds of a marking, once all tokens are put that can be.
    pub(super) fn holds(&self, formula: &PlaceFormula, marking: &[u32]) -> bool {
        formula.holds(&self.analysed.settle_marking(marking))
    }

    fn decide_possibly(&self, formula: &PlaceFormula) -> Possible {
        self.find_possible(&|marking| self.holds(formula, marking), || {
            exclude(self.token_sums(), self.net, formula)
                || self.one_by_one().is_some_and(|it| {
                    are_apart(formula, &|one, other| it.machines.are_apart(one, other))
                })
        })
    }

    fn decide_never(&self, unwanted: &PlaceFormula) -> ClaimVerdict {
        match self.decide_possibly(unwanted) {
            Possible::No => ClaimVerdict::Holds,
            Possible::Yes(seen) => {
                self.blame(&seen.path).explain(self.fails(self.comes_to(&seen), &seen.path, &[]))
            }
            Possible::Unknown(why) => ClaimVerdict::Undecided(why),
        }
    }

    fn decide_reachable(&self, wanted: &PlaceFormula) -> ClaimVerdict {
        match self.decide_possibly(wanted) {
            Possible::Yes(_) => ClaimVerdict::Holds,
            Possible::No => {
                let reason = "no sequence of firings leads there, whatever is reported and when";
                failed(reason, "add transitions that lead there, or remove the check", None)
            }
            Possible::Unknown(why) => ClaimVerdict::Undecided(why),
        }
    }

    fn always_reachable(&self, wanted: &PlaceFormula) -> ClaimVerdict {
        if self.includes_end(wanted) && self.keeps_end() {
            return ClaimVerdict::Holds;
        }
        let asked = |marking: &[u32]| self.holds(wanted, marking);
        let found = self.timed().and_then(|classes| {
            let node = nearest_lost(classes, &asked, &self.budget())?;
            Ok(node.map(|node| Witness::of(classes, node)))
        });
        match found {
            Ok(None) => ClaimVerdict::Holds,
            Ok(Some(seen)) => {
                let reason = format!(
                    "{}, and no sequence of firings leads from there to it",
                    self.comes_to(&seen)
                );
                failed(reason, self.or_the_end(&seen.marking), Some(self.trace_of(&seen.path, &[])))
            }
            Err(why) => self.undecided(why),
        }
    }

    /// Whether a formula holds wherever the mission is over.
    fn includes_end(&self, formula: &PlaceFormula) -> bool {
        let mut ends = [self.plan.goal(), self.plan.safe()].into_iter().flatten();
        let names = |end: PlaceId| match formula {
            PlaceFormula::Any(parts) => parts.contains(&PlaceFormula::at_least(end, 1)),
            other => *other == PlaceFormula::at_least(end, 1),
        };
        ends.all(names)
    }

    /// Of a check that is not met because the mission ended: that the end may count too.
    fn or_the_end(&self, marking: &[u32]) -> String {
        let is_marked = |place: &PlaceId| marking[place.index()] > 0;
        match [self.plan.safe(), self.plan.goal()].into_iter().flatten().find(is_marked) {
            Some(end) => {
                let end = self.net.place(end);
                format!("the mission is over in {end}; if that counts too, write … or {end}")
            }
            None => CHANGE_EITHER.into(),
        }
    }

    fn decide_eventually(&self, wanted: &PlaceFormula) -> ClaimVerdict {
        self.every_run_comes(wanted, |_| vec![0])
    }

    fn leads_to(&self, from: &PlaceFormula, to: &PlaceFormula) -> ClaimVerdict {
        self.every_run_comes(to, |graph| {
            let starts = |node: &u32| self.holds(from, &graph.tokens(*node));
            (0..graph.nodes()).filter(starts).collect()
        })
    }

    /// Decides whether every run through one of `starts` reaches a wanted marking: no cycle and no
    /// dead end avoids it. Every run of the mission is a run of the untimed net, so it suffices
    /// that no run of that net avoids it.
    fn every_run_comes(
        &self,
        wanted: &PlaceFormula,
        starts: impl Fn(&dyn MarkingGraph) -> Vec<u32>,
    ) -> ClaimVerdict {
        let asked = |marking: &[u32]| self.holds(wanted, marking);
        let avoiding =
            |graph: &dyn MarkingGraph| find_escape(graph, starts(graph), &asked, &self.budget());
        if self.is_whole() && avoiding(&self.exploration.space) == Ok(None) {
            return ClaimVerdict::Holds;
        }
        match self.timed().and_then(|classes| avoiding(classes)) {
            Ok(None) => ClaimVerdict::Holds,
            Ok(Some(found)) => self.escaped(&found),
            Err(why) => self.undecided(why),
        }
    }

    fn escaped(&self, escape: &Escape) -> ClaimVerdict {
        match escape {
            Escape::Circle(path, circle) => {
                let lead =
                    if path.is_empty() { String::new() } else { self.after_firings(path) + " " };
                let reason =
                    format!("{lead}this can continue forever without it: {}", self.names(circle));
                self.blame_circle(circle).explain(self.fails(reason, path, circle))
            }
            Escape::DeadEnd(path) => {
                let marking = self.marking_after(path);
                let reason = format!(
                    "{} there {}, and nothing fires any more",
                    self.after_firings(path),
                    self.marked_in_words(&marking)
                );
                failed(reason, self.or_the_end(&marking), Some(self.trace_of(path, &[])))
            }
        }
    }

    /// Advises to turn a check round that asks what the end of the mission leads to.
    fn turn_from_end(&self, from: &Formula, to: &Formula, verdict: ClaimVerdict) -> ClaimVerdict {
        let ends = [self.plan.goal(), self.plan.safe()];
        let (mut failure, end) = match (verdict, from) {
            (ClaimVerdict::Fails(failure), Formula::Marked(end)) => (failure, end),
            (verdict, _) => return verdict,
        };
        let place = self.plan.place_named(end.as_str());
        if place.is_none() || !ends.contains(&place) {
            return ClaimVerdict::Fails(failure);
        }
        failure.remedy = match to {
            Formula::Marked(other) => format!("did you mean {other} leads to {end}?"),
            _ => "exchange the two sides of leads to".to_owned(),
        };
        failure.remedy += &format!(" The mission is over in {end}, which leads to nothing");
        ClaimVerdict::Fails(failure)
    }

    fn marking_after(&self, path: &[TransitionId]) -> Vec<u32> {
        let rules = FiringRules::new(self.net);
        rules.play(self.net.initial(), path).unwrap_or_default()
    }

    fn decide_duration(
        &self,
        until: &PlaceFormula,
        relation: Relation,
        limit: Duration,
    ) -> ClaimVerdict {
        match relation {
            Relation::Greater | Relation::GreaterOrEqual => {
                self.at_least(until, relation == Relation::Greater, limit)
            }
            _ => self.at_most(until, relation == Relation::Less, limit),
        }
    }

    fn at_least(&self, until: &PlaceFormula, is_strict: bool, limit: Duration) -> ClaimVerdict {
        let asked = |marking: &[u32]| self.holds(until, marking);
        let found = self
            .timed()
            .and_then(|classes| shortest_time(self.net, classes, asked, &self.budget()));
        match found {
            Err(why) => self.undecided(why),
            Ok(None) => {
                let reason = "it never happens: no sequence of firings leads there";
                failed(reason, "add transitions that lead there, or remove the check", None)
            }
            Ok(Some(least)) if least.time > limit || (least.time == limit && !is_strict) => {
                ClaimVerdict::Holds
            }
            Ok(Some(least)) => {
                let reason = format!("{} {}", time(least.time), self.are_enough(&least.sequence));
                self.fails(reason, &least.sequence, &[])
            }
        }
    }

    fn are_enough(&self, path: &[TransitionId]) -> String {
        match path {
            [] => "are enough: it holds at the start".into(),
            _ => format!("are enough for {}", self.names(path)),
        }
    }

    fn at_most(&self, until: &PlaceFormula, is_strict: bool, limit: Duration) -> ClaimVerdict {
        let asked = |marking: &[u32]| self.holds(until, marking);
        let found =
            self.timed().and_then(|classes| longest_time(self.net, classes, asked, &self.budget()));
        match found {
            Err(why) => self.undecided(why),
            Ok(Latest::At(most)) if most.time < limit || (most.time == limit && !is_strict) => {
                ClaimVerdict::Holds
            }
            Ok(Latest::At(most)) => {
                let reason = format!("{} can take {}", self.names(&most.sequence), time(most.time));
                let path = FiringTrace { is_late: true, ..self.trace_of(&most.sequence, &[]) };
                failed(reason, CHANGE_EITHER, Some(path))
            }
            Ok(Latest::WithoutEnd(path)) => self.without_end(&path),
            Ok(Latest::Circle(path, circle)) => self.escaped(&Escape::Circle(path, circle)),
            Ok(Latest::DeadEnd(path)) => self.escaped(&Escape::DeadEnd(path)),
        }
    }

    fn without_end(&self, path: &[TransitionId]) -> ClaimVerdict {
        let reason = format!("there is no longest: {}", self.waits(path));
        let remedy = "give what waits another path out with a timeout, or leave the check out";
        failed(reason, remedy, Some(self.trace_of(path, &[])))
    }

    /// The last firing of a path may be waited for without end, and so may the others that could fire
    /// instead.
    pub(super) fn waits(&self, path: &[TransitionId]) -> String {
        let Some((last, before)) = path.split_last() else { return "nothing has to fire".into() };
        let marking = FiringRules::new(self.net).play(self.net.initial(), before);
        let mut names = marking.map(|it| self.name_waits(&it, |_| true)).unwrap_or_default();
        if names.is_empty() {
            names.push(self.name(*last));
        }
        format!(
            "{} {} may be waited for without end",
            self.after_firings(before),
            names.join(" or ")
        )
    }

    /// The names of the transitions that are enabled and need not fire, as far as `is_wanted`. The
    /// failure of a component is named only if nothing else is waited for.
    pub(super) fn name_waits(
        &self,
        marking: &[u32],
        is_wanted: impl Fn(TransitionId) -> bool,
    ) -> Vec<&str> {
        let rules = FiringRules::new(self.net);
        let is_open = |id: &TransitionId| {
            let transition = self.net.transition(*id);
            let need_not_fire = transition.gated || transition.interval.latest.is_none();
            need_not_fire && rules.enabled(marking, *id) && is_wanted(*id)
        };
        let names = self.net.transition_ids().filter(is_open).map(|id| self.name(id));
        let mut names: Vec<_> = names.filter(|name| !name.is_empty()).collect();
        names.dedup();
        let is_failure = |name: &str| {
            let written = self.mission.transitions.iter().find(|it| it.name.value == name);
            written.and_then(|it| it.on.as_ref()).is_some_and(|on| on.event.value == "failed")
        };
        if !names.iter().all(|name| is_failure(name)) {
            names.retain(|name| !is_failure(name));
        }
        names.truncate(MAX_WAITS);
        names
    }

    /// The transitions of the analysed net that are this one of the plan.
    pub(super) fn copies(&self, transition: TransitionId) -> Vec<TransitionId> {
        let sources = (0..).map(TransitionId).zip(&self.analysed.sources);
        sources.filter(|it| *it.1 == Some(transition)).map(|it| it.0).collect()
    }

    fn decide_fires(&self, transition: TransitionId) -> ClaimVerdict {
        match self.firing_of(transition) {
            Possible::Yes(_) => ClaimVerdict::Holds,
            Possible::No => {
                let reason = "no sequence of firings contains it, whatever is reported and when";
                failed(reason, "add transitions that lead to its places, or remove it", None)
            }
            Possible::Unknown(why) => ClaimVerdict::Undecided(why),
        }
    }

    fn decide_dead(&self, transition: TransitionId) -> ClaimVerdict {
        match self.firing_of(transition) {
            Possible::No => ClaimVerdict::Holds,
            Possible::Yes(seen) => {
                let reason = format!("it fires: {}", self.names(&seen.path));
                self.fails(reason, &seen.path, &[])
            }
            Possible::Unknown(why) => ClaimVerdict::Undecided(why),
        }
    }

    /// Whether a transition of the plan can fire; the path ends with it.
    fn firing_of(&self, transition: TransitionId) -> Possible {
        let mut found = Possible::No;
        for copy in self.copies(transition) {
            match (self.firing_of_one(copy), &found) {
                (Possible::Yes(seen), _) => return Possible::Yes(seen),
                (unknown @ Possible::Unknown(_), Possible::No) => found = unknown,
                _ => {}
            }
        }
        found
    }

    fn firing_of_one(&self, base: TransitionId) -> Possible {
        let space = &self.exploration.space;
        let rules = FiringRules::new(self.net);
        let enabling = space.find(|marking| rules.enabled(marking, base));
        let Some(state) = enabling else {
            if self.is_whole() {
                return Possible::No;
            }
            return self.timed_firing(base);
        };
        let mut seen = Witness::of(space, state);
        seen.path.push(base);
        match armor_petri::analysis::classes::is_possible(self.net, &seen.path) {
            Ok(true) => Possible::Yes(seen),
            _ => self.timed_firing(base),
        }
    }

    fn timed_firing(&self, transition: TransitionId) -> Possible {
        let classes = match self.timed() {
            Ok(classes) => classes,
            Err(why) => return Possible::Unknown(self.budget_ran_out(why)),
        };
        let fires = |class: &u32| classes.successors(*class).iter().any(|f| f.0 == transition);
        match (0..classes.nodes()).find(fires) {
            Some(class) => {
                let mut seen = Witness::of(classes, class);
                seen.path.push(transition);
                Possible::Yes(seen)
            }
            None => Possible::No,
        }
    }

    fn decide_bounded(&self, place: PlaceId, most: Option<u32>) -> ClaimVerdict {
        let Some(most) = most else { return self.bounded_at_all(place) };
        if self.bounds.of(place.index()).is_some_and(|bound| bound <= u64::from(most)) {
            return ClaimVerdict::Holds;
        }
        match most.checked_add(1) {
            Some(more) => self.decide_never(&PlaceFormula::at_least(place, more)),
            None => ClaimVerdict::Holds,
        }
    }

    /// As far as tokens go: a sum bounds it, or all states are seen, or it fills without end.
    fn bounded_at_all(&self, place: PlaceId) -> ClaimVerdict {
        if self.bounds.of(place.index()).is_some() {
            return ClaimVerdict::Holds;
        }
        match &self.exploration.ending {
            ExplorationEnd::Complete => ClaimVerdict::Holds,
            ExplorationEnd::Unbounded(_) if self.times_bound_it() => ClaimVerdict::Holds,
            ExplorationEnd::Unbounded(_) if self.grows_untimed_alone() => {
                ClaimVerdict::Undecided("whether its times let it fill is not known".into())
            }
            ExplorationEnd::Unbounded(pumping) if pumping.growing.contains(&place) => {
                let (path, circle) = (&pumping.prefix, &pumping.cycle);
                let begin =
                    if path.is_empty() { String::new() } else { self.after_firings(path) + " " };
                let reason = format!(
                    "{begin}each {} leaves more in it, again and again",
                    self.names(circle)
                );
                self.fails(reason, path, circle)
            }
            ExplorationEnd::Unbounded(_) => ClaimVerdict::Undecided(
                "another place fills without end, so not all was seen".into(),
            ),
            ExplorationEnd::Undecided(why) => self.undecided(*why),
        }
    }
}
