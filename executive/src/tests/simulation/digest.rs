//! A number for all that was decided and published: the same decisions, byte by byte, give the
//! same.

use crate::controller::Controller;
use crate::event::ControllerAction;
use armor_sdk::wire::bincode;

/// FNV-1a, 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Digest(pub(super) u64);

impl Digest {
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(super) fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Adds an action by its content, not by the names of Rust types.
    pub(super) fn add_action(&mut self, action: &ControllerAction) {
        let text = match action {
            ControllerAction::Journal(record) => {
                without_fingerprint(&serde_json::to_string(record).unwrap())
            }
            ControllerAction::Activate { component, activation, values } => {
                let values = serde_json::to_string(values).unwrap();
                format!("activate {} {activation} {values}", component.0)
            }
            ControllerAction::Freeze { component, activation } => {
                format!("freeze {} {activation}", component.0)
            }
            ControllerAction::Kill { component } => format!("kill {}", component.0),
            ControllerAction::Acknowledge { component, serial } => {
                format!("acknowledge {} {serial}", component.0)
            }
            ControllerAction::Answer { connection, request, accepted, .. } => {
                format!("answer {connection} {request} {accepted}")
            }
            ControllerAction::Judge => "judge".to_owned(),
            ControllerAction::JudgeMove => "judge move".to_owned(),
            ControllerAction::Changed => "changed".to_owned(),
            ControllerAction::Publish => "publish".to_owned(),
            ControllerAction::Finished(outcome) => format!("finished {}", outcome.exit_code()),
        };
        self.add(text.as_bytes());
    }

    /// Adds what would be published now.
    pub(super) fn add_marking(&mut self, controller: &Controller) {
        let config = bincode::config::legacy();
        self.add(&bincode::encode_to_vec(controller.marking(0.0), config).unwrap());
    }
}

/// A record without the plan's fingerprint and without prose for people: the fingerprint depends on
/// the wording of the canonical text, and prose may be reworded; neither is a decision.
fn without_fingerprint(line: &str) -> String {
    let mut record: serde_json::Value = serde_json::from_str(line).unwrap();
    let fields = record.as_object_mut().unwrap();
    for field in ["fingerprint", "why", "text", "because"] {
        fields.remove(field);
    }
    record.to_string()
}
