//! A component that the mission waits for, and that gets no data meanwhile: what it requires comes
//! from a component that is frozen, perhaps through others that only pass it on. One with a rate of
//! its own is called without new data, and may send without them.

use std::collections::{BTreeMap, BTreeSet};

use crate::check::activity::{Activity, needed_places};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Link, LinkMode, System};
use crate::source::Location;

/// Links that are followed, so that the check takes milliseconds for any file.
const MAX_STEPS: usize = 2_000_000;

/// Checks each component in each place in which the mission waits for its report.
pub(super) fn check(
    activity: &Activity<'_>,
    system: &System,
    manifests: &Manifests,
    findings: &mut Findings,
) {
    let supplies = required_links(system, manifests);
    let mut steps = 0;
    let mut known = BTreeSet::new();
    for transition in &activity.mission.transitions {
        let Some(on) = &transition.on else { continue };
        for place in needed_places(transition) {
            let Some(place) = activity.place(place) else { continue };
            let name = on.component.value.as_str();
            let Some(named) = place.components.iter().find(|it| it.value == name) else { continue };
            if !known.insert((name, place.name.value.as_str())) {
                continue;
            }
            let marked = BTreeSet::from([place.name.value.as_str()]);
            let is_frozen = |name: &str| activity.may_be_active(name, &marked) == Some(false);
            let by_data =
                |name: &str| system.component(name).is_some_and(|it| it.rate_hz.is_none());
            let Some(link) = frozen_source(name, &supplies, is_frozen, by_data, &mut steps) else {
                continue;
            };
            // That it never delivers is the graver finding.
            if findings.iter().any(|it| is_about(it, Code::FrozenProducer, &link.from.at)) {
                continue;
            }
            let (source, place) = (&link.from.component.value, &place.name.value);
            let data = link.from.data();
            let how = if link.to.component.value == name {
                format!("it requires {data}")
            } else {
                format!("what it requires comes from {data} through {}", link.to.component.value)
            };
            let message = format!(
                "the mission waits in {place} for a report of {name}; {how}, but {source} is frozen there"
            );
            let finding = Finding::new(Code::Starved, &named.at, message);
            let remedy = format!(
                "activate {source} in {place} too, or take it out of all places: then it is always active"
            );
            findings.push(
                finding.related(&link.from.at, "the link").remedy(remedy).frozen([source.as_str()]),
            );
        }
    }
}

/// Returns whether a finding is of this code and about the text at `at`.
pub(super) fn is_about(finding: &Finding, code: Code, at: &Location) -> bool {
    finding.code == code
        && finding
            .at
            .as_ref()
            .is_some_and(|it| it.span == at.span && it.source.path() == at.source.path())
}

/// The links into required inputs that deliver only while their source is active, by the component
/// that they feed.
fn required_links<'a>(
    system: &'a System,
    manifests: &Manifests,
) -> BTreeMap<&'a str, Vec<&'a Link>> {
    let manifest = |name: &str| manifests.get(&system.component(name)?.kind.value);
    let mut required: BTreeMap<&str, Vec<_>> = BTreeMap::new();
    for link in system.links.iter().filter(|link| link.mode == LinkMode::Push) {
        let (from, to) = (&link.from, &link.to);
        let is_latched = manifest(&from.component.value).is_none_or(|manifest| {
            manifest.outputs.iter().any(|it| it.id == from.port.value && it.latched)
        });
        let is_required = manifest(&to.component.value).is_some_and(|manifest| {
            manifest.inputs.iter().any(|it| it.id == to.port.value && it.required)
        });
        // Of several sources any one may deliver.
        let feeds_same = |other: &&Link| other.to.data() == to.data();
        let is_only = system.links.iter().filter(feeds_same).count() == 1;
        if is_required && !is_latched && is_only {
            required.entry(&to.component.value).or_default().push(link);
        }
    }
    required
}

/// Returns the nearest link whose source is frozen, on the way back along required data.
fn frozen_source<'a>(
    component: &'a str,
    supplies: &BTreeMap<&'a str, Vec<&'a Link>>,
    is_frozen: impl Fn(&str) -> bool,
    is_called_by_data: impl Fn(&str) -> bool,
    steps: &mut usize,
) -> Option<&'a Link> {
    let mut reached = BTreeSet::from([component]);
    let mut queue = std::collections::VecDeque::from([component]);
    while let Some(next) = queue.pop_front() {
        for link in supplies.get(next).into_iter().flatten() {
            *steps += 1;
            if *steps > MAX_STEPS {
                return None;
            }
            let source = link.from.component.value.as_str();
            if is_frozen(source) {
                return Some(link);
            }
            if reached.insert(source) && is_called_by_data(source) {
                queue.push_back(source);
            }
        }
    }
    None
}
