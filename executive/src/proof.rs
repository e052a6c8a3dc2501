//! What is proven of a mission before it runs, with a way there where it is bad news.
//!
//! The net is looked at without times, priorities, guards and reports: they only take behaviour
//! away, so what cannot happen here never happens in a run. What can happen here may still be kept
//! from happening by a time or a report: that is a warning, not an error.

use std::collections::BTreeSet;

use armor_missions::{Code, Configuration, Finding, Findings, Location, Mission};
use armor_petri::analysis::components::components;
use armor_petri::analysis::invariants::Bounds;
use armor_petri::analysis::{Budget, Ending, Space, explore};
use armor_petri::{Net, NetBuilder, PlaceId, TransitionId};

use crate::plan::{ComponentId, Plan};

/// Most states of a mission that are looked at.
pub const MAX_STATES: u64 = 500_000;
/// Most memory that they may take, in bytes.
pub const MAX_BYTES: u64 = 256 << 20;
/// Firings of a way that are named.
const MAX_NAMED: usize = 12;

/// Proves the mission of a configuration, whose plan is `plan`. `stop` is asked now and then whether
/// it has taken long enough.
pub fn prove(configuration: &Configuration, plan: &Plan, stop: &dyn Fn() -> bool) -> Findings {
    let mut findings = Findings::default();
    let Ok(Some(mission)) = configuration.flattened() else { return findings };
    let Ok((net, sources)) = analysed(plan) else { return findings };
    let budget = Budget { states: MAX_STATES, memory_bytes: MAX_BYTES, stop };
    let bounds = Bounds::of_net(&net, stop);
    let exploration = explore(&net, &bounds, true, &budget);
    let proof = Proof { plan, mission: &mission, net: &net, sources, space: &exploration.space };
    match exploration.ending {
        Ending::Complete => proof.complete(&budget, &mut findings),
        Ending::Unbounded(pumping) => {
            let (prefix, cycle) = (proof.names(&pumping.prefix), proof.names(&pumping.cycle));
            let place = pumping.growing.first().copied().unwrap_or(PlaceId(0));
            let begin = if prefix.is_empty() { String::new() } else { format!("{prefix}, ") };
            let message = format!(
                "{} fills without end: {begin}then again and again {cycle}",
                net.place(place)
            );
            let finding = Finding::new(Code::FillsWithoutEnd, proof.at(place), message);
            findings.push(finding.remedy(
                "take as many tokens as are put, or stop it with <inhibitor place=\"…\" weight=\"…\"/>",
            ));
        }
        Ending::Undecided(why) => {
            let message = format!(
                "the mission is too large to be proven: {why} ({} states seen)",
                exploration.space.states()
            );
            let finding = Finding::new(Code::NotProven, &mission.at, message);
            findings.push(finding.remedy(
                "prove its parts as missions of their own, or count fewer tokens where it counts",
            ));
        }
    }
    findings
}

/// The mission's net as it is analysed: it ends where the goal or the safe place is marked, and what
/// the file says of components that do not stop, start or last happens at any time. Also which
/// transition of the plan each of its transitions is.
fn analysed(plan: &Plan) -> Result<(Net, Vec<Option<TransitionId>>), armor_petri::NetError> {
    let net = plan.net();
    let mut builder = NetBuilder::default();
    for (name, tokens) in net.places().iter().zip(net.initial()) {
        builder.place(name.as_str(), *tokens);
    }
    let ends: Vec<_> = [plan.goal, plan.safe].into_iter().flatten().collect();
    let mut sources = Vec::new();
    for id in net.transition_ids() {
        let transition = net.transition(id);
        let planned = plan.transition(id);
        let redirected = |to: Option<PlaceId>, why| to.map(|to| (vec![(to, 1)], why));
        let ways = [
            Some((transition.outputs.clone(), "")),
            redirected(planned.on_stop_fail, " (a component does not stop)"),
            redirected(planned.on_start_fail, " (a component does not start)"),
        ];
        for (outputs, why) in ways.into_iter().flatten() {
            let mut t = builder.transition(format!("{}{why}", transition.name));
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
            for end in &ends {
                t = t.inhibitor(*end, 1);
            }
            sources.push(Some(id).filter(|_| why.is_empty()));
        }
    }
    for id in plan.place_ids() {
        if let Some(refuge) = plan.place(id).on_failure {
            let name = format!("failure in {}", net.place(id));
            let mut t = builder.transition(name).input(id, 1).output(refuge, 1);
            for end in &ends {
                t = t.inhibitor(*end, 1);
            }
            sources.push(None);
        }
    }
    Ok((builder.build()?, sources))
}

struct Proof<'a> {
    plan: &'a Plan,
    mission: &'a Mission,
    net: &'a Net,
    sources: Vec<Option<TransitionId>>,
    space: &'a Space,
}

impl Proof<'_> {
    fn complete(&self, budget: &Budget<'_>, findings: &mut Findings) {
        self.dead_transitions(findings);
        self.tokens_of_active_places(findings);
        self.exclusions(findings);
        let Some(goal) = self.plan.goal else { return };
        if self.space.most_in(goal) == 0 {
            let name = self.net.place(goal);
            let message = format!("no way leads to {name}: the mission can never reach its goal");
            let finding = Finding::new(Code::GoalNeverReached, self.at(goal), message);
            findings.push(finding.remedy(
                "follow the transitions from the initial place: one of them needs what never is",
            ));
            return;
        }
        let is_over = |marking: &[u32]| {
            let marked = |place: Option<PlaceId>| place.is_some_and(|p| marking[p.index()] > 0);
            marked(Some(goal)) || marked(self.plan.safe)
        };
        let standstill = |marking: &[u32]| !is_over(marking);
        let Ok(found) = components(self.space, budget, is_over) else { return };
        let Some(lost) = found.lost() else { return };
        let marking = self.space.marking(lost);
        let at = self.nearest_mark(&marking);
        let (way, held) = (self.way(lost), self.held(&marking));
        let stands = standstill(&marking) && self.space.successors(lost).is_empty();
        findings.push(if stands {
            let message = format!("{way} the mission stands still, with a token in {held}");
            Finding::new(Code::Standstill, at, message)
                .remedy("add a transition that leads on, or make it the goal or the safe place")
        } else {
            let message = format!("{way} neither goal nor safe place can be reached any more");
            Finding::new(Code::GoalLost, at, format!("{message}; tokens are in {held}"))
                .remedy("add a transition that leads out, such as one with a timeout")
        });
    }

    fn dead_transitions(&self, findings: &mut Findings) {
        for id in self.space.dead_transitions() {
            let Some(source) = self.sources[id.index()] else { continue };
            let name = &self.plan.net().transition(source).name;
            let written = self.mission.transitions.iter().find(|t| t.name.value == *name);
            let at = written.map_or(&self.mission.at, |t| &t.name.at);
            let message = format!("{name} never fires: no way leads to all that it needs");
            let finding = Finding::new(Code::NeverFires, at, message);
            findings.push(finding.remedy("add a way to its places, or remove it"));
        }
    }

    /// A place is active or not: a second token in it means that two ways run into each other.
    fn tokens_of_active_places(&self, findings: &mut Findings) {
        for id in self.plan.place_ids() {
            if self.plan.place(id).components.is_empty() || self.space.most_in(id) < 2 {
                continue;
            }
            let found = self.space.find(|marking| marking[id.index()] > 1);
            let way = found.map(|state| self.way(state)).unwrap_or_default();
            let message = format!("{way} {} holds more than one token", self.net.place(id));
            let finding = Finding::new(Code::TwoTokens, self.at(id), message.trim().to_owned());
            findings.push(finding.remedy(
                "join the ways before it, or keep the second token out with <inhibitor place=\"…\"/>",
            ));
        }
    }

    /// Exclusive components in places that can be marked together: one of them would wait.
    fn exclusions(&self, findings: &mut Findings) {
        let mut pairs = BTreeSet::new();
        for one in self.plan.component_ids() {
            let component = &self.plan.components()[one.index()];
            for other in component.peers.iter().filter(|other| **other > one) {
                for place in &component.places {
                    for second in &self.plan.components()[other.index()].places {
                        let pair = (*place.min(second), *place.max(second));
                        if place != second && pairs.insert(pair) {
                            self.exclusion((one, *other), (*place, *second), findings);
                        }
                    }
                }
            }
        }
    }

    fn exclusion(
        &self,
        (one, other): (ComponentId, ComponentId),
        (place, second): (PlaceId, PlaceId),
        findings: &mut Findings,
    ) {
        let Some(state) = self.space.together(place, second) else { return };
        let name = |id: ComponentId| self.plan.components()[id.index()].name.as_str();
        let message = format!(
            "{} {} and {} are marked together, but {} and {} exclude each other: one would wait",
            self.way(state),
            self.net.place(place),
            self.net.place(second),
            name(one),
            name(other),
        );
        let finding = Finding::new(Code::MarkedTogether, self.at(place), message);
        findings.push(
            finding
                .related(self.at(second), "together with this one")
                .remedy("let one transition leave the one place and enter the other"),
        );
    }

    /// Where a place is written.
    fn at(&self, place: PlaceId) -> &Location {
        let name = self.net.place(place);
        let written = self.mission.places.iter().find(|written| written.name.value == name);
        written.map_or(&self.mission.at, |place| &place.name.at)
    }

    fn nearest_mark(&self, marking: &[u32]) -> &Location {
        let marked = marking.iter().position(|tokens| *tokens > 0);
        marked.map_or(&self.mission.at, |place| self.at(PlaceId(place as u32)))
    }

    /// "after a, b" for the shortest way to a state.
    fn way(&self, state: u32) -> String {
        match self.space.way_to(state) {
            Some(way) if !way.is_empty() => format!("after {}", self.names(&way)),
            _ => "at the start".to_owned(),
        }
    }

    fn names(&self, way: &[TransitionId]) -> String {
        let name = |id: &TransitionId| self.net.transition(*id).name.as_str();
        let named: Vec<_> = way.iter().take(MAX_NAMED).map(name).collect();
        let more = way.len().saturating_sub(MAX_NAMED);
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        named.join(", ") + &rest
    }

    fn held(&self, marking: &[u32]) -> String {
        let marked = marking.iter().enumerate().filter(|(_, tokens)| **tokens > 0);
        let names: Vec<_> =
            marked.map(|(place, _)| self.net.place(PlaceId(place as u32))).collect();
        if names.is_empty() { "no place".into() } else { names.join(", ") }
    }
}

#[cfg(test)]
mod tests;
