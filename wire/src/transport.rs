//! What carries a connection: the transports that a link can ask for, and how endpoints are
//! spelled.

use std::fmt;
use std::str::FromStr;

use crate::Message;
use crate::registry::ComponentEntry;

/// What a link's data travels on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Transport {
    /// A Unix socket within one host, TCP between two.
    #[default]
    Auto,
    /// TCP, also within one host.
    Tcp,
    /// Shared memory within one host, TCP between two.
    Shm,
    /// Datagrams; TCP where they do not arrive.
    Udp,
}

impl FromStr for Transport {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "tcp" => Ok(Self::Tcp),
            "shm" => Ok(Self::Shm),
            "udp" => Ok(Self::Udp),
            _ => Err("transport is auto, tcp, shm or udp".into()),
        }
    }
}

/// An address that a client can connect to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// `host:port`. The host may be a name, which is resolved at every connection.
    Tcp(String),
    /// The Unix socket of the process start with this instance, on the client's own host.
    Unix(u64),
}

impl Endpoint {
    /// Returns the endpoints at which `entry` can be reached, the preferred one first.
    ///
    /// The TCP endpoint always comes last: two containers may share a host name and no Unix
    /// sockets.
    pub fn of_component(
        entry: &ComponentEntry,
        transport: Transport,
        is_same_host: bool,
    ) -> Vec<Self> {
        let tcp = Self::Tcp(entry.endpoint.clone());
        match transport {
            Transport::Auto | Transport::Shm if is_same_host => {
                vec![Self::Unix(entry.instance), tcp]
            }
            Transport::Auto | Transport::Tcp | Transport::Shm | Transport::Udp => vec![tcp],
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => f.write_str(address),
            Self::Unix(instance) => f.write_str(&unix_socket_name(*instance)),
        }
    }
}

/// Returns the name of a process start's Unix socket in Linux's abstract namespace, without the
/// leading zero byte.
pub fn unix_socket_name(instance: u64) -> String {
    format!("armor-{instance:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry() -> ComponentEntry {
        ComponentEntry {
            name: "laser".into(),
            kind: "laser".into(),
            instance: 0xAB,
            pid: 1,
            host: "robot".into(),
            endpoint: "127.0.0.1:10007".into(),
        }
    }

    #[test]
    fn the_unix_socket_is_preferred_within_a_host_unless_the_link_asks_for_tcp() {
        let spell = |transport, is_same_host| {
            let endpoints = Endpoint::of_component(&entry(), transport, is_same_host);
            endpoints.iter().map(Endpoint::to_string).collect::<Vec<_>>()
        };
        let (unix, tcp) = ("armor-00000000000000ab", "127.0.0.1:10007");
        assert_eq!(spell(Transport::Auto, true), [unix, tcp]);
        assert_eq!(spell(Transport::Auto, false), [tcp]);
        assert_eq!(spell(Transport::Shm, true), [unix, tcp]);
        assert_eq!(spell(Transport::Shm, false), [tcp]);
        assert_eq!(spell(Transport::Tcp, true), [tcp]);
        assert_eq!(spell(Transport::Udp, true), [tcp]);
    }

    #[test]
    fn a_transport_is_read_as_the_file_spells_it() {
        assert_eq!("auto".parse(), Ok(Transport::Auto));
        assert_eq!("tcp".parse(), Ok(Transport::Tcp));
        assert_eq!("shm".parse(), Ok(Transport::Shm));
        assert_eq!("udp".parse(), Ok(Transport::Udp));
        assert!("UDP".parse::<Transport>().is_err());
    }
}
