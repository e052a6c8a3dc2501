//! `armor gate`: the gate of a system to other hosts, as a process.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use armor_keys::HostKeys;
use armor_keys::connect::GateError;
use armor_keys::gate::{self, GateLimits, GateOptions};
use armor_keys::reach::SystemReach;
use armor_keys::routes::{Routes, listen_for_processes, serve_processes};
use armor_socket::FaultTable;
use armor_wire::remote_process::HostAddress;
use clap::Args;

use super::serving::serve_until_signal;
use crate::arguments::{OutputFormat, default_registry, parse_pair};
use crate::doctor::examine_own_host;
use crate::keys_cli::KeysDirectory;
use crate::run::descriptors;
use crate::verb::Verb;

/// What a gate has open besides its connections, with room to spare.
const DESCRIPTORS: usize = 64;

/// Let people with keys reach the system of this host from other hosts.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor run robot.xml --gate 0.0.0.0:7410    starts it with the system
  armor gate --listen 0.0.0.0:7410           next to a system that runs

The folder of keys holds the key of this host (`armor keys add NAME --role host`) and the list of
revoked keys. Both are read again when they change.")]
pub struct GateArguments {
    /// Where it listens: an address of this host, or 0.0.0.0 for all.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub listen: SocketAddr,
    #[command(flatten)]
    pub directory: KeysDirectory,
    /// The system whose registry listens here.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub registry: SocketAddr,
    /// Another host of the system, and where its agent listens, with spaces between several
    /// addresses; `armor run` gives those in the file.
    #[arg(long = "host", value_name = "NAME=ADDRESS:PORT…", value_parser = parse_pair)]
    pub hosts: Vec<(String, String)>,
    /// A component, and the other host on which it runs.
    #[arg(long = "place", value_name = "COMPONENT=HOST", value_parser = parse_pair)]
    pub places: Vec<(String, String)>,
    /// The port on loopback by which processes of this host reach the other hosts.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub router: u16,
}

impl Verb for GateArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        armor_sdk::log::init();
        if armor_socket::has_proxy() {
            bail!("ARMOR_VIA is set, for systems on another host; unset it for a gate to this one");
        }
        if !self.registry.ip().is_loopback() {
            let registry = self.registry;
            bail!(
                "the registry at {registry} is not on this host; a gate leads to the system of its \
                 own host"
            );
        }
        let is_alone = self.hosts.is_empty();
        let limits = if is_alone { GateLimits::default() } else { GateLimits::of_hosts() };
        let most = 2 * limits.sessions + limits.strangers + DESCRIPTORS;
        descriptors::raise_limit(most as u64)?;
        let keys = HostKeys::read(&self.directory.path()?)?;
        let routes = Arc::new(Routes::new(keys.clone(), self.list_gates()));
        let reach = SystemReach::new(self.registry, keys.host_name())
            .with_hosts(self.list_components(), Arc::clone(&routes));
        let (listen, reach) = (self.listen, Arc::new(reach));
        let options = GateOptions {
            listen,
            keys,
            reach,
            runs: None,
            examiner: Arc::new(|| examine_own_host(&own_folder(), &[])),
            limits,
        };
        let ending = serve_until_signal(async {
            if !is_alone {
                let (listener, _) = listen_for_processes(self.router)
                    .await
                    .with_context(|| format!("cannot listen on port {}", self.router))?;
                let faults = Arc::new(FaultTable::default());
                let report = move |error: &GateError| {
                    if faults.is_new(None, error.to_string()) {
                        tracing::warn!("a connection to another host: {error}");
                    }
                };
                tokio::spawn(serve_processes(routes, listener, report));
            }
            Ok(gate::serve(options, |_| {}).await.map(|never| match never {})?)
        })?;
        Ok(ending.into())
    }
}

/// The folder into which the system writes, or would.
fn own_folder() -> PathBuf {
    std::env::var_os("ARMOR_OUT").unwrap_or_else(|| "out".into()).into()
}

impl GateArguments {
    fn list_gates(&self) -> Vec<HostAddress> {
        let gates = self.hosts.iter().cloned();
        let split = |text: &str| text.split_whitespace().map(str::to_owned).collect();
        gates.map(|(host, text)| HostAddress { host, addresses: split(&text) }).collect()
    }

    fn list_components(&self) -> BTreeMap<String, Vec<String>> {
        let hosts = self.hosts.iter().map(|(host, _)| (host.clone(), Vec::new()));
        let mut components: BTreeMap<String, Vec<String>> = hosts.collect();
        for (component, host) in &self.places {
            components.entry(host.clone()).or_default().push(component.clone());
        }
        components
    }
}
