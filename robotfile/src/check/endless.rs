//! Circles of transitions that need no time, no report, no guard and nobody's consent: a token that
//! comes there goes round for ever, and the executive gives up and goes to the safe place. What
//! else may take the token, by its priority and a report at the right moment, is not looked at:
//! hence a warning.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use crate::check::listed;
use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::mission::{ArcKind, Autonomy, Class, Mission, Transition};

/// Transitions of a circle that are shown beside its first one.
const MAX_SHOWN: usize = 8;

pub(super) fn check(mission: &Mission, findings: &mut Findings) {
    let next = next(mission);
    let mut seen = BTreeMap::new();
    for start in next.keys().copied() {
        let mut way = Vec::new();
        let mut here = start;
        while let Some(&(to, transition)) = next.get(here).filter(|_| !seen.contains_key(here)) {
            seen.insert(here, start);
            way.push((here, transition));
            here = to;
        }
        // Where the way comes back to itself, and not to an earlier one, a circle closes.
        if let Some(since) = way.iter().position(|(place, _)| *place == here) {
            report(mission, &way[since..], findings);
        }
    }
}

/// Where a token in a place goes at once, and what moves it: of several, the one that goes first.
fn next(mission: &Mission) -> BTreeMap<&str, (&str, &Transition)> {
    let names = |places: &mut dyn Iterator<Item = &'_ crate::mission::Place>| -> BTreeSet<String> {
        places.map(|place| place.name.value.clone()).collect()
    };
    // To stop and to start a component takes time.
    let slow = names(&mut mission.places.iter().filter(|place| !place.components.is_empty()));
    let safety = names(&mut mission.places.iter().filter(|place| place.class == Class::Safety));
    let rank = |(to, transition): (&str, &Transition)| {
        (transition.class == Class::Safety || safety.contains(to), transition.priority)
    };
    let mut ways: Vec<_> = mission.transitions.iter().filter_map(moved_at_once).collect();
    // Stable: among equals the first of the file stays the first.
    ways.sort_by_key(|(_, to, transition)| Reverse(rank((to, transition))));
    let mut next = BTreeMap::new();
    for (from, to, transition) in ways {
        next.entry(from).or_insert((to, transition));
    }
    next.retain(|from, (to, _)| !slow.contains(*from) && !slow.contains(*to));
    next
}

/// The places between which the transition moves a token as soon as it is there, if it wants
/// nothing else.
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

fn report(mission: &Mission, circle: &[(&str, &Transition)], findings: &mut Findings) {
    let first = (0..circle.len()).min_by_key(|at| circle[*at].1.name.at.span).unwrap_or_default();
    let (before, after) = circle.split_at(first);
    let mut round = after.iter().chain(before);
    let Some((_, first)) = round.next() else { return };
    let is_marked =
        |name: &str| mission.places.iter().any(|p| p.initial > 0 && p.name.value == name);
    let when = match circle.iter().any(|(place, _)| is_marked(place)) {
        true => "from the start on",
        false => "once a token comes there",
    };
    let names = std::iter::once(*first).chain(round.clone().map(|(_, transition)| *transition));
    let names = listed(names.map(|transition| transition.name.value.as_str()));
    let message = format!("{when}, the mission would fire without end: {names}");
    let mut finding = Finding::new(Code::EndlessLoop, &first.name.at, message)
        .remedy("let one of them wait for something: after=\"1s\", on=\"…\" or when=\"…\"");
    for (_, transition) in round.take(MAX_SHOWN) {
        finding = finding.related(&transition.name.at, "then this one");
    }
    findings.push(finding);
}
