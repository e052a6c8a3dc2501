//! Whether this host reaches the agents of the other hosts that a file names: by dialling them, as
//! `armor run` does, with the key of this host.

use std::path::Path;
use std::time::UNIX_EPOCH;

use anyhow::{Context, Result};
use armor_keys::connect::{GateClient, GateError};
use armor_keys::expiry::{format_date, now_s};
use armor_keys::{CertificateFacts, HostKeys};
use armor_wire::clock::ClockSample;
use armor_wire::gate::HostExamination;
use armor_wire::remote_process::HostAddress;

use super::diagnosis::{Diagnosis, HostCondition};
use super::examination::{judge_examination, judge_key};

/// The list of revoked keys, in the folder of the host's key.
const REVOKED: &str = "revoked";

/// A host to examine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExaminedHost {
    /// Its name, as in its key.
    pub name: String,
    /// Where its agent or gate may listen.
    pub addresses: Vec<String>,
}

/// What was found of a host.
#[derive(Clone, Debug, PartialEq)]
struct DialledHost {
    host: String,
    own: String,
    /// The clock found at each of its addresses.
    answers: Vec<(String, Result<ClockSample, GateError>)>,
    /// What it finds of itself; none if no address answers.
    examination: Option<Result<HostExamination, GateError>>,
}

/// Clocks that are further apart, in seconds, do not follow the same time service.
const CLOCK_TOLERANCE_S: f64 = 0.1;

/// Examines the key of this host and each of `hosts`, all at the same time.
///
/// # Errors
/// If no event loop can be started.
pub fn examine_hosts(hosts: &[ExaminedHost], keys: &Path) -> Result<Vec<Diagnosis>> {
    let own = match HostKeys::read(keys) {
        Ok(keys) => keys,
        Err(error) => return Ok(vec![refuse_keys(error.to_string())]),
    };
    let mut found = vec![judge_own_key(&own.facts(), keys, now_s())];
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
    for host in dialled {
        found.extend(judge_clock(&host));
        let examination = host.examination.clone();
        let name = host.host.clone();
        found.push(judge_host(host));
        found.extend(
            examination.map(|it| judge_examination(&name, it, now_s())).unwrap_or_default(),
        );
    }
    runtime.shutdown_background();
    Ok(found)
}

/// Dials all addresses of a host, since a run may need each of them, and has it examine itself.
fn dial(
    host: &ExaminedHost,
    keys: &HostKeys,
) -> impl Future<Output = DialledHost> + Send + 'static {
    let ExaminedHost { name: host, addresses } = host.clone();
    let keys = keys.clone();
    let own = keys.host_name().to_owned();
    let client = |addresses: &[String]| {
        let gate = HostAddress { host: host.clone(), addresses: addresses.to_vec() };
        GateClient::of_host(&gate, keys.clone())
    };
    let dial_one = |address: &String| {
        let client = client(std::slice::from_ref(address));
        tokio::spawn(async move { client.compare_clocks().await })
    };
    let dials: Vec<_> = addresses.iter().map(dial_one).collect();
    let any = client(&addresses);
    async move {
        let mut answers = Vec::new();
        for (address, dial) in addresses.into_iter().zip(dials) {
            if let Ok(answer) = dial.await {
                answers.push((address, answer));
            }
        }
        let examination = match answers.iter().any(|(_, answer)| answer.is_ok()) {
            true => Some(any.examine_host().await),
            false => None,
        };
        DialledHost { host, own, answers, examination }
    }
}

fn refuse_keys(found: String) -> Diagnosis {
    let remedy = "armor keys add NAME --role host, where the authority is; copy the key and the list \
                  `revoked` into a folder of its own, and name it with --keys (docs/hosts.md)";
    Diagnosis::new("key", HostCondition::Fault, found, remedy)
}

/// Judges the key of this host, and the list of revoked keys next to it.
fn judge_own_key(facts: &CertificateFacts, folder: &Path, now_s: i64) -> Diagnosis {
    let name = &facts.holder.name;
    let changed = std::fs::metadata(folder.join(REVOKED)).and_then(|it| it.modified()).ok();
    let changed = changed.and_then(|it| it.duration_since(UNIX_EPOCH).ok());
    let list = changed.map(|it| i64::try_from(it.as_secs()).unwrap_or_default());
    let list = list.map_or_else(String::new, |changed_s| {
        format!("; its list of revoked keys is of {}", format_date(changed_s))
    });
    let found = format!(
        "this is the host {name}, by its key in {}, of {}, valid until {}{list}",
        folder.display(),
        format_date(facts.not_before_s),
        format_date(facts.not_after_s),
    );
    judge_key(name, facts.not_after_s, now_s, found)
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
    Some(Diagnosis::new("clock", condition, found, remedy))
}

fn judge_host(dialled: DialledHost) -> Diagnosis {
    let DialledHost { host, own, answers, .. } = dialled;
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
    Diagnosis::new("host", condition, found, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialled(answers: &[Result<ClockSample, GateError>]) -> DialledHost {
        let addresses = ["arm.local:7410", "10.0.0.2:7410"].map(str::to_owned);
        let answers = addresses.into_iter().zip(answers.iter().cloned()).collect();
        DialledHost { host: "arm".into(), own: "robot".into(), answers, examination: None }
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
