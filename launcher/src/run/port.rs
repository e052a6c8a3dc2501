//! Where the registry listens: as told, or a free port that no other launcher of this user takes.

use std::fs::File;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};

use anyhow::{Context, Result, bail};
use armor_wire::registry::DEFAULT_PORT;

use crate::system::run_file;

/// The last port that is tried.
const LAST_PORT: u16 = DEFAULT_PORT + 100;

/// A port that is ours as long as this lives.
#[derive(Debug)]
pub struct Lease {
    /// Where the registry is to listen.
    pub address: SocketAddr,
    /// Locked; two launchers that start at once do not take the same port.
    _lock: Option<File>,
}

impl Lease {
    /// Whether it is the port that everybody tries first.
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
            TcpListener::bind(address).with_context(|| {
                format!("the registry cannot listen on {address}; give another --registry")
            })?;
            return Ok(Self { address, _lock: None });
        }
        let directory = run_file::directory()?;
        for port in DEFAULT_PORT..=LAST_PORT {
            let lock = File::create(directory.join(format!("port-{port}.lock")))
                .with_context(|| format!("{} cannot be written", directory.display()))?;
            let address = SocketAddr::from((IpAddr::V4(Ipv4Addr::LOCALHOST), port));
            if lock.try_lock().is_ok() && TcpListener::bind(address).is_ok() {
                return Ok(Self { address, _lock: Some(lock) });
            }
        }
        bail!(
            "the ports {DEFAULT_PORT} to {LAST_PORT} are all taken; stop a system or give --registry"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_launchers_never_take_the_same_port() {
        let leases: Vec<_> = (0..5).map(|_| Lease::take(None).expect("a port is free")).collect();
        let mut ports: Vec<_> = leases.iter().map(|lease| lease.address.port()).collect();
        ports.dedup();
        assert_eq!(ports.len(), 5, "{ports:?}");
    }

    #[test]
    fn a_port_that_is_taken_or_open_to_the_world_is_refused() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = taken.local_addr().expect("it listens");
        let error = Lease::take(Some(address)).expect_err("it is taken");
        assert!(error.to_string().contains("--registry"), "{error}");
        let error = Lease::take(Some(([0, 0, 0, 0], 7411).into())).expect_err("it is open");
        assert!(error.to_string().contains("keys"), "{error}");
    }
}
