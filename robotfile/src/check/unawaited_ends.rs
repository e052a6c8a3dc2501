//! Places in which a task comes to an end that nothing waits for: the components' kinds declare that it
//! does, and from the place only a timeout leads on, or another event of the component.

use std::collections::BTreeSet;

use armor_wire::manifest::{EffectKind, Manifest};

use crate::check::unused_done::find_unawaited;
use crate::check::value_effects::has_effect_in;
use crate::code::Code;
use crate::finding::{Finding, Severity};
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::mission::{Autonomy, Class, Mission, Place, Transition};
use crate::model::{Component, Configuration};
use crate::source::Spanned;

/// Checks a file without other faults: an end may seem to be without effect because of any of them.
pub(super) fn check(configuration: &Configuration, manifests: &Manifests, findings: &mut Findings) {
    if findings.iter().any(|finding| finding.severity() != Severity::Note) {
        return;
    }
    let unawaited = find_unawaited(configuration, manifests);
    let mut reported = BTreeSet::new();
    for mission in configuration.missions() {
        for place in &mission.places {
            for name in &place.components {
                let is_awaited = !unawaited.contains(name.value.as_str());
                let Some(component) = configuration.system.component(&name.value) else { continue };
                let kind = manifests.get(&component.kind.value).filter(|kind| kind.ends_by_itself);
                let Some(kind) = kind else { continue };
                let found = find_ignored(mission, place, name, (component, kind), is_awaited);
                // One transition that is missing is one finding, in however many places.
                if let Some(found) = found
                    && reported.insert(name.value.as_str())
                {
                    findings.push(found);
                }
            }
        }
    }
}

/// Finds a place that ignores the end. If other places wait for it (`is_awaited`), an event that leads to
/// where the component works on is enough.
fn find_ignored(
    mission: &Mission,
    place: &Place,
    name: &Spanned<String>,
    (component, kind): (&Component, &Manifest),
    is_awaited: bool,
) -> Option<Finding> {
    let (from, of) = (place.name.value.as_str(), name.value.as_str());
    let mut effects = kind.value_effects.iter();
    let is_endless = effects.any(|effect| {
        matches!(effect.effect, EffectKind::NeverDone | EffectKind::Idle)
            && has_effect_in(component, kind, effect, place)
    });
    let leaves = |it: &&Transition| it.inputs().any(|arc| arc.place.value == from);
    let leaving: Vec<_> = mission.transitions.iter().filter(leaves).collect();
    // The end of another component may be the one that counts there.
    let waits = |it: &&&Transition| it.on.as_ref().is_some_and(|on| on.event.value == "done");
    let begins = mission.submissions.iter().flat_map(|it| &it.enter).any(|it| it.value == from);
    if is_endless || begins || leaving.iter().any(|it| waits(&it)) {
        return None;
    }
    // Without a number of rounds in the file, the first one may be meant.
    let mut limits = kind.value_effects.iter().filter(|it| it.effect == EffectKind::NeverDone);
    let is_limited = limits.all(|limit| {
        let in_place = place.parameters.iter().any(|given| {
            given.component.value == of && given.parameter.name.value == limit.parameter
        });
        in_place || component.parameter(&limit.parameter).is_some()
    });
    let works_on = |it: &Transition| {
        let mut after = it.outputs().filter_map(|arc| mission.place(&arc.place.value));
        after.any(|place| place.activates(of))
    };
    let is_event = |it: &&&Transition| {
        let on = it.on.as_ref();
        let is_own = on.is_some_and(|on| on.component.value == of && on.event.value != "failed");
        is_own && !(is_awaited && works_on(it))
    };
    // `lap` comes once per round, as `laps` counts them; any other event may come in the first or never.
    let is_of_round = |it: &Transition| {
        let event = it.on.as_ref().map_or("", |on| on.event.value.as_str());
        let mut limits = kind.value_effects.iter();
        limits.any(|it| {
            it.effect == EffectKind::NeverDone && it.parameter.trim_end_matches('s') == event
        })
    };
    let mut events = leaving.iter().filter(is_event);
    if let Some(other) = events.find(|it| is_limited || !(is_awaited || is_of_round(it)))
        && let Some(on) = &other.on
    {
        let message = format!(
            "{} waits in {from} for {} of {of}, and no transition waits for its done{}",
            other.name.value,
            on.event.value,
            if is_awaited { " there" } else { "" }
        );
        let finding = Finding::new(Code::EndUnawaited, &on.event.at, message);
        return Some(finding.remedy(format!(
            "did you mean on=\"{of}.done\"? Otherwise add a transition for it from {from}"
        )));
    }
    if is_awaited {
        return None;
    }
    let is_timeout = |it: &&&Transition| {
        it.on.is_none()
            && it.when.is_none()
            && it.not_before.is_none()
            && it.autonomy == Autonomy::Auto
            && it.interval.as_ref().is_some_and(|it| it.value.latest.is_some())
    };
    let timeout = leaving.iter().find(is_timeout)?;
    let interval = timeout.interval.as_ref()?;
    // What an operator or the data decide is a way out of its own.
    let is_only =
        leaving.iter().all(|it| is_timeout(&it) || it.class == Class::Safety || it.is_on_failure());
    if !is_only {
        return None;
    }
    let message = format!(
        "no transition waits for the end of {of}: once it is done, nothing happens in {from} until {}, \
         after {}",
        timeout.name.value,
        interval.at.text()
    );
    let finding = Finding::new(Code::EndUnawaited, &name.at, message);
    let finding = finding.related(&timeout.name.at, "only this one leads on");
    Some(finding.remedy(format!("add <transition from=\"{from}\" to=\"…\" on=\"{of}.done\"/>")))
}
