//! Transitions that put back what they take and change nothing, and inhibitors that keep apart two tokens
//! which a later transition joins.

use crate::check::names::joined;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Autonomy, Mission, Transition};

pub(super) fn check(mission: &Mission, findings: &mut Findings) {
    for transition in &mission.transitions {
        if let Some(mut finding) = find_returning(mission, transition) {
            // Its time ends before those of the others, as far as it is shorter.
            let follows = |it: &Finding| {
                let mut others = it.related.iter();
                it.code == Code::NeverFires && others.any(|(at, _)| at.is_at(&transition.name.at))
            };
            if findings.iter().any(follows) {
                findings.retain(|it| !follows(it));
                finding = finding.stops_transition();
            }
            findings.push(finding);
        }
        findings.extend(find_kept_apart(mission, transition));
        findings.extend(find_idle_resets(mission, transition));
    }
}

/// A reset of a place from which the transition takes the only token: a place with components has one at
/// most.
fn find_idle_resets(mission: &Mission, transition: &Transition) -> Vec<Finding> {
    let resets = transition.arcs.iter().filter(|arc| arc.kind == ArcKind::Reset);
    let is_idle = |name: &str| {
        let takes = transition.inputs().any(|arc| arc.place.value == name);
        takes && mission.place(name).is_some_and(|place| !place.components.is_empty())
    };
    let idle = resets.filter(|arc| is_idle(&arc.place.value));
    let report = |arc: &crate::mission::Arc| {
        let (name, place) = (&transition.name.value, &arc.place.value);
        let message = format!(
            "reset has no effect here: {name} takes the token from {place}, which has one at most, \
             because it activates components"
        );
        let finding = Finding::new(Code::NoEffect, &arc.place.at, message);
        finding.remedy("name another place, or remove the reset")
    };
    idle.map(report).collect()
}

/// A timeout, a guard or a question whose token returns to its place. A component that is active before
/// and after a firing is not touched, unless it is done, which the mission does not wait for. One that
/// takes a report uses that up, and an operator may restart what is done in the place.
fn find_returning(mission: &Mission, transition: &Transition) -> Option<Finding> {
    let time = transition.interval.as_ref().filter(|it| !it.value.earliest.is_zero());
    let condition = match (transition.autonomy, time, &transition.when) {
        (Autonomy::Confirm { .. }, ..) => "once the question is answered,".to_owned(),
        (Autonomy::Operator, ..) => "when the operator fires it,".to_owned(),
        (Autonomy::Auto, Some(time), None) => format!("after {}", time.at.text()),
        (Autonomy::Auto, None, Some(when)) => {
            format!("as long as `{}` is true, again and again,", when.value)
        }
        _ => return None,
    };
    let is_plain = transition.on.is_none()
        && transition.not_before.is_none()
        && transition.not_after.is_none()
        && transition.overrun.is_none()
        && transition.sets.is_empty();
    let sorted = |kind: ArcKind| {
        let arcs = transition.arcs.iter().filter(|arc| arc.kind == kind);
        let mut arcs: Vec<_> = arcs.map(|arc| (arc.place.value.as_str(), arc.weight)).collect();
        arcs.sort_unstable();
        arcs
    };
    let (taken, put) = (sorted(ArcKind::Take), sorted(ArcKind::Put));
    let resets = transition.arcs.iter().any(|arc| arc.kind == ArcKind::Reset);
    if !is_plain || resets || taken.is_empty() || taken != put {
        return None;
    }
    let place = taken[0].0;
    let active = mission.place(place).into_iter().flat_map(|place| &place.components);
    let active: Vec<_> = active.map(|name| name.value.as_str()).collect();
    if transition.autonomy == Autonomy::Operator && !active.is_empty() {
        return None;
    }
    let rest = match active.as_slice() {
        [] => String::new(),
        [only] => format!(", and restarts {only} only if it is done"),
        some => format!(", and restarts of {} only what is done", joined(some.iter().copied())),
    };
    let message = format!(
        "{} changes nothing: {condition} it puts the token back into {place}{rest}",
        transition.name.value
    );
    let at = transition.outputs().next().map_or(&transition.name.at, |arc| &arc.place.at);
    let finding = Finding::new(Code::ChangesNothing, at, message);
    Some(finding.remedy("name another place in to=\"…\", or remove the transition"))
}

/// A transition does not fire while a place is marked, although a later one needs a token in that place
/// together with one that only this transition puts: once the place is marked, neither fires.
fn find_kept_apart(mission: &Mission, transition: &Transition) -> Option<Finding> {
    let inhibitors = transition.arcs.iter().filter(|arc| arc.kind == ArcKind::Inhibitor);
    inhibitors.filter(|arc| arc.weight == 1).find_map(|inhibitor| {
        let kept = inhibitor.place.value.as_str();
        // It may be emptied by something else.
        let mut taking = mission.transitions.iter().filter(|it| {
            it.arcs.iter().any(|arc| {
                arc.place.value == kept && matches!(arc.kind, ArcKind::Take | ArcKind::Reset)
            })
        });
        let (Some(join), None) = (taking.next(), taking.next()) else { return None };
        let is_entered =
            mission.submissions.iter().flat_map(|it| &it.enter).any(|enter| enter.value == kept);
        let mut fed = transition.outputs().map(|arc| arc.place.value.as_str());
        let fed = fed.find(|fed| {
            join.inputs().any(|arc| arc.place.value == *fed) && is_fed_by_one(mission, fed)
        })?;
        if is_entered || join.name.value == transition.name.value {
            return None;
        }
        let (name, join) = (&transition.name.value, &join.name);
        let message = format!(
            "{name} does not fire while {kept} is marked, but {} takes a token from {kept} together with \
             one from {fed}, which only {name} puts there",
            join.value
        );
        let finding = Finding::new(Code::InhibitedJoin, &inhibitor.place.at, message);
        let finding = finding.related(&join.at, "this one joins the two tokens");
        Some(finding.remedy(format!("did you mean <read place=\"{kept}\"/>?")))
    })
}

/// Whether exactly one transition, and nothing else, puts tokens into the place.
fn is_fed_by_one(mission: &Mission, place: &str) -> bool {
    let feeding = mission.transitions.iter();
    let feeding = feeding.filter(|it| it.outputs().any(|arc| arc.place.value == place)).count();
    let left = mission.submissions.iter().flat_map(|it| &it.leave);
    let failed = mission.places.iter().flat_map(|it| &it.on_failure);
    let is_initial = mission.place(place).is_some_and(|it| it.initial > 0);
    feeding == 1 && !is_initial && !left.chain(failed).any(|it| it.value == place)
}
