//! The parameters of the system: all of them at the beginning, then each change.

use std::time::{Duration, Instant};

use armor_sdk::configuration::{ConfigdConnection, ParameterList, Questions};
use armor_sdk::directory::Directory;
use armor_sdk::messages::ConfigurationState;
use armor_sdk::tap::Tap;
use armor_wire::codec;
use armor_wire::config::{ChangeKind, ChangeRecord, ChangeSubject};
use armor_wire::keep::Keep;

use crate::taps::OwnOutputs;
use crate::trail::{PARAMETERS, RecordedParameter};

/// The data by which configd announces each version of the file.
const CONFIGURATION_STATE: &str = "configuration.state";
/// More states than configd publishes while this thread lists the parameters.
const KEEP: Keep = Keep::Last { count: 1000 };
/// Time within which configd must answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(3);
/// How long configd may take to appear before it is sought again.
const APPEARS_WITHIN: Duration = Duration::from_secs(1);
/// Time after which the thread checks whether the recording is over.
const LOOK: Duration = Duration::from_millis(100);
/// The name by which configd knows the recorder.
const RECORDER: &str = "record";

/// Records them on a thread of its own, until `outputs` takes nothing more.
pub(crate) fn follow_parameters(directory: Directory, outputs: OwnOutputs) -> std::io::Result<()> {
    let run = move || {
        let mut trail = ParameterTrail { outputs, version: 0, sequence: 0 };
        while !trail.outputs.are_over() {
            // A configd that has ended is started again.
            let started = Instant::now();
            trail.follow_states(&directory);
            std::thread::sleep(LOOK.saturating_sub(started.elapsed()));
        }
    };
    std::thread::Builder::new().name("record-parameters".into()).spawn(run).map(drop)
}

struct ParameterTrail {
    outputs: OwnOutputs,
    /// The last version whose values are recorded.
    version: u64,
    sequence: u64,
}

impl ParameterTrail {
    fn follow_states(&mut self, directory: &Directory) {
        let Ok(mut tap) = Tap::open(directory, CONFIGURATION_STATE, KEEP, APPEARS_WITHIN) else {
            return;
        };
        if self.version == 0 {
            let name = format!("{RECORDER}-{}", std::process::id());
            let listed = ConfigdConnection::open(directory, &name, ANSWER_WITHIN)
                .and_then(|mut configd| configd.parameters(None));
            let Ok(listed) = listed else { return };
            self.record_values(listed);
        }
        while !self.outputs.are_over() {
            match tap.next(LOOK) {
                Ok(None) => {}
                Ok(Some(message)) => {
                    let Ok(state) = codec::decode::<ConfigurationState>(&message.payload) else {
                        return;
                    };
                    if state.version > self.version {
                        self.record_changes(&state);
                    }
                }
                Err(_) => return,
            }
        }
    }

    fn record_values(&mut self, listed: ParameterList) {
        self.version = listed.version;
        let now_s = self.outputs.timestamp();
        for parameter in listed.parameters {
            self.push(&RecordedParameter {
                stamp: now_s,
                component: parameter.component,
                parameter: parameter.name,
                value: parameter.value,
                version: listed.version,
                origin: parameter.origin,
                ..RecordedParameter::default()
            });
        }
    }

    fn record_changes(&mut self, state: &ConfigurationState) {
        self.version = state.version;
        let now_s = self.outputs.timestamp();
        for change in state.changes.iter().filter_map(read_change) {
            self.push(&RecordedParameter {
                stamp: now_s,
                version: state.version,
                set_by: state.set_by.clone(),
                ..change
            });
        }
    }

    fn push(&mut self, parameter: &RecordedParameter) {
        self.outputs.push(PARAMETERS, parameter, parameter.stamp, self.sequence, 0);
        self.sequence += 1;
    }
}

/// The value of a parameter that has changed, if that is the change.
fn read_change(change: &ChangeRecord) -> Option<RecordedParameter> {
    if change.subject != ChangeSubject::Parameter {
        return None;
    }
    let (component, parameter) = change.name.split_once('.')?;
    let value = if change.change == ChangeKind::Removed { "" } else { &change.after };
    Some(RecordedParameter {
        component: component.into(),
        parameter: parameter.into(),
        value: value.into(),
        before: change.before.clone(),
        ..RecordedParameter::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_has_both_values() {
        let change = ChangeRecord {
            subject: ChangeSubject::Parameter,
            name: "driver.speed".into(),
            change: ChangeKind::Changed,
            before: "1m/s".into(),
            after: "2m/s".into(),
            ..ChangeRecord::default()
        };
        let read = read_change(&change).unwrap();
        assert_eq!((read.component.as_str(), read.parameter.as_str()), ("driver", "speed"));
        assert_eq!((read.before.as_str(), read.value.as_str()), ("1m/s", "2m/s"));
        let removed = ChangeRecord { change: ChangeKind::Removed, ..change.clone() };
        assert_eq!(read_change(&removed).unwrap().value, "");
        let other = ChangeRecord { subject: ChangeSubject::Component, ..change };
        assert_eq!(read_change(&other), None);
    }
}
