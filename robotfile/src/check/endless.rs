//! Circles of transitions without time, report, guard and operator: a token that arrives there
//! would move forever, so the executive goes to the safe place. The check ignores other transitions
//! that may take the token by their priority and a report at the right moment, so the finding is a
//! warning.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::Duration;

use crate::check::graph::CheckGraph;
use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Autonomy, Class, Mission, Place, Transition};

/// The transitions of a circle that are shown in addition to its first one.
const MAX_SHOWN: usize = 8;

pub(super) fn check(mission: &Mission, findings: &mut Findings) {
    let places: BTreeMap<&str, &Place> =
        mission.places.iter().map(|place| (place.name.value.as_str(), place)).collect();
    let moves = find_immediate_moves(mission, &places);
    let edges = moves.iter().map(|(from, (to, transition))| (*from, *to, (*from, *transition)));
    for circle in CheckGraph::new(places.keys().copied(), edges).find_circles(usize::MAX) {
        report_circle(mission, &circle, findings);
    }
}

/// Returns for each place where a token moves immediately, and the transition that moves it: of
/// several transitions, the one that fires first.
fn find_immediate_moves<'a>(
    mission: &'a Mission,
    places: &BTreeMap<&str, &Place>,
) -> BTreeMap<&'a str, (&'a str, &'a Transition)> {
    let place_is = |name: &str, is: fn(&Place) -> bool| places.get(name).is_some_and(|it| is(it));
    let is_safety = |name: &str| place_is(name, |place| place.class == Class::Safety);
    // To stop and to start a component takes time.
    let takes_time = |name: &str| place_is(name, |place| !place.components.is_empty());
    let rank = |to: &str, transition: &Transition| {
        (transition.class == Class::Safety || is_safety(to), transition.priority)
    };
    let mut moves: Vec<_> = mission.transitions.iter().filter_map(moved_at_once).collect();
    // A stable sort: among equals the first of the file stays the first.
    moves.sort_by_key(|(_, to, transition)| Reverse(rank(to, transition)));
    let mut first = BTreeMap::new();
    for (from, to, transition) in moves {
        first.entry(from).or_insert((to, transition));
    }
    first.retain(|from, (to, _)| !takes_time(from) && !takes_time(to));
    first
}

/// Returns the places between which the transition moves a token as soon as it arrives, if it has
/// no other condition.
fn moved_at_once(transition: &Transition) -> Option<(&str, &str, &Transition)> {
    let interval = transition.interval.as_ref();
    let is_timed = interval.is_some_and(|interval| interval.value.latest != Some(Duration::ZERO));
    let is_gated = transition.on.is_some()
        || transition.when.is_some()
        || transition.autonomy != Autonomy::Auto
        || transition.not_before.is_some()
        || transition.not_after.is_some();
    if is_timed || is_gated || transition.is_doubtful {
        return None;
    }
    let mut wanted = transition.arcs.iter().filter(|arc| arc.kind != ArcKind::Put);
    let (Some(taken), None) = (wanted.next(), wanted.next()) else { return None };
    let put = transition.outputs().next()?;
    let is_single = taken.kind == ArcKind::Take && taken.weight == 1;
    is_single.then_some((&taken.place.value, &put.place.value, transition))
}

fn report_circle(mission: &Mission, circle: &[(&str, &Transition)], findings: &mut Findings) {
    let first = (0..circle.len()).min_by_key(|at| circle[*at].1.name.at.span).unwrap_or_default();
    let (before, after) = circle.split_at(first);
    let mut round = after.iter().chain(before);
    let Some((_, first)) = round.next() else { return };
    let is_marked =
        |name: &str| mission.places.iter().any(|p| p.initial > 0 && p.name.value == name);
    let when = match circle.iter().any(|(place, _)| is_marked(place)) {
        true => "from the start",
        false => "once a token arrives there",
    };
    if let [(place, only)] = circle {
        let name = &only.name.value;
        let message = format!("{name} puts the token back into {place}, so it would fire forever");
        let remedy = "write the place that it leads to: to=\"…\"; or make it wait for something: \
                      after=\"1s\", on=\"…\" or when=\"…\"";
        let finding = Finding::new(Code::EndlessLoop, &only.name.at, message).remedy(remedy);
        findings.push(finding.stops_transition());
        return;
    }
    let names = std::iter::once(*first).chain(round.clone().map(|(_, transition)| *transition));
    let names = listed(names.map(|transition| transition.name.value.as_str()));
    let message = format!("{when}, the mission would fire forever: {names}");
    let mut finding = Finding::new(Code::EndlessLoop, &first.name.at, message)
        .remedy("make one of them wait for something: after=\"1s\", on=\"…\" or when=\"…\"");
    for (_, transition) in round.take(MAX_SHOWN) {
        finding = finding.related(&transition.name.at, "then this one");
    }
    findings.push(finding);
}
