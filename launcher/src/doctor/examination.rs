//! What another host finds of itself, and what this host finds of that: its release and its key.

use std::path::{Path, PathBuf};

use armor_keys::connect::GateError;
use armor_keys::expiry::{describe_notice, find_notice, format_date};
use armor_wire::gate::{HostExamination, HostFinding};
use armor_wire::hello::VERSION;

use super::diagnosis::{Diagnosis, HostCondition, diagnose};
use super::host::HostFacts;

/// Examines this host for another one. `out` is where a run writes.
pub fn examine_own_host(out: &Path, component_directories: &[PathBuf]) -> Vec<HostFinding> {
    let diagnoses = match HostFacts::collect(out, component_directories) {
        Ok(facts) => diagnose(&facts),
        Err(error) => {
            let remedy = "`armor doctor` on that host has the details";
            vec![Diagnosis::new("host", HostCondition::Fault, format!("{error:#}"), remedy)]
        }
    };
    let describe = |Diagnosis { subject, condition, found, remedy, .. }: Diagnosis| HostFinding {
        subject: subject.into_owned(),
        condition: condition.as_str().into(),
        found,
        remedy,
    };
    diagnoses.into_iter().map(describe).collect()
}

/// Judges what a host has found of itself, or why it has not answered.
pub fn judge_examination(
    host: &str,
    examination: Result<HostExamination, GateError>,
    now_s: i64,
) -> Vec<Diagnosis> {
    let HostExamination { release, protocol, key_ends_s, findings } = match examination {
        Ok(examination) => examination,
        Err(error) => {
            let found = format!("{host} does not examine itself: {error}");
            let remedy = format!("install the release of this host on {host}");
            return vec![Diagnosis::new("versions", HostCondition::Warning, found, remedy)];
        }
    };
    let ends = format!("the key of {host} is valid until {}", format_date(key_ends_s));
    let mut all =
        vec![judge_versions(host, &release, protocol), judge_key(host, key_ends_s, now_s, ends)];
    all.extend(findings.into_iter().map(|finding| {
        let HostFinding { subject, condition, found, remedy } = finding;
        let condition = HostCondition::named(&condition);
        Diagnosis {
            host: Some(host.to_owned()),
            ..Diagnosis::new(subject, condition, found, remedy)
        }
    }));
    all
}

fn judge_versions(host: &str, release: &str, protocol: u16) -> Diagnosis {
    const SUBJECT: &str = "versions";
    let own = env!("CARGO_PKG_VERSION");
    let found = format!("{host} has armor {release}, protocol {protocol}");
    let remedy = format!("install armor {own} on {host}, or {release} here");
    match (protocol == VERSION, release == own) {
        (true, true) => Diagnosis::good(SUBJECT, found),
        (true, false) => {
            let found = format!("{found}; this host has armor {own}");
            Diagnosis::new(SUBJECT, HostCondition::Warning, found, remedy)
        }
        (false, _) => {
            let found = format!(
                "{found}; this host has armor {own}, protocol {VERSION}: their processes refuse \
                 each other"
            );
            Diagnosis::new(SUBJECT, HostCondition::Fault, found, remedy)
        }
    }
}

/// Judges the key of a host by its end; `found` describes one that is valid for long.
pub fn judge_key(name: &str, not_after_s: i64, now_s: i64, found: String) -> Diagnosis {
    const SUBJECT: &str = "key";
    let Some(notice) = find_notice(not_after_s, now_s) else {
        return Diagnosis::good(SUBJECT, found);
    };
    let condition = if notice == 0 { HostCondition::Fault } else { HostCondition::Warning };
    let found = describe_notice(name, not_after_s, now_s).unwrap_or(found);
    let remedy = format!("armor keys renew {name}, where the authority is");
    Diagnosis::new(SUBJECT, condition, found, remedy)
}

#[cfg(test)]
mod tests {
    use armor_keys::expiry::DAY_S;

    use super::*;

    const NOW_S: i64 = 1_800_000_000;

    fn examination() -> HostExamination {
        HostExamination {
            release: env!("CARGO_PKG_VERSION").into(),
            protocol: VERSION,
            key_ends_s: NOW_S + 100 * DAY_S,
            findings: vec![HostFinding {
                subject: "disk".into(),
                condition: "warning".into(),
                found: "200.0 MiB free in /out".into(),
                remedy: "free some space".into(),
            }],
        }
    }

    fn judge(examination: HostExamination) -> Vec<(HostCondition, String, String)> {
        let all = judge_examination("arm", Ok(examination), NOW_S);
        all.into_iter().map(|one| (one.condition, one.subject.into_owned(), one.found)).collect()
    }

    #[test]
    fn another_release_and_a_key_that_ends_are_found_at_the_host() {
        let good = judge(examination());
        assert!(good[0].0 == HostCondition::Good && good[1].0 == HostCondition::Good, "{good:?}");
        assert_eq!(good[2].0, HostCondition::Warning, "its own finding stays what it is: {good:?}");
        let older = judge(HostExamination { release: "0.0.1".into(), ..examination() });
        assert!(older[0].0 == HostCondition::Warning && older[0].2.contains("arm has armor 0.0.1"));
        let other = judge(HostExamination { protocol: VERSION - 1, ..examination() });
        assert!(other[0].0 == HostCondition::Fault && other[0].2.contains("refuse each other"));
        let ends = judge(HostExamination { key_ends_s: NOW_S + DAY_S, ..examination() });
        assert!(
            ends[1].0 == HostCondition::Warning && ends[1].2.contains("the key of arm expires")
        );
        let expired = judge(HostExamination { key_ends_s: NOW_S - 1, ..examination() });
        assert_eq!(expired[1].0, HostCondition::Fault);
    }

    #[test]
    fn a_host_that_does_not_answer_has_another_release() {
        let gate = "arm.local:7410".to_owned();
        let reason = "it has closed the connection".to_owned();
        let failed = Err(GateError::Unreachable { gate, reason });
        let all = judge_examination("arm", failed, NOW_S);
        assert!(all[0].condition == HostCondition::Warning && all[0].remedy.contains("on arm"));
    }

    #[test]
    fn this_host_examines_itself_for_others() {
        let findings = examine_own_host(Path::new("out"), &[]);
        for subject in ["versions", "disk", "ports", "shared memory", "real time", "cpu shares"] {
            let found = findings.iter().find(|finding| finding.subject == subject);
            let condition = &found.unwrap_or_else(|| panic!("no {subject}")).condition;
            assert_eq!(HostCondition::named(condition).as_str(), condition);
        }
    }
}
