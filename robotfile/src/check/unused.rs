//! Unused parts: outputs that no link uses, components that nothing refers to.

use std::collections::BTreeSet;

use armor_wire::Message;
use armor_wire::clock::Clock;
use armor_wire::manifest::Manifest;

use crate::check::manifests::Manifests;
use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::guard::{Guard, Name};
use crate::model::{Component, Configuration};

pub(super) fn check(configuration: &Configuration, manifests: &Manifests, findings: &mut Findings) {
    let used = Used::of(configuration);
    for component in &configuration.system.components {
        if let Some(manifest) = manifests.get(&component.kind.value) {
            used.check_component(component, manifest, findings);
        }
    }
}

/// The parts of the system that the file refers to.
#[derive(Default)]
struct Used<'a> {
    components: BTreeSet<&'a str>,
    /// Component and output.
    outputs: BTreeSet<(&'a str, &'a str)>,
    /// The outputs that guards and variables use, as `component.output`.
    watched: BTreeSet<String>,
    /// Whether the system has one component only.
    is_alone: bool,
}

impl<'a> Used<'a> {
    fn of(configuration: &'a Configuration) -> Self {
        let system = &configuration.system;
        let mut used = Self { is_alone: system.components.len() < 2, ..Self::default() };
        let clock = system.clock.iter().map(|clock| &clock.source);
        for from in system.links.iter().map(|link| &link.from).chain(clock) {
            used.outputs.insert((&from.component.value, &from.port.value));
            used.components.insert(&from.component.value);
        }
        used.components.extend(system.links.iter().map(|link| link.to.component.value.as_str()));
        for mission in configuration.missions() {
            let sources = mission.variables.iter().filter_map(|variable| variable.source.as_ref());
            let guards = mission.transitions.iter().filter_map(|t| t.when.as_ref());
            for text in sources.chain(guards) {
                let guard = Guard::parse(&text.value);
                let data = guard.iter().flat_map(Guard::names).filter_map(Name::data);
                used.watched.extend(data.map(str::to_owned));
            }
            let in_places = mission.places.iter().flat_map(|place| &place.components);
            used.components.extend(in_places.map(|name| name.value.as_str()));
            let reporters = mission.transitions.iter().filter_map(|t| t.on.as_ref());
            used.components.extend(reporters.map(|on| on.component.value.as_str()));
        }
        used
    }

    fn check_component(&self, component: &Component, manifest: &Manifest, findings: &mut Findings) {
        let name = component.name.value.as_str();
        let has_ports = !manifest.inputs.is_empty() || !manifest.outputs.is_empty();
        // A required input without a link is an error already.
        let is_refused = manifest.inputs.iter().any(|input| input.required);
        let is_watched =
            manifest.outputs.iter().any(|it| self.watched.contains(&format!("{name}.{}", it.id)));
        let is_idle = !is_watched && !self.components.contains(name);
        if has_ports && !is_refused && !self.is_alone && is_idle {
            let message = format!("{name} is unused: it has no link and is in no place");
            let finding = Finding::new(Code::ComponentIdle, &component.name.at, message);
            findings.push(finding.remedy("link it, or remove it"));
            return;
        }
        let unused = |output: &&str| {
            !self.outputs.contains(&(name, output))
                && !self.watched.contains(&format!("{name}.{output}"))
        };
        // A clock is used by `<clock>`, not by a link.
        let outputs = manifest.outputs.iter().filter(|output| output.type_name != Clock::NAME);
        let outputs = outputs.map(|output| output.id.as_str());
        let unused: Vec<_> =
            outputs.filter(unused).map(|output| format!("{name}.{output}")).collect();
        if !unused.is_empty() {
            let message = format!("no link uses {}", unused.join(", "));
            let finding = Finding::new(Code::UnusedOutput, &component.name.at, message);
            findings.push(finding.remedy("link what is needed, or ignore this note"));
        }
    }
}
