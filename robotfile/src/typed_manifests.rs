//! The manifests of the components of a system, in which ports that take any type have the one that
//! they get in this file: that of the first link.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, PortManifest};

use crate::manifests::Manifests;
use crate::model::{Link, Port, System};

/// The manifest of each component whose kind is known.
pub struct TypedManifests<'a> {
    by_name: BTreeMap<&'a str, Cow<'a, Manifest>>,
    /// The first link to each input that takes any type, by component and input.
    first: BTreeMap<(&'a str, &'a str), &'a Link>,
    /// For each component that passes messages on, the input from which its outputs have their type.
    passed: BTreeMap<&'a str, &'a str>,
    /// Those outputs, by component and output.
    passing: BTreeSet<(&'a str, &'a str)>,
}

impl<'a> TypedManifests<'a> {
    /// Finds the types. A port keeps the type `Any` if it is not linked, or if the type of what feeds
    /// it is not known.
    pub fn of(system: &'a System, manifests: &'a Manifests) -> Self {
        let components = system.components.iter();
        let kinds = components.filter_map(|component| {
            Some((component.name.value.as_str(), manifests.get(&component.kind.value)?))
        });
        let kinds: BTreeMap<&str, &Manifest> = kinds.collect();
        let by_name = kinds.iter().map(|(name, kind)| (*name, Cow::Borrowed(*kind))).collect();
        let (first, passed, passing) = Default::default();
        let mut typed = Self { by_name, first, passed, passing };
        for (name, kind) in &kinds {
            let input = kind.inputs.iter().find(|input| input.is_any());
            if let Some(input) = input.filter(|_| kind.outputs.iter().any(PortManifest::is_any)) {
                typed.passed.insert(name, &input.id);
                let outputs = kind.outputs.iter().filter(|output| output.is_any());
                typed.passing.extend(outputs.map(|output| (*name, output.id.as_str())));
            }
        }
        for link in &system.links {
            let (component, input) =
                (link.to.component.value.as_str(), link.to.port.value.as_str());
            let kind = kinds.get(component);
            let is_any = |port: &PortManifest| port.id == input && port.is_any();
            if kind.is_some_and(|kind| kind.inputs.iter().any(is_any)) {
                typed.first.entry((component, input)).or_insert(link);
            }
        }
        typed.resolve();
        typed
    }

    /// Gives types along the links: one component that passes messages on may feed another one.
    fn resolve(&mut self) {
        // What waits for the type of a component's outputs.
        let mut waiting: BTreeMap<&str, Vec<_>> = BTreeMap::new();
        let mut ready = Vec::new();
        for (input, link) in &self.first {
            match self.find_output(&link.from) {
                Some(output) if output.is_any() => {
                    waiting.entry(&link.from.component.value).or_default().push((*input, *link));
                }
                Some(_) => ready.push((*input, *link)),
                None => {}
            }
        }
        while let Some(((component, input), link)) = ready.pop() {
            let Some(source) = self.find_output(&link.from).cloned() else { continue };
            let Some(kind) = self.by_name.get_mut(component) else { continue };
            let passes = self.passed.get(component) == Some(&input);
            let kind = kind.to_mut();
            let inputs = kind.inputs.iter_mut().filter(|port| port.id == input);
            let outputs = kind.outputs.iter_mut().filter(|port| passes && port.is_any());
            for port in inputs.chain(outputs) {
                port.type_name.clone_from(&source.type_name);
                port.schema.clone_from(&source.schema);
                port.schema_hash = source.schema_hash;
            }
            if passes {
                ready.extend(waiting.remove(component).unwrap_or_default());
            }
        }
    }

    /// The manifest of a component; `None` if there is no such component, or its kind is unknown.
    pub fn find(&self, component: &str) -> Option<&Manifest> {
        self.by_name.get(component).map(AsRef::as_ref)
    }

    /// All of them, by component.
    pub fn iter(&self) -> impl Iterator<Item = (&'a str, &Manifest)> {
        self.by_name.iter().map(|(name, kind)| (*name, kind.as_ref()))
    }

    fn find_output(&self, port: &Port) -> Option<&PortManifest> {
        let kind = self.find(&port.component.value)?;
        kind.outputs.iter().find(|output| output.id == port.port.value)
    }

    /// The link from which an input that takes any type has its type.
    pub(crate) fn first_link(&self, input: &Port) -> Option<&'a Link> {
        self.first.get(&(input.component.value.as_str(), input.port.value.as_str())).copied()
    }

    /// The input of the component whose messages come out of `output`.
    pub(crate) fn passed_input(&self, output: &Port) -> Option<&'a str> {
        let component = output.component.value.as_str();
        let is_passing = self.passing.contains(&(component, output.port.value.as_str()));
        self.passed.get(component).copied().filter(|_| is_passing)
    }
}
