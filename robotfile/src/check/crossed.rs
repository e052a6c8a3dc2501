//! Links whose ends were exchanged with those of another: an input takes data of another output than
//! the one with its name, although both have the same type.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, PortManifest};

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Link, System};

/// Warns of a link from `a.truth` to `b.pose` where `c.pose` publishes the same type, and an input
/// called `truth` takes it: each end has a partner of its own name. A filter between two components
/// (`driver.velocity`, `limiter.limited`) has none, and is no mistake.
pub(super) fn check(system: &System, manifests: &Manifests, findings: &mut Findings) {
    let kinds: BTreeMap<&str, &Manifest> = system
        .components
        .iter()
        .filter_map(|it| Some((it.name.value.as_str(), manifests.get(&it.kind.value)?)))
        .collect();
    let ports = |is_output: bool| {
        kinds.iter().flat_map(move |(name, kind)| {
            let ports = if is_output { &kind.outputs } else { &kind.inputs };
            ports.iter().map(move |port| (*name, port))
        })
    };
    let inputs: BTreeSet<_> =
        ports(false).map(|(_, port)| (port.id.as_str(), port.schema_hash)).collect();
    let mut outputs: BTreeMap<_, Vec<&str>> = BTreeMap::new();
    for (name, port) in ports(true) {
        outputs.entry((port.id.as_str(), port.schema_hash)).or_default().push(name);
    }
    // Two links whose outputs are exchanged are one mistake.
    let mut exchanged = BTreeSet::new();
    for link in &system.links {
        let Some((from, to)) = ports_of(link, &kinds) else { continue };
        let has_partner = inputs.contains(&(from.id.as_str(), to.schema_hash));
        if from.id == to.id || from.schema_hash != to.schema_hash || !has_partner {
            continue;
        }
        let named = outputs.get(&(to.id.as_str(), to.schema_hash)).into_iter().flatten();
        let consumer = link.to.component.value.as_str();
        let Some(producer) = named.copied().find(|name| *name != consumer) else { continue };
        let (from, to) = (link.from.data(), link.to.data());
        let meant = format!("{producer}.{}", link.to.port.value);
        if exchanged.contains(&link.from.at.span) {
            continue;
        }
        let remedy = if let Some(other) = find_exchanged(link, &meant, system) {
            exchanged.insert(other.from.at.span);
            format!("exchange the outputs of the two links: from=\"{meant}\" here")
        } else if producer != link.from.component.value {
            format!(
                "write from=\"{meant}\"; if {from} is meant, remove the component that publishes \
                 {meant}"
            )
        } else {
            format!("write from=\"{meant}\"")
        };
        let message =
            format!("{to} takes {from}, although {meant} has its name and publishes the same type");
        let finding = Finding::new(Code::CrossedLink, &link.from.at, message);
        findings.push(finding.remedy(remedy));
    }
}

/// Returns the link that takes what this one should take, and gives it to an input with the name of
/// this one's output.
fn find_exchanged<'a>(link: &Link, meant: &str, system: &'a System) -> Option<&'a Link> {
    let is_it =
        |other: &&Link| other.from.data() == meant && other.to.port.value == link.from.port.value;
    system.links.iter().find(is_it)
}

fn ports_of<'a>(
    link: &Link,
    kinds: &BTreeMap<&str, &'a Manifest>,
) -> Option<(&'a PortManifest, &'a PortManifest)> {
    let kind = |name: &str| kinds.get(name).copied();
    let outputs = &kind(&link.from.component.value)?.outputs;
    let inputs = &kind(&link.to.component.value)?.inputs;
    let output = outputs.iter().find(|port| port.id == link.from.port.value)?;
    let input = inputs.iter().find(|port| port.id == link.to.port.value)?;
    Some((output, input))
}
