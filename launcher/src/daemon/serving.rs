//! What the daemons have in common: they serve until a signal, and are found by the registry.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use armor_wire::registry::ComponentEntry;
use tokio::signal::unix::{SignalKind, signal};

use crate::exit::CommandEnding;

/// Returns a flag that SIGTERM or SIGINT sets.
pub fn watch_for_signals() -> Result<&'static AtomicBool> {
    static SIGNALLED: AtomicBool = AtomicBool::new(false);
    let wait = || {
        let ended = serve_until_signal(std::future::pending());
        if let Err(error) = ended {
            tracing::error!("signals cannot be caught: {error}");
        }
        SIGNALLED.store(true, Ordering::Relaxed);
    };
    std::thread::Builder::new().name("signals".into()).spawn(wait).context("no thread")?;
    Ok(&SIGNALLED)
}

/// Returns the entry under which a daemon is registered.
pub fn make_entry(name: &str, address: SocketAddr) -> ComponentEntry {
    let host = armor_socket::host_name();
    ComponentEntry {
        name: name.into(),
        kind: name.into(),
        instance: armor_socket::random_id(),
        pid: std::process::id(),
        host,
        endpoint: armor_socket::name_endpoint(address),
    }
}

/// Serves until SIGTERM or SIGINT.
pub fn serve_until_signal(serving: impl Future<Output = Result<()>>) -> Result<CommandEnding> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the event loop cannot be started")?;
    runtime.block_on(async {
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        tokio::select! {
            result = serving => result.map(|()| CommandEnding::Fine),
            _ = terminate.recv() => Ok(CommandEnding::Fine),
            _ = interrupt.recv() => Ok(CommandEnding::Interrupted),
        }
    })
}
