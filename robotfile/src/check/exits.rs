//! Transitions that leave a place as soon as it is marked, although components are active in it or
//! other transitions wait for a report or an operator: a condition was probably forgotten.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::schema::Scalar;

use crate::check::companions::accompanies;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::Guard;
use crate::mission::{Arc, ArcKind, Autonomy, Class, Interval, Mission, Place, Transition};
use crate::source::Spanned;

/// `active_places` are the places with components.
pub(super) fn check(
    mission: &Mission,
    active_places: &BTreeMap<&str, &Place>,
    findings: &mut Findings,
) {
    let mut waiting: BTreeMap<&str, &Transition> = BTreeMap::new();
    let mut reporting: BTreeMap<&str, &Transition> = BTreeMap::new();
    for transition in &mission.transitions {
        for arc in transition.inputs() {
            let place = arc.place.value.as_str();
            let is_timed = transition.interval.is_some() && active_places.contains_key(place);
            let asks = transition.autonomy != Autonomy::Auto;
            if is_timed || asks || transition.on.is_some() {
                waiting.entry(place).or_insert(transition);
            }
            if transition.on.is_some() && active_places.contains_key(place) {
                reporting.entry(place).or_insert(transition);
            }
        }
    }
    let counters: BTreeSet<_> = mission
        .variables
        .iter()
        .filter(|variable| variable.counts().is_some())
        .map(|variable| variable.name.value.as_str())
        .collect();
    for transition in mission.transitions.iter().filter(|it| is_immediate_emergency(mission, it)) {
        findings.push(report_emergency(transition));
    }
    let delayed = |it: &&Transition| is_emergency(mission, it) && is_delay_alone(it);
    for transition in mission.transitions.iter().filter(delayed) {
        findings.push(report_delayed_emergency(transition));
    }
    for transition in mission.transitions.iter().filter(|it| is_emergency(mission, it)) {
        findings.extend(find_consent(transition));
    }
    for transition in &mission.transitions {
        let inputs: Vec<_> = transition.inputs().collect();
        let [arc] = &inputs[..] else {
            findings.extend(find_hasty_join(mission, transition, &inputs, &reporting));
            continue;
        };
        let place = arc.place.value.as_str();
        let is_plain =
            transition.arcs.iter().all(|it| matches!(it.kind, ArcKind::Take | ArcKind::Put));
        // One that returns the token to its place only sets a variable after a while.
        let returns = transition.outputs().any(|it| it.place.value == place);
        if is_plain && !returns && has_only_delay(transition) {
            let others =
                mission.transitions.iter().filter(|it| it.name.value != transition.name.value);
            let mut rivals = others.filter(|it| it.inputs().any(|arc| arc.place.value == place));
            let rival = rivals.next();
            findings.extend(rival.map(|rival| report_delay(transition, place, rival)));
        }
        if !is_plain || has_moment(transition) {
            continue;
        }
        let Some(when) = &transition.when else {
            findings.extend(waiting.get(place).map(|it| report(transition, place, it)));
            continue;
        };
        let Some(other) = reporting.get(place) else { continue };
        let Ok(guard) = Guard::parse(&when.value) else { continue };
        let names: Vec<_> = guard.names().iter().map(|name| name.as_str()).collect();
        let is_counted = !names.is_empty() && names.iter().all(|name| counters.contains(name));
        if is_counted && keeps_values(mission, place, &names) {
            findings.push(report_decided(transition, &when.value, place, other));
        } else if is_counted && is_true_at_first(mission, place, &guard) {
            findings.push(report_at_first(transition, &when.value, place, other));
        }
    }
}

/// A transition without a condition takes the tokens of a place in which another one waits for a
/// report, and of places that are marked all the time: it joins nothing, and fires immediately.
fn find_hasty_join(
    mission: &Mission,
    transition: &Transition,
    inputs: &[&Arc],
    reporting: &BTreeMap<&str, &Transition>,
) -> Option<Finding> {
    let is_plain = transition
        .arcs
        .iter()
        .all(|it| matches!(it.kind, ArcKind::Take | ArcKind::Put | ArcKind::Reset));
    if !is_plain || has_moment(transition) || transition.when.is_some() {
        return None;
    }
    inputs.iter().find_map(|arc| {
        let place = arc.place.value.as_str();
        let other = reporting.get(place).filter(|it| it.name.value != transition.name.value)?;
        let mut others = inputs.iter().filter(|it| it.place.value != place);
        let is_hasty =
            others.all(|it| it.weight == 1 && accompanies(mission, place, &it.place.value));
        is_hasty.then(|| report(transition, place, other))
    })
}

/// Returns whether it is an emergency exit. One without any place is a finding already.
fn is_emergency(mission: &Mission, transition: &Transition) -> bool {
    let mut arcs = transition.arcs.iter();
    transition.class == Class::Safety
        && !transition.arcs.is_empty()
        && arcs.all(|arc| arc.kind == ArcKind::Put)
        && !mission.lacks_input(transition)
}

/// Returns whether an emergency exit waits for nothing.
fn is_immediate_emergency(mission: &Mission, transition: &Transition) -> bool {
    is_emergency(mission, transition) && !has_moment(transition) && transition.when.is_none()
}

/// An emergency that a person must agree to before it fires. One that fires without an answer gives
/// the person time to prevent it.
fn find_consent(transition: &Transition) -> Option<Finding> {
    let Autonomy::Confirm { fire_unanswered: false, .. } = transition.autonomy else { return None };
    let at = transition.autonomy_at.as_ref().unwrap_or(&transition.name.at);
    let name = &transition.name.value;
    let waits = transition.on.is_some()
        || transition.when.is_some()
        || transition.interval.is_some()
        || transition.not_before.is_some();
    let (message, remedy) = match waits {
        true => (
            format!("the emergency {name} does not fire before the operator has agreed to it"),
            "remove it; or let the emergency fire without an answer: answer-within=\"…\" \
             unanswered=\"fire\"",
        ),
        false => (
            format!(
                "the emergency {name} waits for nothing but the operator's answer, who is asked as \
                 soon as the mission begins"
            ),
            "write operator=\"true\" if the operator fires it, or on=\"…\" or when=\"…\" for what it \
             waits for",
        ),
    };
    Some(Finding::new(Code::EmergencyAsks, at, message).remedy(remedy))
}

fn report_emergency(transition: &Transition) -> Finding {
    let message = format!(
        "{} fires as soon as the mission begins: it takes a token from no place, and waits for nothing",
        transition.name.value
    );
    let remedy = "write operator=\"true\" if the operator fires it, or on=\"…\" or when=\"…\" for what \
                  it waits for";
    let finding = Finding::new(Code::ImmediateExit, &transition.name.at, message);
    finding.remedy(remedy).stops_transition()
}

fn report_delayed_emergency(transition: &Transition) -> Finding {
    let time = transition.interval.as_ref().map_or("", |interval| interval.at.text());
    let message = format!(
        "{} fires `{time}` after the mission begins: it takes a token from no place, and waits for \
         nothing but its earliest time",
        transition.name.value
    );
    let remedy = "write on=\"…\" or when=\"…\" for what it waits for, or operator=\"true\" if the \
                  operator fires it";
    let finding = Finding::new(Code::ImmediateExit, &transition.name.at, message);
    finding.remedy(remedy).stops_transition()
}

/// Returns whether anything but a guard determines when the transition fires.
fn has_moment(transition: &Transition) -> bool {
    transition.on.is_some()
        || transition.interval.is_some()
        || transition.not_before.is_some()
        || transition.not_after.is_some()
        || transition.autonomy != Autonomy::Auto
        || transition.is_doubtful
}

/// Returns whether the variables are set, but only by transitions that enter the place or leave it:
/// as it activates components, it has one token, so their values do not change while it is marked.
fn keeps_values(mission: &Mission, place: &str, names: &[&str]) -> bool {
    let is_named =
        |it: &&Transition| it.sets.iter().any(|set| names.contains(&set.variable.value.as_str()));
    let mut setters = mission.transitions.iter().filter(is_named).peekable();
    let moves_token = |it: &Transition| {
        let takes = it.inputs().any(|arc| arc.place.value == place);
        takes != it.outputs().any(|arc| arc.place.value == place)
    };
    setters.peek().is_some() && setters.all(moves_token)
}

/// Returns whether the guard is true when the place is marked for the first time: its variables have
/// the values with which they begin, because only transitions from the place set them.
fn is_true_at_first(mission: &Mission, place: &str, guard: &Guard) -> bool {
    let sets = |transition: &Transition, name: &str| {
        transition.sets.iter().any(|set| set.variable.value == name)
    };
    let is_set_here = |name: &str| {
        let mut setters = mission.transitions.iter().filter(|it| sets(it, name)).peekable();
        setters.peek().is_some()
            && setters.all(|it| it.inputs().any(|arc| arc.place.value == place))
    };
    let first = |name: &str| {
        let variable = mission.variables.iter().find(|it| it.name.value == name)?;
        Some(Scalar::Number(variable.counts()?.initial as f64))
    };
    let names = || guard.names().iter().map(|name| name.as_str());
    let values: Vec<_> = names().map(first).collect();
    names().all(is_set_here) && guard.holds(&values) == Some(true)
}

fn report(transition: &Transition, place: &str, other: &Transition) -> Finding {
    let message = format!(
        "{} has no condition: it fires as soon as {place} is marked, before {} can",
        transition.name.value, other.name.value
    );
    let remedy = "write on=\"…\", when=\"…\", timeout=\"…\" or operator=\"true\", or remove it";
    let finding = Finding::new(Code::ImmediateExit, &transition.name.at, message);
    finding.remedy(remedy).related(&other.name.at, "this one waits")
}

/// Returns whether the transition of the ordinary class has an earliest time, and nothing that it waits
/// for.
fn has_only_delay(transition: &Transition) -> bool {
    transition.class == Class::Normal && is_delay_alone(transition)
}

fn is_delay_alone(transition: &Transition) -> bool {
    // `interval="[2s,inf)"` states that it has no latest time.
    let is_delay = |it: &Spanned<Interval>| {
        it.value.latest.is_none() && !it.value.earliest.is_zero() && !it.at.text().starts_with('[')
    };
    transition.interval.as_ref().is_some_and(is_delay)
        && transition.on.is_none()
        && transition.when.is_none()
        && transition.not_before.is_none()
        && transition.not_after.is_none()
        && transition.autonomy == Autonomy::Auto
        && !transition.is_doubtful
}

fn report_delay(transition: &Transition, place: &str, other: &Transition) -> Finding {
    let time = transition.interval.as_ref().map_or("", |interval| interval.at.text());
    let message = format!(
        "{} waits for nothing but its earliest time, `{time}` after {place} is marked",
        transition.name.value
    );
    let remedy = format!(
        "write on=\"…\" or when=\"…\" for what it waits for, or timeout=\"{time}\" if it fires after \
         this time in any case"
    );
    let finding = Finding::new(Code::ImmediateExit, &transition.name.at, message);
    finding.remedy(remedy).related(&other.name.at, "this one leads on from the same place")
}

fn report_decided(
    transition: &Transition,
    guard: &str,
    place: &str,
    other: &Transition,
) -> Finding {
    let message = format!(
        "{} waits for nothing: where `{guard}` is true, it fires as soon as {place} is marked, \
         before {} can",
        transition.name.value, other.name.value
    );
    let remedy = format!(
        "write on=\"…\" for the report that it waits for, or decide in a place before {place}, \
         without components"
    );
    let finding = Finding::new(Code::ImmediateExit, &transition.name.at, message);
    finding.remedy(remedy).related(&other.name.at, "this one waits")
}

fn report_at_first(
    transition: &Transition,
    guard: &str,
    place: &str,
    other: &Transition,
) -> Finding {
    let message = format!(
        "{} waits for nothing: `{guard}` is true when {place} is marked for the first time, so it \
         fires immediately, before {} can",
        transition.name.value, other.name.value
    );
    let on = other
        .on
        .as_ref()
        .map_or("…".to_owned(), |on| format!("{}.{}", on.component.value, on.event.value));
    let finding = Finding::new(Code::ImmediateExit, &transition.name.at, message);
    finding
        .remedy(format!("write on=\"{on}\", or the report that it waits for"))
        .related(&other.name.at, "this one waits")
}
