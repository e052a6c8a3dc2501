//! Where the agents of hosts are, if the file gives no address: an agent announces itself on the local
//! network by multicast DNS (RFC 6762, with DNS-SD, RFC 6763), and others listen for it.
//!
//! Anyone on the network can announce anything. An announcement only states where to connect; who is
//! there is proven by the keys, as at an address in the file.

use std::collections::{HashMap, HashSet};
use std::net::{SocketAddr, SocketAddrV6};
use std::thread;
use std::time::Duration;

use mdns_sd::{IfKind, ScopedIp, ServiceDaemon, ServiceEvent, ServiceInfo};
use parking_lot::Mutex;
use tokio::sync::watch;
use tokio::time;

/// The kind of service that agents announce.
const SERVICE: &str = "_armor-host._tcp.local.";
/// The property with the name of the host: the name of a service gets a number if it is taken.
const HOST: &str = "host";
/// Most announcements that are kept. A stranger may send any number.
const MAX_KEPT: usize = 256;

/// The announcement of one agent, for as long as this lives.
pub struct Announcement(ServiceDaemon);

impl Announcement {
    /// Announces the agent of `host`, which listens at `address`: at all addresses of this computer, if
    /// that is unspecified.
    ///
    /// # Errors
    /// If the thread that answers cannot be started. A network that appears later is used then.
    pub fn start(host: &str, address: SocketAddr) -> Result<Self, mdns_sd::Error> {
        // Other programs may announce this computer under its own name.
        let computer = format!("armor-{:016x}.local.", armor_socket::random_id());
        let (ip, is_any) = (address.ip(), address.ip().is_unspecified());
        let ips = if is_any { String::new() } else { ip.to_string() };
        let port = address.port();
        let service =
            ServiceInfo::new(SERVICE, host, &computer, ips.as_str(), port, &[(HOST, host)][..])?;
        let mut service = if is_any { service.enable_addr_auto() } else { service };
        if address.is_ipv4() {
            service.set_interfaces(vec![IfKind::IPv4]);
        }
        let daemon = ServiceDaemon::new()?;
        daemon.register(service)?;
        Ok(Self(daemon))
    }
}

impl Drop for Announcement {
    fn drop(&mut self) {
        // It sends a goodbye first, so that no launcher waits for an agent that has ended.
        if let Ok(ended) = self.0.shutdown() {
            let _ = ended.recv_timeout(Duration::from_secs(1));
        }
    }
}

/// Returns where the agent of `host` announces itself; waits for it up to `limit`.
///
/// # Errors
/// If nothing is announced under this name.
pub(crate) async fn find_agent(host: &str, limit: Duration) -> Result<Vec<SocketAddr>, String> {
    let mut agents = listen().map_err(|error| format!("multicast DNS cannot be used: {error}"))?;
    let is_known = |agents: &AgentTable| !agents.addresses_of(host).is_empty();
    match time::timeout(limit, agents.wait_for(is_known)).await {
        Ok(Ok(agents)) => Ok(agents.addresses_of(host)),
        Ok(Err(_)) => Err("multicast DNS has ended".into()),
        Err(_) => Err(format!(
            "no agent announces itself as {host} on the local network; is it started with \
             `armor host --announce`?"
        )),
    }
}

/// What one computer hears of agents. It begins with the first question of the process, and lasts: an
/// answer takes a while, and connections are tried often.
fn listen() -> Result<watch::Receiver<AgentTable>, mdns_sd::Error> {
    static AGENTS: Mutex<Option<watch::Receiver<AgentTable>>> = Mutex::new(None);
    let mut agents = AGENTS.lock();
    if let Some(agents) = agents.as_ref().filter(|agents| agents.has_changed().is_ok()) {
        return Ok(agents.clone());
    }
    let daemon = ServiceDaemon::new()?;
    let events = daemon.browse(SERVICE)?;
    let (sender, receiver) = watch::channel(AgentTable::default());
    thread::spawn(move || {
        let _daemon = daemon;
        while let Ok(event) = events.recv() {
            sender.send_if_modified(|agents| agents.update(event));
        }
    });
    *agents = Some(receiver.clone());
    Ok(receiver)
}

/// The agents that announce themselves.
#[derive(Default)]
struct AgentTable {
    /// By the name of the service.
    agents: HashMap<String, AnnouncedAgent>,
}

#[derive(PartialEq, Eq)]
struct AnnouncedAgent {
    host: String,
    /// The likeliest first.
    addresses: Vec<SocketAddr>,
}

impl AgentTable {
    /// Returns whether the event has changed it.
    fn update(&mut self, event: ServiceEvent) -> bool {
        match event {
            ServiceEvent::ServiceResolved(service) => {
                let Some(host) = service.txt_properties.get_property_val_str(HOST) else {
                    return false;
                };
                let addresses = list_addresses(&service.addresses, service.port);
                let agent = AnnouncedAgent { host: host.to_owned(), addresses };
                self.insert(service.fullname.clone(), agent)
            }
            ServiceEvent::ServiceRemoved(_, name) => self.agents.remove(&name).is_some(),
            _ => false,
        }
    }

    fn insert(&mut self, name: String, agent: AnnouncedAgent) -> bool {
        let is_new = !self.agents.contains_key(&name);
        if is_new && self.agents.len() >= MAX_KEPT || self.agents.get(&name) == Some(&agent) {
            return false;
        }
        self.agents.insert(name, agent);
        true
    }

    fn addresses_of(&self, host: &str) -> Vec<SocketAddr> {
        let mut names: Vec<_> =
            self.agents.iter().filter(|(_, agent)| agent.host == host).collect();
        // The name without a number first: it was taken first.
        names.sort_by_key(|(name, _)| (name.len(), *name));
        names.into_iter().flat_map(|(_, agent)| agent.addresses.iter().copied()).collect()
    }
}

/// The addresses of a service, those that other networks can reach first.
fn list_addresses(all: &HashSet<ScopedIp>, port: u16) -> Vec<SocketAddr> {
    let mut addresses: Vec<_> = all.iter().map(|ip| socket_address(ip, port)).collect();
    addresses.sort_by_key(|address| (rank(address), *address));
    addresses
}

fn socket_address(ip: &ScopedIp, port: u16) -> SocketAddr {
    match ip {
        ScopedIp::V6(ip) if ip.addr().is_unicast_link_local() => {
            SocketAddrV6::new(*ip.addr(), port, 0, ip.scope_id().index).into()
        }
        _ => SocketAddr::new(ip.to_ip_addr(), port),
    }
}

fn rank(address: &SocketAddr) -> u8 {
    match address {
        SocketAddr::V4(address) if address.ip().is_loopback() => 3,
        SocketAddr::V6(address) if address.ip().is_loopback() => 3,
        SocketAddr::V6(address) if address.ip().is_unicast_link_local() => 2,
        SocketAddr::V6(_) => 1,
        SocketAddr::V4(_) => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agent(host: &str, addresses: &[&str]) -> AnnouncedAgent {
        let addresses = addresses.iter().map(|address| address.parse().expect("an address"));
        AnnouncedAgent { host: host.into(), addresses: addresses.collect() }
    }

    #[test]
    fn what_a_stranger_announces_comes_after_it_and_hides_nothing() {
        let mut table = AgentTable::default();
        let stranger = || agent("arm", &["10.0.0.66:7410"]);
        let own = || agent("arm", &["10.0.0.2:7410"]);
        assert!(table.insert("arm (2)._armor-host._tcp.local.".into(), stranger()));
        assert!(table.insert("arm._armor-host._tcp.local.".into(), own()));
        assert!(!table.insert("arm._armor-host._tcp.local.".into(), own()), "nothing is new");
        table.insert("leg._armor-host._tcp.local.".into(), agent("leg", &["10.0.0.3:7410"]));
        let both = ["10.0.0.2:7410", "10.0.0.66:7410"].map(|it| it.parse().expect("an address"));
        assert_eq!(table.addresses_of("arm"), both);
        for number in 0..2 * MAX_KEPT {
            table.insert(format!("x{number}"), agent("x", &[]));
        }
        assert_eq!(table.agents.len(), MAX_KEPT);
        let moved = agent("arm", &["10.0.0.4:7410"]);
        assert!(table.insert("arm._armor-host._tcp.local.".into(), moved), "it is kept already");
        let name = "arm._armor-host._tcp.local.".to_owned();
        assert!(table.update(ServiceEvent::ServiceRemoved(SERVICE.into(), name)));
        assert_eq!(table.addresses_of("arm"), both[1..]);
    }

    #[test]
    fn an_address_that_others_reach_comes_first() {
        let texts = ["[::1]:1", "127.0.0.1:1", "[fe80::2%0]:1", "[fd00::2]:1", "10.0.0.2:1"];
        let mut addresses: Vec<SocketAddr> =
            texts.iter().map(|text| text.parse().expect("an address")).collect();
        addresses.sort_by_key(|address| (rank(address), *address));
        let sorted: Vec<_> = addresses.iter().map(|address| address.ip().to_string()).collect();
        assert_eq!(sorted, ["10.0.0.2", "fd00::2", "fe80::2", "127.0.0.1", "::1"]);
    }

    #[tokio::test]
    async fn an_agent_is_found_as_long_as_it_announces_itself() {
        let host = format!("host-{:x}", armor_socket::random_id());
        let none = find_agent(&host, Duration::from_millis(1)).await.expect_err("there is none");
        assert!(none.contains(&format!("no agent announces itself as {host}")), "{none}");
        let address = "127.0.0.1:7000".parse().expect("an address");
        let announcement = Announcement::start(&host, address).expect("it is announced");
        let found = find_agent(&host, Duration::from_secs(60)).await;
        assert_eq!(found, Ok(vec![address]));
        drop(announcement);
        let mut agents = listen().expect("it listens already");
        let gone = agents.wait_for(|agents| agents.addresses_of(&host).is_empty());
        time::timeout(Duration::from_secs(60), gone).await.expect("a goodbye").expect("it lasts");
    }
}
