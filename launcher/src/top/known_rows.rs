//! What was last known of the components of other hosts, shown while such a host is cut off. Pure.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use armor_inspect::run_control::HostReport;

use super::snapshot::{CUT_OFF, ProcessRow};

/// Time for which a row is kept after its component has disappeared from the registry: the launcher
/// may report later than the registry that the host is cut off.
const KEEP_FOR: Duration = Duration::from_secs(10);

/// The last rows of components, by name, and when each was seen.
#[derive(Debug, Default)]
pub struct KnownRows(BTreeMap<String, (ProcessRow, Instant)>);

impl KnownRows {
    /// Marks the rows of hosts that are cut off, with the values that were last known, and adds the rows
    /// of components there that have disappeared.
    pub fn mark_cut_off(&mut self, rows: &mut Vec<ProcessRow>, hosts: &[HostReport], now: Instant) {
        let describe_cut =
            |host: &str| hosts.iter().find(|report| report.host == host)?.describe_cut();
        for row in rows.iter_mut() {
            match describe_cut(&row.host) {
                Some(cut) => *row = mark(self.known_or(row), cut),
                None => self.remember(row, now),
            }
        }
        self.0.retain(|_, (row, seen)| {
            describe_cut(&row.host).is_some() || now.duration_since(*seen) < KEEP_FOR
        });
        let is_missing = |row: &&ProcessRow| rows.iter().all(|shown| shown.name != row.name);
        let missing = self.0.values().map(|(row, _)| row).filter(is_missing);
        let missing = missing.filter_map(|row| Some(mark(row.clone(), describe_cut(&row.host)?)));
        let missing: Vec<_> = missing.collect();
        rows.extend(missing);
    }

    /// Takes in the row of a component whose host is not cut off.
    fn remember(&mut self, row: &ProcessRow, now: Instant) {
        // One that does not run here, or is no component of a host, is not to be shown as if it were.
        if row.pid.is_none() {
            self.0.remove(&row.name);
            return;
        }
        match self.0.get_mut(&row.name) {
            // It no longer answers: its host may be cut off, which the launcher has not noticed yet.
            Some((known, seen)) if known.pid == row.pid && row.exec_hz.is_none() => {
                known.host.clone_from(&row.host);
                *seen = now;
            }
            _ => {
                self.0.insert(row.name.clone(), (row.clone(), now));
            }
        }
    }

    /// Returns the last known row of this component on this host; this row if there is none.
    fn known_or(&self, row: &ProcessRow) -> ProcessRow {
        let known = self.0.get(&row.name).map(|(known, _)| known);
        known.filter(|known| known.host == row.host).unwrap_or(row).clone()
    }
}

fn mark(row: ProcessRow, problem: String) -> ProcessRow {
    ProcessRow { state: CUT_OFF.into(), problem, ..row }
}

#[cfg(test)]
mod tests {
    use armor_inspect::run_control::HostLink;

    use super::super::snapshot::tests::{report, row};
    use super::*;

    fn far() -> ProcessRow {
        ProcessRow { host: "arm".into(), ..row("gripper", 0.0, 3) }
    }

    #[test]
    fn a_component_that_has_disappeared_with_its_host_keeps_its_row() {
        let mut known = KnownRows::default();
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let connected = [report("arm", HostLink::Connected)];
        let cut = [report("arm", HostLink::CutOff)];
        let look = |known: &mut KnownRows, mut rows: Vec<ProcessRow>, hosts: &[_], s| {
            known.mark_cut_off(&mut rows, hosts, at(s));
            rows
        };
        let near = row("driver", 1.0, 0);
        let rows = look(&mut known, vec![near.clone(), far()], &connected, 0);
        assert_eq!(rows, [near.clone(), far()], "nothing is marked");
        // It no longer answers, and the launcher has noticed nothing.
        let silent = ProcessRow { state: "suspected".into(), exec_hz: None, ..far() };
        assert_eq!(look(&mut known, vec![silent.clone()], &connected, 2), vec![silent.clone()]);
        let problem = "arm is cut off for 3.0 s (it has fallen silent)".to_owned();
        let expected = ProcessRow { state: "cut off".into(), problem, ..far() };
        let rows = look(&mut known, vec![near.clone(), silent], &cut, 3);
        assert_eq!(rows, [near.clone(), expected.clone()]);
        // The registry has removed it, a minute ago.
        let rows = look(&mut known, vec![near.clone()], &cut, 60);
        assert_eq!(rows, [near.clone(), expected]);
        // It is connected again, without the component.
        assert_eq!(look(&mut known, vec![near.clone()], &connected, 61), vec![near.clone()]);
        assert_eq!(look(&mut known, vec![near.clone()], &cut, 62), [near]);
    }

    #[test]
    fn a_row_that_disappears_before_the_cut_is_noticed_is_kept_for_a_while() {
        let mut known = KnownRows::default();
        let start = Instant::now();
        let cut = [report("arm", HostLink::CutOff)];
        known.mark_cut_off(&mut vec![far()], &[], start);
        let mut rows = Vec::new();
        known.mark_cut_off(&mut rows, &[], start + Duration::from_secs(1));
        assert!(rows.is_empty(), "{rows:?}");
        known.mark_cut_off(&mut rows, &cut, start + Duration::from_secs(2));
        assert_eq!(rows.len(), 1);
        let mut later = Vec::new();
        let mut known = KnownRows::default();
        known.mark_cut_off(&mut vec![far()], &[], start);
        known.mark_cut_off(&mut later, &[], start + KEEP_FOR);
        known.mark_cut_off(&mut later, &cut, start + KEEP_FOR);
        assert!(later.is_empty(), "it ended long before: {later:?}");
    }

    #[test]
    fn a_component_that_the_launcher_reports_as_ended_is_not_shown_as_cut_off_later() {
        let mut known = KnownRows::default();
        let now = Instant::now();
        known.mark_cut_off(&mut vec![far()], &[], now);
        let ended = ProcessRow { pid: None, state: "ended".into(), ..far() };
        known.mark_cut_off(&mut vec![ended], &[], now);
        let mut rows = Vec::new();
        known.mark_cut_off(&mut rows, &[report("arm", HostLink::CutOff)], now);
        assert!(rows.is_empty(), "{rows:?}");
    }
}
