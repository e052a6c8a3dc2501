//! The address of the registry: the given one, or a free port that no other launcher of this host
//! takes.

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{self, UnixListener};

use anyhow::{Result, bail};
use armor_socket::explain_bind_error;
use armor_wire::registry::DEFAULT_PORT;

/// The last port that is tried.
pub const LAST_PORT: u16 = DEFAULT_PORT + 100;

/// A port that is ours as long as this lives.
#[derive(Debug)]
pub struct PortLease {
    /// Where the registry is to listen.
    pub address: SocketAddr,
    /// Two launchers that start at the same time must not take the same port.
    _claim: Option<UnixListener>,
}

impl PortLease {
    /// Returns whether it is the default port.
    pub fn is_default(&self) -> bool {
        self.address.port() == DEFAULT_PORT
    }

    /// Takes the port that was asked for, or the first free one.
    ///
    /// # Errors
    /// If the port asked for is taken, or all are.
    pub fn take(asked: Option<SocketAddr>) -> Result<Self> {
        if let Some(address) = asked {
            if !address.ip().is_loopback() {
                bail!(
                    "the registry may not listen on {address}: without keys, only this host may \
                     be served; give an address such as 127.0.0.1:{DEFAULT_PORT}"
                );
            }
            if let Err(error) = TcpListener::bind(address) {
                let reason = explain_bind_error(address, &error);
                bail!(
                    "the registry cannot listen on {address}: {reason}; or give another --registry"
                );
            }
            return Ok(Self { address, _claim: None });
        }
        for port in DEFAULT_PORT..=LAST_PORT {
            let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
            if let Ok(claim) = claim_port(port)
                && TcpListener::bind(address).is_ok()
            {
                return Ok(Self { address, _claim: Some(claim) });
            }
        }
        bail!(
            "the ports {DEFAULT_PORT} to {LAST_PORT} are all taken; stop a system or give --registry"
        )
    }
}

/// Claims a port by a socket name that only one process of the host (of its network namespace, as
/// with ports) can have, and that the kernel releases when the process ends. The port itself is
/// left to the registry.
fn claim_port(port: u16) -> std::io::Result<UnixListener> {
    let name = format!("armor-registry-{port}");
    UnixListener::bind_addr(&net::SocketAddr::from_abstract_name(name)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_launchers_never_take_the_same_port() {
        let leases: Vec<_> =
            (0..5).map(|_| PortLease::take(None).expect("a port is free")).collect();
        let mut ports: Vec<_> = leases.iter().map(|lease| lease.address.port()).collect();
        ports.dedup();
        assert_eq!(ports.len(), 5, "{ports:?}");
    }

    #[test]
    fn a_port_that_is_taken_or_open_to_the_world_is_refused() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = taken.local_addr().expect("it listens");
        let error = PortLease::take(Some(address)).expect_err("it is taken");
        let text = error.to_string();
        assert!(text.contains("--registry") && text.contains("of this user already"), "{text}");
        let error = PortLease::take(Some(([0, 0, 0, 0], 7411).into())).expect_err("it is open");
        assert!(error.to_string().contains("keys"), "{error}");
    }
}
