//! Places that no sequence of transitions leads to, whatever the guards and times: a place counts
//! as reached if a transition puts tokens there whose own places are all reached. (The analysis of
//! the net proves more; this needs no state space.)

use std::collections::{BTreeMap, BTreeSet};

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Mission, Place, Transition};

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
    // Where a transition leads to a place, the finding is about the places before it.
    let is_first = |place: &&&Place| !targets.contains(place.name.value.as_str());
    let has_first = unreached.iter().any(|place| is_first(&place));
    for place in unreached.iter().filter(|place| !has_first || is_first(place)) {
        let name = &place.name.value;
        let mut message = match goal.filter(|goal| goal == name) {
            Some(_) if is_main => continue,
            Some(_) => format!("the goal can never be reached: no transition leads to {name}"),
            None => format!("no transition leads to {name}"),
        };
        let never: Vec<_> =
            active(place).into_iter().filter(|name| !ever_active.contains(name)).collect();
        match never.as_slice() {
            [] => {}
            [only] => message += &format!(", so {only} is never active"),
            some => message += &format!(", so {} are never active", some.join(" and ")),
        }
        let finding = Finding::new(Code::UnreachablePlace, &place.name.at, message);
        let remedy = "add a transition to it, or remove it";
        findings.push(finding.remedy(remedy).stops_transition());
    }
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
