//! Which simulators stand in for the robots of a file.

use anyhow::{Context, Result, bail};
use armor_robotfile::model::{Component, Link, System};
use armor_robotfile::{Configuration, Manifests, advise_similar};
use armor_wire::manifest::{Manifest, PortManifest};

use crate::inspect_cli::mission::arguments::RehearseArguments;

/// The kind of the simulator.
pub const SIMULATOR: &str = "simulator";

/// The simulators of a rehearsal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StandIn {
    /// Their names in the file that is played, the source of the clock first.
    pub simulators: Vec<String>,
    /// The components that the first simulator replaces; it takes the place of the first of them. Empty if
    /// the file has simulators.
    pub replaced: Vec<String>,
    /// The links with an end that moves from another replaced component to the first one: both ends, as they
    /// are and as they will be.
    pub moved_links: Vec<[(String, String); 2]>,
    /// Whether the file has a `<clock>`.
    pub has_clock: bool,
    /// The world, relative to the current folder.
    pub world: Option<std::path::PathBuf>,
}

/// Chooses the simulators: those of the file; else one in place of the components that `--replace` names, if
/// it provides and takes all that these do.
///
/// # Errors
/// If neither is possible, or the clock of the file is another one.
pub fn choose_simulators(
    configuration: &Configuration,
    manifests: &Manifests,
    arguments: &RehearseArguments,
) -> Result<StandIn> {
    let (system, file) = (&configuration.system, arguments.file.display());
    let own = system.components.iter().filter(|it| it.kind.value == SIMULATOR);
    let own: Vec<_> = own.map(|component| component.name.value.clone()).collect();
    let clock = system.clock.as_ref().map(|clock| clock.source.component.value.clone());
    let has_clock = clock.is_some();
    let world = arguments.world.clone();
    if let Some(simulator) = own.first() {
        if let Some(replaced) = arguments.replace.first() {
            bail!(
                "--replace {replaced}: {file} has the simulator {simulator} already, and is rehearsed as it is"
            );
        }
        let source = clock.unwrap_or_else(|| simulator.clone());
        if !own.contains(&source) {
            bail!(
                "the <clock> of {file} is {source}, which is no simulator, so that its time cannot be made \
                 faster: rehearse a copy of the file with <clock source=\"{simulator}.clock\"/>"
            );
        }
        let mut simulators = own;
        simulators.retain(|name| *name != source);
        simulators.insert(0, source);
        let moved_links = Vec::new();
        return Ok(StandIn { simulators, replaced: Vec::new(), moved_links, has_clock, world });
    }
    let simulator = manifests.get(SIMULATOR).context("this program has no simulator")?;
    let Some(first) = arguments.replace.first() else {
        bail!("{}", advise_replacement(system, simulator, manifests, &file.to_string()));
    };
    if let Some(clock) = clock {
        bail!(
            "the <clock> of {file} is {clock}, so that its time cannot follow the simulator: rehearse a copy \
             of the file without <clock>"
        );
    }
    if world.is_none() {
        bail!(
            "--replace {first}: the simulator needs a world: give --world with an SVG drawing or the YAML of \
             a grid map"
        );
    }
    for name in &arguments.replace {
        let known = system.components.iter().map(|it| it.name.value.as_str());
        let Some(component) = system.component(name) else {
            bail!(
                "--replace {name}: {file} has no component of this name{}",
                advise_similar(name, known)
            );
        };
        if let Some(why) = find_mismatch(component, system, simulator, manifests) {
            bail!(
                "--replace {name}: the simulator cannot stand in for it: {why}; write a simulator of your own \
                 into a copy of the file"
            );
        }
    }
    Ok(StandIn {
        simulators: vec![first.clone()],
        moved_links: move_links(&system.links, &arguments.replace),
        replaced: arguments.replace.clone(),
        has_clock,
        world,
    })
}

/// Why the simulator does not fit the links of a component; none if it does.
fn find_mismatch(
    component: &Component,
    system: &System,
    simulator: &Manifest,
    manifests: &Manifests,
) -> Option<String> {
    let name = &component.name.value;
    let own = manifests.get(&component.kind.value);
    let find = |ports: &[PortManifest], id: &str| ports.iter().find(|port| port.id == id).cloned();
    for link in &system.links {
        let ends = [
            (&link.from, &simulator.outputs, own.map(|own| &own.outputs), "has no output"),
            (&link.to, &simulator.inputs, own.map(|own| &own.inputs), "has no input"),
        ];
        for (end, simulated, real, lacks) in ends {
            if end.component.value != *name {
                continue;
            }
            let port = &end.port.value;
            let Some(simulated) = find(simulated, port) else {
                return Some(format!("{}: the simulator {lacks} {port}", end.data()));
            };
            let real = real.and_then(|real| find(real, port));
            if let Some(real) = real.filter(|real| real.schema_hash != simulated.schema_hash) {
                return Some(format!(
                    "{} is {}, and that of the simulator {}",
                    end.data(),
                    real.type_name,
                    simulated.type_name
                ));
            }
        }
    }
    None
}

/// What to do with a file without a simulator.
fn advise_replacement(
    system: &System,
    simulator: &Manifest,
    manifests: &Manifests,
    file: &str,
) -> String {
    let drives = |component: &&Component| {
        let name = &component.name.value;
        let provides = system.links.iter().any(|link| link.from.component.value == *name);
        provides && find_mismatch(component, system, simulator, manifests).is_none()
    };
    let fitting: Vec<_> =
        system.components.iter().filter(drives).map(|it| it.name.value.as_str()).collect();
    let fitting = match fitting.as_slice() {
        [] => "no component of the file has outputs that the simulator provides under the same names, so \
               write the simulator into a copy of the file"
            .to_owned(),
        some => format!(
            "name the components that are the robot's hardware with --replace; those whose outputs the \
             simulator provides are {}",
            some.join(", ")
        ),
    };
    format!("{file} has no simulator to rehearse it in: {fitting}")
}

/// All replaced components become the first one.
fn move_links(links: &[Link], replaced: &[String]) -> Vec<[(String, String); 2]> {
    let Some(first) = replaced.first() else { return Vec::new() };
    let moved = |component: &str, port: &str| {
        let is_replaced = replaced.iter().any(|name| name == component);
        format!("{}.{port}", if is_replaced { first } else { component })
    };
    let both = links.iter().map(|link| {
        let (from, to) = (&link.from, &link.to);
        let ends = (from.data(), to.data());
        let new = (
            moved(&from.component.value, &from.port.value),
            moved(&to.component.value, &to.port.value),
        );
        [ends, new]
    });
    both.filter(|[old, new]| old != new).collect()
}
