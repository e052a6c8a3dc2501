//! Whether this host reaches the agents of the other hosts that a file names: by dialling them, as
//! `armor run` does, with the key of this host.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use armor_keys::HostKeys;
use armor_keys::connect::{GateClient, GateError};
use armor_keys::expiry::{describe_notice, find_notice, now_s};
use armor_robotfile::model::Host;
use armor_wire::clock::ClockSample;
use armor_wire::remote_process::HostAddress;

use super::diagnosis::{Diagnosis, HostCondition};

/// What was found of a host.
#[derive(Clone, Debug, PartialEq)]
struct DialledHost {
    host: String,
    own: String,
    /// The clock found at each of its addresses.
    answers: Vec<(String, Result<ClockSample, GateError>)>,
}

/// Clocks that are further apart, in seconds, do not follow the same time service.
const CLOCK_TOLERANCE_S: f64 = 0.1;

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
    found.extend(dialled.iter().filter_map(judge_clock));
    found.extend(dialled.into_iter().map(judge_host));
    runtime.shutdown_background();
    Ok(found)
}

/// Dials all addresses of a host, since a run may need each of them.
fn dial(host: &Host, keys: &HostKeys) -> impl Future<Output = DialledHost> + Send + 'static {
    let (host, addresses) = (host.name.value.clone(), host.addresses.value.clone());
    let own = keys.host_name().to_owned();
    let dial_one = |address: &String| {
        let gate = HostAddress { host: host.clone(), addresses: vec![address.clone()] };
        let client = GateClient::of_host(&gate, keys.clone());
        tokio::spawn(async move { client.compare_clocks().await })
    };
    let dials: Vec<_> = addresses.iter().map(dial_one).collect();
    async move {
        let mut answers = Vec::new();
        for (address, dial) in addresses.into_iter().zip(dials) {
            if let Ok(answer) = dial.await {
                answers.push((address, answer));
            }
        }
        DialledHost { host, own, answers }
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

/// Judges how far the clock of the host is from that of this one, by the quickest answer.
fn judge_clock(dialled: &DialledHost) -> Option<Diagnosis> {
    let answers = dialled.answers.iter().filter_map(|(_, answer)| answer.as_ref().ok());
    let clock = answers.min_by(|a, b| a.round_trip_s.total_cmp(&b.round_trip_s))?;
    let error_s = clock.round_trip_s / 2.0;
    let (host, own) = (&dialled.host, &dialled.own);
    let side = if clock.offset_s < 0.0 { "behind" } else { "ahead of" };
    let found = format!(
        "the clock of {host} is {:.3} s {side} that of {own}, within {:.1} ms",
        clock.offset_s.abs(),
        error_s * 1e3
    );
    let is_apart = clock.offset_s.abs() > CLOCK_TOLERANCE_S + error_s;
    let (condition, remedy) = if is_apart {
        let remedy = "let the same time service set both clocks (chrony or systemd-timesyncd): the \
                      dates in logs and the validity of keys depend on them";
        (HostCondition::Warning, remedy.to_owned())
    } else {
        (HostCondition::Good, String::new())
    };
    Some(Diagnosis { subject: "clock", condition, found, remedy })
}

fn judge_host(dialled: DialledHost) -> Diagnosis {
    let DialledHost { host, own, answers } = dialled;
    let mut good = Vec::new();
    let mut failures = Vec::new();
    let mut is_refused = false;
    for (address, answer) in answers {
        match answer {
            Ok(clock) => {
                good.push(format!("{address} after {:.1} ms", clock.round_trip_s * 1e3));
            }
            Err(GateError::Unreachable { reason, .. }) => {
                failures.push(format!("{address}: {reason}"));
            }
            Err(GateError::NoneReached { tried }) => failures.push(tried),
            Err(error) => {
                is_refused = true;
                failures.push(format!("{address}: {error}"));
            }
        }
    }
    let condition = match (good.is_empty(), failures.is_empty()) {
        (false, true) => HostCondition::Good,
        (false, false) => HostCondition::Warning,
        (true, _) => HostCondition::Fault,
    };
    let found = match condition {
        HostCondition::Fault => format!("{host} at {}", failures.join("; ")),
        _ => {
            let answers = good.join(" and at ");
            let others: String = failures.iter().map(|it| format!("; not at {it}")).collect();
            format!("{host} answers at {answers}; both accept the other's key{others}")
        }
    };
    let remedy = match condition {
        HostCondition::Good => String::new(),
        _ if is_refused => format!(
            "{host} and {own} need keys of one authority, and the present list of revoked ones \
             (armor keys list); check the clocks of both"
        ),
        HostCondition::Warning => {
            "a run uses the address that answers; correct the other one in the file, or repair its \
             network"
                .into()
        }
        _ => format!(
            "on {host}: armor host --from {own}; check the address in the file, and that no firewall \
             closes the port"
        ),
    };
    Diagnosis { subject: "host", condition, found, remedy }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialled(answers: &[Result<ClockSample, GateError>]) -> DialledHost {
        let addresses = ["arm.local:7410", "10.0.0.2:7410"].map(str::to_owned);
        let answers = addresses.into_iter().zip(answers.iter().cloned()).collect();
        DialledHost { host: "arm".into(), own: "robot".into(), answers }
    }

    fn judge(answers: &[Result<ClockSample, GateError>]) -> Diagnosis {
        judge_host(dialled(answers))
    }

    #[test]
    fn clocks_that_are_apart_by_more_than_the_measurement_explains_are_a_warning() {
        let at = |offset_s, round_trip_s| Ok(ClockSample { offset_s, round_trip_s });
        let judge = |answers: &[_]| judge_clock(&dialled(answers)).unwrap();
        let good = judge(&[at(0.02, 0.004)]);
        let text = "the clock of arm is 0.020 s ahead of that of robot, within 2.0 ms";
        assert_eq!((good.condition, good.found.as_str()), (HostCondition::Good, text));
        assert_eq!(judge(&[at(0.4, 0.8)]).condition, HostCondition::Good);
        let behind = judge(&[at(0.4, 0.8), at(-1.5, 0.004)]);
        assert!(behind.found.contains("1.500 s behind that of robot"), "{behind:?}");
        assert!(behind.condition == HostCondition::Warning && behind.remedy.contains("chrony"));
        let reason = "no route".to_owned();
        let gate = "arm.local:7410".to_owned();
        assert!(judge_clock(&dialled(&[Err(GateError::Unreachable { gate, reason })])).is_none());
    }

    #[test]
    fn a_host_that_is_missing_or_has_another_key_is_a_fault_with_its_remedy() {
        let answer = Ok(ClockSample { offset_s: 0.0, round_trip_s: 0.003 });
        let good = judge(std::slice::from_ref(&answer));
        let text = "arm answers at arm.local:7410 after 3.0 ms; both accept the other's key";
        assert_eq!((good.condition, good.found.as_str()), (HostCondition::Good, text));
        let gate = || "arm.local:7410".to_owned();
        let missing = Err(GateError::Unreachable { gate: gate(), reason: "no route".into() });
        let fault = judge(std::slice::from_ref(&missing));
        assert_eq!(fault.found, "arm at arm.local:7410: no route");
        assert!(fault.remedy.starts_with("on arm: armor host --from robot"), "{fault:?}");
        let warning = judge(&[missing.clone(), answer]);
        assert_eq!(warning.condition, HostCondition::Warning);
        assert_eq!(
            warning.found,
            "arm answers at 10.0.0.2:7410 after 3.0 ms; both accept the other's key; not at \
             arm.local:7410: no route"
        );
        let fault = judge(&[missing.clone(), missing]);
        assert_eq!(fault.found, "arm at arm.local:7410: no route; 10.0.0.2:7410: no route");
        let reason = "it is the gate of base, not of arm".to_owned();
        let wrong = judge(&[Err(GateError::NotAccepted { gate: gate(), reason })]);
        assert!(wrong.condition == HostCondition::Fault && wrong.found.contains("of base"));
    }
}
