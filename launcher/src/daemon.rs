//! The daemons and the stock components, each as a program of its own: what the launcher starts,
//! and what can be started by hand on any host.

mod configd;
mod executive;

use std::net::SocketAddr;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, bail};
use armor_wire::registry::ComponentEntry;
use clap::CommandFactory;
use tokio::signal::unix::{SignalKind, signal};

use crate::arguments;
use crate::exit::Ending;
use crate::kinds::stock::STOCK;

pub use configd::run as configd;
pub use executive::run as executive;

/// Runs the registry until it is asked to end.
///
/// # Errors
/// If it cannot listen.
pub fn registry(arguments: &arguments::Registry) -> Result<Ending> {
    armor_sdk::log::init();
    let options = armor_registry::RegistryOptions {
        listen: arguments.listen,
        ..armor_registry::RegistryOptions::default()
    };
    until_asked(async {
        Ok(armor_registry::serve(options, |_| {}).await.map(|never| match never {})?)
    })
}

/// A flag that SIGTERM or SIGINT sets.
fn asked_to_end() -> Result<&'static AtomicBool> {
    static ASKED: AtomicBool = AtomicBool::new(false);
    let wait = || {
        let ended = until_asked(std::future::pending());
        if let Err(error) = ended {
            tracing::error!("signals cannot be caught: {error}");
        }
        ASKED.store(true, Ordering::Relaxed);
    };
    std::thread::Builder::new().name("signals".into()).spawn(wait).context("no thread")?;
    Ok(&ASKED)
}

/// How a daemon is found.
fn entry(name: &str, address: SocketAddr) -> ComponentEntry {
    let host = armor_socket::host_name();
    ComponentEntry {
        name: name.into(),
        kind: name.into(),
        instance: armor_socket::random_id(),
        pid: std::process::id(),
        host,
        endpoint: address.to_string(),
    }
}

/// Runs a stock component.
///
/// # Errors
/// If there is no such kind.
pub fn component(arguments: arguments::Component) -> Result<ExitCode> {
    let kind = arguments.kind;
    // The flags after a kind are the component's, so clap looks for none in this command.
    if ["--help", "-h"].contains(&kind.as_str()) {
        let mut program = arguments::Arguments::command();
        program.build();
        let help = program.find_subcommand_mut("component").context("it is a command")?;
        help.print_long_help()?;
        return Ok(Ending::Fine.into());
    }
    let Some(stock) = STOCK.iter().find(|stock| stock.kind == kind) else {
        let known: Vec<_> = STOCK.iter().map(|stock| stock.kind).collect();
        bail!("no stock component is called {kind}; there are {}", known.join(", "));
    };
    Ok((stock.run)(arguments.arguments))
}

/// Serves until SIGTERM or SIGINT.
fn until_asked(serving: impl Future<Output = Result<()>>) -> Result<Ending> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the event loop cannot be started")?;
    runtime.block_on(async {
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        tokio::select! {
            result = serving => result.map(|()| Ending::Fine),
            _ = terminate.recv() => Ok(Ending::Fine),
            _ = interrupt.recv() => Ok(Ending::Interrupted),
        }
    })
}
