//! The state machine on a socket.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::{SystemTime, UNIX_EPOCH};

use armor_socket::{Limits, ListenError, Server, listen, random_id};
use armor_wire::registry::{DEFAULT_PORT, Reply, Request};
use thiserror::Error;
use tracing::info;

use crate::directory::Directory;

/// How the registry is run.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Where it listens: a loopback address; port 0 for any free one.
    pub listen: SocketAddr,
    /// What its peers may take of it.
    pub limits: Limits,
}

impl Default for Options {
    fn default() -> Self {
        Self { listen: (Ipv4Addr::LOCALHOST, DEFAULT_PORT).into(), limits: Limits::default() }
    }
}

/// Why the registry cannot serve.
#[derive(Debug, Error)]
pub enum ServeError {
    /// It cannot listen where it should.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system refuses what every process needs.
    #[error("cannot start the registry: {0}")]
    System(#[from] std::io::Error),
}

/// Serves until the future is dropped, which closes everything. `ready` is told the address once
/// peers can connect to it.
///
/// # Errors
/// [`ServeError`] if it cannot start; once ready it goes on whatever its peers do.
pub async fn serve(
    options: Options,
    ready: impl FnOnce(SocketAddr),
) -> Result<Infallible, ServeError> {
    let listener = listen(options.listen)?;
    let address = listener.local_addr()?;
    let mut server = Server::<Request, Reply>::new(listener, options.limits)?;
    let wall_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    let instance = random_id();
    let mut directory = Directory::new(instance, wall_s - server.now().as_secs_f64());
    info!(%address, instance, "the registry listens");
    ready(address);
    loop {
        let event = server.event().await;
        for action in directory.handle(event, server.now()) {
            server.act(action);
        }
    }
}
