//! Timeouts that end before a component of their place was called even once, or before the operator's
//! time for an answer is over; and times in which no person answers.

use std::time::Duration;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Autonomy, Mission, Place, Transition};
use crate::model::System;

/// In less time no person reads a question and answers it. The reaction to a light that is expected
/// takes a quarter of a second; here a text is read first, and a key chosen.
const SHORTEST_ANSWER: Duration = Duration::from_secs(1);

/// Checks the transitions that leave a place with components after a time, and those that ask.
pub(super) fn check(mission: &Mission, system: &System, findings: &mut Findings) {
    for transition in &mission.transitions {
        findings.extend(find_short_answer(transition));
        let Some(interval) = &transition.interval else { continue };
        let Some(latest) = interval.value.latest.filter(|latest| !latest.is_zero()) else {
            continue;
        };
        let [from] = transition.inputs().collect::<Vec<_>>()[..] else { continue };
        let Some(place) = mission.place(&from.place.value).filter(|_| is_timeout(transition))
        else {
            continue;
        };
        // One that is shorter still is a finding already.
        let is_known = findings.iter().any(|finding| {
            finding.code == Code::TimeTooShort
                && finding.at.as_ref().is_some_and(|at| at.is_at(&interval.at))
        });
        if is_known {
            continue;
        }
        findings.extend(find_cut_question(transition, latest, place, mission));
        let Some((component, period)) = find_slowest(place, system) else { continue };
        if latest < period {
            let (name, text) = (&transition.name.value, interval.at.text());
            let message = format!(
                "`{text}` is too short: {name} leaves {} before {component} is called, every {:?}",
                place.name.value, period
            );
            let finding = Finding::new(Code::TimeTooShort, &interval.at, message);
            findings.push(finding.remedy("write a longer time: is the unit right?"));
        }
    }
}

/// A question that is over before anyone can have read it.
fn find_short_answer(transition: &Transition) -> Option<Finding> {
    let Autonomy::Confirm { within: Some(within), fire_unanswered } = transition.autonomy else {
        return None;
    };
    let at = transition.answer_at.as_ref().filter(|_| within < SHORTEST_ANSWER)?;
    let result = if fire_unanswered { "fires" } else { "is declined" };
    let message = format!(
        "`{}` is too short: {} {result} before a person has read the question",
        at.text(),
        transition.name.value
    );
    let finding = Finding::new(Code::TimeTooShort, at, message);
    Some(finding.remedy("write a time in which a person can answer, such as 30s"))
}

/// A question that the operator may answer for longer than its place is marked, or a transition that the
/// operator has no time to fire.
fn find_cut_question(
    timeout: &Transition,
    latest: Duration,
    place: &Place,
    mission: &Mission,
) -> Option<Finding> {
    let name = &place.name.value;
    let asks = |it: &Transition| match it.autonomy {
        Autonomy::Confirm { within: Some(within), .. } => latest < within,
        Autonomy::Confirm { within: None, .. } | Autonomy::Operator => latest < SHORTEST_ANSWER,
        Autonomy::Auto => false,
    };
    let mut questions = mission.transitions.iter().filter(|it| asks(it));
    let question = questions.find(|it| it.inputs().any(|arc| arc.place.value == *name))?;
    let interval = timeout.interval.as_ref()?;
    let (late, asked) = (&timeout.name.value, &question.name.value);
    let (what, label, remedy) = match question.autonomy {
        Autonomy::Operator => (
            format!("a person can fire {asked}"),
            "this one waits for the operator",
            "write a time in which a person can act, such as 30s",
        ),
        Autonomy::Confirm { within: None, .. } => (
            format!("a person has read the question about {asked}"),
            "this question",
            "write a time in which a person can answer, such as 30s",
        ),
        _ => (
            format!("the time for the answer about {asked} is over"),
            "this question",
            "write a longer time here, or a shorter answer-within=\"…\" there",
        ),
    };
    let text = interval.at.text();
    let message = format!("`{text}` is too short: {late} leaves {name} before {what}");
    let finding = Finding::new(Code::TimeTooShort, &interval.at, message);
    let at = question.autonomy_at.as_ref().unwrap_or(&question.name.at);
    Some(finding.related(at, label).remedy(remedy))
}

fn is_timeout(transition: &Transition) -> bool {
    transition.on.is_none() && transition.when.is_none() && transition.autonomy == Autonomy::Auto
}

/// The component of the place that is called least often, and its period.
fn find_slowest<'a>(place: &'a Place, system: &System) -> Option<(&'a str, Duration)> {
    let periods = place.components.iter().filter_map(|name| {
        let rate = system.component(&name.value)?.rate_hz.as_ref()?;
        let period = Duration::try_from_secs_f64(1.0 / rate.value).ok()?;
        Some((name.value.as_str(), period))
    });
    periods.max_by_key(|(_, period)| *period)
}
