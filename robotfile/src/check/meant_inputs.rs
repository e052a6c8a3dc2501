//! Inputs that are fed twice, or by data of another type, while another input, which is not fed, takes
//! these data: that one was probably meant.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use armor_wire::manifest::{Manifest, PortManifest};

use crate::check::ports::{find_port, is_same_type};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Link, System};
use crate::source::{Location, Span};

/// Improves the findings about inputs that are fed twice: if one of the two links carries data of
/// another type, that is the finding; if an input that needs such data is not fed, it was probably
/// meant.
pub(super) fn explain_fed_twice(
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let fed: BTreeSet<_> = system
        .links
        .iter()
        .map(|link| (link.to.component.value.as_str(), link.to.port.value.as_str()))
        .collect();
    let wrong: BTreeSet<_> =
        findings.iter().filter(|f| f.code == Code::TypeMismatch).filter_map(place_of).collect();
    let is_wrong = |at: &Location| wrong.contains(&(at.source.path(), at.span));
    let mut dropped = BTreeSet::new();
    let mut remedies = BTreeMap::new();
    for finding in findings.iter().filter(|finding| finding.code == Code::InputFedTwice) {
        let Some(place) = place_of(finding) else { continue };
        let first = finding.related.first().map(|(at, _)| at);
        if wrong.contains(&place) || first.is_some_and(is_wrong) {
            dropped.insert((place.0.to_path_buf(), place.1));
            continue;
        }
        let link = system.links.iter().find(|link| link.to.at.span == place.1);
        let output = link.and_then(|link| find_port(&link.from, kinds, true));
        let unfed = output.and_then(|output| {
            system.components.iter().find_map(|component| {
                let name = component.name.value.as_str();
                let mut inputs = kinds.get(name)?.inputs.iter().filter(|input| input.required);
                let is_meant = |input: &&PortManifest| {
                    is_same_type(output, input) && !fed.contains(&(name, input.id.as_str()))
                };
                inputs.find(is_meant).map(|input| format!("{name}.{}", input.id))
            })
        });
        let unfed = unfed.or_else(|| {
            // Of the same component, or where the same data were linked twice, of any other one.
            let (link, output) = (link?, output?);
            let is_repeated = system
                .links
                .iter()
                .filter(|it| it.to.data() == link.to.data() && it.from.data() == link.from.data())
                .count()
                > 1;
            let own = link.to.component.value.as_str();
            let names = system.components.iter().map(|it| it.name.value.as_str());
            names.filter(|name| (*name == own) != is_repeated).find_map(|name| {
                let mut inputs = kinds.get(name)?.inputs.iter();
                let is_meant = |input: &&PortManifest| {
                    is_same_type(output, input)
                        && !fed.contains(&(name, input.id.as_str()))
                        && (!is_repeated || input.id == link.to.port.value)
                };
                inputs.find(is_meant).map(|input| format!("{name}.{}", input.id))
            })
        });
        let unfed = unfed.or_else(|| {
            // Or of another component than the one that sends the data, if it is the only one.
            let other = system.links.iter().find(|it| first.is_some_and(|at| it.to.at.is_at(at)));
            let free = [other, link].into_iter().flatten().flat_map(|link| {
                let output = find_port(&link.from, kinds, true);
                let fed = &fed;
                let names = system.components.iter().map(|it| it.name.value.as_str());
                let names = names.filter(move |name| *name != link.from.component.value);
                names.flat_map(move |name| {
                    let inputs = kinds.get(name).into_iter().flat_map(|it| &it.inputs);
                    let fits = inputs.filter(move |input| {
                        output.is_some_and(|output| is_same_type(output, input))
                            && !input.is_any()
                            && !fed.contains(&(name, input.id.as_str()))
                    });
                    fits.map(move |input| format!("{name}.{}", input.id))
                })
            });
            let mut free = free.collect::<BTreeSet<_>>().into_iter();
            free.next().filter(|_| free.next().is_none())
        });
        // The same output twice: the other link may be from one that nothing uses.
        let unused = first.and_then(|_| find_unused_output(link?, system, kinds));
        if let Some(unused) = unused {
            let remedy = format!("did you mean from=\"{unused}\", which no link uses?");
            remedies.insert((place.0.to_path_buf(), place.1), remedy);
        } else if let Some(unfed) = unfed {
            let remedy = format!("was one meant for {unfed}, which nothing feeds?");
            remedies.insert((place.0.to_path_buf(), place.1), remedy);
        }
    }
    let key = |finding: &Finding| {
        let place = place_of(finding).filter(|_| finding.code == Code::InputFedTwice);
        place.map(|(path, span)| (path.to_path_buf(), span))
    };
    findings.retain(|finding| key(finding).is_none_or(|place| !dropped.contains(&place)));
    for finding in findings.iter_mut() {
        if let Some(remedy) = key(finding).and_then(|place| remedies.remove(&place)) {
            finding.remedy = format!("{remedy} Otherwise {}", finding.remedy);
        }
    }
}

/// Returns the only output of this type that no link uses, of another component with the same port,
/// where two links are alike.
fn find_unused_output(
    link: &Link,
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
) -> Option<String> {
    let is_alike =
        |it: &&Link| it.from.data() == link.from.data() && it.to.data() == link.to.data();
    if system.links.iter().filter(is_alike).count() < 2 {
        return None;
    }
    let output = find_port(&link.from, kinds, true)?;
    let all = system.components.iter().flat_map(|component| {
        let name = component.name.value.as_str();
        let outputs = kinds.get(name).into_iter().flat_map(|kind| &kind.outputs);
        outputs.map(move |it| (name, it))
    });
    let is_used = |name: &str, port: &str| {
        let mut links = system.links.iter();
        links.any(|it| it.from.component.value == name && it.from.port.value == port)
    };
    let mut unused = all.filter(|(name, it)| {
        is_same_type(output, it) && it.id == output.id && !it.is_any() && !is_used(name, &it.id)
    });
    let (Some((name, port)), None) = (unused.next(), unused.next()) else { return None };
    Some(format!("{name}.{}", port.id))
}

/// Merges a link to an input of another type with the input that takes its data and that nothing
/// feeds, if there is one: it is meant.
pub(super) fn explain_unfed(
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let mut explained = Vec::new();
    for finding in findings.iter_mut().filter(|it| it.code == Code::TypeMismatch) {
        let is_its = |link: &&Link| finding.at.as_ref().is_some_and(|at| link.to.at.is_at(at));
        let Some(link) = system.links.iter().find(is_its) else { continue };
        let Some(output) = find_port(&link.from, kinds, true) else { continue };
        let is_fed = |name: &str, id: &str| {
            let mut links = system.links.iter();
            links.any(|it| it.to.component.value == name && it.to.port.value == id)
        };
        let mut meant = system.components.iter().flat_map(|component| {
            let kind = kinds.get(component.name.value.as_str());
            let inputs = kind.into_iter().flat_map(|kind| {
                kind.inputs.iter().filter(|input| {
                    let mut groups = kind.needs_one_of.iter();
                    input.required || groups.any(|it| it.contains(&input.id))
                })
            });
            let name = component.name.value.as_str();
            inputs
                .filter(move |it| is_same_type(output, it) && !it.is_any() && !is_fed(name, &it.id))
                .map(move |input| (component, input))
        });
        let Some((component, input)) = meant.next().filter(|_| meant.next().is_none()) else {
            continue;
        };
        let name = &component.name;
        finding.remedy = format!(
            "did you mean to=\"{}.{}\"? It takes {}, and nothing feeds it",
            name.value, input.id, output.type_name
        );
        explained.push((name.at.clone(), format!("{}.{}", name.value, input.id)));
    }
    findings.retain(|finding| {
        let is_it = |(at, input): &(Location, String)| {
            finding.at.as_ref().is_some_and(|it| it.is_at(at))
                && (finding.message.contains(input) || finding.remedy.contains(input))
        };
        finding.code != Code::InputUnfed || !explained.iter().any(is_it)
    });
}

fn place_of(finding: &Finding) -> Option<(&Path, Span)> {
    finding.at.as_ref().map(|at| (at.source.path(), at.span))
}
