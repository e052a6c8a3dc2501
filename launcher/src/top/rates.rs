//! Rates from two statuses of the same process. Pure.

use std::collections::HashMap;

use armor_sdk::control::Status;

/// Per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    pub exec_hz: f64,
    pub output_hz: f64,
    pub output_bytes_per_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct Counts {
    uptime_s: f64,
    exec_calls: u64,
    published: u64,
    published_bytes: u64,
}

/// The last statuses and rates, by process start.
#[derive(Debug, Default)]
pub struct RateTable {
    known: HashMap<(String, u64), (Counts, Option<Rates>)>,
}

impl RateTable {
    /// Takes a status of a process start, and returns its rates: those of the last two different
    /// statuses, none before the second.
    pub fn update(&mut self, instance: u64, status: &Status) -> Option<Rates> {
        let now = Counts::of(status);
        let known = self.known.entry((status.name.clone(), instance)).or_insert((now, None));
        let (before, rates) = *known;
        if now.uptime_s <= before.uptime_s {
            return rates;
        }
        let passed_s = now.uptime_s - before.uptime_s;
        let rate = |now: u64, before: u64| now.saturating_sub(before) as f64 / passed_s;
        let rates = Rates {
            exec_hz: rate(now.exec_calls, before.exec_calls),
            output_hz: rate(now.published, before.published),
            output_bytes_per_s: rate(now.published_bytes, before.published_bytes),
        };
        *known = (now, Some(rates));
        Some(rates)
    }

    /// Forgets all process starts but these.
    pub fn keep(&mut self, is_kept: impl Fn(&str, u64) -> bool) {
        self.known.retain(|(name, instance), _| is_kept(name, *instance));
    }
}

impl Counts {
    fn of(status: &Status) -> Self {
        Self {
            uptime_s: status.uptime_s,
            exec_calls: status.exec_calls,
            published: status.outputs.iter().map(|output| output.published).sum(),
            published_bytes: status.outputs.iter().map(|output| output.published_bytes).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use armor_sdk::control::{OutputStatus, RunState};

    use super::*;

    fn status(uptime_s: f64, exec_calls: u64, published: u64) -> Status {
        let output = |id: &str| OutputStatus {
            id: id.into(),
            data: format!("laser.{id}"),
            type_name: "Scan".into(),
            published,
            published_bytes: published * 100,
            links: Vec::new(),
        };
        Status {
            name: "laser".into(),
            kind: "laser".into(),
            state: RunState::Active,
            activation: 0,
            controllable: true,
            uptime_s,
            exec_calls,
            skipped_ticks: 0,
            skipped_share: 0.0,
            clock_offset_s: 0.0,
            clock_error_s: None,
            last_error: String::new(),
            untaken_events: 0,
            time_s: 0.0,
            busy: false,
            call: None,
            outputs: vec![output("scan"), output("echo")],
            inputs: Vec::new(),
        }
    }

    #[test]
    fn rates_are_those_between_the_last_two_different_statuses() {
        let mut table = RateTable::default();
        assert_eq!(table.update(1, &status(10.0, 100, 50)), None);
        let expected = Some(Rates { exec_hz: 20.0, output_hz: 40.0, output_bytes_per_s: 4000.0 });
        assert_eq!(table.update(1, &status(12.0, 140, 90)), expected);
        assert_eq!(table.update(1, &status(12.0, 140, 90)), expected, "the same status again");
        assert_eq!(table.update(2, &status(1.0, 3, 2)), None, "another process has other counters");
        table.keep(|_, instance| instance == 2);
        assert_eq!(table.update(1, &status(13.0, 160, 100)), None);
    }
}
