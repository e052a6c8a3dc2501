//! What is proven of every mission whose states can all be looked at.

use std::borrow::Cow;
use std::collections::BTreeSet;

use armor_petri::analysis::ExplorationEnd;
use armor_petri::analysis::boundedness::PumpingSequence;
use armor_petri::analysis::classes::is_possible;
use armor_petri::analysis::components::find_components;
use armor_petri::analysis::rules::FiringRules;
use armor_petri::analysis::runs::{MarkingGraph, nearest_lost};
use armor_petri::{NetTransition, PlaceId, TransitionId};
use armor_robotfile::{Code, Finding, Findings, Location};

use crate::exclusive::list_exclusive_places;
use crate::proof::Proof;
use crate::witness::Witness;
use armor_plan::ComponentId;

/// Most transitions to the goal that a remedy explains.
const MOST_LACKS: usize = 2;
/// Most emergency exits that a message names.
const MOST_EMERGENCIES: usize = 3;

/// A graph of markings without the firings of emergencies.
struct RegularGraph<'a> {
    graph: &'a dyn MarkingGraph,
    emergencies: &'a BTreeSet<TransitionId>,
}

impl MarkingGraph for RegularGraph<'_> {
    fn nodes(&self) -> u32 {
        self.graph.nodes()
    }

    fn tokens(&self, node: u32) -> Cow<'_, [u32]> {
        self.graph.tokens(node)
    }

    fn firings(&self, node: u32) -> Cow<'_, [(TransitionId, u32)]> {
        let mut firings = self.graph.firings(node);
        if firings.iter().any(|firing| self.emergencies.contains(&firing.0)) {
            firings.to_mut().retain(|firing| !self.emergencies.contains(&firing.0));
        }
        firings
    }

    fn path(&self, node: u32) -> Vec<TransitionId> {
        self.graph.path(node)
    }
}

impl Proof<'_> {
    pub(super) fn complete(&self, findings: &mut Findings) {
        if !self.effort.has_begun {
            // A mission that runs may be past the places of such a transition.
            self.dead_transitions(findings);
        }
        self.tokens_of_active_places(findings);
        self.find_meetings(findings);
        self.contradictions(findings);
        self.values_outside(findings);
        self.find_ties(findings);
        if !self.effort.has_begun {
            self.find_unmet(findings);
        }
        let Some(goal) = self.plan.goal() else { return };
        match self.goal_never(goal) {
            Some(never) => findings.push(never),
            None => {
                findings.extend(self.end_lost());
                if !self.effort.has_begun {
                    self.find_ignored_ends(findings);
                    self.find_immediate(findings);
                }
            }
        }
    }

    /// A mission whose goal or safe place is marked at the start: nothing fires in it, which explains
    /// all else.
    pub(super) fn over_at_start(&self) -> Option<Finding> {
        let (goal, safe) = (self.plan.goal(), self.plan.safe());
        let is_marked = |place: &PlaceId| self.net.initial()[place.index()] > 0;
        let (place, noun) = match goal.filter(is_marked) {
            Some(goal) => (goal, "goal"),
            None => (safe.filter(is_marked)?, "safe place"),
        };
        let name = self.net.place(place);
        let code = match goal.filter(|goal| *goal != place) {
            Some(_) => Code::GoalNeverReached,
            None => Code::OverAtStart,
        };
        let message =
            format!("the mission is over at its start: its {noun}, {name}, is marked initially");
        let remedy = format!(
            "name another place as {noun}, or mark another one initially: the one in which the \
             robot begins to work"
        );
        Some(Finding::new(code, self.at(place), message).remedy(remedy))
    }

    fn goal_never(&self, goal: PlaceId) -> Option<Finding> {
        let name = self.net.place(goal);
        let (message, remedy) = if self.most_in(goal) > 0 {
            let at_goal = |marking: &[u32]| marking[goal.index()] > 0;
            if self.comes_in_time(&at_goal) {
                return None;
            }
            let classes = self.timed_if_small()?;
            if classes.nearest(&at_goal).is_some() {
                return None;
            }
            if let Some(never) = self.goal_preempted(goal, classes) {
                return Some(never);
            }
            let message = format!(
                "{name} never comes in time: something else always fires before what leads there"
            );
            let remedy = "compare the times on the path to it with those of what fires before";
            (message, remedy.to_owned())
        } else {
            let stands =
                self.standing().filter(|seen| !self.waiting_starts(&seen.marking).is_empty());
            let stands = stands.map(|seen| {
                let held = self.marked_names(&seen.marking) + &self.waiting_starts(&seen.marking);
                format!("; {} there is a token in {held}", self.after_firings(&seen.path))
            });
            let message = format!(
                "no sequence of firings leads to {name}: the mission can never reach its goal{}",
                stands.unwrap_or_default()
            );
            (message, self.advise_goal(goal))
        };
        let finding = Finding::new(Code::GoalNeverReached, self.at(goal), message);
        Some(finding.remedy(remedy))
    }

    /// Whether the times allow the nearest path to a marking; if not, another path may still be in time.
    fn comes_in_time(&self, asked: &dyn Fn(&[u32]) -> bool) -> bool {
        let space = &self.exploration.space;
        let path = space.find(asked).and_then(|state| space.path_to(state));
        path.is_some_and(|path| is_possible(self.net, &path) == Ok(true))
    }

    /// What to do about a goal that nothing leads to.
    fn advise_goal(&self, goal: PlaceId) -> String {
        let net = self.plan.net();
        let transitions = net.transition_ids().map(|id| net.transition(id));
        let leading: Vec<_> = transitions
            .filter(|transition| transition.outputs.iter().any(|(place, _)| *place == goal))
            .collect();
        let lacks: Vec<_> =
            leading.iter().filter_map(|transition| self.describe_lack(transition)).collect();
        if !lacks.is_empty() && lacks.len() == leading.len() {
            return lacks.into_iter().take(MOST_LACKS).collect::<Vec<_>>().join("; ");
        }
        let advice = if !leading.is_empty() {
            "follow the transitions from the initial place: one of them needs what never is"
        } else if self.mission.submissions.is_empty() {
            "no transition leads to it: write its name into the to=\"…\" of the last one"
        } else {
            "no transition and no sub-mission leads to it: write its name into a to=\"…\" or out=\"…\""
        };
        advice.to_owned()
    }

    /// Which tokens a transition never has, as far as they are what it lacks.
    fn describe_lack(&self, transition: &NetTransition) -> Option<String> {
        let (name, net) = (&transition.name, self.plan.net());
        let mut needed = transition.inputs.iter().chain(&transition.reads);
        let short = needed.find(|(place, count)| self.most_in(*place) < *count);
        if let Some((place, count)) = short {
            let place_name = net.place(*place);
            return Some(match self.most_in(*place) {
                0 => self
                    .advise_after_safe(*place)
                    .or_else(|| self.describe_count_before(*place))
                    .unwrap_or_else(|| {
                        format!("{name} needs a token in {place_name}, which is never marked")
                    }),
                most => {
                    format!(
                        "{name} needs {count} tokens in {place_name}, which holds at most {most}"
                    )
                }
            });
        }
        let [(first, _), others @ ..] = transition.inputs.as_slice() else { return None };
        if others.is_empty() {
            return None;
        }
        let has_all = |marking: &[u32]| {
            transition.inputs.iter().all(|(place, count)| marking[place.index()] >= *count)
        };
        if self.find_witness(&has_all).is_some() {
            return None;
        }
        let taken = self.find_taken_before(transition).unwrap_or_default();
        let others = others.iter().map(|(place, _)| net.place(*place)).collect::<Vec<_>>();
        let (first, others) = (net.place(*first), others.join(", "));
        Some(format!(
            "{name} needs tokens in {first} and {others}, which never have them together{taken}"
        ))
    }

    /// The count of tokens that the only transition to a place never has.
    fn describe_count_before(&self, place: PlaceId) -> Option<String> {
        let net = self.plan.net();
        let leading = net.transition_ids().map(|id| net.transition(id));
        let mut leading = leading.filter(|it| it.outputs.iter().any(|arc| arc.0 == place));
        let (Some(only), None) = (leading.next(), leading.next()) else { return None };
        let mut needed = only.inputs.iter().chain(&only.reads);
        let (scarce, count) = needed.find(|(place, count)| self.most_in(*place) < *count)?;
        let (name, most) = (&only.name, self.most_in(*scarce));
        (most > 0).then(|| {
            format!(
                "{name} needs {count} tokens in {}, which holds at most {most}",
                net.place(*scarce)
            )
        })
    }

    /// What to do if a transition takes one of the tokens that a join needs, when it puts the other.
    fn find_taken_before(&self, join: &NetTransition) -> Option<String> {
        let net = self.plan.net();
        let needs = |place: PlaceId| join.inputs.iter().any(|arc| arc.0 == place);
        net.transition_ids().map(|id| net.transition(id)).find_map(|it| {
            let taken = it.inputs.iter().find(|arc| needs(arc.0))?.0;
            let puts_other = it.outputs.iter().any(|arc| needs(arc.0) && arc.0 != taken);
            (puts_other && it.inputs.len() > 1 && it.name != join.name).then(|| {
                let (name, taken) = (&it.name, net.place(taken));
                format!(
                    ": {name} takes the one in {taken} before; did you mean <read place=\"{taken}\"/> \
                     in {name}?"
                )
            })
        })
    }

    /// What to do if only transitions lead to a place that take a token from the safe place.
    fn advise_after_safe(&self, place: PlaceId) -> Option<String> {
        let (safe, net) = (self.plan.safe()?, self.plan.net());
        let transitions = net.transition_ids().map(|id| net.transition(id));
        let mut leading = transitions.filter(|it| it.outputs.iter().any(|arc| arc.0 == place));
        let takes_safe = |it: &NetTransition| it.inputs.iter().any(|arc| arc.0 == safe);
        let first = leading.next().filter(|first| takes_safe(first))?;
        let safe_name = net.place(safe);
        leading.all(takes_safe).then(|| {
            format!(
                "{} leads on from {safe_name}, the safe place, and the mission is over when \
                 {safe_name} is marked: name another place as safe",
                first.name
            )
        })
    }

    /// Of a mission that has places without a bound as far as tokens go.
    pub(super) fn without_bounds(&self, pumping: &PumpingSequence, findings: &mut Findings) {
        if self.times_bound_it() {
            return self.complete(findings);
        }
        findings.push(self.fills(pumping));
        // What the states seen show is so, whatever the others are.
        self.tokens_of_active_places(findings);
        self.find_meetings(findings);
        self.contradictions(findings);
        self.values_outside(findings);
        if self.plan.goal().is_some()
            && let Some(seen) = self.standing()
        {
            findings.push(self.lost_at(&seen, true));
        }
    }

    /// The nearest marking in which nothing but an emergency fires any more, and the mission is not
    /// over.
    fn standing(&self) -> Option<Witness> {
        let rules = FiringRules::new(self.net);
        let regular = || self.net.transition_ids().filter(|id| !self.is_emergency(*id));
        self.find_witness(&|marking| {
            let fires = regular().any(|id| rules.enabled(marking, id));
            !fires && !self.is_over(marking)
        })
    }

    fn is_emergency(&self, transition: TransitionId) -> bool {
        self.analysed.emergencies.contains(&transition)
    }

    /// The most tokens that a place holds in a state.
    pub(super) fn most_in(&self, place: PlaceId) -> u32 {
        if !matches!(self.exploration.ending, ExplorationEnd::Unbounded(_)) {
            return self.exploration.space.most_in(place);
        }
        let (classes, _) = self.timed_so_far();
        let tokens = |class| classes.marking(class)[place.index()];
        (0..classes.classes() as u32).map(tokens).max().unwrap_or(0)
    }

    pub(super) fn fills(&self, pumping: &PumpingSequence) -> Finding {
        let (prefix, cycle) = (self.names(&pumping.prefix), self.names(&pumping.cycle));
        let place = pumping.growing.first().copied().unwrap_or(PlaceId(0));
        let begin = if prefix.is_empty() { String::new() } else { format!("{prefix}, ") };
        let untimed = if self.grows_untimed_alone() {
            "; its times do not allow just this, and what they do allow was too much to be looked at"
        } else {
            ""
        };
        let message = format!(
            "{} fills without end: {begin}then again and again {cycle}{untimed}",
            self.net.place(place),
        );
        Finding::new(Code::FillsWithoutEnd, self.at(place), message)
            .trace(self.trace_of(&pumping.prefix, &pumping.cycle))
            .remedy("take as many tokens as are put, or stop it with <inhibitor place=\"…\" weight=\"…\"/>")
    }

    /// A marking from which neither goal nor safe place can be reached any more, except by an
    /// emergency: an operator's order is no regular exit.
    fn end_lost(&self) -> Option<Finding> {
        if self.keeps_end() {
            return None;
        }
        let is_over = |marking: &[u32]| self.is_over(marking);
        let space = &self.exploration.space;
        let emergencies = &self.analysed.emergencies;
        if let Some(classes) = self.timed_if_small() {
            let regular = RegularGraph { graph: classes, emergencies };
            if let Ok(found) = nearest_lost(&regular, &is_over, &self.budget()) {
                return Some(self.lost_in(&regular, found?));
            }
        }
        let regular = RegularGraph { graph: space, emergencies };
        let node = match emergencies.is_empty() {
            true => find_components(space, &self.untimed_budget(), is_over).ok()?.lost(),
            false => nearest_lost(&regular, &is_over, &self.untimed_budget()).ok()?,
        };
        Some(self.lost_in(&regular, node?))
    }

    fn lost_in(&self, graph: &RegularGraph<'_>, node: u32) -> Finding {
        self.lost_at(&Witness::of(graph, node), graph.firings(node).is_empty())
    }

    pub(super) fn lost_at(&self, seen: &Witness, stands_still: bool) -> Finding {
        let at = self.nearest_mark(&seen.marking);
        let held = self.marked_names(&seen.marking) + &self.waiting_starts(&seen.marking);
        let after = self.after_firings(&seen.path);
        let held = held + &self.emergencies_in_words();
        let finding = if stands_still {
            let message = format!("{after} the mission stands still, with a token in {held}");
            let read = self.advise_read(&seen.path).unwrap_or_default();
            Finding::new(Code::Standstill, at, message).remedy(format!(
                "add a transition that leads on, or make it the goal or the safe place{read}"
            ))
        } else {
            let message = format!("{after} neither goal nor safe place can be reached any more");
            Finding::new(Code::GoalLost, at, format!("{message}; tokens are in {held}"))
                .remedy("add a transition that leads out, such as one with a timeout")
        };
        finding.trace(self.trace_of(&seen.path, &[]))
    }

    /// "; only an emergency (stop) leads out": what a stuck mission is left by.
    fn emergencies_in_words(&self) -> String {
        // Not where a component does not start or stop, which is no exit of its own.
        let is_own = |id: &&TransitionId| self.analysed.sources[id.index()].is_some();
        let own = self.analysed.emergencies.iter().filter(is_own);
        let names: BTreeSet<_> = own.map(|id| self.name(*id)).collect();
        match names.into_iter().take(MOST_EMERGENCIES).collect::<Vec<_>>().as_slice() {
            [] => String::new(),
            names => format!("; only an emergency ({}) leads out", names.join(", ")),
        }
    }

    /// A place is active or not: a second token in it means that two branches meet there without a join.
    pub(super) fn tokens_of_active_places(&self, findings: &mut Findings) {
        for id in self.plan.place_ids() {
            let is_active = !self.plan.place(id).components.is_empty();
            if !is_active || self.most_in(id) < 2 {
                continue;
            }
            let Some(seen) = self.find_witness(&|marking| marking[id.index()] > 1) else {
                continue;
            };
            let (after, place) = (self.after_firings(&seen.path), self.net.place(id));
            let message = format!("{after} {place} holds more than one token");
            let finding = Finding::new(Code::TwoTokens, self.at(id), message);
            findings.push(finding.trace(self.trace_of(&seen.path, &[])).remedy(
                "join the branches that lead to it, or keep the second token out with <inhibitor place=\"…\"/>",
            ));
        }
    }

    /// The pairs of places of which each activates one of two exclusive components.
    pub(super) fn exclusive_places(&self) -> Vec<([ComponentId; 2], [PlaceId; 2])> {
        list_exclusive_places(self.plan)
    }

    /// Exclusive components in places that can be marked together: one of them would wait.
    pub(super) fn find_meetings(&self, findings: &mut Findings) {
        for (components, places) in self.exclusive_places() {
            findings.extend(self.meeting_finding(components, places));
        }
    }

    fn meeting_finding(
        &self,
        components: [ComponentId; 2],
        [place, second]: [PlaceId; 2],
    ) -> Option<Finding> {
        let seen = self.find_together(place, second)?;
        let [one, other] = components.map(|id| self.plan.components()[id.index()].name.as_str());
        let message = format!(
            "{} {} and {} are marked together, but {one} and {other} exclude each other: one would wait",
            self.after_firings(&seen.path),
            self.net.place(place),
            self.net.place(second),
        );
        let finding = Finding::new(Code::MarkedTogether, self.at(place), message)
            .trace(self.trace_of(&seen.path, &[]))
            .related(self.at(second), "together with this one");
        let fork = self.find_fork(&seen.path).map(|name| self.at_transition(name));
        let label = "this one put a token into each of the places that it leads to";
        Some(
            fork.into_iter()
                .fold(finding, |finding, at| finding.related(at, label))
                .remedy("let one transition leave the one place and enter the other"),
        )
    }

    fn nearest_mark(&self, marking: &[u32]) -> &Location {
        let marked = marking.iter().position(|tokens| *tokens > 0);
        marked.map_or(&self.mission.at, |place| self.at(PlaceId(place as u32)))
    }
}
