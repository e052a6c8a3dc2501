//! The daemons and the stock components, each as a program of its own: what the launcher starts,
//! and what can be started by hand on any host.

mod configd;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, anyhow, bail};
use armor_executive::{Outcome, Plan};
use armor_missions::{Colours, Findings};
use armor_wire::registry::ComponentEntry;
use clap::CommandFactory;
use tokio::signal::unix::{SignalKind, signal};

use crate::arguments;
use crate::check;
use crate::exit::Ending;
use crate::kinds::stock::STOCK;

pub use configd::run as configd;

/// Runs the registry until it is asked to end.
///
/// # Errors
/// If it cannot listen.
pub fn registry(arguments: &arguments::Registry) -> Result<Ending> {
    armor_sdk::log::init();
    let options =
        armor_registry::Options { listen: arguments.listen, ..armor_registry::Options::default() };
    until_asked(async {
        Ok(armor_registry::serve(options, |_| {}).await.map(|never| match never {})?)
    })
}

/// Plays the mission to its end: code 0 at its goal, 3 in its safe place, 4 if it failed, and 130 if
/// it was told to stop, in which case the same journal goes on with it.
///
/// # Errors
/// If the mission or the journal cannot be used.
pub fn executive(arguments: &arguments::Executive) -> Result<ExitCode> {
    armor_sdk::log::init();
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let (overrides, malformed) = check::overrides(&arguments.overrides, &folder);
    if let Some(finding) = malformed.first() {
        bail!("{finding}");
    }
    let reading = armor_missions::check(armor_missions::load(&arguments.file), &overrides, None);
    let refused = |findings: &Findings| anyhow!("{}", findings.render(Colours::No).trim_end());
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(refused(&reading.findings));
    };
    let Some(plan) = Plan::of(configuration).map_err(|f| refused(&f))? else {
        bail!("{} has no mission to play", arguments.file.display());
    };
    let journal = arguments.journal.clone().unwrap_or_else(default_journal);
    let options = armor_executive::Options { registry: arguments.registry.to_string(), journal };
    let outcome = armor_executive::run(plan, &options, asked_to_end()?)?;
    Ok(ExitCode::from(match outcome {
        Outcome::Goal => 0,
        Outcome::Safe => 3,
        Outcome::Failed => 4,
        Outcome::Interrupted => Ending::Interrupted.code(),
    }))
}

/// In the folder of the run, or the current one.
fn default_journal() -> PathBuf {
    PathBuf::from(std::env::var_os("ARMOR_OUT").unwrap_or_default()).join("executive.journal")
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
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    ComponentEntry {
        name: name.into(),
        kind: name.into(),
        instance: armor_net::random_id(),
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
