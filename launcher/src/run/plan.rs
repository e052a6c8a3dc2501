//! The processes that a file needs, and how each is started.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_recording::playback::PLAYBACK;
use armor_robotfile::model::{Component, Restart};
use armor_robotfile::resources::ResourceLimits;
use armor_robotfile::{Configuration, advise_similar};
use armor_sdk::messages::Progress;
use armor_wire::Message;
use armor_wire::name::is_name;
use armor_wire::remote_process::{ProcessResources, RemoteStart, VariableSetting};
use armor_wire::run_key::RunSecret;

use super::arguments::RunArguments;
use super::environment::select_variables;
use super::glibc;
use super::host_states::HostStates;
use super::other_hosts::OtherHosts;
use super::process::{OWN_PROGRAM, ProcessStart};
use super::remote::RemotePlan;
use super::supervisor::{ChildRole, Duty};
use super::{survivors, unfinished};
use crate::guard::GuardedResources;
use crate::kinds::build::{find_build, fingerprint_manifest};
use crate::kinds::{Catalogue, ComponentKind, Origin};
use crate::playback_cli::played::{PLAYBACK_CLOCK, PlayedRecording};
use armor_socket::GROUP_VARIABLE;
use armor_socket::run_keys::{KEY_VARIABLE, format_key, format_secret};

/// The launcher's own name in the log.
pub const LAUNCHER: &str = "launcher";
/// The gate's name, if there is one.
const GATE: &str = "gate";
/// Names that components cannot have.
const RESERVED: [&str; 5] = ["registry", "configd", "configuration", "executive", LAUNCHER];

/// By convention, the output on which a component reports the progress of its task.
const PROGRESS_OUTPUT: &str = "progress";

/// The processes of a run; both lists in the same order.
#[derive(Debug)]
pub struct ProcessPlan {
    /// What the supervisor needs to know of each process.
    pub duties: Vec<Duty>,
    /// How each process is started.
    pub starts: Vec<PlannedStart>,
    /// Where the registry listens.
    pub registry: SocketAddr,
    /// Where the gate listens for processes of this host, if there are other hosts.
    pub router: Option<SocketAddr>,
    /// What is known of the other hosts while the system runs.
    pub hosts: HostStates,
    /// The mark of all processes of the run, in [`survivors::VARIABLE`].
    pub mark: String,
    /// What the log begins with: variables that the file names and that are not set.
    pub warnings: Vec<String>,
}

/// How a process is started.
#[derive(Debug)]
pub enum PlannedStart {
    /// On this host.
    Here(ProcessStart),
    /// By the agent of another host.
    Remote(Box<RemotePlan>),
}

/// The name of a run: the mission's, the system's, or the file's.
pub fn name_of(configuration: &Configuration, file: &Path) -> String {
    let mission = configuration.mission.as_ref().and_then(|mission| mission.name.as_ref());
    let named = mission.or(configuration.system.name.as_ref()).map(|name| name.value.clone());
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    named.or(stem.filter(|stem| is_name(stem))).unwrap_or_else(|| "system".into())
}

/// Returns the names that the system and the mission have in the file.
pub fn list_file_names(configuration: &Configuration) -> Vec<String> {
    let mission = configuration.mission.as_ref().and_then(|mission| mission.name.as_ref());
    let names = [mission, configuration.system.name.as_ref()];
    names.into_iter().flatten().map(|name| name.value.clone()).collect()
}

/// Returns the outputs by which components report their progress, `component.progress`.
pub fn list_progress_outputs(configuration: &Configuration, catalogue: &Catalogue) -> Vec<String> {
    let reports_progress = |component: &&Component| {
        let kind = catalogue.kinds.get(&component.kind.value);
        kind.is_some_and(|kind| {
            let mut outputs = kind.manifest.outputs.iter();
            outputs.any(|port| port.id == PROGRESS_OUTPUT && port.type_name == Progress::NAME)
        })
    };
    let components = configuration.system.components.iter().filter(reports_progress);
    components.map(|component| format!("{}.{PROGRESS_OUTPUT}", component.name.value)).collect()
}

/// Returns the outputs that publish a value only when it changes, `component.output`.
pub fn list_latched_outputs(
    configuration: &Configuration,
    catalogue: &Catalogue,
) -> BTreeSet<String> {
    let of_component = |component: &Component| {
        let kind = catalogue.kinds.get(&component.kind.value);
        let outputs = kind.into_iter().flat_map(|kind| &kind.manifest.outputs);
        let latched = outputs.filter(|output| output.latched);
        latched.map(|output| format!("{}.{}", component.name.value, output.id)).collect::<Vec<_>>()
    };
    configuration.system.components.iter().flat_map(of_component).collect()
}

impl ProcessPlan {
    /// The processes that `configuration` needs.
    ///
    /// # Errors
    /// If a component has a name that the system needs itself, or one to be left out is not there.
    pub fn new(
        configuration: &Configuration,
        catalogue: &Catalogue,
        arguments: &RunArguments,
        registry: SocketAddr,
        out: &Path,
        hosts: Option<&OtherHosts>,
        played: Option<&PlayedRecording>,
    ) -> Result<Self> {
        let mark = survivors::make_mark();
        let mut plan = Self {
            duties: Vec::new(),
            starts: Vec::new(),
            registry,
            router: hosts.map(|hosts| hosts.place().router),
            hosts: hosts.map(OtherHosts::states).unwrap_or_default(),
            mark,
            warnings: Vec::new(),
        };
        let file = arguments.file.as_os_str();
        let at = registry.to_string();
        let sets = arguments.overrides.iter().flat_map(|set| ["--set".into(), set.into()]);
        let sets: Vec<OsString> = sets.collect();

        plan.add_daemon("registry", ChildRole::Registry, vec!["--listen".into(), (&at).into()]);
        let versions = out.join(unfinished::VERSIONS);
        let mut configd = vec![file.into(), "--registry".into(), (&at).into()];
        configd.extend(["--versions".into(), versions.into_os_string()]);
        // The file was valid at the start; later changes to it must not end a running system.
        configd.push("--wait".into());
        configd.extend(sets.iter().cloned());
        for directory in &arguments.kinds.directories {
            configd.extend(["--components".into(), directory.into()]);
        }
        if played.is_some() {
            configd.extend(["--clock".into(), PLAYBACK_CLOCK.into()]);
        }
        // A recording can be played without the file.
        if !configuration.sources.is_empty() {
            plan.add_daemon("configd", ChildRole::Configd, configd);
        }
        let components = &configuration.system.components;
        for without in &arguments.without {
            if !components.iter().any(|component| component.name.value == *without) {
                let names = components.iter().map(|component| component.name.value.as_str());
                let advice = advise_similar(without, names.clone());
                let names = names.collect::<Vec<_>>().join(", ");
                bail!(
                    "--without {without}: no component is called that{advice} (there are {names})"
                );
            }
        }
        for component in components {
            let name = &component.name.value;
            let is_played = played.is_some_and(|played| played.replaces(name));
            if !is_played && !arguments.without.contains(name) {
                match (&component.host, hosts) {
                    (Some(host), Some(hosts)) => {
                        let remote = hosts.plan(host, component, configuration)?;
                        plan.add_remote(component, catalogue, &remote)?;
                    }
                    _ => plan.component(component, catalogue, &at)?,
                }
            }
        }
        let plays_mission =
            configuration.mission.is_some() && played.is_none_or(|played| !played.is_alone);
        if plays_mission {
            let journal = out.join(unfinished::JOURNAL);
            let mut executive = vec![file.into(), "--registry".into(), (&at).into()];
            executive.extend(["--resume".into(), "--journal".into(), journal.into_os_string()]);
            executive.push("--supervised".into());
            executive.extend(sets);
            if arguments.trust_clock {
                executive.push("--trust-clock".into());
            }
            if played.is_some() {
                executive.extend(["--clock".into(), PLAYBACK_CLOCK.into()]);
            }
            plan.add_daemon("executive", ChildRole::Executive, executive);
        }
        if let Some(played) = played {
            plan.add_player(played, &at, plays_mission);
        }
        if let Some(gate) = arguments.gate {
            plan.add_gate(gate, &arguments.keys.path()?, components, &at, hosts)?;
        }
        let mut environment = vec![
            ("ARMOR_REGISTRY".into(), OsString::from(&at)),
            ("ARMOR_OUT".into(), out.as_os_str().to_owned()),
        ];
        let group = configuration.system.group.as_ref();
        if let Some(group) = group.filter(|group| !armor_socket::has_group(&group.value)) {
            bail!(
                "{}: this host has no group {}; create it (`groupadd {}`) or remove the attribute",
                group.at,
                group.value,
                group.value
            );
        }
        environment.extend(group.map(|group| (GROUP_VARIABLE.into(), (&group.value).into())));
        if arguments.headless {
            environment.push(("ARMOR_HEADLESS".into(), "1".into()));
        }
        let place = hosts.map(|hosts| hosts.place().list_variables());
        let place = place.into_iter().flatten().map(|(name, value)| (name.into(), value.into()));
        environment.extend(place);
        // A `web-view` serves other hosts with the keys that the launcher was given.
        let keys = arguments.keys.variable();
        for start in &mut plan.starts {
            let PlannedStart::Here(start) = start else { continue };
            // The file decides who takes part, not the shell that starts the system.
            start.environment.retain(|(name, _)| name != GROUP_VARIABLE);
            if let Some((name, _)) = &keys {
                start.environment.retain(|(known, _)| known != name);
            }
            start.environment.extend(environment.iter().chain(&keys).cloned());
            start.mark = format!("{}{}/", plan.mark, start.name);
            start.environment.push((survivors::VARIABLE.into(), (&start.mark).into()));
        }
        Ok(plan)
    }

    /// Sets a variable in the environment of every process on this host.
    pub fn set_variable(&mut self, (name, value): (&str, &str)) {
        for start in &mut self.starts {
            let PlannedStart::Here(start) = start else { continue };
            // That of the shell is of another run.
            start.environment.retain(|(known, _)| known != name);
            start.environment.push((name.into(), value.into()));
        }
    }

    /// Gives every process its key: the secret itself to what serves or commands the whole system.
    pub fn set_keys(&mut self, secret: RunSecret) {
        for (duty, start) in self.duties.iter().zip(&mut self.starts) {
            let key = match duty.role {
                // It takes part under the names of the components that it plays.
                ChildRole::Component if duty.name == PLAYBACK => Some(format_secret(secret)),
                ChildRole::Component => Some(format_key(&duty.name, secret)),
                ChildRole::Registry | ChildRole::Configd | ChildRole::Executive => {
                    Some(format_secret(secret))
                }
                ChildRole::Gate => None,
            };
            match start {
                PlannedStart::Here(start) => {
                    // That of the shell is of another run.
                    start.environment.retain(|(known, _)| known != KEY_VARIABLE);
                    start.environment.extend(key.map(|key| (KEY_VARIABLE.into(), key.into())));
                }
                PlannedStart::Remote(plan) => {
                    let name = KEY_VARIABLE.to_owned();
                    let key = key.map(|value| VariableSetting { name, value });
                    plan.start.settings.extend(key);
                }
            }
        }
    }

    /// Returns the names of all processes that write to the log.
    pub fn names(&self) -> Vec<&str> {
        [LAUNCHER].into_iter().chain(self.duties.iter().map(|duty| duty.name.as_str())).collect()
    }

    fn add_daemon(&mut self, name: &str, role: ChildRole, mut arguments: Vec<OsString>) {
        arguments.insert(0, name.into());
        self.add(name, role, Restart::Always, OWN_PROGRAM.into(), arguments);
    }

    /// Adds the player of a recording, with which the run ends.
    fn add_player(&mut self, played: &PlayedRecording, at: &str, plays_mission: bool) {
        let mut arguments = played.player_arguments(plays_mission);
        arguments.extend(["--registry".into(), at.into()]);
        self.add(PLAYBACK, ChildRole::Component, Restart::Never, OWN_PROGRAM.into(), arguments);
        if let Some(duty) = self.duties.last_mut() {
            duty.ends_run = true;
        }
    }

    /// Adds the gate to other hosts, after a look at whether it can start: a key that cannot be used
    /// must not be found out when the robot is out of reach.
    fn add_gate(
        &mut self,
        listen: SocketAddr,
        keys: &Path,
        components: &[Component],
        at: &str,
        hosts: Option<&OtherHosts>,
    ) -> Result<()> {
        if let Some(component) = components.iter().find(|it| it.name.value == GATE) {
            bail!(
                "{}: with --gate the name {GATE} belongs to the gate itself; rename the component, \
                 or start `armor gate` by itself",
                component.name.at
            );
        }
        armor_keys::gate::check_start(listen, keys)?;
        let mut arguments: Vec<OsString> = vec!["--listen".into(), listen.to_string().into()];
        arguments.extend(["--registry".into(), at.into()]);
        arguments.extend(["--keys".into(), keys.as_os_str().to_owned()]);
        if let Some(hosts) = hosts {
            arguments.extend(hosts.list_arguments(components));
        }
        self.add_daemon(GATE, ChildRole::Gate, arguments);
        Ok(())
    }

    fn component(&mut self, component: &Component, catalogue: &Catalogue, at: &str) -> Result<()> {
        let (name, kind) = (&component.name.value, &component.kind.value);
        check_name(component)?;
        let found = find_kind(component, catalogue)?;
        let mut arguments: Vec<OsString> =
            ["--name", name.as_str(), "--registry", at].map(OsString::from).to_vec();
        let program = match &found.origin {
            Origin::Stock => {
                arguments.splice(0..0, ["component".into(), kind.into()]);
                OWN_PROGRAM.into()
            }
            Origin::Executable(path) => path.clone(),
        };
        self.add(name, ChildRole::Component, component.restart, program, arguments);
        let Some(PlannedStart::Here(start)) = self.starts.last_mut() else { return Ok(()) };
        if let Some(named) = &component.variables {
            let unset = named.value.iter().filter(|name| std::env::var_os(name).is_none());
            self.warnings.extend(unset.map(|name| {
                let (at, component) = (&named.at, &component.name.value);
                format!("{at}: the variable {name} is not set here, so {component} does not get it")
            }));
            start.environment = select_variables(std::env::vars_os(), &named.value);
        }
        start.resources = find_resources(component)?;
        if let Some(duty) = self.duties.last_mut() {
            duty.kind = Some(kind.clone());
            duty.watchdog = component.watchdog.as_ref().map(|watchdog| watchdog.value);
        }
        Ok(())
    }

    /// Adds a component that the agent of another host runs.
    fn add_remote(
        &mut self,
        component: &Component,
        catalogue: &Catalogue,
        plan: &RemotePlan,
    ) -> Result<()> {
        let name = &component.name.value;
        check_name(component)?;
        let found = find_kind(component, catalogue)?;
        let mut plan = plan.clone();
        if let Origin::Executable(path) = &found.origin {
            plan.start.executable_len = std::fs::metadata(path).map_or(0, |it| it.len());
            plan.executable = Some(path.clone());
        }
        let ResourceLimits { nice, realtime, cpus, cpu, memory } = &component.resources;
        plan.start = RemoteStart {
            component: name.clone(),
            kind: component.kind.value.clone(),
            manifest: fingerprint_manifest(&found.manifest),
            build: find_build(&found.origin),
            variables: component.variables.as_ref().map(|it| it.value.clone()).unwrap_or_default(),
            resources: ProcessResources {
                nice: nice.as_ref().map(|nice| nice.value),
                realtime: realtime.as_ref().map(|priority| priority.value),
                cpus: cpus
                    .iter()
                    .flat_map(|it| &it.value)
                    .filter_map(|it| (*it).try_into().ok())
                    .collect(),
                cpu_permille: cpu.as_ref().map(|cpu| cpu.value.permille),
                memory: memory.as_ref().map(|memory| memory.value),
            },
            ..plan.start
        };
        self.duties.push(Duty {
            name: name.clone(),
            role: ChildRole::Component,
            restart: component.restart,
            watchdog: component.watchdog.as_ref().map(|watchdog| watchdog.value),
            kind: Some(component.kind.value.clone()),
            ends_run: false,
            host: Some(plan.host.clone()),
        });
        self.starts.push(PlannedStart::Remote(Box::new(plan)));
        Ok(())
    }

    fn add(
        &mut self,
        name: &str,
        role: ChildRole,
        restart: Restart,
        program: PathBuf,
        arguments: Vec<OsString>,
    ) {
        self.duties.push(Duty {
            name: name.into(),
            role,
            restart,
            watchdog: None,
            kind: None,
            ends_run: false,
            host: None,
        });
        let mut environment = select_variables(std::env::vars_os(), &[]);
        if role != ChildRole::Component {
            environment.push((glibc::VARIABLE.into(), glibc::SETTINGS.into()));
        }
        let takes_reports = role == ChildRole::Executive;
        let name = name.into();
        self.starts.push(PlannedStart::Here(ProcessStart {
            name,
            program,
            arguments,
            environment,
            mark: String::new(),
            resources: GuardedResources::default(),
            takes_reports,
        }));
    }
}

fn check_name(component: &Component) -> Result<()> {
    let name = &component.name.value;
    if RESERVED.contains(&name.as_str()) {
        bail!(
            "{}: the name {name} belongs to the system itself; rename the component",
            component.name.at
        );
    }
    Ok(())
}

fn find_kind<'a>(component: &Component, catalogue: &'a Catalogue) -> Result<&'a ComponentKind> {
    let kind = &component.kind.value;
    let found = catalogue.kinds.get(kind);
    found.with_context(|| format!("{}: no kind is called {kind}", component.kind.at))
}

/// Returns what the file lets a component use of the host.
///
/// # Errors
/// If the host or the user cannot grant it.
fn find_resources(component: &Component) -> Result<GuardedResources> {
    let ResourceLimits { nice, realtime, cpus, cpu, memory } = &component.resources;
    let resources = GuardedResources {
        nice: nice.as_ref().map(|nice| nice.value),
        realtime: realtime.as_ref().map(|priority| priority.value),
        cpus: cpus.iter().flat_map(|cpus| cpus.value.iter().copied()).collect(),
        cpu_permille: cpu.as_ref().map(|cpu| cpu.value.permille),
        memory: memory.as_ref().map(|memory| memory.value),
    };
    let obstacles = [
        (nice.as_ref().map(|nice| &nice.at), resources.refuse_nice()),
        (realtime.as_ref().map(|priority| &priority.at), resources.refuse_realtime()),
        (cpus.as_ref().map(|cpus| &cpus.at), resources.refuse_cpus()),
        (cpu.as_ref().map(|cpu| &cpu.at), resources.refuse_cpu()),
    ];
    for obstacle in obstacles {
        if let (Some(at), Some(why)) = obstacle {
            bail!("{at}: {why}");
        }
    }
    Ok(resources)
}
