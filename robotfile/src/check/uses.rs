//! What a file uses of its components: parameters, ports and events, in links, places, guards and
//! transitions. A kind that lacks some of it is probably not the one that was meant.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::Manifest;

use crate::guard::{Guard, Name};
use crate::model::Configuration;

/// What is used of a component.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Use {
    Parameter,
    Input,
    Output,
    Event,
}

/// Returns whether the kind has this parameter or port, or may report this event.
pub(super) fn has(kind: &Manifest, (is, name): (Use, &str)) -> bool {
    match is {
        Use::Parameter => kind.parameters.iter().any(|it| it.name == name),
        Use::Input => kind.inputs.iter().any(|it| it.id == name),
        Use::Output => kind.outputs.iter().any(|it| it.id == name),
        Use::Event => {
            let is_it = |event: &armor_wire::manifest::EventManifest| {
                event.name == name || !event.named_by.is_empty()
            };
            kind.common_reports().contains(&name)
                || kind.events.as_ref().is_none_or(|events| events.iter().any(is_it))
        }
    }
}

/// What is used of one component.
#[derive(Default)]
pub(super) struct ComponentUses(BTreeSet<(Use, String)>);

impl ComponentUses {
    /// Returns what is used of each component that something is used of.
    pub(super) fn collect(configuration: &Configuration) -> BTreeMap<String, Self> {
        let mut all: BTreeMap<String, Self> = BTreeMap::new();
        let mut add = |component: &str, is: Use, name: &str| {
            all.entry(component.to_owned()).or_default().0.insert((is, name.to_owned()));
        };
        let system = &configuration.system;
        for component in &system.components {
            for given in &component.parameters {
                add(&component.name.value, Use::Parameter, &given.name.value);
            }
        }
        let sources = system.links.iter().map(|link| &link.from);
        let sources = sources.chain(system.clock.iter().map(|clock| &clock.source));
        for port in sources {
            add(&port.component.value, Use::Output, &port.port.value);
        }
        for port in system.links.iter().map(|link| &link.to) {
            add(&port.component.value, Use::Input, &port.port.value);
        }
        for mission in configuration.missions() {
            for given in mission.places.iter().flat_map(|place| &place.parameters) {
                add(&given.component.value, Use::Parameter, &given.parameter.name.value);
            }
            for on in mission.transitions.iter().filter_map(|it| it.on.as_ref()) {
                add(&on.component.value, Use::Event, &on.event.value);
            }
            let followed = mission.variables.iter().filter_map(|it| it.source.as_ref());
            let mut names: Vec<_> =
                followed.filter_map(|source| Name::of_data(&source.value)).collect();
            for when in mission.transitions.iter().filter_map(|it| it.when.as_ref()) {
                names.extend(Guard::parse(&when.value).iter().flat_map(Guard::names).cloned());
            }
            for data in names.iter().filter_map(Name::data) {
                if let Some((component, output)) = data.split_once('.') {
                    add(component, Use::Output, output);
                }
            }
        }
        all
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (Use, &str)> {
        self.0.iter().map(|(is, name)| (*is, name.as_str()))
    }

    /// Returns whether the kind has all of it.
    pub(super) fn is_known_to(&self, kind: &Manifest) -> bool {
        self.iter().all(|it| has(kind, it))
    }

    /// Returns the inputs and parameters that the kind needs and that are not given.
    pub(super) fn find_missing<'a>(&self, kind: &'a Manifest) -> Vec<&'a str> {
        let is_given = |is: Use, name: &str| self.iter().any(|it| it == (is, name));
        let inputs = kind.inputs.iter().filter(|it| it.required && !is_given(Use::Input, &it.id));
        let parameters = kind.parameters.iter();
        let parameters = parameters
            .filter(|it| it.default.is_none() && !is_given(Use::Parameter, &it.name))
            .map(|it| it.name.as_str());
        inputs.map(|it| it.id.as_str()).chain(parameters).collect()
    }
}
