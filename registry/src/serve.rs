//! The state machine on a socket.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::{SystemTime, UNIX_EPOCH};

use armor_socket::{ListenError, Server, ServerLimits, listen, random_id};
use armor_wire::registry::{DEFAULT_PORT, RegistryReply, RegistryRequest};
use armor_wire::run_key::RunSecret;
use thiserror::Error;
use tracing::info;

use crate::directory::RegistryDirectory;

/// How the registry is run.
#[derive(Clone, Copy, Debug)]
pub struct RegistryOptions {
    /// Where it listens: a loopback address; port 0 for any free one.
    pub listen: SocketAddr,
    /// Limits on what its peers cost.
    pub limits: ServerLimits,
    /// The secret of the run whose launcher has started it.
    pub secret: Option<RunSecret>,
}

impl Default for RegistryOptions {
    fn default() -> Self {
        Self {
            listen: (Ipv4Addr::LOCALHOST, DEFAULT_PORT).into(),
            limits: ServerLimits::default(),
            secret: None,
        }
    }
}

/// Why the registry cannot serve.
#[derive(Debug, Error)]
pub enum RegistryStartError {
    /// It cannot listen where it should.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system refuses what every process needs.
    #[error("cannot start the registry: {0}")]
    System(#[from] std::io::Error),
}

/// Serves until the future is dropped, which closes everything. `ready` gets the address once
/// peers can connect to it.
///
/// # Errors
/// [`RegistryStartError`] if it cannot start; once ready, no peer can end it.
pub async fn serve(
    options: RegistryOptions,
    ready: impl FnOnce(SocketAddr),
) -> Result<Infallible, RegistryStartError> {
    let listener = listen(options.listen)?;
    let address = listener.local_addr()?;
    let mut server = Server::<RegistryRequest, RegistryReply>::new(listener, options.limits)?;
    let wall_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    let instance = random_id();
    let directory = RegistryDirectory::new(instance, wall_s - server.now().as_secs_f64());
    let mut directory = directory.with_secret(options.secret);
    info!(%address, instance, "the registry listens");
    ready(address);
    loop {
        let event = server.next_event().await;
        for action in directory.handle(event, server.now()) {
            server.perform(action);
        }
    }
}
