//! Transitions that never fire in time, and what always fires before them: on the path to the goal, and
//! from the places of one transition.

use std::collections::BTreeSet;

use armor_petri::analysis::classes::StateClasses;
use armor_petri::{PlaceId, TransitionId};
use armor_robotfile::mission::{Autonomy, Transition};
use armor_robotfile::{Code, Finding, Findings};

use crate::proof::Proof;
use crate::witness::Witness;
use armor_robotfile::time_in_words;

/// Most transitions that a message names.
const MOST_NAMED: usize = 3;

impl Proof<'_> {
    /// A goal that would be reached but for the times: along the shortest path to it, the first
    /// transition that cannot fire, and those that fire in its place.
    pub(super) fn goal_preempted(&self, goal: PlaceId, classes: &StateClasses) -> Option<Finding> {
        let space = &self.exploration.space;
        let path = Witness::of(space, space.find(|marking| marking[goal.index()] > 0)?).path;
        let mut class = 0;
        for (number, next) in path.iter().enumerate() {
            let after = classes.successors(class).iter().find(|firing| firing.0 == *next);
            if let Some((_, after)) = after {
                class = *after;
                continue;
            }
            let firings = classes.successors(class).iter().map(|firing| firing.0);
            let named = || firings.clone().filter(|id| !self.name(*id).is_empty());
            let inputs = &self.net.transition(*next).inputs;
            let rival = |id: &TransitionId| {
                let taken = &self.net.transition(*id).inputs;
                taken.iter().any(|arc| inputs.iter().any(|input| input.0 == arc.0))
            };
            // What waits for a report or an order need not fire before.
            let must_fire = || named().filter(|id| self.must_fire(*id));
            let first = must_fire().find(rival).or_else(|| must_fire().next());
            let first = first.or_else(|| named().next())?;
            let (first, next) = (self.name(first), self.name(*next));
            let when = match &path[..number] {
                [] => String::new(),
                before => format!("{}, ", self.after_firings(before)),
            };
            let message = format!(
                "{} never comes in time: {when}{first} always fires before {next} can",
                self.net.place(goal)
            );
            let finding = Finding::new(Code::GoalNeverReached, self.at(goal), message)
                .related(self.at_transition(first), "this one fires first")
                .remedy(self.advise_preempting(first, next));
            return Some(if first == next {
                finding
            } else {
                finding.related(self.at_transition(next), "this one never fires in time")
            });
        }
        None
    }

    /// What to do about a transition that always fires before another one.
    fn advise_preempting(&self, first: &str, next: &str) -> String {
        let mut written = self.mission.transitions.iter();
        // The transition into a sub-mission is written as the name of its file.
        let is_entrance = |it: &&Transition| {
            it.name.value == first && first.ends_with(".enter") && it.name.at.text() != first
        };
        if let Some(enter) = written.clone().find(is_entrance)
            && let Some(place) = enter.inputs().next()
        {
            let meant = self.mission.find_unused_place();
            let meant = meant.map(|meant| format!("did you mean in=\"{meant}\"? "));
            return format!(
                "{}{} begins as soon as {} is marked",
                meant.unwrap_or_default(),
                enter.name.at.text(),
                place.place.value
            );
        }
        let waits_for_nothing = written.find(|it| it.name.value == first).is_some_and(|it| {
            it.on.is_none() && it.interval.is_none() && it.autonomy == Autonomy::Auto
        });
        match waits_for_nothing {
            true => format!(
                "write what {first} waits for: on=\"…\", after=\"…\", or operator=\"true\" if the \
                 operator fires it"
            ),
            false => format!("compare the times of {first} and {next}"),
        }
    }

    /// Reports the transitions that have their tokens in time for no firing: of several, the timeout
    /// that ends the mission before all of them.
    pub(super) fn report_late(&self, late: &[TransitionId], findings: &mut Findings) {
        match self.find_early_end(late) {
            Some(finding) => findings.push(finding),
            None => findings.extend(late.iter().map(|source| self.never_in_time(*source))),
        }
    }

    /// The only timeout that leads from another place to the end of the mission, sooner than each of
    /// several transitions can fire.
    fn find_early_end(&self, sources: &[TransitionId]) -> Option<Finding> {
        let net = self.plan.net();
        let names: Vec<_> = sources.iter().map(|id| net.transition(*id).name.as_str()).collect();
        let (last, first) = names.split_last().filter(|(_, first)| !first.is_empty())?;
        let written = |name: &str| self.mission.transitions.iter().find(|it| it.name.value == name);
        let late: Vec<_> = names.iter().map(|name| written(name)).collect::<Option<_>>()?;
        let earliest = |it: &Transition| it.interval.as_ref().map(|it| it.value.earliest);
        let soonest = late.iter().map(|it| earliest(it)).collect::<Option<Vec<_>>>()?;
        let soonest = soonest.into_iter().min()?;
        let ends = [&self.mission.goal, &self.mission.safe];
        let is_end =
            |place: &str| ends.iter().any(|it| it.as_ref().is_some_and(|it| it.value == place));
        let is_early_end = |it: &&Transition| {
            let is_timeout = it.on.is_none() && it.when.is_none();
            let id = net.transition_ids().find(|id| net.transition(*id).name == it.name.value);
            // It counts while each of them waits.
            let is_alongside = id.is_some_and(|id| {
                let own = &net.transition(id).inputs;
                sources.iter().all(|source| {
                    let needed = &net.transition(*source).inputs;
                    let is_shared =
                        own.iter().any(|(place, _)| needed.iter().any(|(other, _)| other == place));
                    let are_marked = |marking: &[u32]| {
                        let mut both = own.iter().chain(needed);
                        both.all(|(place, count)| marking[place.index()] >= *count)
                    };
                    !is_shared && self.find_witness(&are_marked).is_some()
                })
            });
            is_timeout
                && is_alongside
                && it.inputs().next().is_some()
                && it.outputs().any(|arc| is_end(&arc.place.value))
                && earliest(it).is_some_and(|time| !time.is_zero() && time < soonest)
        };
        let mut early = self.mission.transitions.iter().filter(is_early_end);
        let (Some(end), None) = (early.next(), early.next()) else { return None };
        let name = &end.name.value;
        let message = format!(
            "{name} ends the mission after {}, before {} and {last} can fire",
            time_in_words(earliest(end)?),
            first.join(", ")
        );
        let finding = Finding::new(Code::NeverFires, &end.name.at, message).may_follow();
        let related = late.iter().fold(finding, |finding, it| {
            finding.related(&it.name.at, "this one never fires in time")
        });
        Some(related.remedy(format!("give {name} a longer time than these have")))
    }

    /// A transition that has its tokens in time for no firing.
    fn never_in_time(&self, source: TransitionId) -> Finding {
        let name = self.plan.net().transition(source).name.as_str();
        let preempting = self.find_preempting(source);
        let (first, remedy) = match preempting.as_slice() {
            [] => (
                "something else".to_owned(),
                "compare its times with those of the transitions that leave its places before"
                    .to_owned(),
            ),
            [only] => ((*only).to_owned(), self.advise_preempting(only, name)),
            some => (
                some.join(" or "),
                format!("compare its times with those of {}", some.join(" and ")),
            ),
        };
        let message = format!("{name} never fires in time: {first} always fires before it");
        let finding =
            Finding::new(Code::NeverFires, self.at_transition(name), message).may_follow();
        let related = preempting.iter().map(|first| self.at_transition(first));
        related.fold(finding, |finding, at| finding.related(at, "this one")).remedy(remedy)
    }

    /// Whether a transition fires by itself after some time, so that another one may be too late.
    fn must_fire(&self, transition: TransitionId) -> bool {
        let transition = self.net.transition(transition);
        !transition.gated && transition.interval.latest.is_some()
    }

    /// The transitions that must fire while it waits, and that take a token of its places, or else end the
    /// mission; if there are none, all that take a token of its places.
    fn find_preempting(&self, source: TransitionId) -> Vec<&str> {
        let Some(classes) = self.timed_if_small() else { return Vec::new() };
        let net = self.plan.net();
        let needed = || net.transition(source).inputs.iter().chain(&net.transition(source).reads);
        let takes = |id: TransitionId| {
            let inputs = &self.net.transition(id).inputs;
            inputs.iter().any(|(place, _)| needed().any(|(needed, _)| needed == place))
        };
        let has_tokens = |class: &u32| {
            let marking = classes.marking(*class);
            needed().all(|(place, count)| marking[place.index()] >= *count)
        };
        let waiting = (0..classes.classes() as u32).filter(has_tokens);
        let firings: BTreeSet<_> =
            waiting.flat_map(|class| classes.successors(class)).copied().collect();
        let ends = |(id, after): &(TransitionId, u32)| {
            self.must_fire(*id) && self.is_over(classes.marking(*after))
        };
        let names_of = |is_one: &dyn Fn(&(TransitionId, u32)) -> bool| {
            let names = firings.iter().filter(|firing| is_one(firing)).map(|it| self.name(it.0));
            names.filter(|name| !name.is_empty()).collect::<BTreeSet<_>>()
        };
        let takes = |(id, _): &(TransitionId, u32)| takes(*id);
        let names = [
            names_of(&|firing| self.must_fire(firing.0) && takes(firing)),
            names_of(&ends),
            names_of(&takes),
        ];
        let names = names.into_iter().find(|names| !names.is_empty()).unwrap_or_default();
        names.into_iter().take(MOST_NAMED).collect()
    }
}
