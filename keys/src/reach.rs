//! Which processes a gate leads to, and with which rights: decided before a byte is forwarded.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;

use armor_wire::acting::{Preface, Rights};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::remote_process::REGISTRY_PORT;

use crate::connect::GateClient;
use crate::dial::list_endpoints;
use crate::identity::{KeyHolder, KeyPurpose};
use crate::routes::Routes;

/// Where a connection leads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// To a process of this host, which gets the preface first.
    Process {
        /// Where it listens, on loopback.
        address: SocketAddr,
        /// On whose behalf.
        preface: Preface,
    },
    /// To the gate of another host of the system.
    Host {
        /// Its name in the file.
        host: String,
        /// What to ask it for.
        address: String,
        /// On whose behalf.
        preface: Preface,
    },
}

/// Decides where connections of holders of keys may lead.
pub trait Reach: Send + Sync {
    /// Finds the process at `address` for the holder of a key. May wait for other processes.
    ///
    /// # Errors
    /// The refusal for the client.
    fn find_target(
        &self,
        client: &KeyHolder,
        address: &str,
        acts_for: Option<&Preface>,
    ) -> Result<Target, Refusal>;

    /// The gate of another host of the system.
    fn find_gate(&self, host: &str) -> Option<Arc<GateClient>>;

    /// The address of the registry of the system, if it is on this host.
    fn registry(&self) -> Option<SocketAddr>;
}

/// The system whose registry is on this host: its processes here, and the gates of its other hosts.
pub struct SystemReach {
    registry: SocketAddr,
    host: String,
    /// The components that the file places on each of the other hosts.
    components: BTreeMap<String, Vec<String>>,
    routes: Option<Arc<Routes>>,
}

impl SystemReach {
    /// A system on this host only.
    pub fn new(registry: SocketAddr, host: &str) -> Self {
        Self { registry, host: host.into(), components: BTreeMap::new(), routes: None }
    }

    /// Adds its other hosts: the components on each, and the ways to them.
    #[must_use]
    pub fn with_hosts(
        mut self,
        components: BTreeMap<String, Vec<String>>,
        routes: Arc<Routes>,
    ) -> Self {
        (self.components, self.routes) = (components, Some(routes));
        self
    }

    /// What the holder of a key may do.
    fn find_preface(&self, client: &KeyHolder) -> Result<Preface, Refusal> {
        let name = &client.name;
        let rights = match client.purpose {
            KeyPurpose::Person(role) => Rights::Person { role },
            KeyPurpose::Host => match self.components.get(name) {
                Some(components) => Rights::Host { components: components.clone() },
                None => {
                    let text = format!(
                        "{name} is the key of a host, and the file of this system names no host \
                         {name}; a person connects with the key of a person"
                    );
                    return Err(Refusal::new(RefusalCode::Role, text));
                }
            },
        };
        Ok(Preface { name: name.clone(), rights })
    }

    fn is_registered(&self, address: SocketAddr) -> Result<bool, Refusal> {
        let endpoints = list_endpoints(self.registry).map_err(|error| {
            let registry = self.registry;
            let text = format!("the registry at {registry} does not answer the gate: {error}");
            Refusal::new(RefusalCode::UnknownData, text)
        })?;
        let named = format!("{}:{}", self.host, address.port());
        let numeric = address.to_string();
        Ok(endpoints.iter().any(|endpoint| *endpoint == named || *endpoint == numeric))
    }
}

impl Reach for SystemReach {
    fn find_target(
        &self,
        client: &KeyHolder,
        address: &str,
        acts_for: Option<&Preface>,
    ) -> Result<Target, Refusal> {
        let refuse = |code, text: String| Err(Refusal::new(code, text));
        let preface = self.find_preface(client)?;
        if acts_for.is_some() {
            let text = format!("{} may not forward connections of others", client.name);
            return refuse(RefusalCode::Role, text);
        }
        let named = address.rsplit_once(':');
        let target = match named {
            Some((host, port)) if host == self.host => {
                let port = port.parse().map_err(|_| malformed_address(address, self.registry))?;
                match port {
                    REGISTRY_PORT => self.registry,
                    port => SocketAddr::from((Ipv4Addr::LOCALHOST, port)),
                }
            }
            Some((host, _)) if self.routes.as_ref().is_some_and(|it| it.leads_to(host)) => {
                return match client.purpose {
                    KeyPurpose::Person(_) => {
                        let (host, address) = (host.to_owned(), address.to_owned());
                        Ok(Target::Host { host, address, preface })
                    }
                    KeyPurpose::Host => refuse(
                        RefusalCode::WrongPurpose,
                        format!("{host} is another host, with a gate of its own"),
                    ),
                };
            }
            _ => address.parse().map_err(|_| malformed_address(address, self.registry))?,
        };
        if !target.ip().is_loopback() {
            let text =
                format!("{target} is not on the robot's host: a gate leads to its system only");
            return refuse(RefusalCode::WrongPurpose, text);
        }
        if target != self.registry && !self.is_registered(target)? {
            let text = format!("no process of the system listens on {target} of the robot's host");
            return refuse(RefusalCode::UnknownData, text);
        }
        Ok(Target::Process { address: target, preface })
    }

    fn find_gate(&self, host: &str) -> Option<Arc<GateClient>> {
        self.routes.as_ref()?.find_gate(host)
    }

    fn registry(&self) -> Option<SocketAddr> {
        Some(self.registry)
    }
}

fn malformed_address(address: &str, registry: SocketAddr) -> Refusal {
    let text = format!("{address} is not an address with a port, such as {registry}");
    Refusal::new(RefusalCode::Malformed, text)
}

#[cfg(test)]
mod tests {
    use armor_wire::acting::KeyRole;
    use armor_wire::remote_process::HostAddress;

    use super::*;

    fn reach() -> SystemReach {
        let registry = SocketAddr::from((Ipv4Addr::LOCALHOST, 7411));
        let components = BTreeMap::from([("arm".to_owned(), vec!["gripper".to_owned()])]);
        let addresses = vec!["arm.local:7410".into()];
        let gates = [HostAddress { host: "arm".into(), addresses }];
        let routes = Routes::without_keys("robot", gates);
        SystemReach::new(registry, "robot").with_hosts(components, Arc::new(routes))
    }

    fn find(client: (&str, KeyPurpose), address: &str) -> Result<Target, Refusal> {
        let holder = KeyHolder { name: client.0.into(), purpose: client.1 };
        reach().find_target(&holder, address, None)
    }

    const ALICE: (&str, KeyPurpose) = ("alice", KeyPurpose::Person(KeyRole::Operator));
    const ARM: (&str, KeyPurpose) = ("arm", KeyPurpose::Host);

    #[test]
    fn a_host_gets_the_rights_of_the_components_that_the_file_places_there() {
        let rights = Rights::Host { components: vec!["gripper".into()] };
        let preface = Preface { name: "arm".into(), rights };
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 7411));
        let registry = Target::Process { address, preface };
        assert_eq!(find(ARM, "robot:0"), Ok(registry.clone()));
        assert_eq!(find(ARM, "127.0.0.1:7411"), Ok(registry));
        let refusal = find(("base", KeyPurpose::Host), "robot:0").unwrap_err();
        assert!(refusal.text.contains("names no host base"), "{refusal}");
    }

    #[test]
    fn a_person_reaches_the_processes_of_every_host_and_a_host_only_those_here() {
        let preface = Preface::of_person("alice", KeyRole::Operator);
        let (host, address) = ("arm".to_owned(), "arm:20001".to_owned());
        assert_eq!(find(ALICE, "arm:20001"), Ok(Target::Host { host, address, preface }));
        assert!(find(ARM, "arm:20001").unwrap_err().text.contains("a gate of its own"));
    }

    #[test]
    fn no_other_address_is_reached_and_no_one_forwards_for_others() {
        for address in ["192.168.1.1:22", "other:22", "robot:x", "robot", "", "0.0.0.0:7411"] {
            assert!(find(ALICE, address).is_err(), "{address}");
        }
        let holder = KeyHolder { name: "arm".into(), purpose: KeyPurpose::Host };
        let engineer = Preface::of_person("alice", KeyRole::Engineer);
        let refusal = reach().find_target(&holder, "robot:0", Some(&engineer)).unwrap_err();
        assert!(refusal.text.contains("may not forward"), "{refusal}");
    }
}
