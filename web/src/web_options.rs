//! How a server is started.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Where the server listens by default.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

/// How a server is started.
#[derive(Clone, Debug)]
pub struct WebOptions {
    /// Where it listens, on loopback; port 0 takes a free one.
    pub listen: SocketAddr,
    /// The registry of the system, `host:port`.
    pub registry: String,
    /// Who gives an order that names no author.
    pub author: String,
}
