//! Checks of a single transition: conditions that exclude each other, dates, and times that the
//! mission's period cannot keep.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::check::exits;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Autonomy, LostLink, Mission, Place, Transition};
use crate::source::Spanned;

/// A component that is activated has not yet acted after this time: its start alone is a message to
/// its process, a call, and a message back.
const SHORTEST_TIME: Duration = Duration::from_millis(10);

/// Checks the transitions of a mission; `period` is that of the main mission, in which it is played.
pub(super) fn check(
    mission: &Mission,
    period: Option<&Spanned<Duration>>,
    findings: &mut Findings,
) {
    let with_components = mission.places.iter().filter(|place| !place.components.is_empty());
    let safe_places: BTreeMap<&str, &Place> =
        with_components.map(|place| (place.name.value.as_str(), place)).collect();
    for place in safe_places.values().filter(|place| place.initial > 1) {
        let remedy = "write initial=\"true\"; to count tokens, use a place without components";
        too_many_tokens(&place.name, place, remedy, findings);
    }
    exits::check(mission, &safe_places, findings);
    for transition in &mission.transitions {
        let before = findings.total();
        for arc in &transition.arcs {
            let place = safe_places.get(arc.place.value.as_str());
            match (arc.kind, place) {
                (ArcKind::Put, Some(place)) if arc.weight > 1 => {
                    let remedy =
                        "remove the weight; to count tokens, use a place without components";
                    too_many_tokens(&arc.place, place, remedy, findings);
                }
                (ArcKind::Take | ArcKind::Read, Some(_)) if arc.weight > 1 => {
                    let why = format!(
                        "{} activates components, so it never has {} tokens",
                        arc.place.value, arc.weight
                    );
                    let remedy =
                        "remove the weight; to count tokens, use a place without components";
                    report_never(transition, &arc.place, &why, remedy, findings);
                }
                _ => {}
            }
        }
        excluded_by_itself(transition, findings);
        check_dates(transition, findings);
        shorter_than_period(transition, period, findings);
        too_short(transition, findings);
        report_latest_of_operator(transition, findings);
        if mission.lacks_input(transition)
            && !transition.is_doubtful
            && !mission.is_meant_exit(transition)
        {
            report_missing_input(transition, findings);
        }
        let is_active = |place: &str| safe_places.contains_key(place);
        // One that cannot fire at all takes no token.
        let is_sound = findings.total() == before && !transition.is_doubtful;
        let leads_on = |place: &str| leads_on_from(mission, place);
        if let Some(from) = lost_token(transition, is_active, leads_on).filter(|_| is_sound) {
            report_missing_output(transition, from, findings);
        }
    }
}

fn too_many_tokens(at: &Spanned<String>, place: &Place, remedy: &str, findings: &mut Findings) {
    let message = format!("{} activates components, so it has one token at most", place.name.value);
    findings.push(Finding::new(Code::TooManyTokens, &at.at, message).remedy(remedy));
}

fn report_never(
    transition: &Transition,
    at: &Spanned<String>,
    why: &str,
    remedy: &str,
    findings: &mut Findings,
) {
    let message = format!("{} can never fire: {why}", transition.name.value);
    let finding = Finding::new(Code::NeverFires, &at.at, message);
    findings.push(finding.remedy(remedy).stops_transition());
}

/// Reports a transition that requires tokens in a place, and at the same time fewer of them.
fn excluded_by_itself(transition: &Transition, findings: &mut Findings) {
    for inhibitor in transition.arcs.iter().filter(|arc| arc.kind == ArcKind::Inhibitor) {
        let wanted = transition.arcs.iter().filter(|arc| {
            matches!(arc.kind, ArcKind::Take | ArcKind::Read)
                && arc.place.value == inhibitor.place.value
        });
        if wanted.map(|arc| arc.weight).max().is_some_and(|wanted| wanted >= inhibitor.weight) {
            let place = &inhibitor.place.value;
            let why = match inhibitor.weight {
                1 => format!("it requires {place} to be both marked and empty"),
                n => format!("it requires {n} or more tokens in {place}, and fewer than {n}"),
            };
            let remedy = "change one of the two conditions, or remove the transition";
            report_never(transition, &inhibitor.place, &why, remedy, findings);
        }
    }
}

/// A transition without `from` was probably meant to start in some place.
fn report_missing_input(transition: &Transition, findings: &mut Findings) {
    let name = &transition.name;
    let message = format!(
        "{} takes tokens from no place, so it can fire at any time, again and again",
        name.value
    );
    let finding = Finding::new(Code::NoInput, &name.at, message);
    findings.push(finding.remedy(
        "write from=\"…\"; to end the mission from every place, write class=\"safety\" and lead it to \
         the safe place or the goal",
    ));
}

/// Returns the place from which the transition takes the token, if it puts none: a place with
/// components, or one of which it limits the time and which another transition leads on from.
fn lost_token(
    transition: &Transition,
    is_active: impl Fn(&str) -> bool,
    leads_on: impl Fn(&str) -> bool,
) -> Option<&str> {
    if transition.outputs().next().is_some() {
        return None;
    }
    let has_latest = transition.interval.as_ref().is_some_and(|it| it.latest.is_some());
    let is_time_out = has_latest && transition.sets.is_empty();
    let mut inputs = transition.inputs().map(|arc| arc.place.value.as_str());
    inputs.find(|place| is_active(place) || (is_time_out && leads_on(place)))
}

/// Returns whether a transition moves the only token of the place to another place.
fn leads_on_from(mission: &Mission, place: &str) -> bool {
    let has_one = mission.place(place).is_some_and(|it| it.initial <= 1);
    let moves = |it: &Transition| {
        it.arcs.iter().all(|arc| arc.weight == 1)
            && it.inputs().any(|arc| arc.place.value == place)
            && it.outputs().any(|arc| arc.place.value != place)
    };
    has_one && mission.transitions.iter().any(moves)
}

/// A transition without `to` was probably meant to lead to some place.
fn report_missing_output(transition: &Transition, from: &str, findings: &mut Findings) {
    let name = &transition.name;
    let message = format!(
        "{} takes the token from {from} and puts it into no place: the mission does not continue there",
        name.value
    );
    let finding = Finding::new(Code::NoOutput, &name.at, message);
    let remedy =
        "write to=\"…\"; where a branch of the mission ends, let it lead to a place of its own";
    findings.push(finding.remedy(remedy).stops_transition());
}

/// A latest time in which no component can do anything.
fn too_short(transition: &Transition, findings: &mut Findings) {
    let Some(interval) = &transition.interval else { return };
    let Some(latest) = interval.value.latest.filter(|latest| *latest < SHORTEST_TIME) else {
        return;
    };
    let (name, text) = (&transition.name.value, interval.at.text());
    let (message, remedy) = if latest.is_zero() {
        let message = format!("`{text}` is no time: {name} fires as soon as it is enabled");
        (message, "write a longer time, or remove it: without a time it fires immediately too")
    } else {
        let message = format!("`{text}` is too short: {name} fires before a component can act");
        (message, "write a longer time, such as 1s")
    };
    findings.push(Finding::new(Code::TimeTooShort, &interval.at, message).remedy(remedy));
}

fn check_dates(transition: &Transition, findings: &mut Findings) {
    let (Some(from), Some(to)) = (&transition.not_before, &transition.not_after) else { return };
    if from.value >= to.value {
        let message = format!(
            "{} can never fire: {} (not-before) is not earlier than {} (not-after)",
            transition.name.value,
            from.at.text(),
            to.at.text()
        );
        let finding = Finding::new(Code::DatesCrossed, &to.at, message);
        findings.push(
            finding
                .remedy("swap the two dates, or correct one")
                .related(&from.at, "not before this"),
        );
    }
}

/// With a period the net is examined only at that interval, so a shorter time is missed.
/// An operator's transition has no latest moment: what `timeout` or `interval` states for it has no
/// effect.
fn report_latest_of_operator(transition: &Transition, findings: &mut Findings) {
    let Some(interval) = &transition.interval else { return };
    if transition.autonomy != Autonomy::Operator
        || interval.value.latest.is_none()
        || transition.lost_link.as_ref().is_some_and(|it| it.value == LostLink::Fire)
    {
        return;
    }
    let message = format!(
        "this latest time has no effect: {} fires only when the operator decides, after {:?} at the \
         earliest",
        transition.name.value, interval.value.earliest
    );
    let finding = Finding::new(Code::NoEffect, &interval.at, message);
    findings.push(finding.remedy(
        "write after=\"…\" for the earliest time; for a time out, add a transition of its own",
    ));
}

fn shorter_than_period(
    transition: &Transition,
    period: Option<&Spanned<Duration>>,
    findings: &mut Findings,
) {
    let (Some(period), Some(interval)) = (period, &transition.interval) else { return };
    let Some(latest) = interval.latest.filter(|latest| !latest.is_zero()) else { return };
    if latest < period.value {
        let message = format!(
            "{} is shorter than the mission's period, {}: {} fires too late",
            interval.at.text(),
            period.at.text(),
            transition.name.value
        );
        let finding = Finding::new(Code::ShorterThanPeriod, &interval.at, message);
        let remedy = "write a shorter period, or none: without one the mission acts immediately";
        findings.push(finding.remedy(remedy).related(&period.at, "the period"));
    }
}
