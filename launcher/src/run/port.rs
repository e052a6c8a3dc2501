//! The address of the registry: the given one, or a free port that no other launcher of this host
//! takes.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{self, UnixListener};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use armor_socket::explain_bind_error;
use armor_wire::registry::DEFAULT_PORT;

/// The last port that is tried.
pub const LAST_PORT: u16 = DEFAULT_PORT + 100;
/// How long a port that is asked for is waited for.
const FREE_WITHIN: Duration = Duration::from_secs(3);
/// Time between two looks at it.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// A port that is ours as long as this lives.
#[derive(Debug)]
pub struct PortLease {
    /// Where the registry is to listen.
    pub address: SocketAddr,
    /// Two launchers that start at the same time must not take the same port.
    _claim: UnixListener,
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
            let Ok(claim) = claim_port(address) else {
                bail!(
                    "another `armor run` of this host has just taken {address} for its registry; \
                     give another --registry"
                );
            };
            if let Err(error) = bind_when_free(address) {
                let reason = explain_bind_error(address, &error);
                bail!(
                    "the registry cannot listen on {address}: {reason}; or give another --registry"
                );
            }
            return Ok(Self { address, _claim: claim });
        }
        for port in DEFAULT_PORT..=LAST_PORT {
            let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
            if let Ok(claim) = claim_port(address)
                && TcpListener::bind(address).is_ok()
            {
                return Ok(Self { address, _claim: claim });
            }
        }
        bail!(
            "the ports {DEFAULT_PORT} to {LAST_PORT} are all taken; stop a system or give --registry"
        )
    }
}

/// Binds a port, and leaves it again. The registry of a launcher that was killed may hold it for a moment.
fn bind_when_free(address: SocketAddr) -> io::Result<()> {
    let start = Instant::now();
    loop {
        match TcpListener::bind(address) {
            Err(error)
                if error.kind() == io::ErrorKind::AddrInUse && start.elapsed() < FREE_WITHIN =>
            {
                thread::sleep(LOOK_EVERY);
            }
            bound => return bound.map(drop),
        }
    }
}

/// Claims a port by a socket name that only one process of the host (of its network namespace, as
/// with ports) can have, and that the kernel releases when the process ends. The port itself is
/// left to the registry.
fn claim_port(address: SocketAddr) -> io::Result<UnixListener> {
    let name = format!("armor-registry-{address}");
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
        let address = leases[0].address;
        let error = PortLease::take(Some(address)).expect_err("it is claimed").to_string();
        assert!(error.contains("another `armor run`"), "{error}");
        drop(leases);
        // Another test may claim one of those that are free again.
        let leases: Vec<_> = ports
            .iter()
            .filter_map(|port| PortLease::take(Some((Ipv4Addr::LOCALHOST, *port).into())).ok())
            .collect();
        assert!(!leases.is_empty(), "{ports:?}");
    }

    #[test]
    fn a_port_that_is_left_in_a_moment_is_waited_for() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = taken.local_addr().expect("it listens");
        let (sender, taking) = std::sync::mpsc::channel();
        let leaving = thread::spawn(move || {
            taking.recv().expect("it is being taken");
            drop(taken);
        });
        sender.send(()).expect("it waits");
        let lease = PortLease::take(Some(address)).expect("it is left");
        assert_eq!(lease.address, address);
        leaving.join().expect("no panic");
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
