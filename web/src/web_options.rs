//! How a server is started.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Where the server listens by default.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

/// How a server is started.
#[derive(Clone, Debug)]
pub struct WebOptions {
    /// Where it listens; port 0 takes a free one. Beyond loopback it speaks HTTPS.
    pub listen: SocketAddr,
    /// The folder with the key of this host, for an address beyond loopback.
    pub keys: Option<PathBuf>,
    /// The registry of the system, `host:port`.
    pub registry: String,
    /// Who gives an order that names no author.
    pub author: String,
}
