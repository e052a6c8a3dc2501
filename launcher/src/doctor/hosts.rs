//! Whether this host reaches the agents of the other hosts that a file names: by dialling them, as
//! `armor run` does, with the key of this host.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_keys::HostKeys;
use armor_keys::connect::{GateClient, GateError};
use armor_keys::expiry::{describe_notice, find_notice, now_s};
use armor_robotfile::model::Host;
use armor_wire::gate::GateRequest;
use armor_wire::remote_process::HostAddress;

use super::diagnosis::{Diagnosis, HostCondition};

/// What was found of a host.
#[derive(Clone, Debug, PartialEq)]
struct DialledHost {
    host: String,
    address: String,
    own: String,
    answer: Result<Duration, GateError>,
}

/// Examines the key of this host and each of `hosts`, all at the same time.
///
/// # Errors
/// If no event loop can be started.
pub fn examine_hosts(hosts: &[Host], keys: &Path) -> Result<Vec<Diagnosis>> {
    let own = match HostKeys::read(keys) {
        Ok(keys) => keys,
        Err(error) => return Ok(vec![refuse_keys(error.to_string())]),
    };
    let facts = own.facts();
    let mut found = vec![judge_key(&facts.holder.name, facts.not_after_s, keys.to_owned())];
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.context("the event loop cannot be started")?;
    let dialled = runtime.block_on(async {
        let dials: Vec<_> = hosts.iter().map(|host| tokio::spawn(dial(host, &own))).collect();
        let mut dialled = Vec::new();
        for dial in dials {
            dialled.extend(dial.await);
        }
        dialled
    });
    found.extend(dialled.into_iter().map(judge_host));
    runtime.shutdown_background();
    Ok(found)
}

fn dial(host: &Host, keys: &HostKeys) -> impl Future<Output = DialledHost> + Send + 'static {
    let (host, address) = (host.name.value.clone(), host.address.value.clone());
    let own = keys.host_name().to_owned();
    let gate = HostAddress { host: host.clone(), address: address.clone() };
    let client = GateClient::of_host(&gate, keys.clone());
    async move {
        let start = Instant::now();
        // An agent refuses this to a host, after both have proven their keys.
        let answer = client.request(GateRequest::Watch).await.map(|_| start.elapsed());
        DialledHost { host, address, own, answer }
    }
}

fn refuse_keys(found: String) -> Diagnosis {
    let remedy = "armor keys add NAME --role host, where the authority is; copy the key and the list \
                  `revoked` into a folder of its own, and name it with --keys (docs/hosts.md)";
    let condition = HostCondition::Fault;
    Diagnosis { subject: "key", condition, found, remedy: remedy.into() }
}

fn judge_key(name: &str, not_after_s: i64, folder: PathBuf) -> Diagnosis {
    let now_s = now_s();
    let notice =
        find_notice(not_after_s, now_s).and_then(|_| describe_notice(name, not_after_s, now_s));
    let (condition, found, remedy) = match notice {
        Some(notice) => {
            let remedy = format!("armor keys renew {name}, where the authority is");
            (HostCondition::Warning, notice, remedy)
        }
        None => {
            let found = format!("this is the host {name}, by its key in {}", folder.display());
            (HostCondition::Good, found, String::new())
        }
    };
    Diagnosis { subject: "key", condition, found, remedy }
}

fn judge_host(dialled: DialledHost) -> Diagnosis {
    let DialledHost { host, address, own, answer } = dialled;
    let (condition, found, remedy) = match answer {
        Ok(time) => {
            let ms = time.as_secs_f64() * 1e3;
            let found = format!(
                "{host} answers at {address} after {ms:.0} ms; both accept the other's key"
            );
            (HostCondition::Good, found, String::new())
        }
        Err(GateError::Unreachable { reason, .. }) => {
            let remedy = format!(
                "on {host}: armor host --from {own}; check the address in the file, and that no \
                 firewall closes the port"
            );
            (HostCondition::Fault, format!("{host} at {address}: {reason}"), remedy)
        }
        Err(error) => {
            let remedy = format!(
                "{host} and {own} need keys of one authority, and the present list of revoked ones \
                 (armor keys list); check the clocks of both"
            );
            (HostCondition::Fault, format!("{host} at {address}: {error}"), remedy)
        }
    };
    Diagnosis { subject: "host", condition, found, remedy }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(answer: Result<Duration, GateError>) -> Diagnosis {
        let (host, address, own) = ("arm".into(), "arm.local:7410".into(), "robot".into());
        judge_host(DialledHost { host, address, own, answer })
    }

    #[test]
    fn a_host_that_is_missing_or_has_another_key_is_a_fault_with_its_remedy() {
        let good = judge(Ok(Duration::from_millis(3)));
        let text = "arm answers at arm.local:7410 after 3 ms; both accept the other's key";
        assert_eq!((good.condition, good.found.as_str()), (HostCondition::Good, text));
        let gate = || "arm.local:7410".to_owned();
        let missing = GateError::Unreachable { gate: gate(), reason: "no route".into() };
        let missing = judge(Err(missing));
        assert_eq!(missing.found, "arm at arm.local:7410: no route");
        assert!(missing.remedy.starts_with("on arm: armor host --from robot"), "{missing:?}");
        let reason = "it is the gate of base, not of arm".to_owned();
        let wrong = judge(Err(GateError::NotAccepted { gate: gate(), reason }));
        assert!(wrong.condition == HostCondition::Fault && wrong.found.contains("of base"));
    }
}
