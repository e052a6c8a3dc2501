//! What the launcher knows of the other hosts: whether each is connected, and how far its clock is from
//! that of this host.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use armor_inspect::run_control::{HostLink, HostReport};
use armor_wire::clock::ClockSample;
use parking_lot::Mutex;

/// Measurements of a clock that are kept; the one with the shortest round trip counts, since a delay in
/// one direction only looks like an offset.
const MAX_SAMPLES: usize = 8;

/// All other hosts; clones share what is known.
#[derive(Clone, Debug, Default)]
pub struct HostStates(Arc<Mutex<BTreeMap<String, KnownHost>>>);

#[derive(Debug, Default)]
struct KnownHost {
    /// The components whose connections to its agent are there.
    connected: BTreeSet<String>,
    was_connected: bool,
    /// The last change of its link, and when that was.
    link: Option<(HostLink, Instant)>,
    /// Why it is not connected.
    reason: String,
    samples: VecDeque<ClockSample>,
}

impl HostStates {
    /// Adds a host that has not been heard of.
    pub fn add_host(&self, host: &str) {
        self.0.lock().entry(host.to_owned()).or_default().note_link();
    }

    /// The agent runs the component.
    pub fn report_connected(&self, host: &str, component: &str) {
        let mut all = self.0.lock();
        let known = all.entry(host.to_owned()).or_default();
        known.connected.insert(component.to_owned());
        known.was_connected = true;
        known.note_link();
    }

    /// The connection of the component has ended, and why the host cannot be reached.
    pub fn report_lost(&self, host: &str, component: &str, reason: &str) {
        let mut all = self.0.lock();
        let known = all.entry(host.to_owned()).or_default();
        known.connected.remove(component);
        known.reason = reason.to_owned();
        known.note_link();
    }

    /// The component has no connection any more because it has ended.
    pub fn remove_component(&self, host: &str, component: &str) {
        if let Some(known) = self.0.lock().get_mut(host) {
            // Others tell whether it can be reached.
            if known.connected.len() > 1 {
                known.connected.remove(component);
            }
        }
    }

    /// Adds a measurement of the clock of a host.
    pub fn record_clock(&self, host: &str, sample: ClockSample) {
        let mut all = self.0.lock();
        let samples = &mut all.entry(host.to_owned()).or_default().samples;
        samples.push_back(sample);
        if samples.len() > MAX_SAMPLES {
            samples.pop_front();
        }
    }

    /// Returns what is known of each host.
    pub fn list(&self) -> Vec<HostReport> {
        self.0.lock().iter().map(|(host, known)| known.describe(host)).collect()
    }
}

impl KnownHost {
    fn judge_link(&self) -> HostLink {
        match (self.connected.is_empty(), self.was_connected) {
            (false, _) => HostLink::Connected,
            (true, true) => HostLink::CutOff,
            (true, false) => HostLink::Awaited,
        }
    }

    /// Notes when the link has changed.
    fn note_link(&mut self) {
        let link = self.judge_link();
        if self.link.is_none_or(|(before, _)| before != link) {
            self.link = Some((link, Instant::now()));
        }
    }

    fn describe(&self, host: &str) -> HostReport {
        let link = self.judge_link();
        let reason = match link {
            HostLink::Connected => String::new(),
            HostLink::CutOff | HostLink::Awaited => self.reason.clone(),
        };
        let best = self.samples.iter().min_by(|a, b| a.round_trip_s.total_cmp(&b.round_trip_s));
        HostReport {
            host: host.to_owned(),
            link,
            reason,
            for_s: self.link.map_or(0.0, |(_, since)| since.elapsed().as_secs_f64()),
            clock_offset_s: best.map(|sample| sample.offset_s),
            clock_error_s: best.map(|sample| sample.round_trip_s / 2.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_of_a_clock_is_that_of_the_shortest_round_trip() {
        let states = HostStates::default();
        // Half a second ahead; 2 ms each way, then 2 ms and 98 ms.
        let at = |us: u64| 1_700_000_000_000_000 + us;
        let far = ClockSample::of(at(0), at(502_000), at(100_000));
        let near = ClockSample::of(at(0), at(502_000), at(4_000));
        for sample in [far, near, far] {
            states.record_clock("arm", sample);
        }
        let [report] = &states.list()[..] else { panic!("one host") };
        let (offset, error) = (report.clock_offset_s.unwrap(), report.clock_error_s.unwrap());
        assert!((offset - 0.5).abs() < 1e-6 && (error - 0.002).abs() < 1e-6, "{report:?}");
        // It is behind by an hour.
        let behind = ClockSample::of(at(3_600_000_000), at(1_000), at(3_600_002_000));
        assert!((behind.offset_s + 3600.0).abs() < 1e-3, "{behind:?}");
        for _ in 0..MAX_SAMPLES {
            states.record_clock("arm", far);
        }
        let worse = states.list()[0].clock_error_s.unwrap();
        assert!((worse - 0.05).abs() < 1e-6, "an old measurement does not count forever");
    }

    #[test]
    fn a_host_is_connected_while_one_of_its_components_is() {
        let states = HostStates::default();
        states.add_host("arm");
        let link = || {
            let report = states.list().remove(0);
            (report.link, report.reason)
        };
        assert_eq!(link(), (HostLink::Awaited, String::new()));
        states.report_lost("arm", "gripper", "no route");
        assert_eq!(link(), (HostLink::Awaited, "no route".into()));
        states.report_connected("arm", "gripper");
        states.report_connected("arm", "camera");
        states.report_lost("arm", "gripper", "it has fallen silent");
        assert_eq!(link(), (HostLink::Connected, String::new()));
        states.remove_component("arm", "camera");
        assert_eq!(link().0, HostLink::Connected);
        states.report_lost("arm", "camera", "it has fallen silent");
        assert_eq!(link(), (HostLink::CutOff, "it has fallen silent".into()));
    }
}
