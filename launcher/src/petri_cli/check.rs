//! `armor net check`: the faults of a net, each with a firing sequence that shows it.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use armor_petri::analysis::boundedness::PumpingSequence;
use armor_petri::analysis::classes::{self, find_state_classes};
use armor_petri::analysis::components::find_components;
use armor_petri::analysis::durations::{Latest, TimedSequence, longest_time, shortest_time};
use armor_petri::analysis::invariants::{
    Semiflow, Semiflows, excluding_sum, place_semiflows, transition_semiflows,
};
use armor_petri::analysis::{AnalysisBudget, Exhausted, Space};
use armor_petri::{FiringInterval, Net, PlaceId, TransitionId};

use super::arguments::NetCheckArguments;
use super::net_facts::{NetFacts, load_net, name_all, option_of, run_within_budget};
use super::report::{self, NetReport};
use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line, print_text};

/// Prints the report; fails if the net is unbounded, cannot be decided, or breaks what was asked.
///
/// # Errors
/// If the file cannot be read, contains no net, or lacks a place of the arguments.
pub fn print_check(arguments: &NetCheckArguments, format: OutputFormat) -> Result<CommandEnding> {
    let file = load_net(&arguments.file)?;
    let place = |name: &String| {
        let found = file.net.places().iter().position(|place| place == name);
        let found = found.with_context(|| format!("there is no place `{name}` in the net"))?;
        Ok(PlaceId(found as u32))
    };
    let goal = arguments.goal.as_ref().map(place).transpose()?;
    let exclusive = arguments.exclusive.iter().map(place).collect::<Result<Vec<_>>>()?;
    let report = run_within_budget(&arguments.budget, |budget| {
        let checking = Checking { net: &file.net, budget, goal, report: NetReport::default() };
        checking.run(&exclusive, arguments.invariants)
    });
    match format {
        OutputFormat::Json => end_printing(print_line(serde_json::to_string(&report)?))?,
        _ => end_printing(print_text(report.text()))?,
    };
    Ok(if report.errors.is_empty() { CommandEnding::Fine } else { CommandEnding::Failed })
}

struct Checking<'a> {
    net: &'a Net,
    budget: &'a AnalysisBudget<'a>,
    goal: Option<PlaceId>,
    report: NetReport,
}

impl Checking<'_> {
    fn run(mut self, exclusive: &[PlaceId], with_invariants: bool) -> NetReport {
        let facts = NetFacts::gather_facts(self.net, true, self.budget);
        self.report.bounded = facts.decide_bounds();
        if let Some(pumping) = &facts.pumping {
            self.report.pumping = Some(pumping_of(self.net, pumping));
            self.error("some place can be filled without end");
        }
        if let Some(exhausted) = facts.undecided {
            self.undecided(exhausted);
        }
        if let Some(space) = facts.all_states() {
            self.states(space);
            self.ends(space);
        }
        self.semiflows(exclusive, with_invariants, facts.all_states());
        let timed = self.net.transitions().iter().any(|t| t.interval != FiringInterval::UNTIMED);
        if timed && facts.pumping.is_none() {
            self.time();
        }
        self.report
    }

    fn error(&mut self, text: impl Into<String>) {
        self.report.errors.push(text.into());
    }

    fn undecided(&mut self, exhausted: Exhausted) {
        let option = option_of(exhausted);
        self.report.undecided.get_or_insert(option);
        self.error(format!("not decided: {exhausted} ({option})"));
    }

    fn states(&mut self, space: &Space) {
        self.report.states = Some(space.states());
        self.report.edges = Some(space.edges());
        let dead: Vec<_> = space.dead_transitions().collect();
        self.report.dead_transitions = Some(name_all(self.net, &dead));
        self.report.deadlocks = Some(space.deadlocks());
        self.report.deadlock = space.first_deadlock().map(|state| self.sequence_to(space, state));
    }

    /// Where the net can end up, and whether the goal stays within reach.
    fn ends(&mut self, space: &Space) {
        let goal = self.goal;
        let asked = |marking: &[u32]| goal.is_none_or(|goal| marking[goal.index()] > 0);
        let found = match find_components(space, self.budget, asked) {
            Ok(found) => found,
            Err(exhausted) => return self.undecided(exhausted),
        };
        self.report.components = Some(found.components);
        self.report.reversible = Some(found.is_reversible());
        self.report.home_states = Some(found.home_states());
        if let Some(goal) = goal {
            let lost = found.lost().map(|state| self.sequence_to(space, state));
            if lost.is_some() {
                self.error("the goal cannot be reached from everywhere");
            }
            let place = self.net.place(goal).to_owned();
            self.report.goal =
                Some(report::GoalReport { place, always_reachable: lost.is_none(), lost });
        }
    }

    /// Semiflows, where they are asked for or may prove an exclusion.
    fn semiflows(&mut self, exclusive: &[PlaceId], listed: bool, space: Option<&Space>) {
        if exclusive.is_empty() && !listed {
            return;
        }
        let places = place_semiflows(self.net, self.budget.stop);
        for pair in exclusive.chunks_exact(2) {
            let exclusive = self.exclusive(&places, space, pair[0], pair[1]);
            let shown = exclusive.places.join(" and ");
            match exclusive.holds {
                Some(true) => {}
                Some(false) => self.error(format!("{shown} can be marked together")),
                None => self.error(format!("not decided: {shown} marked together")),
            }
            self.report.exclusive.push(exclusive);
        }
        if listed {
            let transitions = transition_semiflows(self.net, self.budget.stop);
            let place = |id: &PlaceId| self.net.place(*id).to_owned();
            let transition = |id: &TransitionId| self.net.transition(*id).name.clone();
            self.report.invariants = Some(report::Invariants {
                complete: places.complete && transitions.complete,
                places: places.semiflows.iter().map(|flow| weights(flow, place)).collect(),
                transitions: transitions.semiflows.iter().map(|f| weights(f, transition)).collect(),
            });
        }
    }

    fn exclusive(
        &self,
        semiflows: &Semiflows<PlaceId>,
        space: Option<&Space>,
        one: PlaceId,
        other: PlaceId,
    ) -> report::ExclusiveReport {
        let by_invariant = excluding_sum(semiflows, self.net, one, other).is_some();
        let together = space.filter(|_| !by_invariant).map(|space| space.together(one, other));
        let (holds, by) = match (by_invariant, together) {
            (true, _) => (Some(true), Some("invariant")),
            (false, Some(found)) => (Some(found.is_none()), Some("states")),
            (false, None) => (None, None),
        };
        let seen =
            together.flatten().zip(space).map(|(state, space)| self.sequence_to(space, state));
        let places = [one, other].map(|place| self.net.place(place).to_owned());
        report::ExclusiveReport { places, holds, by, together: seen }
    }

    /// The timed net.
    fn time(&mut self) {
        let (found, exhausted) = find_state_classes(self.net, self.budget);
        if let Some(exhausted) = exhausted {
            return self.undecided(exhausted);
        }
        let dead = found.dead_transitions(self.net.transitions().len());
        let deadlock = found.deadlocks().next();
        let mut report = report::ClassReport {
            classes: found.classes(),
            edges: found.edges(),
            markings: found.markings(),
            dead_transitions: name_all(self.net, &dead),
            deadlocks: found.deadlocks().count() as u64,
            deadlock: deadlock
                .map(|class| self.with_marking(&found.path_to(class), found.marking(class))),
            ..report::ClassReport::default()
        };
        if let Some(goal) = self.goal
            && let Err(exhausted) = self.durations(&found, goal, &mut report)
        {
            self.undecided(exhausted);
        }
        self.report.classes = Some(report);
    }

    fn durations(
        &self,
        found: &classes::StateClasses,
        goal: PlaceId,
        report: &mut report::ClassReport,
    ) -> Result<(), Exhausted> {
        let asked = |marking: &[u32]| marking[goal.index()] > 0;
        let timed = |timed: TimedSequence| report::TimedSequence {
            seconds: timed.time.as_secs_f64(),
            sequence: name_all(self.net, &timed.sequence),
        };
        report.shortest = shortest_time(self.net, found, asked, self.budget)?.map(timed);
        let without = |why, sequence: &[_], circle: &[_]| report::NoLongest {
            why,
            sequence: name_all(self.net, sequence),
            circle: name_all(self.net, circle),
        };
        match longest_time(self.net, found, asked, self.budget)? {
            Latest::At(latest) => report.longest = Some(timed(latest)),
            Latest::WithoutEnd(path) => {
                report.no_longest = Some(without(
                    "no upper bound: the last firing can be waited for without end",
                    &path,
                    &[],
                ));
            }
            Latest::Circle(path, circle) => {
                report.no_longest = Some(without(
                    "it may never be marked: some firings can repeat forever",
                    &path,
                    &circle,
                ));
            }
            Latest::DeadEnd(path) => {
                report.no_longest =
                    Some(without("it may never be marked: there is a deadlock", &path, &[]));
            }
        }
        Ok(())
    }

    fn sequence_to(&self, space: &Space, state: u32) -> report::FiringSequence {
        let path = space.path_to(state).expect("the exploration was asked to remember paths");
        self.with_marking(&path, &space.marking(state))
    }

    fn with_marking(&self, path: &[TransitionId], marking: &[u32]) -> report::FiringSequence {
        let marked = self.net.places().iter().cloned().zip(marking.iter().copied());
        report::FiringSequence {
            sequence: name_all(self.net, path),
            marking: marked.filter(|(_, tokens)| *tokens > 0).collect(),
        }
    }
}

fn pumping_of(net: &Net, pumping: &PumpingSequence) -> report::PumpingReport {
    report::PumpingReport {
        prefix: name_all(net, &pumping.prefix),
        cycle: name_all(net, &pumping.cycle),
        growing: pumping.growing.iter().map(|place| net.place(*place).to_owned()).collect(),
    }
}

fn weights<Id>(flow: &Semiflow<Id>, name: impl Fn(&Id) -> String) -> BTreeMap<String, u64> {
    flow.weights.iter().map(|(id, weight)| (name(id), *weight)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_petri::file::tina;

    fn report(text: &str, goal: Option<u32>, exclusive: &[u32]) -> NetReport {
        let net = tina::read(text).expect("a net").net;
        let goal = goal.map(PlaceId);
        let budget = AnalysisBudget::UNLIMITED;
        let checking = Checking { net: &net, budget: &budget, goal, report: NetReport::default() };
        let exclusive: Vec<_> = exclusive.iter().copied().map(PlaceId).collect();
        checking.run(&exclusive, false)
    }

    #[test]
    fn a_goal_that_can_be_lost_is_shown_with_the_firings_that_lose_it() {
        let report = report("tr a p -> goal\ntr b p -> trap\npl p (1)", Some(1), &[]);
        let goal = report.goal.expect("it was asked for");
        assert_eq!(goal.lost.expect("b loses it").sequence, ["b"]);
        assert_eq!(report.errors, ["the goal cannot be reached from everywhere"]);
    }

    #[test]
    fn exclusion_is_proven_by_a_sum_or_refuted_by_a_firing_sequence() {
        let safe = report("tr a p -> q\npl p (1)", None, &[0, 1]);
        assert_eq!((safe.exclusive[0].by, safe.errors.len()), (Some("invariant"), 0));
        let unsafe_ = report("tr a p -> q\npl p (2)", None, &[0, 1]);
        let together = unsafe_.exclusive[0].together.as_ref().expect("after one firing");
        assert_eq!((&together.sequence[..], unsafe_.errors.len()), (&["a".to_owned()][..], 1));
    }

    #[test]
    fn a_timed_net_is_looked_at_with_its_times() {
        let report =
            report("tr early [0,2] p -> goal\ntr late [3,3] p -> q\npl p (1)", Some(1), &[]);
        let classes = report.classes.expect("it has intervals");
        assert_eq!(classes.dead_transitions, ["late"]);
        assert_eq!(classes.longest.expect("the goal comes").seconds, 2.0);
    }
}
