//! Data that stands still: a guard over data of a component that is frozen where the guard is evaluated, and
//! a link whose producer is frozen whenever its consumer is active. Only what the arcs exclude is a
//! finding: where two places might be marked together, both checks are silent.

use std::collections::BTreeSet;

use crate::check::activity::{Activity, needed_places};
use crate::check::guards::within;
use crate::check::reach::find_reached;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Guard, Name};
use crate::manifests::Manifests;
use crate::mission::Transition;
use crate::model::{Link, LinkMode, System};

/// Checks the guards of a mission and the links of its system.
pub(super) fn check(
    activity: &Activity<'_>,
    system: &System,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    let mut found = Findings::default();
    for (number, transition) in activity.mission.transitions.iter().enumerate() {
        activity.check_guard(number, transition, &mut found);
    }
    // A sub-mission that is included twice is checked twice, with the same result.
    findings.extend_new(found);
    for link in &system.links {
        if is_sent_once(link, system, manifests) == Some(true) {
            activity.check_link(link, findings);
        }
    }
}

/// Whether a message of the link reaches only consumers that are active when it is published; none
/// if the kind of the producer is not known. A latched output sends its last message to a consumer
/// that starts later.
fn is_sent_once(link: &Link, system: &System, manifests: Option<&Manifests>) -> Option<bool> {
    let producer = system.component(&link.from.component.value)?;
    let outputs = &manifests?.get(&producer.kind.value)?.outputs;
    let output = outputs.iter().find(|output| output.id == link.from.port.value)?;
    Some(!output.latched && link.mode == LinkMode::Push)
}

impl Activity<'_> {
    fn check_guard(&self, number: usize, transition: &Transition, findings: &mut Findings) {
        let Some(when) = &transition.when else { return };
        let Ok(guard) = Guard::parse(&when.value) else { return };
        let needed = needed_places(transition);
        let works = |name: &&str| self.place(name).is_some_and(|it| !it.components.is_empty());
        // A place without components decides by the last values; only where something works does a
        // guard wait for them to change.
        let place = needed.iter().find(|name| works(name));
        for name in guard.names() {
            let Some((component, is)) = self.source_of(name, transition) else { continue };
            if self.is_active_only_after(&component, number) == Some(true) {
                let message = format!(
                    "{is}, but {component} is active only after {} has fired, so it is not known \
                     before",
                    transition.name.value
                );
                let at = within(when, name.at.clone());
                let finding = Finding::new(Code::FrozenData, &at, message);
                findings.push(finding.remedy(format!(
                    "activate {component} before, or take it out of all places: then it is always \
                     active"
                )).frozen([component.as_str()]));
                continue;
            }
            let Some(place) = place else { continue };
            if self.may_be_active(&component, &needed) != Some(false) {
                continue;
            }
            let message = format!("{is}, but {component} is frozen while {place} is marked");
            let at = within(when, name.at.clone());
            let finding = Finding::new(Code::FrozenData, &at, message);
            findings.push(finding.remedy(format!(
                "activate {component} in {place} too, or take it out of all places: then it is always active; or decide by its last value in a place without components"
            )).frozen([component.as_str()]));
        }
    }

    /// Whether none of the places of a component is reached before the transition with this number
    /// has fired; none if the mission does not control it, or if too much was looked at.
    fn is_active_only_after(&self, component: &str, number: usize) -> Option<bool> {
        let places = self.places_of(component)?;
        self.count_pairs(2 * (self.mission.transitions.len() + self.mission.places.len()))?;
        let is_in = |reached: &BTreeSet<&str>| places.iter().any(|place| reached.contains(place));
        let without = find_reached(self.mission, &[], Some(number));
        Some(!is_in(&without) && is_in(&find_reached(self.mission, &[], None)))
    }

    /// The component whose data a name in a guard is, with the data in words.
    fn source_of(&self, name: &Name, transition: &Transition) -> Option<(String, String)> {
        if let Some(data) = name.data() {
            let (component, _) = data.split_once('.')?;
            return Some((component.to_owned(), format!("{name} is data of {component}")));
        }
        let variable = self.mission.variable_of(&transition.name.value, name.as_str())?;
        let source = &variable.source.as_ref()?.value;
        let (component, _) = source.split_once('.')?;
        Some((component.to_owned(), format!("{name} follows {source}")))
    }

    fn check_link(&self, link: &Link, findings: &mut Findings) {
        let (from, to) = (&link.from.component.value, &link.to.component.value);
        let places = |name: &str| {
            let places = self.places_of(name)?.iter().copied();
            let reached = places.filter(|place| self.together.may_be_together(place, place));
            Some(reached.collect::<Vec<_>>()).filter(|reached| !reached.is_empty())
        };
        let (Some(producing), Some(consuming)) = (places(from), places(to)) else { return };
        if self.count_pairs(producing.len() * consuming.len()).is_none() {
            return;
        }
        let meets = |producing: &&str| {
            consuming.iter().any(|place| self.together.may_be_together(producing, place))
        };
        if producing.iter().any(meets) {
            return;
        }
        let message = format!(
            "{from} is frozen whenever {to} is active, so this link never delivers a message"
        );
        let finding = Finding::new(Code::FrozenProducer, &link.from.at, message);
        let mut sets = self.mission.exclusives.iter();
        // One that excludes others must be in a place.
        let is_exclusive = sets.any(|set| set.components.iter().any(|it| it.value == *from));
        let (both, free) = match is_exclusive {
            true => (format!("activate {to} where {from} is active"), to),
            false => ("activate both in one place".to_owned(), from),
        };
        findings.push(
            finding
                .remedy(format!(
                    "{both}, or take {free} out of all places: then it is always active"
                ))
                .frozen([from.as_str(), to.as_str()]),
        );
    }
}
