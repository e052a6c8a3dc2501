//! Every required input is fed.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, PortManifest};
use armor_wire::name::is_name;

use crate::check::ports::{describe_type, find_port, is_same_type};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Component, Port, System};
use crate::unreadable::UnreadableParts;

/// Which inputs are fed, also those that a mistaken link was probably meant for.
pub(super) struct FedInputs<'a> {
    /// Component and port at either end of a link: the ends may be exchanged.
    ends: BTreeSet<(&'a str, &'a str)>,
    /// Ends that are not there, in the component or in the port.
    mistaken: Vec<(&'a str, &'a str)>,
    /// The components and data types of links to an input of another type: they may be meant for
    /// another input of the component.
    misdirected: BTreeSet<(&'a str, u64)>,
    /// The data types of links to an input that another link feeds too: one of them may be meant for
    /// an input of another component.
    doubled: BTreeSet<u64>,
    /// What could not be read.
    unreadable: &'a UnreadableParts,
}

impl<'a> FedInputs<'a> {
    pub(super) fn of(system: &'a System, kinds: &BTreeMap<&str, &Manifest>) -> Self {
        let links = &system.links;
        let components: BTreeSet<_> =
            system.components.iter().map(|c| c.name.value.as_str()).collect();
        let name = |port: &'a Port| (port.component.value.as_str(), port.port.value.as_str());
        let ends = links.iter().flat_map(|link| [&link.from, &link.to]).map(name).collect();
        let is_there = |(component, port): &(&str, &str)| match kinds.get(component) {
            Some(kind) => kind.inputs.iter().chain(&kind.outputs).any(|known| known.id == *port),
            // Of an unknown kind any port may be there.
            None => components.contains(component) || system.unreadable.may_contain(component),
        };
        let is_output = |(component, port): &(&str, &str)| {
            let kind = kinds.get(component);
            kind.is_some_and(|kind| kind.outputs.iter().any(|known| known.id == *port))
        };
        let to = links.iter().map(|link| name(&link.to));
        let mut fed = Self {
            ends,
            mistaken: to.filter(|end| !is_there(end) || is_output(end)).collect(),
            misdirected: BTreeSet::new(),
            doubled: BTreeSet::new(),
            unreadable: &system.unreadable,
        };
        let mut seen = BTreeSet::new();
        for link in links {
            let is_second = !seen.insert(name(&link.to));
            let ends = (find_port(&link.from, kinds, true), find_port(&link.to, kinds, false));
            let (Some(output), Some(input)) = ends else { continue };
            if !is_same_type(output, input) {
                fed.misdirected.insert((&link.to.component.value, output.schema_hash));
            } else if is_second && !input.many {
                fed.doubled.insert(output.schema_hash);
            }
        }
        fed
    }

    /// Whether a link ends at a port of the component that is no input.
    pub(super) fn has_mistaken(&self, component: &str) -> bool {
        self.mistaken.iter().any(|(other, _)| *other == component)
    }

    fn is_fed(&self, component: &str, input: &PortManifest) -> bool {
        let name = input.id.as_str();
        self.unreadable.may_feed(component, name)
            || self.ends.contains(&(component, name))
            || self.misdirected.contains(&(component, input.schema_hash))
            || self.doubled.contains(&input.schema_hash)
            || self.mistaken.iter().any(|(other, port)| *other == component || *port == name)
    }
}

pub(super) fn check_required(
    component: &Component,
    manifest: &Manifest,
    fed: &FedInputs<'_>,
    findings: &mut Findings,
) {
    let name = &component.name;
    if !is_name(&name.value) {
        // Links may name it as it was meant; that it is malformed is a finding already.
        return;
    }
    let inputs = manifest.inputs.iter().filter(|input| input.required);
    for input in inputs.filter(|input| !fed.is_fed(&name.value, input)) {
        let message =
            format!("nothing feeds {}.{}, which {} needs", name.value, input.id, manifest.kind);
        let finding = Finding::new(Code::InputUnfed, &name.at, message);
        let remedy = format!(
            "add <link from=\"…\" to=\"{}.{}\"/>, from an output of {}",
            name.value,
            input.id,
            describe_type(input)
        );
        findings.push(finding.remedy(remedy));
    }
}
