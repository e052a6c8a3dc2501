//! Places that no sequence of transitions leads to, whatever the guards and times: a place counts
//! as reached if a transition puts tokens there whose own places are all reached. (The analysis of
//! the net proves more; this needs no state space.)

use std::collections::{BTreeMap, BTreeSet};

use crate::check::graph::CheckGraph;
use crate::check::lost_outputs;
use crate::code::Code;
use crate::finding::{Finding, MAX_RELATED};
use crate::findings::Findings;
use crate::mission::{ArcKind, Mission, Place, Submission, Transition};
use crate::model::Configuration;
use crate::source::plain_path;

/// The beginning of the message about the goal of a sub-mission.
const NO_GOAL: &str = "the goal can never be reached";
/// Places for which it is found out whether others are reached from them: each costs a pass.
const MAX_BEGINNINGS: usize = 16;

/// `whole` is the mission with its sub-missions. A goal that the main mission cannot reach is a
/// finding of the proof. Returns whether all places are reached.
pub(super) fn check(
    mission: &Mission,
    whole: &Mission,
    is_main: bool,
    findings: &mut Findings,
) -> bool {
    let reached = find_reached(whole, &[], None);
    let is_reached = |place: &&Place| reached.contains(place.name.value.as_str());
    let active =
        |of: &Place| of.components.iter().map(|name| name.value.clone()).collect::<Vec<_>>();
    let ever_active: BTreeSet<_> =
        whole.places.iter().filter(is_reached).flat_map(active).collect();
    let goal = mission.goal.as_ref().map(|goal| goal.value.as_str());
    let targets: BTreeSet<_> = whole.transitions.iter().flat_map(output_places).collect();
    let leads = |name: &str| match targets.contains(name) {
        false => format!("no transition leads to {name}"),
        true => format!("what leads to {name} starts from places that are never reached either"),
    };
    // A transition that leads back to its own place was probably meant to lead to the first place.
    let returning =
        findings.iter().filter(|it| it.code == Code::EndlessLoop && it.stops_transition);
    let mut returning = returning.filter(|it| is_of(mission, it)).count();
    for (number, (place, circle)) in find_first(mission, whole, &reached).into_iter().enumerate() {
        if returning > 0 {
            returning -= 1;
            continue;
        }
        let name = &place.name.value;
        let mut message = match goal.filter(|goal| goal == name) {
            Some(_) if is_main => continue,
            Some(_) => format!("{NO_GOAL}: {}", leads(name)),
            None => leads(name),
        };
        let never: Vec<_> =
            active(place).into_iter().filter(|name| !ever_active.contains(name)).collect();
        match never.as_slice() {
            [] => {}
            [only] => message += &format!(", so {only} is never active"),
            some => message += &format!(", so {} are never active", some.join(" and ")),
        }
        let group: BTreeSet<_> =
            circle.iter().chain([&place]).map(|it| it.name.value.as_str()).collect();
        let mut finding = Finding::new(Code::UnreachablePlace, &place.name.at, message);
        for other in circle.iter().take(MAX_RELATED) {
            finding = finding.related(&other.name.at, "and here");
        }
        let begins = || {
            number < MAX_BEGINNINGS
                && !targets.contains(name.as_str())
                && find_reached(whole, &[name], None).len() > reached.len() + 1
        };
        let advice = lost_outputs::advise_entrance(mission, name)
            .or_else(|| advise_submission(mission, name))
            .or_else(|| lost_outputs::advise(mission, whole, name, &reached));
        let remedy = advice.unwrap_or_else(|| {
            let not_on = find_initial_after(mission, &group);
            match not_on.map(|other| format!(", not on {other},")) {
                None if !begins() => "add a transition to it, or remove it".into(),
                not_on => format!(
                    "write initial=\"true\" on {name}{} if the mission begins in it; otherwise add a \
                     transition to it, or remove it",
                    not_on.unwrap_or_default()
                ),
            }
        });
        findings.push(finding.remedy(remedy).stops_transition());
    }
    whole.places.iter().all(|place| is_reached(&place))
}

/// Returns the only initial place, if only transitions from these places lead to it.
fn find_initial_after<'a>(mission: &'a Mission, places: &BTreeSet<&str>) -> Option<&'a str> {
    let mut initial = mission.places.iter().filter(|it| it.initial > 0);
    let (Some(only), None) = (initial.next(), initial.next()) else { return None };
    let only = only.name.value.as_str();
    let mut leading =
        mission.transitions.iter().filter(|it| output_places(it).any(|it| it == only));
    let from = |it: &Transition| it.inputs().any(|arc| places.contains(arc.place.value.as_str()));
    (leading.clone().next().is_some() && leading.all(from)).then_some(only)
}

/// What to write into a sub-mission that was probably to leave to the place.
fn advise_submission(mission: &Mission, place: &str) -> Option<String> {
    mission.submissions.iter().enumerate().find_map(|(number, submission)| {
        let file = &submission.file.value;
        let enter = &submission.enter.as_ref()?.value;
        let Some(leave) = &submission.leave else {
            return Some(format!(
                "add a transition to it; or write out=\"{place}\" if {file} is to leave to it"
            ));
        };
        let mut before = mission.submissions[..number].iter();
        let is_same = |other: &Submission| {
            other.leave.as_ref().is_some_and(|other| other.value == leave.value)
        };
        if enter == &leave.value || before.any(is_same) {
            return Some(format!("write out=\"{place}\" if {file} is to leave to it"));
        }
        // One that leaves to the goal is as it should be.
        let is_goal = mission.goal.as_ref().is_some_and(|goal| goal.value == leave.value);
        (enter == place).then(|| match is_goal {
            true => format!("add a transition to it, or lead one to it: {file} begins there"),
            false => format!(
                "add a transition to it; or did you mean in=\"{}\" out=\"{place}\" for {file}?",
                leave.value
            ),
        })
    })
}

/// Drops the findings about places that are not reached because the goal of a sub-mission that
/// leaves to them is missing or not reached, which is a finding already.
pub(super) fn drop_explained(configuration: &Configuration, findings: &mut Findings) {
    let has_fault = |submission: &&Submission| {
        findings.iter().any(|finding| {
            let is_fault = finding.code == Code::NoGoal
                || (finding.code == Code::UnreachablePlace && finding.message.starts_with(NO_GOAL));
            let path = finding.at.as_ref().map(|at| plain_path(at.source.path()));
            is_fault && path.as_ref() == Some(&submission.path)
        })
    };
    let explained: BTreeSet<_> = configuration
        .missions()
        .flat_map(|mission| {
            let leaves = mission.submissions.iter().filter(has_fault);
            let left = leaves.filter_map(|submission| submission.leave.as_ref());
            left.filter_map(|left| Some(&mission.place(&left.value)?.name.at))
        })
        .map(|at| (at.source.path().to_path_buf(), at.span))
        .collect();
    findings.retain(|finding| {
        finding.code != Code::UnreachablePlace
            || finding
                .at
                .as_ref()
                .is_none_or(|at| !explained.contains(&(at.source.path().to_path_buf(), at.span)))
    });
}

/// Returns the unreached places that the others follow from, each with those that follow: places
/// that no transition leads to, and one place of each circle that is entered from nowhere.
fn find_first<'a>(
    mission: &'a Mission,
    whole: &Mission,
    reached: &BTreeSet<&str>,
) -> Vec<(&'a Place, Vec<&'a Place>)> {
    let names = whole.places.iter().map(|place| place.name.value.as_str());
    let unreached: Vec<_> = names.filter(|name| !reached.contains(name)).collect();
    let numbers: BTreeMap<_, _> = unreached.iter().enumerate().map(|(at, it)| (*it, at)).collect();
    // A transition is a node too: of many places to many places, its edges stay few.
    let count = unreached.len();
    let nodes = 0..count + whole.transitions.len();
    let edges = whole.transitions.iter().enumerate().flat_map(|(at, transition)| {
        let number = |name: &str| numbers.get(name).copied();
        let needs = needed_places(transition).into_iter().filter_map(number);
        let puts = output_places(transition).filter_map(number);
        let ends = needs.map(|place| (place, count + at, ()));
        ends.chain(puts.map(|place| (count + at, place, ()))).collect::<Vec<_>>()
    });
    let own: BTreeMap<_, _> =
        mission.places.iter().map(|place| (place.name.value.as_str(), place)).collect();
    let groups = CheckGraph::new(nodes, edges).find_first_groups();
    let groups = groups.into_iter().map(|group| {
        let names = group.into_iter().filter_map(|node| unreached.get(node));
        names.filter_map(|name| own.get(name).copied()).collect::<Vec<_>>()
    });
    let mut first: Vec<_> =
        groups.filter_map(|places| Some((*places.first()?, places[1..].to_vec()))).collect();
    first.sort_by_key(|(place, _)| place.name.at.span);
    first
}

fn is_of(mission: &Mission, finding: &Finding) -> bool {
    let path = mission.at.source.path();
    finding.at.as_ref().is_some_and(|at| at.source.path() == path)
}

/// Returns the places that are reached from the initial ones, and from `begins`, if the transition
/// with the number `without` never fires.
pub(super) fn find_reached<'a>(
    mission: &'a Mission,
    begins: &[&'a str],
    without: Option<usize>,
) -> BTreeSet<&'a str> {
    let begins = begins.iter().copied().chain(failure_places(mission)).collect();
    find_reached_from(mission, begins, |index, _| without != Some(index))
}

/// The same if nothing fails.
pub(super) fn find_reached_without_failures(mission: &Mission) -> BTreeSet<&str> {
    find_reached_from(mission, Vec::new(), |_, transition| !transition.is_on_failure())
}

fn find_reached_from<'a>(
    mission: &'a Mission,
    begins: Vec<&'a str>,
    may_fire: impl Fn(usize, &Transition) -> bool,
) -> BTreeSet<&'a str> {
    let mut waiting: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut missing = Vec::new();
    for (index, transition) in mission.transitions.iter().enumerate() {
        let needs = needed_places(transition);
        missing.push(needs.len() + usize::from(!may_fire(index, transition)));
        for place in needs {
            waiting.entry(place).or_default().push(index);
        }
    }
    let initial = mission.places.iter().filter(|place| place.initial > 0);
    let mut open: Vec<&str> = initial.map(|place| place.name.value.as_str()).collect();
    open.extend(begins);
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
