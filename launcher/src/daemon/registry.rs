//! `armor registry`: the registry as a process.

use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;

use super::serving::serve_until_signal;
use crate::arguments::{OutputFormat, default_registry};
use crate::verb::Verb;

/// Run the registry alone.
#[derive(Args, Debug)]
pub struct RegistryArguments {
    /// Where it listens.
    #[arg(long, value_name = "ADDRESS:PORT", env = "ARMOR_REGISTRY", default_value_t = default_registry())]
    pub listen: SocketAddr,
}

impl Verb for RegistryArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        armor_sdk::log::init();
        let options = armor_registry::RegistryOptions {
            listen: self.listen,
            secret: armor_socket::own_secret(),
            ..armor_registry::RegistryOptions::default()
        };
        let ending = serve_until_signal(async {
            Ok(armor_registry::serve(options, |_| {}).await.map(|never| match never {})?)
        })?;
        Ok(ending.into())
    }
}
