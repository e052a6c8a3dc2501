//! Whether a mission is over, and texts of processes as the fonts can show them.

use armor_inspect::systems::RunRecord;
use armor_marking::{Marking, MarkingStage};
use eframe::egui;

/// Whether nothing more can be ordered.
pub fn is_over(stage: MarkingStage) -> bool {
    stage.has_ended() || stage == MarkingStage::Stopping
}

/// The marking of a mission that is over, which has no transition that may still fire.
pub fn without_firings(marking: &Marking) -> Marking {
    Marking { enabled: Vec::new(), confirmations: Vec::new(), ..marking.clone() }
}

/// What a process states, as the fonts can show it.
pub fn printable(ui: &egui::Ui, text: &str) -> String {
    crate::text::paintable(ui.ctx(), &text.replace('\u{2192}', "->")).into_owned()
}

/// The time of day of a time since the Unix epoch, to the second.
pub fn time_of_day(epoch_s: f64) -> String {
    let of_day = (epoch_s.max(0.0) as u64) % 86_400;
    format!("{:02}:{:02}:{:02} UTC", of_day / 3600, of_day / 60 % 60, of_day % 60)
}

/// What distinguishes a run from others of the same system: its address and its start.
pub fn name_run(record: &RunRecord) -> String {
    let started = time_of_day(record.started_s);
    format!("{} at {}, started {started}", record.system, record.registry)
}

/// Whether two records are of one run.
pub fn is_same_run(one: &RunRecord, other: &RunRecord) -> bool {
    (one.pid, one.registry) == (other.pid, other.registry)
        && (one.started_s - other.started_s).abs() < 0.001
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_of_day_has_two_digits_each() {
        assert_eq!(time_of_day(0.0), "00:00:00 UTC");
        assert_eq!(time_of_day(1_790_000_000.9), "14:13:20 UTC");
    }
}
