//! Answers to components, from the model to the messages of the protocol.

use std::collections::BTreeSet;
use std::path::Path;

use armor_robotfile::mission::PlaceParameter;
use armor_robotfile::model::{self, Component};
use armor_robotfile::{Configuration, Manifests, Mission, suggest_similar};
use armor_wire::config::{
    Assigned, ComponentSettings, InputSettings, ListedParameter, ListedType, cut_text,
};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::registry::DataReader;
use armor_wire::transport::Transport;

/// Most names that are listed to a component that is not in the file.
const MAX_LISTED: usize = 20;
/// Origin of a default.
const DEFAULT: &str = "default";

/// Returns how the component runs and is connected. `commanded`: whether the mission activates and
/// freezes it.
pub(crate) fn component_settings(
    component: &Component,
    configuration: &Configuration,
    commanded: bool,
    version: u64,
) -> ComponentSettings {
    let name = &component.name.value;
    let links = configuration.system.links.iter().filter(|link| link.to.component.value == *name);
    let inputs = links.map(|link| InputSettings {
        id: link.to.port.value.clone(),
        data: link.from.data(),
        keep: link.find_policy(),
        wake: link.wake,
        transport: match link.transport {
            model::Transport::Tcp => Transport::Tcp,
            model::Transport::Shm => Transport::Shm,
            model::Transport::Udp => Transport::Udp,
            model::Transport::Auto => Transport::Auto,
        },
        history: link.history,
    });
    ComponentSettings {
        version,
        rate_hz: component.rate_hz.as_ref().map(|rate| rate.value),
        controlled: commanded,
        inputs: inputs.collect(),
        clock: clock_source(name, configuration),
        watchdog_s: component.watchdog.as_ref().map(|watchdog| watchdog.value.as_secs_f64()),
    }
}

/// Returns the data that the component's time follows; none for its provider, which uses the host's
/// clock.
fn clock_source(component: &str, configuration: &Configuration) -> Option<String> {
    let source = &configuration.system.clock.as_ref()?.source;
    (source.component.value != component).then(|| source.data())
}

/// Returns what each component reads: the data of its links, and that which its time follows; `clock`
/// replaces that of the file.
pub(crate) fn list_readers(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    clock: Option<&String>,
) -> Vec<DataReader> {
    let system = &configuration.system;
    let list_data = |name: &String| {
        let links = system.links.iter().filter(|link| link.to.component.value == *name);
        let clock = clock.cloned().or_else(|| clock_source(name, configuration));
        let data: BTreeSet<_> = links.map(|link| link.from.data()).chain(clock).collect();
        data.into_iter().collect()
    };
    let reads_all = |component: &Component| {
        let kind = manifests.and_then(|known| known.get(&component.kind.value));
        kind.is_some_and(|kind| kind.reads_all)
    };
    let readers = system.components.iter().map(|component| DataReader {
        component: component.name.value.clone(),
        data: list_data(&component.name.value),
        reads_all: reads_all(component),
    });
    readers.collect()
}

/// What the file, or `--set`, gives a parameter; nothing if it leaves it to its default. Relative
/// folders of the file start from `root`.
pub(crate) fn assigned_value(
    component: &Component,
    parameter: &str,
    root: &Path,
) -> Option<Assigned> {
    let parameter = component.parameter(parameter)?;
    Some(Assigned {
        text: parameter.value.value.clone(),
        base: root.join(&parameter.folder).to_string_lossy().into_owned(),
        origin: parameter.origin(),
    })
}

/// Returns the refusal for a component that is not in the file.
pub(crate) fn no_component(name: &str, configuration: &Configuration) -> Refusal {
    let components = &configuration.system.components;
    let mut names: Vec<_> =
        components.iter().take(MAX_LISTED).map(|component| component.name.value.as_str()).collect();
    if components.len() > MAX_LISTED {
        names.push("…");
    }
    // The first is the file that was opened; its system may be in another one.
    let main = configuration.sources.first().map(|source| source.path().display().to_string());
    let owner = match (main, configuration.sources.len()) {
        (None, _) => "the system".into(),
        (Some(main), 1) => main,
        (Some(main), _) => format!("the system of {main}"),
    };
    let known = components.iter().map(|component| component.name.value.as_str());
    let listed = match suggest_similar(name, known) {
        Some(advice) => format!("{advice} It has"),
        None => "it has".into(),
    };
    let text = format!("{owner} has no component called `{name}`; {listed}: {}", names.join(", "));
    Refusal::new(RefusalCode::UnknownData, text)
}

/// Why a component gets no answer about a parameter that its kind does not have; nothing if its
/// kind is not known, or has it.
pub(crate) fn no_parameter(
    component: &Component,
    parameter: &str,
    manifests: Option<&Manifests>,
) -> Option<Refusal> {
    let manifest = manifests?.get(&component.kind.value)?;
    if manifest.parameters.iter().any(|known| known.name == parameter) {
        return None;
    }
    let names: Vec<_> = manifest.parameters.iter().map(|known| known.name.as_str()).collect();
    let has = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let listed = match suggest_similar(parameter, names.iter().copied()) {
        Some(advice) => format!("{advice} It has"),
        None => "it has".into(),
    };
    let text = format!(
        "`{}` is a {}, and that has no parameter called `{parameter}`; {listed}: {has}",
        component.name.value, manifest.kind
    );
    Some(Refusal::new(RefusalCode::UnknownData, text))
}

/// The parameters of a component: those of its kind, then what else the file assigns.
pub(crate) fn list_parameters(
    component: &Component,
    mission: Option<&Mission>,
    manifests: Option<&Manifests>,
) -> Vec<ListedParameter> {
    let places =
        |parameter: &str| cut_text(given_by_places(&component.name.value, parameter, mission));
    let manifest = manifests.and_then(|manifests| manifests.get(&component.kind.value));
    let declared: Vec<_> = manifest.iter().flat_map(|manifest| &manifest.parameters).collect();
    let assigned = |name: &str| {
        component.parameter(name).map(|given| (given.value.value.clone(), given.origin()))
    };
    let of_kind = declared.iter().map(|known| {
        let default = || (known.default.clone().unwrap_or_default(), DEFAULT.to_owned());
        let (value, origin) = assigned(&known.name).unwrap_or_else(default);
        let range = match known.choices.as_slice() {
            [] if known.format.is_some() => known.form(),
            [] => known.intended_range(),
            choices => choices.join(", "),
        };
        ListedParameter {
            component: component.name.value.clone(),
            name: known.name.clone(),
            kind: ListedType(Some(known.kind)),
            value: cut_text(value),
            unit: known.unit.clone(),
            origin: cut_text(origin),
            live: known.live,
            range: cut_text(range),
            doc: cut_text(&*known.doc),
            places: places(&known.name),
        }
    });
    let others = component.parameters.iter().map(|given| &given.name.value);
    let others = others.filter(|name| declared.iter().all(|known| known.name != **name));
    let others = others.filter_map(|name| {
        let (value, origin) = assigned(name)?;
        Some(ListedParameter {
            component: component.name.value.clone(),
            name: name.clone(),
            value: cut_text(value),
            origin: cut_text(origin),
            places: places(name),
            ..ListedParameter::default()
        })
    });
    of_kind.chain(others).collect()
}

/// `PLACE=VALUE` of each place that gives the parameter a value.
fn given_by_places(component: &str, parameter: &str, mission: Option<&Mission>) -> String {
    let places = mission.iter().flat_map(|mission| &mission.places);
    let given = places.filter_map(|place| {
        let is_it = |given: &&PlaceParameter| {
            given.component.value == component && given.parameter.name.value == parameter
        };
        let found = place.parameters.iter().find(is_it)?;
        Some(format!("{}={}", place.name.value, found.parameter.value.value))
    });
    given.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_component_is_answered_with_the_main_file_and_a_similar_name() {
        let mission = r#"<armor version="1"><mission system="robots/rover.xml" safe="a"><place name="a" initial="true" components="tank"/></mission></armor>"#;
        let system =
            r#"<armor version="1"><system><component name="tank" kind="tank"/></system></armor>"#;
        let reading = armor_robotfile::read(Path::new("m/survey.xml"), &mut |path| {
            Ok(if path.ends_with("rover.xml") { system } else { mission }.into())
        });
        let configuration = reading.configuration.expect("two valid files");
        let text = |name| no_component(name, &configuration).text;
        assert_eq!(
            text("tnak"),
            "the system of m/survey.xml has no component called `tnak`; did you mean tank? It has: \
             tank"
        );
        assert!(text("camera").ends_with("called `camera`; it has: tank"), "{}", text("camera"));
    }
}
