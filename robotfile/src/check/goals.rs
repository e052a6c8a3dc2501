//! Missions whose paths to the goal are certainly not what was meant: only failures lead there, or the
//! goal and the safe place are exchanged.

use std::collections::BTreeSet;

use crate::check::names::listed;
use crate::check::reach::{find_reached, find_reached_without_failures};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Class, Mission, Place, Transition};
use crate::source::{Location, Spanned};

/// Checks a mission; `whole` is the mission with its sub-missions.
///
/// `is_never_done` states whether a component certainly never reports that it is done.
pub(super) fn check(
    mission: &Mission,
    whole: &Mission,
    is_main: bool,
    is_never_done: &dyn Fn(&str) -> bool,
    findings: &mut Findings,
) {
    check_exchanged(mission, findings);
    check_safe_left(mission, findings);
    let is_reported = check_goal_left(mission, is_main, findings);
    if !is_main {
        if !is_reported {
            check_inner_goal_left(mission, findings);
        }
        check_one_end(mission, findings);
    }
    check_failures(mission, whole, is_never_done, findings);
    if is_main {
        check_refuges(mission, findings);
        check_left_tokens(mission, findings);
    }
}

/// A failure that leads to the goal, although the mission has a safe place: it ends as if it had succeeded.
fn check_refuges(mission: &Mission, findings: &mut Findings) {
    let (Some(goal), Some(safe)) = (&mission.goal, &mission.safe) else { return };
    let is_known = findings
        .iter()
        .any(|it| matches!(it.code, Code::GoalByFailure | Code::GoalExchanged | Code::NeverFires));
    if is_known || goal.value == safe.value {
        return;
    }
    for place in mission.places.iter().filter(|place| !place.components.is_empty()) {
        let Some(refuge) = place.on_failure.as_ref().filter(|it| it.value == goal.value) else {
            continue;
        };
        let message = format!(
            "after a failure in {}, the mission ends in its goal {}, as if it had succeeded",
            place.name.value, goal.value
        );
        let finding = Finding::new(Code::FailsToItself, &refuge.at, message);
        findings.push(finding.remedy(
            "name a place from which the mission can still succeed, or remove on-failure: then the \
             mission goes to its safe place",
        ));
    }
}

/// With several tokens, one that no transition takes any more was perhaps to be joined with another.
fn check_left_tokens(mission: &Mission, findings: &mut Findings) {
    let initial: u32 = mission.places.iter().map(|place| place.initial).sum();
    let forks = |transition: &Transition| {
        transition.inputs().next().is_some()
            && transition.outputs().count() > transition.inputs().count()
    };
    let Some(goal) = &mission.goal else { return };
    if initial < 2 && !mission.transitions.iter().any(forks) {
        return;
    }
    let arcs = mission.transitions.iter().flat_map(|transition| &transition.arcs);
    let used = arcs.filter(|arc| arc.kind != ArcKind::Put).map(|arc| &arc.place);
    let entered = mission.submissions.iter().filter_map(|inner| inner.enter.as_ref());
    let ends = mission.safe.iter().chain([goal]);
    let used: BTreeSet<&str> =
        used.chain(entered).chain(ends).map(|place| place.value.as_str()).collect();
    let left = mission.transitions.iter().flat_map(|transition| transition.outputs());
    let left: BTreeSet<&str> = left.map(|arc| arc.place.value.as_str()).collect();
    let is_left = |place: &&Place| {
        let name = place.name.value.as_str();
        place.components.is_empty() && left.contains(name) && !used.contains(name)
    };
    for place in mission.places.iter().filter(is_left) {
        let name = &place.name.value;
        let message = format!(
            "no transition takes the token from {name}, so the mission does not wait for it at its \
             goal"
        );
        let finding = Finding::new(Code::StaysThere, &place.name.at, message);
        findings.push(finding.remedy(format!(
            "name {name} in the from=\"…\" of the transition that joins the tokens, or ignore this \
             note"
        )));
    }
}

/// The goal is reached if a component fails, and not otherwise.
fn check_failures(
    mission: &Mission,
    whole: &Mission,
    is_never_done: &dyn Fn(&str) -> bool,
    findings: &mut Findings,
) {
    let Some(goal) = &mission.goal else { return };
    let is_reached = |reached: &BTreeSet<&str>| reached.contains(goal.value.as_str());
    let reached = find_reached_without_failures(whole);
    // Those findings explain it already.
    let explains =
        |code| matches!(code, Code::UnreachablePlace | Code::DoneUnused | Code::GoalExchanged);
    let is_known = findings.iter().any(|it| explains(it.code));
    if is_known || is_reached(&reached) || !is_reached(&find_reached(whole, &[], None)) {
        return;
    }
    // From the goal back to a place to which nothing but a failure leads.
    let mut place = goal.value.as_str();
    let mut seen = BTreeSet::new();
    let mut on_failure = None;
    while seen.insert(place) {
        let mut leading = whole.transitions.iter().filter(|transition| leads_to(transition, place));
        let Some(transition) = leading.next() else { break };
        if transition.is_on_failure() {
            on_failure = transition.on.as_ref().map(|on| (transition, on));
            break;
        }
        let mut needed = transition.inputs().map(|arc| arc.place.value.as_str());
        match needed.find(|needed| !reached.contains(needed)) {
            Some(missing) => place = missing,
            None => break,
        }
    }
    if let Some((transition, on)) = on_failure {
        let name = &transition.name;
        // In a mission and its sub-mission it is one mistake.
        let is_same = |it: &Finding| {
            it.code == Code::GoalByFailure
                && it.at.as_ref().is_some_and(|at| at.is_at(&on.event.at))
        };
        if findings.iter().any(is_same) {
            return;
        }
        let message = format!(
            "the goal {} is reached only if a component fails: {} waits for {}.failed",
            goal.value, name.value, on.component.value
        );
        let inputs = transition.inputs().filter_map(|arc| whole.place(&arc.place.value));
        let active = inputs.flat_map(|it| &it.components).map(|it| it.value.as_str());
        let mut candidates = std::iter::once(on.component.value.as_str()).chain(active);
        let guess = candidates.find(|it| !is_never_done(it));
        let guess = guess.map(|it| format!("did you mean on=\"{it}.done\"? Otherwise "));
        let finding = Finding::new(Code::GoalByFailure, &on.event.at, message);
        findings.push(finding.remedy(format!(
            "{}add a transition that leads to {place} when all goes well",
            guess.unwrap_or_default()
        )));
        return;
    }
    let Some(place) = mission.place(place) else { return };
    let message = format!(
        "the goal {} is reached only if a component fails: no transition leads to {}",
        goal.value, place.name.value
    );
    let finding = Finding::new(Code::GoalByFailure, &place.name.at, message);
    findings.push(finding.remedy("add the transition that leads to it when all goes well"));
}

fn leads_to(transition: &Transition, place: &str) -> bool {
    transition.outputs().any(|arc| arc.place.value == place)
}

/// Reports that something is done lead to the safe place, and only timeouts and failures to the goal.
fn check_exchanged(mission: &Mission, findings: &mut Findings) {
    let (Some(goal), Some(safe)) = (&mission.goal, &mission.safe) else { return };
    let entering = |place: &str| {
        let place = place.to_owned();
        mission.transitions.iter().filter(move |transition| leads_to(transition, &place))
    };
    let is_by = |transition: &Transition, event: &str| {
        transition.on.as_ref().is_some_and(|on| on.event.value == event)
    };
    let has_others = |transition: &Transition| {
        let from: Vec<_> = transition.inputs().map(|arc| arc.place.value.as_str()).collect();
        let shares = |it: &&Transition| it.inputs().any(|arc| from.contains(&&*arc.place.value));
        mission.transitions.iter().filter(shares).count() > 1
    };
    let is_exit = |transition: &Transition| {
        let is_emergency = transition.class == Class::Safety && !is_by(transition, "done");
        let is_timeout = transition.on.is_none()
            && transition.when.is_none()
            && transition.not_before.is_none()
            && transition.interval.as_ref().is_some_and(|it| !it.value.earliest.is_zero());
        is_emergency || (is_timeout && has_others(transition)) || transition.is_on_failure()
    };
    // A transition that is the only one from its place belongs to what leads to that place.
    let is_after_done = |transition: &Transition| {
        let mut before = transition.inputs().flat_map(|arc| entering(&arc.place.value));
        let mut left = mission.submissions.iter().filter_map(|inner| inner.leave.as_ref());
        let is_after_inner =
            left.any(|leave| transition.inputs().any(|arc| arc.place.value == leave.value));
        let is_after = is_after_inner || before.any(|it| is_by(it, "done"));
        is_by(transition, "done") || (!has_others(transition) && is_after)
    };
    let remedy = format!("did you mean goal=\"{}\" safe=\"{}\"?", safe.value, goal.value);
    let find_safety = |name: &str| mission.place(name).filter(|it| it.class == Class::Safety);
    if let (Some(place), None) = (find_safety(&goal.value), find_safety(&safe.value)) {
        let message = format!(
            "the goal {} has class=\"safety\", and the safe place {} has not",
            goal.value, safe.value
        );
        let finding = Finding::new(Code::GoalExchanged, &goal.at, message).remedy(remedy);
        findings.push(finding.related(&place.name.at, "this place"));
        return;
    }
    // Another report of a component whose end leads elsewhere from the same place.
    let is_other_end = |transition: &Transition| {
        let Some(on) = &transition.on else { return false };
        let mut rivals = mission.transitions.iter().filter(|it| is_by(it, "done"));
        !is_by(transition, "done")
            && transition.when.is_none()
            && rivals.any(|it| {
                let shares = |arc: &crate::mission::Arc| {
                    transition.inputs().any(|own| own.place.value == arc.place.value)
                };
                it.on.as_ref().is_some_and(|done| done.component.value == on.component.value)
                    && it.inputs().any(shares)
            })
    };
    let to_goal: Vec<_> = entering(&goal.value).collect();
    let is_bad_end = |it: &Transition| is_exit(it) || is_other_end(it);
    let mut exits = to_goal.iter().copied();
    if !exits.any(is_exit) || !to_goal.iter().copied().all(is_bad_end) {
        return;
    }
    // A sub-mission that is done leads to the goal, and nothing leads on from one that is meant as goal.
    let mut left = mission.submissions.iter().filter_map(|inner| inner.leave.as_ref());
    if left.any(|leave| leave.value == goal.value) || mission.leads_on_from(&safe.value) {
        return;
    }
    // Where a failure leads to the goal, any report or guard that leads to the safe place is a success.
    // So is the only one after something is done, where the goal is reached if that is not done in time.
    // Other timeouts may be the plan: a patrol until its time is over, unless the battery is low.
    let is_failed = to_goal.iter().any(|it| it.is_on_failure());
    let from_same = |one: &Transition, other: &Transition| {
        one.inputs().any(|arc| other.inputs().any(|it| it.place.value == arc.place.value))
    };
    let mut done = mission.transitions.iter().filter(|it| is_by(it, "done"));
    let is_late = done.any(|it| to_goal.iter().any(|late| from_same(it, late)));
    let is_only_after_done = |transition: &Transition| {
        let mut rivals = mission.transitions.iter().filter(|it| from_same(it, transition));
        let mut before = transition.inputs().flat_map(|arc| entering(&arc.place.value));
        before.any(|it| is_by(it, "done"))
            && rivals.all(|it| it.name.value == transition.name.value || is_exit(it))
    };
    let is_success = |transition: &Transition| {
        let waits = transition.on.is_some() || transition.when.is_some();
        is_after_done(transition)
            || (is_failed && waits && !is_exit(transition))
            || (is_late && is_only_after_done(transition))
    };
    if let Some(done) = entering(&safe.value).find(|transition| is_success(transition)) {
        let done = &done.name;
        // A failure that leads to the real safe place is as it should be.
        let is_of_exit = |at: &Location| {
            to_goal.iter().filter_map(|it| it.on.as_ref()).any(|on| on.event.at.is_at(at))
        };
        findings
            .retain(|it| it.code != Code::DoneUnused || !it.at.as_ref().is_some_and(is_of_exit));
        let ends = if to_goal.iter().copied().all(is_exit) {
            "timeouts and failures"
        } else {
            "timeouts, failures and other reports than done"
        };
        let message = format!(
            "only {ends} lead to the goal {}, and {} leads to the safe place {}",
            goal.value, done.value, safe.value
        );
        let finding = Finding::new(Code::GoalExchanged, &goal.at, message);
        findings.push(finding.remedy(remedy).related(&done.at, "this transition"));
    }
}

/// A sub-mission whose goal is its safe place too, so that the mission which includes it goes to its own
/// safe place or on, whichever is first, although another place without a way out seems to be the safe one.
fn check_one_end(mission: &Mission, findings: &mut Findings) {
    let (Some(goal), Some(safe)) = (&mission.goal, &mission.safe) else { return };
    let Some(end) = mission.find_unnamed_end().filter(|_| goal.value == safe.value) else { return };
    let message = format!("{} is the goal of the sub-mission and its safe place", goal.value);
    let finding = Finding::new(Code::GoalExchanged, &safe.at, message);
    let finding = finding.related(&end.name.at, "nothing leads on from this place");
    findings.push(finding.remedy(format!("did you mean safe=\"{}\"?", end.name.value)));
}

/// The mission leads on from its safe place, where it is over, and another place without a way out,
/// to which an emergency or a timeout leads, seems to be meant.
fn check_safe_left(mission: &Mission, findings: &mut Findings) {
    let (Some(safe), Some(end)) = (&mission.safe, mission.find_unnamed_end()) else { return };
    let name = &end.name.value;
    let is_exit = |it: &Transition| {
        let is_timeout = it.on.is_none() && it.interval.is_some();
        leads_to(it, name) && (it.class == Class::Safety || is_timeout || it.is_on_failure())
    };
    if mission.transitions.iter().any(is_exit) {
        report_left(mission, (safe, "safe"), end, findings);
    }
}

/// The same of the goal, where another place without a way out is led to.
fn check_goal_left(mission: &Mission, is_main: bool, findings: &mut Findings) -> bool {
    let Some(goal) = &mission.goal else { return false };
    // The proof finds that the main mission is over at its start.
    if is_main && mission.place(&goal.value).is_some_and(|place| place.initial > 0) {
        return false;
    }
    let is_safe =
        |place: &Place| mission.safe.as_ref().is_some_and(|safe| safe.value == place.name.value);
    let is_led_to = |name: &str| {
        let mut left = mission.submissions.iter().flat_map(|inner| &inner.leave);
        let regular = |it: &Transition| it.class != Class::Safety && !it.is_on_failure();
        left.any(|leave| leave.value == name)
            || mission.transitions.iter().any(|it| regular(it) && leads_to(it, name))
    };
    let mut ends = mission.places.iter().filter(|place| {
        let name = &place.name.value;
        place.components.is_empty()
            && place.initial == 0
            && !is_safe(place)
            && !mission.leads_on_from(name)
            && is_led_to(name)
    });
    match (ends.next(), ends.next()) {
        (Some(end), None) => report_left(mission, (goal, "goal"), end, findings),
        _ => false,
    }
}

/// Reports that the mission leads on from one of its ends, where `end` is probably meant. Returns whether
/// it does.
fn report_left(
    mission: &Mission,
    (place, role): (&Spanned<String>, &str),
    end: &Place,
    findings: &mut Findings,
) -> bool {
    let name = &place.value;
    let Some((names, verb)) = name_leaving(mission, name) else { return false };
    let noun = if role == "safe" { "safe place" } else { role };
    let message = format!(
        "{names} {verb} on from {name}, the {noun}, and the mission is over when {name} is marked"
    );
    // What the mission would do after that end is over, too.
    let is_cut = |it: &Finding| {
        it.code == Code::EndsTooSoon && it.at.as_ref().is_some_and(|at| at.text() == name)
    };
    findings.retain(|finding| !is_cut(finding));
    let finding = Finding::new(Code::NeverFires, &place.at, message).stops_transition();
    let finding = finding.related(&end.name.at, "nothing leads on from this place");
    findings.push(finding.remedy(format!("did you mean {role}=\"{}\"?", end.name.value)));
    true
}

/// A sub-mission leads on from its goal, where the mission that includes it continues.
fn check_inner_goal_left(mission: &Mission, findings: &mut Findings) {
    let Some(goal) = &mission.goal else { return };
    let Some((names, verb)) = name_leaving(mission, &goal.value) else { return };
    let message = format!(
        "{names} {verb} on from {goal}, the goal, and the mission that includes this one continues \
         when {goal} is marked",
        goal = goal.value
    );
    let finding = Finding::new(Code::NeverFires, &goal.at, message).stops_transition();
    let is_reached = |name: &str| mission.transitions.iter().any(|it| leads_to(it, name));
    let safe = mission.safe.as_ref().map(|safe| safe.value.as_str());
    let mut ends = mission.places.iter().map(|place| &place.name).filter(|name| {
        is_reached(&name.value) && !mission.leads_on_from(&name.value) && safe != Some(&name.value)
    });
    findings.push(match (ends.next(), ends.next()) {
        (Some(end), None) => finding
            .related(&end.at, "nothing leads on from this place")
            .remedy(format!("did you mean goal=\"{}\"?", end.value)),
        _ => finding.remedy("name another place as goal, or remove what leads on from it"),
    });
}

/// Returns the transitions and sub-missions that take a token from a place, and the beginning of what
/// happens to them.
fn name_leaving(mission: &Mission, place: &str) -> Option<(String, &'static str)> {
    let takes = |it: &&Transition| it.inputs().any(|arc| arc.place.value == place);
    let leaving = mission.transitions.iter().filter(takes).map(|it| it.name.value.as_str());
    let entered = mission
        .submissions
        .iter()
        .filter(|inner| inner.enter.as_ref().is_some_and(|enter| enter.value == place));
    let inner: Vec<_> = entered.map(|inner| inner.file.value.as_str()).collect();
    let leaving: Vec<_> = leaving.chain(inner.iter().copied()).collect();
    let (last, others) = leaving.split_last()?;
    Some(match others {
        [] if !inner.is_empty() => ((*last).to_owned(), "never begins: it leads"),
        [] => ((*last).to_owned(), "never fires: it leads"),
        _ => {
            let names = format!("{} and {last}", listed(others.iter().copied()));
            (names, "never fire: they lead")
        }
    })
}
