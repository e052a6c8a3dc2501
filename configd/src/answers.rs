//! The model in the words of the protocol.

use std::path::Path;

use armor_missions::Configuration;
use armor_missions::model::{self, Component};
use armor_wire::config::{Assigned, InputSettings, Settings};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::keep::Transport;

/// Names listed to a component that the file does not hold.
const MAX_LISTED: usize = 20;

/// How the component runs and is connected.
pub(crate) fn settings(
    component: &Component,
    configuration: &Configuration,
    version: u64,
) -> Settings {
    let name = &component.name.value;
    let links = configuration.system.links.iter().filter(|link| link.to.component.value == *name);
    let inputs = links.map(|link| InputSettings {
        id: link.to.port.value.clone(),
        data: link.from.data(),
        keep: link.keep,
        wake: link.wake,
        transport: match link.transport {
            model::Transport::Tcp => Transport::Tcp,
            _ => Transport::Auto,
        },
    });
    let mission = configuration.mission.as_ref();
    Settings {
        version,
        rate_hz: component.rate_hz.as_ref().map(|rate| rate.value),
        controlled: component.controllable && mission.is_some_and(|mission| mission.controls(name)),
        inputs: inputs.collect(),
        // The format has no attribute for it.
        watchdog_s: None,
    }
}

/// What the file, or `--set`, gives a parameter; nothing if it leaves it to its default. Relative
/// folders of the file start from `root`.
pub(crate) fn assigned(component: &Component, parameter: &str, root: &Path) -> Option<Assigned> {
    let parameter = component.parameter(parameter)?;
    Some(Assigned {
        text: parameter.value.value.clone(),
        base: root.join(&parameter.folder).to_string_lossy().into_owned(),
        origin: parameter.origin(),
    })
}

/// Why a component that the file does not hold gets nothing.
pub(crate) fn no_component(name: &str, configuration: &Configuration) -> Refusal {
    let components = &configuration.system.components;
    let mut names: Vec<_> =
        components.iter().take(MAX_LISTED).map(|component| component.name.value.as_str()).collect();
    if components.len() > MAX_LISTED {
        names.push("…");
    }
    let file = configuration.sources.last().map(|source| source.path().display().to_string());
    let text = format!(
        "{} holds no component called `{name}`; it holds: {}",
        file.as_deref().unwrap_or("the system"),
        names.join(", ")
    );
    Refusal::new(RefusalCode::UnknownData, text)
}
