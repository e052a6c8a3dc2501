//! The places in which sub-missions begin. A sub-mission takes the token as soon as its place is
//! marked, so nothing else should take it from there: neither a transition nor another sub-mission.

use std::collections::BTreeMap;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Mission, Submission, Transition};

/// Checks the entrances of all sub-missions of a mission.
pub(super) fn check(mission: &Mission, findings: &mut Findings) {
    report_rivals(mission, findings);
    report_shared(mission, findings);
    report_exchanged(mission, findings);
}

/// A sub-mission begins as soon as its place is marked. A transition from that place with a guard
/// competes with that; one that waits for anything never fires, which the proof finds.
fn report_rivals(mission: &Mission, findings: &mut Findings) {
    for submission in &mission.submissions {
        let Some(enter) = &submission.enter else { continue };
        let competes = |transition: &&Transition| {
            transition.when.is_some()
                && transition.on.is_none()
                && transition.interval.is_none()
                && transition.priority == 0
                && transition.inputs().any(|arc| arc.place.value == enter.value)
        };
        for transition in mission.transitions.iter().filter(competes) {
            let message = format!(
                "{} takes the token from {}, and so does {}, which begins as soon as {} is marked: \
                 only their order decides",
                transition.name.value, enter.value, submission.file.value, enter.value
            );
            let finding = Finding::new(Code::Tie, &transition.name.at, message);
            let remedy = format!(
                "let it start from another place than the in=\"{}\" of the sub-mission, or write \
                 priority=\"1\" on it",
                enter.value
            );
            findings.push(finding.remedy(remedy).related(&enter.at, "the sub-mission begins here"));
        }
    }
}

/// Reports two sub-missions that begin in the same place and leave to different ones: only the first
/// of them ever begins. The same sub-mission with the same places is a finding of its own.
fn report_shared(mission: &Mission, findings: &mut Findings) {
    let mut seen: BTreeMap<&str, &Submission> = BTreeMap::new();
    for submission in &mission.submissions {
        let Some(enter) = &submission.enter else { continue };
        let Some(first) = seen.get(enter.value.as_str()) else {
            seen.insert(&enter.value, submission);
            continue;
        };
        let leave = |it: &Submission| it.leave.as_ref().map(|place| place.value.clone());
        if first.path == submission.path && leave(first) == leave(submission) {
            continue;
        }
        let (file, place) = (&submission.file.value, &enter.value);
        let message = format!(
            "{file} never begins here: {place} is also the in=\"…\" of {}, which begins first",
            first.file.value
        );
        let finding = Finding::new(Code::Tie, &enter.at, message).stops_transition();
        let remedy = match mission.find_unused_place() {
            Some(other) => {
                format!("did you mean in=\"{other}\"? No transition leads on from {other}")
            }
            None => "name another place as in=\"…\" of one of them".into(),
        };
        let first = first.enter.as_ref().map_or(&first.file.at, |first| &first.at);
        findings.push(finding.remedy(remedy).related(first, "the first one begins here"));
    }
}

/// Reports a sub-mission that begins in a place from which a transition leads on, and leaves to a place
/// that transitions lead to and from which nothing leads on: both places are probably exchanged.
fn report_exchanged(mission: &Mission, findings: &mut Findings) {
    for submission in &mission.submissions {
        let (Some(enter), Some(leave)) = (&submission.enter, &submission.leave) else { continue };
        let takes = |it: &&Transition, place: &str| it.inputs().any(|arc| arc.place.value == place);
        let puts = |it: &Transition, place: &str| it.outputs().any(|arc| arc.place.value == place);
        let mut transitions = mission.transitions.iter();
        let next = transitions.clone().find(|it| takes(it, &enter.value));
        let leads = |place: &str| mission.transitions.iter().any(|it| puts(it, place));
        let is_end =
            [&mission.goal, &mission.safe].into_iter().flatten().any(|it| it.value == leave.value);
        let is_entered = mission
            .submissions
            .iter()
            .any(|it| it.enter.as_ref().is_some_and(|other| other.value == leave.value));
        let Some(next) = next.filter(|_| !is_end && !is_entered) else { continue };
        if transitions.any(|it| takes(&it, &leave.value))
            || !leads(&enter.value)
            || !leads(&leave.value)
        {
            continue;
        }
        let message = format!(
            "{} takes the token from {enter} before {next} can, and nothing leads on from {leave}",
            submission.file.value,
            enter = enter.value,
            next = next.name.value,
            leave = leave.value
        );
        let finding = Finding::new(Code::NeverFires, &enter.at, message).stops_transition();
        let finding = finding.related(&next.name.at, "this transition never fires");
        findings.push(
            finding.remedy(format!("did you mean in=\"{}\" out=\"{}\"?", leave.value, enter.value)),
        );
    }
}
