//! Places that nothing leads to because a transition or a sub-mission leads elsewhere, or lost one of the
//! places that it leads to: where a later transition joins the token from there with another one, the
//! place that was meant is known.

use std::collections::BTreeSet;

use crate::check::reach::find_reached;
use crate::mission::{ArcKind, Class, Mission, Submission, Transition};

/// What to write so that the mission leads to `place`, which nothing leads to; `whole` is the mission with
/// its sub-missions, and `reached` its places that are reached.
pub(super) fn advise(
    mission: &Mission,
    whole: &Mission,
    place: &str,
    reached: &BTreeSet<&str>,
) -> Option<String> {
    if is_fed(mission, place, None) {
        return None;
    }
    advise_exit(mission, place)
        .or_else(|| advise_fork(mission, whole, place, reached))
        .or_else(|| advise_end(mission, place, reached))
}

/// A transition leads to where a sub-mission leaves to, in place of where it begins.
pub(super) fn advise_entrance(mission: &Mission, place: &str) -> Option<String> {
    let is_it = |it: &&Submission| it.enter.as_ref().is_some_and(|enter| enter.value == place);
    let submission = mission.submissions.iter().find(is_it)?;
    let leave = &submission.leave.as_ref()?.value;
    let mut leading = mission.transitions.iter().filter(|it| leads_to(it, leave));
    let (Some(only), None) = (leading.next(), leading.next()) else { return None };
    (takes(mission, leave).next().is_some() && only.inputs().next().is_some()).then(|| {
        format!(
            "did you mean to=\"{place}\" in {}? {} begins in {place} and leaves to {leave}",
            only.name.value, submission.file.value
        )
    })
}

/// A sub-mission leaves to a place that something else leads to as well.
fn advise_exit(mission: &Mission, place: &str) -> Option<String> {
    if !is_needed_without_components(mission, place) {
        return None;
    }
    let is_it = |it: &&Submission| {
        let leave = it.leave.as_ref();
        leave.is_some_and(|leave| is_fed(mission, &leave.value, Some(it)))
    };
    let mut doubtful = mission.submissions.iter().filter(is_it);
    let (Some(only), None) = (doubtful.next(), doubtful.next()) else { return None };
    Some(format!("did you mean out=\"{place}\" for {}?", only.file.value))
}

/// A later transition takes a token that follows from the place together with another one, so a
/// transition was to lead to both.
fn advise_fork(
    mission: &Mission,
    whole: &Mission,
    place: &str,
    reached: &BTreeSet<&str>,
) -> Option<String> {
    let follows = find_reached(whole, &[place], None);
    let mut forks = mission
        .transitions
        .iter()
        .filter(|it| it.inputs().next().is_some() && it.outputs().count() > it.inputs().count());
    // Without any fork, no two tokens can be joined.
    let is_one_token = forks.clone().next().is_none();
    let joins = |it: &&Transition| {
        let has = |is_one: &dyn Fn(&str) -> bool| it.inputs().any(|arc| is_one(&arc.place.value));
        it.inputs().count() > 1
            && has(&|name| !reached.contains(name) && follows.contains(name))
            && (is_one_token || has(&|name| reached.contains(name)))
            && !has(&|name| !follows.contains(name))
    };
    let join = mission.transitions.iter().find(joins)?;
    let fork = match (forks.next(), forks.next()) {
        (None, _) => find_first(mission)?,
        (Some(only), None) => only,
        _ => return None,
    };
    let outputs: Vec<_> = fork.outputs().map(|arc| arc.place.value.as_str()).collect();
    // A fork leads to this place in place of one to which another transition leads.
    let is_other = |name: &str| {
        let mut others = mission.transitions.iter().filter(|it| it.name.value != fork.name.value);
        others.any(|it| leads_to(it, name))
    };
    let to = match outputs.as_slice() {
        [only] => format!("{only} {place}"),
        [first, second] => match [is_other(first), is_other(second)] {
            [false, true] => format!("{first} {place}"),
            [true, false] => format!("{place} {second}"),
            _ => return None,
        },
        _ => return None,
    };
    Some(format!(
        "did you mean to=\"{to}\" in {}? {} needs a token that comes from {place}, and another one",
        fork.name.value, join.name.value
    ))
}

/// The only transition by which the mission leaves its initial place, apart from those to its safe place.
fn find_first(mission: &Mission) -> Option<&Transition> {
    let mut initial = mission.places.iter().filter(|place| place.initial > 0);
    let (Some(only), None) = (initial.next(), initial.next()) else { return None };
    let is_safe =
        |it: &Transition| mission.safe.as_ref().is_some_and(|it2| leads_to(it, &it2.value));
    let mut leaving = takes(mission, &only.name.value)
        .filter(|it| it.class == Class::Normal && !is_safe(it) && !it.is_on_failure());
    let (first, None) = (leaving.next()?, leaving.next()) else { return None };
    Some(first)
}

/// The mission stops in the only place that nothing leads on from.
fn advise_end(mission: &Mission, place: &str, reached: &BTreeSet<&str>) -> Option<String> {
    if !is_needed_without_components(mission, place) {
        return None;
    }
    let ends = || mission.goal.iter().chain(&mission.safe);
    let mut stops = mission.places.iter().filter(|it| {
        let name = it.name.value.as_str();
        reached.contains(name)
            && !mission.leads_on_from(name)
            && !ends().any(|end| end.value == name)
    });
    let (Some(only), None) = (stops.next(), stops.next()) else { return None };
    let from = &only.name.value;
    Some(format!(
        "nothing leads on from {from}: add <transition from=\"{from}\" to=\"{place}\">, or <submission \
         in=\"{from}\" out=\"{place}\">"
    ))
}

/// Whether a transition takes a token from a place in which no component works, so that the mission does
/// not begin there.
fn is_needed_without_components(mission: &Mission, place: &str) -> bool {
    let works = mission.place(place).is_none_or(|it| !it.components.is_empty());
    !works && takes(mission, place).next().is_some()
}

fn takes<'a>(mission: &'a Mission, place: &str) -> impl Iterator<Item = &'a Transition> {
    let place = place.to_owned();
    mission.transitions.iter().filter(move |it| {
        let mut needed = it.arcs.iter().filter(|arc| arc.kind == ArcKind::Take);
        needed.any(|arc| arc.place.value == place)
    })
}

fn leads_to(transition: &Transition, place: &str) -> bool {
    transition.outputs().any(|arc| arc.place.value == place)
}

/// Whether anything but `without` puts tokens into the place.
fn is_fed(mission: &Mission, place: &str, without: Option<&Submission>) -> bool {
    let is_other = |it: &&Submission| !without.is_some_and(|without| std::ptr::eq(*it, without));
    let left = mission.submissions.iter().filter(is_other).filter_map(|it| it.leave.as_ref());
    let failed = mission.places.iter().filter_map(|it| it.on_failure.as_ref());
    mission.transitions.iter().any(|it| leads_to(it, place))
        || left.chain(failed).any(|it| it.value == place)
}
