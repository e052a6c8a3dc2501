//! A component that one place activates by mistake: the mission controls it then, so it is frozen in
//! all other places, and what needs it there is found. The mistake is in that place.

use std::collections::{BTreeMap, BTreeSet};

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::Place;
use crate::model::Configuration;
use crate::source::Spanned;

/// Names the place in the findings about frozen components, if several follow from it; and merges that
/// a component is missing there, in place of which the wrong one was written.
pub(super) fn advise(configuration: &Configuration, findings: &mut Findings) {
    if findings.iter().all(|finding| finding.frozen.is_empty()) {
        return;
    }
    let lone = find_lone(configuration);
    let find = |finding: &Finding| {
        // Merged findings each stand for a place or a link that needs the component.
        let own = usize::from(finding.code == Code::Starved);
        let is_needed_often = finding.related.len() > own;
        let mut frozen = finding.frozen.iter().filter(|_| is_needed_often);
        frozen.find_map(|name| Some((name.clone(), *lone.get(name.as_str())?)))
    };
    let Some((name, (place, named))) = findings.iter().find_map(find) else { return };
    let mut missing = findings.iter().filter(|finding| {
        let is_there =
            |it: &Spanned<String>| finding.at.as_ref().is_some_and(|at| at.is_at(&it.at));
        finding.code == Code::LoopInterrupted
            && !finding.frozen.contains(&name)
            && place.components.iter().any(is_there)
    });
    let missing = missing.next().cloned().filter(|_| missing.next().is_none());
    let place = &place.name.value;
    let Some(finding) = findings.iter_mut().find(|it| find(it).is_some()) else { return };
    finding.remedy = match missing.as_ref().and_then(|it| it.frozen.first()) {
        Some(meant) => format!(
            "did you mean {meant} in place of {name} in {place}? Otherwise {}",
            finding.remedy
        ),
        None => format!(
            "take {name} out of {place}, the only place that activates it: then it is always active; \
             or {}",
            finding.remedy
        ),
    };
    let message = format!("only {place} activates {name}, so it is frozen everywhere else");
    let needing = std::mem::replace(&mut finding.message, message);
    let at = finding.at.replace(named.at.clone());
    finding.related.splice(0..0, at.map(|at| (at, needing)));
    if let Some(missing) = missing {
        finding.merge_place(missing.clone());
        findings
            .retain(|finding| finding.code != missing.code || finding.message != missing.message);
    }
}

/// The components that only one place activates, together with others, and that exclude no other.
fn find_lone(configuration: &Configuration) -> BTreeMap<&str, (&Place, &Spanned<String>)> {
    let mut lone: BTreeMap<&str, (&Place, &Spanned<String>)> = BTreeMap::new();
    let mut others = BTreeSet::new();
    for mission in configuration.missions() {
        let sets = mission.exclusives.iter().flat_map(|set| &set.components);
        others.extend(sets.map(|name| name.value.as_str()));
        for place in &mission.places {
            for name in &place.components {
                let is_alone = place.components.len() < 2;
                if lone.insert(&name.value, (place, name)).is_some() || is_alone {
                    others.insert(name.value.as_str());
                }
            }
        }
    }
    lone.retain(|name, _| !others.contains(name));
    lone
}
