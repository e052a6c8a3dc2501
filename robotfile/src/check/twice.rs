//! What is written twice: the same sub-mission at the same places, and transitions that differ only
//! in their names.

use std::collections::BTreeMap;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Guard, implies};
use crate::mission::{Mission, Transition};
use crate::source::{Location, Spanned};

/// The same sub-mission twice at the same places: only one of them begins.
pub(super) fn submissions_once(mission: &Mission, findings: &mut Findings) {
    let mut seen: BTreeMap<_, &Location> = BTreeMap::new();
    for submission in &mission.submissions {
        let name = |place: &Option<Spanned<String>>| place.as_ref().map(|it| it.value.clone());
        let (Some(enter), leave) = (name(&submission.enter), name(&submission.leave)) else {
            continue;
        };
        let file = &submission.file;
        let key = (submission.path.clone(), enter, leave);
        if let Some(first) = seen.get(&key) {
            let message = format!(
                "{} is included twice with the same in and out: only the order in the file decides \
                 which one begins",
                file.value
            );
            let finding = Finding::new(Code::Tie, &file.at, message);
            findings.push(
                finding
                    .remedy("remove one of them, or give it other places")
                    .related(first, "first here"),
            );
        } else {
            seen.insert(key, &file.at);
        }
    }
}

/// Of two transitions that can fire at the same moment and differ only in their names, one is to be
/// removed.
pub(super) fn advise_identical(mission: &Mission, findings: &mut Findings) {
    let at = |location: &Location| {
        let is_there = |it: &&Transition| {
            it.name.at.span == location.span && it.name.at.source.path() == location.source.path()
        };
        mission.transitions.iter().find(is_there)
    };
    for finding in findings.iter_mut().filter(|finding| finding.code == Code::Tie) {
        let own = finding.at.as_ref().and_then(at);
        let other = finding.related.first().and_then(|(first, _)| at(first));
        if let (Some(own), Some(other)) = (own, other)
            && acts_alike(own, other)
        {
            finding.remedy = format!(
                "{} and {} differ only in their names: remove one, or was another from=\"…\" meant?",
                other.name.value, own.name.value
            );
        }
    }
}

/// Of two transitions that differ only in their guards, one fires only when the other one can: it changes
/// nothing.
pub(super) fn check_implied(mission: &Mission, findings: &mut Findings) {
    for one in &mission.transitions {
        let Some(when) = &one.when else { continue };
        let Ok(guard) = Guard::parse(&when.value) else { continue };
        let is_wider = |other: &&Transition| {
            let of_other = other.when.as_ref().and_then(|it| Guard::parse(&it.value).ok());
            other.name.value != one.name.value
                && does_the_same(one, other)
                && of_other.is_some_and(|it| implies(&guard, &it) && !implies(&it, &guard))
        };
        let Some(other) = mission.transitions.iter().find(is_wider) else { continue };
        let (name, wider) = (&one.name.value, &other.name.value);
        let message = format!(
            "{name} changes nothing: whenever `{}` is true, {wider} can fire, which does the same",
            when.value
        );
        let finding = Finding::new(Code::ConditionImplied, &when.at, message);
        findings.push(
            finding
                .remedy(format!(
                    "was another from=\"…\" meant, here or in {wider}? Otherwise remove one"
                ))
                .related(&other.name.at, "this one does the same"),
        );
    }
}

/// Whether they have the same arcs, values and conditions, apart from their guards.
fn does_the_same(one: &Transition, other: &Transition) -> bool {
    acts_alike_apart_from_guards(one, other)
        && (one.class, one.priority) == (other.class, other.priority)
        && one.interval.is_none()
        && [one, other].iter().all(|it| it.not_before.is_none() && it.not_after.is_none())
}

fn acts_alike(one: &Transition, other: &Transition) -> bool {
    let text = |it: &Option<Spanned<String>>| it.as_ref().map(|text| text.value.clone());
    acts_alike_apart_from_guards(one, other) && text(&one.when) == text(&other.when)
}

fn acts_alike_apart_from_guards(one: &Transition, other: &Transition) -> bool {
    let arcs = |it: &Transition| {
        let arcs = it.arcs.iter().map(|arc| (arc.kind, arc.place.value.clone(), arc.weight));
        let mut arcs: Vec<_> = arcs.collect();
        arcs.sort();
        arcs
    };
    let sets = |it: &Transition| {
        let sets = it.sets.iter().map(|set| (set.variable.value.clone(), set.value.value.clone()));
        sets.collect::<Vec<_>>()
    };
    let on = |it: &Transition| {
        it.on.as_ref().map(|on| (on.component.value.clone(), on.event.value.clone()))
    };
    arcs(one) == arcs(other)
        && sets(one) == sets(other)
        && on(one) == on(other)
        && one.autonomy == other.autonomy
        && one.interval.as_ref().map(|it| it.at.text())
            == other.interval.as_ref().map(|it| it.at.text())
}
