//! Places that no sequence of transitions leads to, whatever the guards and times: a place counts
//! as reached if a transition puts tokens there whose own places are all reached. (The analysis of
//! the net proves more; this needs no state space.)

use std::collections::{BTreeMap, BTreeSet};

use crate::check::graph::CheckGraph;
use crate::code::Code;
use crate::finding::{Finding, MAX_RELATED};
use crate::findings::Findings;
use crate::mission::{ArcKind, Mission, Place, Submission, Transition};
use crate::source::plain_path;

/// `whole` is the mission with its sub-missions. A goal that the main mission cannot reach is a
/// finding of the proof.
pub(super) fn check(mission: &Mission, whole: &Mission, is_main: bool, findings: &mut Findings) {
    let reached = find_reached(whole);
    let is_reached = |place: &&Place| reached.contains(place.name.value.as_str());
    let active =
        |of: &Place| of.components.iter().map(|name| name.value.clone()).collect::<Vec<_>>();
    let ever_active: BTreeSet<_> =
        whole.places.iter().filter(is_reached).flat_map(active).collect();
    let goal = mission.goal.as_ref().map(|goal| goal.value.as_str());
    let unreached: Vec<_> = mission.places.iter().filter(|place| !is_reached(place)).collect();
    let targets: BTreeSet<_> = whole.transitions.iter().flat_map(output_places).collect();
    let leads = |name: &str| match targets.contains(name) {
        false => format!("no transition leads to {name}"),
        true => format!("what leads to {name} starts from places that are never reached either"),
    };
    let explained = find_explained(mission, findings);
    // A transition that leads back to its own place was probably meant to lead to the first place.
    let returning =
        findings.iter().filter(|it| it.code == Code::EndlessLoop && it.stops_transition);
    let mut returning = returning.filter(|it| is_of(mission, it)).count();
    for (place, circle) in find_first(&unreached, whole) {
        if returning > 0 {
            returning -= 1;
            continue;
        }
        let name = &place.name.value;
        if explained.contains(name) {
            continue;
        }
        let mut message = match goal.filter(|goal| goal == name) {
            Some(_) if is_main => continue,
            Some(_) => format!("the goal can never be reached: {}", leads(name)),
            None => leads(name),
        };
        let never: Vec<_> =
            active(place).into_iter().filter(|name| !ever_active.contains(name)).collect();
        match never.as_slice() {
            [] => {}
            [only] => message += &format!(", so {only} is never active"),
            some => message += &format!(", so {} are never active", some.join(" and ")),
        }
        let mut finding = Finding::new(Code::UnreachablePlace, &place.name.at, message);
        for other in circle.into_iter().take(MAX_RELATED) {
            finding = finding.related(&other.name.at, "and here");
        }
        let remedy = "add a transition to it, or remove it";
        findings.push(finding.remedy(remedy).stops_transition());
    }
}

/// Returns the places that are not reached because a sub-mission that leaves to them has no goal,
/// which is a finding already.
fn find_explained(mission: &Mission, findings: &Findings) -> BTreeSet<String> {
    let has_no_goal = |submission: &&Submission| {
        findings.iter().any(|finding| {
            let path = finding.at.as_ref().map(|at| plain_path(at.source.path()));
            finding.code == Code::NoGoal && path.as_ref() == Some(&submission.path)
        })
    };
    let without_goal = mission.submissions.iter().filter(has_no_goal);
    without_goal.filter_map(|inner| Some(inner.leave.as_ref()?.value.clone())).collect()
}

/// Returns the unreached places that the others follow from, each with those that follow: places
/// that no transition leads to, and one place of each circle that is entered from nowhere.
fn find_first<'a>(unreached: &[&'a Place], whole: &Mission) -> Vec<(&'a Place, Vec<&'a Place>)> {
    let by_name: BTreeMap<_, _> =
        unreached.iter().enumerate().map(|(at, it)| (it.name.value.as_str(), at)).collect();
    // A transition is a node too: of many places to many places, its edges stay few.
    let count = unreached.len();
    let nodes = 0..count + whole.transitions.len();
    let edges = whole.transitions.iter().enumerate().flat_map(|(at, transition)| {
        let known = |name: &str| by_name.get(name).copied();
        let needs = needed_places(transition).into_iter().filter_map(known);
        let puts = output_places(transition).filter_map(known);
        let ends = needs.map(|place| (place, count + at, ()));
        ends.chain(puts.map(|place| (count + at, place, ()))).collect::<Vec<_>>()
    });
    let groups = CheckGraph::new(nodes, edges).find_first_groups();
    let places = groups.into_iter().map(|group| {
        let places = group.into_iter().filter(|node| *node < count);
        places.map(|node| unreached[node]).collect::<Vec<_>>()
    });
    let mut first: Vec<_> =
        places.filter_map(|places| Some((*places.first()?, places[1..].to_vec()))).collect();
    first.sort_by_key(|(place, _)| place.name.at.span);
    first
}

fn is_of(mission: &Mission, finding: &Finding) -> bool {
    let path = mission.at.source.path();
    finding.at.as_ref().is_some_and(|at| at.source.path() == path)
}

fn find_reached(mission: &Mission) -> BTreeSet<&str> {
    let mut waiting: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut missing = Vec::new();
    for (index, transition) in mission.transitions.iter().enumerate() {
        let needs = needed_places(transition);
        missing.push(needs.len());
        for place in needs {
            waiting.entry(place).or_default().push(index);
        }
    }
    let initial = mission.places.iter().filter(|place| place.initial > 0);
    let mut open: Vec<&str> = initial.map(|place| place.name.value.as_str()).collect();
    open.extend(failure_places(mission));
    let sources = mission.transitions.iter().zip(&missing).filter(|(_, missing)| **missing == 0);
    open.extend(sources.flat_map(|(transition, _)| output_places(transition)));
    let mut reached = BTreeSet::new();
    while let Some(place) = open.pop() {
        if !reached.insert(place) {
            continue;
        }
        for index in waiting.get(place).into_iter().flatten() {
            missing[*index] -= 1;
            if missing[*index] == 0 {
                open.extend(output_places(&mission.transitions[*index]));
            }
        }
    }
    reached
}

fn needed_places(transition: &Transition) -> BTreeSet<&str> {
    let needed =
        transition.arcs.iter().filter(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Read));
    needed.map(|arc| arc.place.value.as_str()).collect()
}

fn output_places(transition: &Transition) -> impl Iterator<Item = &str> {
    let overrun = transition.overrun.iter().map(|place| place.value.as_str());
    transition.outputs().map(|arc| arc.place.value.as_str()).chain(overrun)
}

/// Where tokens go when something fails; that can happen at any time.
fn failure_places(mission: &Mission) -> impl Iterator<Item = &str> {
    let of_places = mission.places.iter().filter_map(|place| place.on_failure.as_ref());
    let of_transitions = mission
        .transitions
        .iter()
        .flat_map(|transition| [&transition.on_stop_fail, &transition.on_start_fail])
        .flatten();
    mission.safe.iter().chain(of_places).chain(of_transitions).map(|place| place.value.as_str())
}
