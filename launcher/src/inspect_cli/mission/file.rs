//! The mission file on the disk, if it differs from the played version: configd reports it.

use std::time::Duration;

use armor_sdk::messages::ConfigurationState;
use armor_wire::WireType;
use armor_wire::codec;
use armor_wire::config::FindingSeverity;

use armor_inspect::ObservedSystem;

/// How the configuration stands, latched.
const STATE: &str = "configuration.state";
/// Longest time to wait for the latched value.
const WITHIN: Duration = Duration::from_secs(1);
/// Findings that are named; `armor check` shows all.
const MAX_NAMED: usize = 3;

/// Returns that the file is not valid as text; none if it is valid, or that is unknown.
pub fn problem(observed: &ObservedSystem, played: u64) -> Option<String> {
    let invalid = describe_invalid(&read_state(observed)?)?;
    Some(format!("{invalid}: version {played} continues; see `armor check`"))
}

/// Returns the same without a mission.
pub fn problem_of_file(observed: &ObservedSystem) -> Option<String> {
    let state = read_state(observed)?;
    let invalid = describe_invalid(&state)?;
    Some(format!("{invalid}: version {} is in force; see `armor check`", state.version))
}

fn read_state(observed: &ObservedSystem) -> Option<ConfigurationState> {
    // Not waited for: a mission can be played without configd.
    observed.list().ok()?.data.iter().find(|entry| entry.data == STATE)?;
    let mut tap = observed.tap(STATE).ok()?;
    if tap.schema().hash() != ConfigurationState::schema().hash() {
        return None;
    }
    codec::decode(&tap.next(WITHIN).ok()??.payload).ok()
}

fn describe_invalid(state: &ConfigurationState) -> Option<String> {
    if !state.refused {
        return None;
    }
    let errors: Vec<_> =
        state.findings.iter().filter(|it| it.severity == FindingSeverity::Error).collect();
    let named = errors.iter().take(MAX_NAMED).map(|it| match it.line {
        0 => format!("{} in {}", it.code, it.file),
        line => format!("{} at {}:{line}", it.code, it.file),
    });
    let mut named: Vec<_> = named.collect();
    let more = errors.len().saturating_sub(MAX_NAMED) + state.findings_left_out as usize;
    if more > 0 {
        named.push(format!("{more} more"));
    }
    Some(format!("the file on the disk is not valid ({})", named.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_wire::config::FindingRecord;

    #[test]
    fn a_file_that_is_refused_is_named_with_its_errors() {
        let finding = |severity, code: &str, line| FindingRecord {
            severity,
            code: code.into(),
            message: String::new(),
            remedy: String::new(),
            file: "office.xml".into(),
            line,
            column: 1,
            end_line: line,
            end_column: 1,
            text: String::new(),
            source_line: String::new(),
        };
        let mut state = ConfigurationState {
            stamp: 0.0,
            version: 2,
            files: vec!["office.xml".into()],
            refused: true,
            findings: vec![
                finding(FindingSeverity::Warning, "W0211", 3),
                finding(FindingSeverity::Error, "E0101", 7),
                finding(FindingSeverity::Error, "E0201", 0),
            ],
            findings_left_out: 0,
            changes: Vec::new(),
            changes_left_out: 0,
            set_by: String::new(),
        };
        assert_eq!(
            describe_invalid(&state).as_deref(),
            Some("the file on the disk is not valid (E0101 at office.xml:7, E0201 in office.xml)")
        );
        state.findings = vec![finding(FindingSeverity::Error, "E0101", 7); 5];
        assert!(describe_invalid(&state).is_some_and(|it| it.contains("office.xml:7, 2 more)")));
        state.refused = false;
        assert_eq!(describe_invalid(&state), None);
    }
}
