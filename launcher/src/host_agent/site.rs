//! What an agent has for one system: its folder, its log, and the router of its components to the other
//! hosts.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use armor_files::create_own_folder;
use armor_keys::HostKeys;
use armor_keys::connect::GateError;
use armor_keys::routes::{Routes, listen_for_processes, serve_processes};
use armor_socket::{FaultTable, HostPlace};
use armor_wire::remote_process::{HostAddress, RemoteStart};
use tokio::task::AbortHandle;

use crate::arguments::OutputFormat;
use crate::run::logs::{EarlierLogs, RunLog, Sinks};
use crate::run::status::StatusLine;

/// What an agent has for one system.
pub(super) struct Site {
    pub(super) log: RunLog,
    sinks: Option<Sinks>,
    pub(super) folder: PathBuf,
    pub(super) place: HostPlace,
    routes: Arc<Routes>,
    router: AbortHandle,
}

impl Site {
    /// Makes the folder and opens the router. Must be called in a runtime.
    ///
    /// # Errors
    /// If the folder or the router cannot be made.
    pub(super) async fn open(
        out: &Path,
        keys: &HostKeys,
        start: &RemoteStart,
        launcher: &str,
        address: SocketAddr,
        format: OutputFormat,
    ) -> Result<Self> {
        let folder = out.join(&start.system);
        let why = || format!("the folder {} cannot be used", folder.display());
        create_own_folder(&folder).with_context(why)?;
        let folder = folder.canonicalize().with_context(why)?;
        let logs = folder.join("logs");
        let (log, sinks) =
            RunLog::start(&logs, EarlierLogs::Append, &[], format, StatusLine::for_stderr())?;
        let routes = Arc::new(Routes::new(keys.clone(), list_gates(start, launcher, address)));
        let (listener, router) =
            listen_for_processes(0).await.context("no port for the ways to other hosts")?;
        let faults = Arc::new(FaultTable::default());
        let report = move |error: &GateError| {
            if faults.is_new(None, error.to_string()) {
                tracing::warn!("a component's connection to another host: {error}");
            }
        };
        let serving = tokio::spawn(serve_processes(Arc::clone(&routes), listener, report));
        let place = HostPlace { host: keys.host_name().to_owned(), router };
        Ok(Self { log, sinks: Some(sinks), folder, place, routes, router: serving.abort_handle() })
    }

    /// Sets the gates of the other hosts, which may have changed since the last start of the system.
    pub(super) fn set_hosts(&self, start: &RemoteStart, launcher: &str, address: SocketAddr) {
        self.routes.set_gates(list_gates(start, launcher, address));
    }

    /// Whether the system has a host of this name.
    pub(super) fn leads_to(&self, host: &str) -> bool {
        self.routes.leads_to(host)
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        self.router.abort();
        if let Some(sinks) = self.sinks.take() {
            sinks.end();
        }
    }
}

/// The gates of the other hosts: that of the launcher is where it connects from.
fn list_gates(start: &RemoteStart, launcher: &str, address: SocketAddr) -> Vec<HostAddress> {
    let own = SocketAddr::new(address.ip().to_canonical(), start.gate_port).to_string();
    let mut gates = start.hosts.clone();
    gates.push(HostAddress { host: launcher.to_owned(), addresses: vec![own] });
    gates
}
