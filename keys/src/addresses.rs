//! The addresses at which a gate may listen. They are tried in turn, and so is each of those to which a
//! name resolves; the one that was reached last comes first.

use std::net::SocketAddr;
use std::time::Duration;

use armor_wire::gate::ANNOUNCED;
use armor_wire::remote_process::HostAddress;
use parking_lot::Mutex;
use tokio::net::lookup_host;
use tokio::time;

use crate::connect::{GateError, LIMIT};
use crate::discovery::find_agent;

/// How long resolving a name, and reaching one of several addresses, may take: an address that is dead
/// must not delay the next one for long, and one lost packet is repeated after a second.
const EACH_WITHIN: Duration = Duration::from_millis(1500);
/// Most addresses of one name that are tried; strangers may announce any number.
const MAX_RESOLVED: usize = 8;

/// The addresses of one gate.
pub(crate) struct GateAddresses {
    /// As the file writes them: names or addresses, each with a port.
    names: Vec<String>,
    /// The host whose gate it is, if it may announce itself.
    host: Option<String>,
    last: Mutex<Option<GatePlace>>,
}

/// One address at which a gate may be reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct GatePlace {
    /// What errors call it.
    pub(crate) label: String,
    pub(crate) address: SocketAddr,
    /// How long reaching it may take.
    pub(crate) limit: Duration,
}

impl GateAddresses {
    pub(crate) fn new(names: Vec<String>) -> Self {
        Self { names, host: None, last: Mutex::default() }
    }

    /// Those of the gate of a host.
    pub(crate) fn of_host(gate: &HostAddress) -> Self {
        Self { host: Some(gate.host.clone()), ..Self::new(gate.addresses.clone()) }
    }

    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The address that was reached last.
    pub(crate) fn last_reached(&self) -> Option<GatePlace> {
        self.last.lock().clone()
    }

    pub(crate) fn set_reached(&self, place: GatePlace) {
        *self.last.lock() = Some(place);
    }

    /// Finds the addresses of one of the names.
    ///
    /// # Errors
    /// If it does not resolve.
    pub(crate) async fn resolve(&self, name: &str) -> Result<Vec<GatePlace>, GateError> {
        let resolved = match &self.host {
            Some(host) if name == ANNOUNCED => find_agent(host, EACH_WITHIN).await,
            _ => look_up(name).await,
        };
        match resolved {
            Ok(mut addresses) => {
                addresses.truncate(MAX_RESOLVED);
                Ok(list_places(name, &addresses, self.names.len() == 1))
            }
            Err(reason) => Err(GateError::Unreachable { gate: name.to_owned(), reason }),
        }
    }
}

async fn look_up(name: &str) -> Result<Vec<SocketAddr>, String> {
    let addresses: Vec<_> = match time::timeout(EACH_WITHIN, lookup_host(name)).await {
        Ok(Ok(addresses)) => addresses.collect(),
        Ok(Err(error)) => return Err(error.to_string()),
        Err(_) => return Err(format!("its name was not resolved within {EACH_WITHIN:?}")),
    };
    match addresses.is_empty() {
        true => Err("its name has no address".into()),
        false => Ok(addresses),
    }
}

/// The places of a name; `is_alone` if the gate has no other name.
fn list_places(name: &str, addresses: &[SocketAddr], is_alone: bool) -> Vec<GatePlace> {
    let is_only = addresses.len() == 1;
    let limit = if is_only && is_alone { LIMIT } else { EACH_WITHIN };
    let places = addresses.iter().map(|address| {
        let label = match is_only {
            // Where it is announced, it may have any port.
            _ if name == ANNOUNCED => format!("{name} ({address})"),
            true => name.to_owned(),
            false => format!("{name} ({})", address.ip()),
        };
        GatePlace { label, address: *address, limit }
    });
    places.collect()
}

/// The failures at all addresses of a gate as one.
pub(crate) fn join_failures(mut failures: Vec<GateError>) -> GateError {
    if failures.len() == 1 {
        return failures.remove(0);
    }
    let tried = failures.iter().map(|failure| match failure {
        GateError::Unreachable { gate, reason } | GateError::NotAccepted { gate, reason } => {
            format!("{gate}: {reason}")
        }
        other => other.to_string(),
    });
    GateError::NoneReached { tried: tried.collect::<Vec<_>>().join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(addresses: &[&str]) -> Vec<SocketAddr> {
        addresses.iter().map(|address| address.parse().expect("an address")).collect()
    }

    #[test]
    fn only_the_only_address_has_all_the_time() {
        let one = parse(&["10.0.0.2:7410"]);
        let two = parse(&["10.0.0.2:7410", "[fd00::2]:7410"]);
        let list = |addresses: &[SocketAddr], is_alone| {
            let places = list_places("arm.local:7410", addresses, is_alone);
            places.into_iter().map(|place| (place.label, place.limit)).collect::<Vec<_>>()
        };
        let name = || "arm.local:7410".to_owned();
        assert_eq!(list(&one, true), [(name(), LIMIT)]);
        assert_eq!(list(&one, false), [(name(), EACH_WITHIN)]);
        let both = ["arm.local:7410 (10.0.0.2)", "arm.local:7410 (fd00::2)"];
        let announced = list_places(ANNOUNCED, &one, true);
        assert_eq!(announced[0].label, "mdns (10.0.0.2:7410)");
        assert_eq!(list(&two, true), both.map(|label| (label.to_owned(), EACH_WITHIN)));
    }

    #[test]
    fn the_reason_names_every_address_that_was_tried() {
        let first = GateError::Unreachable { gate: "arm:1".into(), reason: "no route".into() };
        assert_eq!(join_failures(vec![first.clone()]), first);
        let reason = "it is the gate of base, not of arm".into();
        let second = GateError::NotAccepted { gate: "10.0.0.2:1".into(), reason };
        assert_eq!(
            join_failures(vec![first, second]).to_string(),
            "no address of the gate can be used: arm:1: no route; 10.0.0.2:1: it is the gate of \
             base, not of arm"
        );
    }
}
