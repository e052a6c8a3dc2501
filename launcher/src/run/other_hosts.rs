//! The other hosts of a system, as its file names them: how their agents are reached, and how this host
//! is reached from there.

use std::ffi::OsString;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use armor_keys::HostKeys;
use armor_keys::routes::Routes;
use armor_robotfile::Configuration;
use armor_robotfile::Spanned;
use armor_robotfile::model::{Component, Host};
use armor_socket::{HostPlace, PORTS, random_id};
use armor_wire::remote_process::{
    CutOff, HostAddress, ProcessResources, RemoteStart, Takeover, VariableSetting,
};

use super::arguments::RunArguments;
use super::host_states::HostStates;
use super::own_run::OwnRun;
use super::remote::RemotePlan;

/// How many ports are tried for the router.
const MAX_TRIES: usize = 64;

/// The other hosts.
pub struct OtherHosts {
    hosts: Vec<Host>,
    place: HostPlace,
    routes: Routes,
    states: HostStates,
    start: RemoteStart,
}

impl OtherHosts {
    /// Those of a file; `None` if all components run on this host.
    ///
    /// # Errors
    /// If this host has no key or no gate, so that the others could not reach it.
    pub fn find(
        configuration: &Configuration,
        arguments: &RunArguments,
        system: &str,
        own_run: &OwnRun,
    ) -> Result<Option<Self>> {
        let file = &configuration.system;
        let used = |host: &&Host| {
            let placed = file.components.iter().filter_map(|component| component.host.as_ref());
            let mut placed = placed.map(|name| &name.value);
            placed.any(|name| *name == host.name.value)
        };
        let hosts: Vec<Host> = file.hosts.iter().filter(used).cloned().collect();
        let Some(first) = hosts.first() else { return Ok(None) };
        let Some(gate) = arguments.gate else {
            let (at, name) = (&first.name.at, &first.name.value);
            bail!(
                "{at}: components run on the host {name}, which must reach this one: give --gate \
                 0.0.0.0:7410 and --keys (docs/hosts.md)"
            );
        };
        if gate.ip().is_loopback()
            && let Some(far) = hosts.iter().find(|host| !is_on_this_host(host))
        {
            let (at, name) = (&far.name.at, &far.name.value);
            bail!(
                "{at}: {name} cannot reach the gate of this host at {gate}, which is for this host \
                 only: give --gate 0.0.0.0:{} or another of its addresses",
                gate.port()
            );
        }
        let keys = HostKeys::read(&arguments.keys.path()?)?;
        let own = keys.host_name().to_owned();
        if let Some(host) = hosts.iter().find(|host| host.name.value == own) {
            let at = &host.name.at;
            bail!(
                "{at}: {own} is this host, by its key; components without `host` run here: remove \
                 host=\"{own}\" and the <host>"
            );
        }
        let place = HostPlace { host: own, router: choose_router_port()? };
        // For the connections of the launcher itself, such as those to components.
        armor_socket::adopt_place(Some(place.clone()));
        let gates = hosts.iter().map(address_of);
        let routes = Routes::new(keys, gates.clone());
        let mut settings = Vec::new();
        if arguments.headless {
            settings.push(VariableSetting { name: "ARMOR_HEADLESS".into(), value: "1".into() });
        }
        let (name, value) = own_run.variable();
        settings.push(VariableSetting { name: name.into(), value: value.into() });
        let start = RemoteStart {
            system: system.to_owned(),
            run: random_id(),
            component: String::new(),
            kind: String::new(),
            components: Vec::new(),
            manifest: 0,
            build: String::new(),
            executable_len: 0,
            variables: Vec::new(),
            settings,
            resources: ProcessResources::default(),
            cut_off: CutOff::default(),
            is_commanded: false,
            hosts: gates.collect(),
            gate_port: gate.port(),
            takeover: Takeover::Never,
        };
        let states = HostStates::default();
        hosts.iter().for_each(|host| states.add_host(&host.name.value));
        Ok(Some(Self { hosts, place, routes, states, start }))
    }

    /// The place of this host among them.
    pub fn place(&self) -> &HostPlace {
        &self.place
    }

    /// Their agents.
    pub fn addresses(&self) -> Vec<HostAddress> {
        self.hosts.iter().map(address_of).collect()
    }

    /// What is known of them while the system runs.
    pub fn states(&self) -> HostStates {
        self.states.clone()
    }

    /// How a component is run on one of them; what depends on the component is left out.
    ///
    /// # Errors
    /// If there is no such host.
    pub fn plan(
        &self,
        name: &Spanned<String>,
        component: &Component,
        configuration: &Configuration,
    ) -> Result<RemotePlan> {
        let host = self.hosts.iter().find(|host| host.name.value == name.value);
        let gate = self.routes.find_gate(&name.value);
        let unknown = || format!("{}: there is no host called {}", name.at, name.value);
        let (host, gate) = host.zip(gate).with_context(unknown)?;
        let mut start = self.start.clone();
        // What a mission may not freeze, its host does not freeze either.
        start.cut_off = match host.cut_off {
            CutOff::Safe if !component.controllable => CutOff::Continue,
            cut_off => cut_off,
        };
        start.is_commanded = configuration.commands(component);
        let is_there = |component: &&Component| {
            component.host.as_ref().is_some_and(|host| host.value == name.value)
        };
        let there = configuration.system.components.iter().filter(is_there);
        start.components = there.map(|component| component.name.value.clone()).collect();
        // The way to itself is no way.
        start.hosts.retain(|other| other.host != name.value);
        Ok(RemotePlan {
            host: name.value.clone(),
            start,
            gate: Arc::clone(&gate),
            executable: None,
            states: self.states.clone(),
        })
    }

    /// The arguments of the gate: the hosts, which components run on them, and its router.
    pub fn list_arguments(&self, components: &[Component]) -> Vec<OsString> {
        let hosts = self.hosts.iter().map(address_of);
        let hosts =
            hosts.map(|host| ("--host", format!("{}={}", host.host, host.addresses.join(" "))));
        let placed = components.iter().filter_map(|component| {
            let host = component.host.as_ref()?;
            Some(("--place", format!("{}={}", component.name.value, host.value)))
        });
        let router = [("--router", self.place.router.port().to_string())];
        let all = hosts.chain(placed).chain(router);
        all.flat_map(|(option, value)| [option.into(), value.into()]).collect()
    }
}

/// Whether all addresses are of loopback, by what is written.
fn is_on_this_host(host: &Host) -> bool {
    let is_loopback = |address: SocketAddr| address.ip().is_loopback();
    host.addresses
        .value
        .iter()
        .all(|address| address.starts_with("localhost:") || address.parse().is_ok_and(is_loopback))
}

fn address_of(host: &Host) -> HostAddress {
    HostAddress { host: host.name.value.clone(), addresses: host.addresses.value.clone() }
}

/// Chooses a free port for the router; the gate takes it, again after each restart.
fn choose_router_port() -> Result<SocketAddr> {
    let width = u64::from(PORTS.end - PORTS.start);
    for _ in 0..MAX_TRIES {
        let offset = u16::try_from(random_id() % width).unwrap_or(0);
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, PORTS.start + offset));
        if TcpListener::bind(address).is_ok() {
            return Ok(address);
        }
    }
    bail!("no port is free for the connections to other hosts")
}
