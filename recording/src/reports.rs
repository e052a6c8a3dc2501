//! What components report to the mission, as a recording keeps it: the output `armor.reports`.

use armor_sdk::control::ReportKind;
use armor_sdk::prelude::Message;

/// The data under which reports are recorded.
pub const REPORTS: &str = "armor.reports";
/// How the two reports that every component has are written; all others are names of events.
const DONE: &str = "done";
const FAILED: &str = "failed";

/// A report of a component.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct RecordedReport {
    /// System time.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The component.
    pub component: String,
    /// Its activation.
    pub activation: u64,
    /// `done`, `failed`, or the name of an event.
    pub report: String,
    /// Why it has failed.
    pub reason: String,
    /// The value of an event.
    pub value: f64,
}

impl RecordedReport {
    /// As it is recorded.
    pub fn new(stamp: f64, component: &str, activation: u64, kind: &ReportKind) -> Self {
        let component = component.to_owned();
        let (report, reason, value) = match kind {
            ReportKind::Done => (DONE.into(), String::new(), 0.0),
            ReportKind::Failed { reason } => (FAILED.into(), reason.clone(), 0.0),
            ReportKind::Event { name, value } => (name.clone(), String::new(), *value),
        };
        Self { stamp, component, activation, report, reason, value }
    }

    /// The report itself.
    pub fn kind(&self) -> ReportKind {
        match self.report.as_str() {
            DONE => ReportKind::Done,
            FAILED => ReportKind::Failed { reason: self.reason.clone() },
            name => ReportKind::Event { name: name.into(), value: self.value },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_read_as_it_was_recorded() {
        let kinds = [
            ReportKind::Done,
            ReportKind::Failed { reason: "no path".into() },
            ReportKind::Event { name: "seen".into(), value: 0.5 },
        ];
        for kind in kinds {
            let recorded = RecordedReport::new(1.0, "arm", 3, &kind);
            assert_eq!((recorded.kind(), recorded.activation), (kind, 3));
        }
    }
}
