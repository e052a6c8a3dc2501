//! A system on several hosts: the name of this host in the file, and the way to the others.
//!
//! Where a system has several hosts, processes register as `HOST:PORT` with the name of their host.
//! Connections to another host go through the router of this one, a SOCKS5 proxy that the gate or the
//! agent of this host offers to its own processes.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::OnceLock;

use parking_lot::Mutex;

/// The name of this host in the file.
const HOST_VARIABLE: &str = "ARMOR_HOST";
/// `address:port` of the router on this host.
const ROUTER_VARIABLE: &str = "ARMOR_ROUTER";

/// This host in a system of several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostPlace {
    /// Its name in the file.
    pub host: String,
    /// Where its router listens.
    pub router: SocketAddr,
}

/// What a tool has found out about the system that it connects to.
static FOUND: Mutex<Option<HostPlace>> = Mutex::new(None);

impl HostPlace {
    /// The environment variables that give a process this place.
    pub fn list_variables(&self) -> [(&'static str, String); 2] {
        [(HOST_VARIABLE, self.host.clone()), (ROUTER_VARIABLE, self.router.to_string())]
    }
}

/// Gives this process its place in the system that it connects to from here on, or none. What the
/// environment sets comes before it.
pub fn adopt_place(place: Option<HostPlace>) {
    *FOUND.lock() = place;
}

/// Returns the place that the environment, or [`adopt_place`], has given this process.
pub fn own_place() -> Option<HostPlace> {
    static SET: OnceLock<Option<HostPlace>> = OnceLock::new();
    let set = SET.get_or_init(|| {
        let variable = |name| std::env::var(name).ok().filter(|it: &String| !it.is_empty());
        let router = variable(ROUTER_VARIABLE)?.parse().ok()?;
        Some(HostPlace { host: variable(HOST_VARIABLE)?, router })
    });
    set.clone().or_else(|| FOUND.lock().clone())
}

/// Returns how other processes of the system reach one of this host that listens on `address`.
pub fn name_endpoint(address: SocketAddr) -> String {
    match own_place() {
        Some(place) => format!("{}:{}", place.host, address.port()),
        None => address.to_string(),
    }
}

/// The way to an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// It is on this host, or has no name of a host.
    Direct(String),
    /// It is on another host of the system.
    Router(SocketAddr),
}

/// Returns the way to `address` for a process with this place.
pub(crate) fn find_way(place: Option<&HostPlace>, address: &str) -> Way {
    let direct = || Way::Direct(address.to_owned());
    let (Some(place), Some((host, port))) = (place, address.rsplit_once(':')) else {
        return direct();
    };
    if host == place.host {
        return Way::Direct(format!("{}:{port}", Ipv4Addr::LOCALHOST));
    }
    // Addresses in numbers are those of this host: a process registers under a name.
    if address.parse::<SocketAddr>().is_ok() || host == "localhost" {
        return direct();
    }
    Way::Router(place.router)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_other_hosts_go_through_the_router() {
        let router: SocketAddr = "127.0.0.1:4711".parse().unwrap();
        let place = HostPlace { host: "robot".into(), router };
        let direct = |address: &str| Way::Direct(address.to_owned());
        for (address, way) in [
            ("robot:20000", direct("127.0.0.1:20000")),
            ("arm:20000", Way::Router(router)),
            ("arm.local:20000", Way::Router(router)),
            ("127.0.0.1:20000", direct("127.0.0.1:20000")),
            ("[::1]:20000", direct("[::1]:20000")),
            ("localhost:20000", direct("localhost:20000")),
            ("robot", direct("robot")),
        ] {
            assert_eq!(find_way(Some(&place), address), way, "{address}");
            assert_eq!(find_way(None, address), direct(address));
        }
    }
}
