//! `armor gate`: the gate of a system to other hosts, as a process.

use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_keys::gate::{self, GateLimits, GateOptions};
use clap::Args;

use super::serving::serve_until_signal;
use crate::arguments::{OutputFormat, default_registry};
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
}

impl Verb for GateArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        armor_sdk::log::init();
        if armor_socket::has_proxy() {
            bail!("ARMOR_VIA is set, for systems on another host; unset it for a gate to this one");
        }
        let limits = GateLimits::default();
        let most = 2 * limits.sessions + limits.strangers + DESCRIPTORS;
        descriptors::raise_limit(most as u64)?;
        let options = GateOptions {
            listen: self.listen,
            keys: self.directory.path()?,
            registry: self.registry,
            limits,
        };
        let ending = serve_until_signal(async {
            Ok(gate::serve(options, |_| {}).await.map(|never| match never {})?)
        })?;
        Ok(ending.into())
    }
}
