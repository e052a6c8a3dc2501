//! One time for the system: each process estimates how far the registry's clock is from its own
//! monotonic clock, from NTP's four stamps (RFC 5905, section 8), with a bound on the error.

use std::collections::VecDeque;

use crate::Message;

/// How many exchanges the estimate looks back on.
const WINDOW: usize = 8;
/// How fast two clocks may drift apart, in seconds per second: 50 ppm of quartz each.
const MAX_DRIFT: f64 = 100e-6;

/// The time of a system that follows data, as its source publishes it (`rosgraph_msgs/Clock`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Clock {
    /// Seconds since the Unix epoch, or since another start that the source chooses; not negative.
    #[message(unit = "s")]
    pub clock: f64,
}

/// One exchange of stamps, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exchange {
    /// Own monotonic clock when the question left.
    pub asked_s: f64,
    /// System time when it arrived.
    pub received_s: f64,
    /// System time when the answer left.
    pub sent_s: f64,
    /// Own monotonic clock when the answer arrived.
    pub answered_s: f64,
}

impl Exchange {
    fn offset_s(&self) -> f64 {
        ((self.received_s - self.asked_s) + (self.sent_s - self.answered_s)) / 2.0
    }

    fn round_trip_s(&self) -> f64 {
        (self.answered_s - self.asked_s) - (self.sent_s - self.received_s)
    }
}

/// One measurement of the clock of another host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockSample {
    /// Its time minus that of this host, in seconds; the error is at most half the round trip.
    pub offset_s: f64,
    /// The time between question and answer, in seconds.
    pub round_trip_s: f64,
}

impl ClockSample {
    /// As NTP computes it, for an answer that is sent as soon as the question has arrived. All times are
    /// in microseconds since 1970.
    pub fn of(asked_us: u64, answered_us: u64, heard_us: u64) -> Self {
        let distance_s = |from: u64, to: u64| (to as f64 - from as f64) * 1e-6;
        let (there, back) = (distance_s(asked_us, answered_us), distance_s(heard_us, answered_us));
        Self { offset_s: (there + back) / 2.0, round_trip_s: distance_s(asked_us, heard_us) }
    }
}

/// The offset as known now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockEstimate {
    /// System time minus own monotonic clock, in seconds.
    pub offset_s: f64,
    /// Half the round trip it was measured with and the drift since, in seconds: the error is at
    /// most that.
    pub error_s: f64,
}

/// Filters exchanges: of the last few, the one with the shortest round trip counts (NTP's clock
/// filter), because the delay of a packet is also an error of its stamps.
#[derive(Clone, Debug, Default)]
pub struct ClockFilter {
    recent: VecDeque<Exchange>,
}

impl ClockFilter {
    /// Takes in an exchange. One that went backwards in time is ignored; one that cannot be true
    /// together with what is known means that a clock was set, and what was known is forgotten.
    pub fn add(&mut self, exchange: Exchange) {
        let backwards = exchange.answered_s < exchange.asked_s
            || exchange.sent_s < exchange.received_s
            || exchange.round_trip_s() < 0.0;
        if backwards || !(exchange.offset_s() + exchange.round_trip_s()).is_finite() {
            return;
        }
        let contradicts = |known: ClockEstimate| {
            let error_s = known.error_s + exchange.round_trip_s() / 2.0;
            (known.offset_s - exchange.offset_s()).abs() > error_s
        };
        if self.estimate_at(exchange.answered_s).is_some_and(contradicts) {
            self.clear();
        }
        if self.recent.len() == WINDOW {
            self.recent.pop_front();
        }
        self.recent.push_back(exchange);
    }

    /// Forgets everything: the registry has restarted and its time with it.
    pub fn clear(&mut self) {
        self.recent.clear();
    }

    /// The best estimate, as of the last exchange.
    pub fn estimate(&self) -> Option<ClockEstimate> {
        self.estimate_at(self.recent.back()?.answered_s)
    }

    fn estimate_at(&self, now_s: f64) -> Option<ClockEstimate> {
        let error_s = |exchange: &Exchange| {
            exchange.round_trip_s() / 2.0 + (now_s - exchange.answered_s).max(0.0) * MAX_DRIFT
        };
        let best = self.recent.iter().min_by(|a, b| error_s(a).total_cmp(&error_s(b)))?;
        Some(ClockEstimate { offset_s: best.offset_s(), error_s: error_s(best) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A question at `asked_s` that takes `there_s`, and its answer `back_s`; the true offset.
    fn exchange(asked_s: f64, there_s: f64, back_s: f64, offset_s: f64) -> Exchange {
        let received_s = asked_s + there_s + offset_s;
        let answered_s = asked_s + there_s + back_s + 0.001;
        Exchange { asked_s, received_s, sent_s: received_s + 0.001, answered_s }
    }

    fn filter(exchanges: &[Exchange]) -> ClockFilter {
        let mut filter = ClockFilter::default();
        exchanges.iter().for_each(|exchange| filter.add(*exchange));
        filter
    }

    #[test]
    fn the_shortest_round_trip_is_believed_and_the_truth_lies_within_its_error() {
        let known = filter(&[
            exchange(0.0, 0.050, 0.001, 1000.0),
            exchange(1.0, 0.001, 0.002, 1000.0),
            exchange(2.0, 0.001, 0.080, 1000.0),
        ]);
        let estimate = known.estimate().expect("three exchanges");
        assert!((estimate.offset_s - 1000.0).abs() <= estimate.error_s, "{estimate:?}");
        assert!(estimate.error_s < 0.002, "{estimate:?}");
    }

    #[test]
    fn a_clock_that_was_set_is_noticed_immediately() {
        let known =
            filter(&[exchange(0.0, 0.001, 0.001, 1000.0), exchange(1.0, 0.010, 0.010, 4600.0)]);
        assert!((known.estimate().expect("one left").offset_s - 4600.0).abs() < 0.001);
    }

    #[test]
    fn a_drifting_clock_is_followed() {
        let mut known = ClockFilter::default();
        for step in 0..1000 {
            let asked_s = f64::from(step);
            let offset_s = 1000.0 + asked_s * 40e-6;
            let delay_s = if step % 3 == 0 { 0.0005 } else { 0.004 };
            known.add(exchange(asked_s, delay_s, delay_s / 2.0, offset_s));
            let estimate = known.estimate().expect("some");
            assert!((estimate.offset_s - offset_s).abs() <= estimate.error_s, "{estimate:?}");
        }
    }

    #[test]
    fn nonsense_is_ignored() {
        let good = exchange(0.0, 0.001, 0.001, 1000.0);
        let nonsense = [
            Exchange { asked_s: f64::NAN, ..good },
            Exchange { sent_s: f64::INFINITY, ..good },
            Exchange { answered_s: -1.0, ..good },
            Exchange { sent_s: good.received_s - 1.0, ..good },
            Exchange { asked_s: -1e308, received_s: 1e308, sent_s: 1e308, answered_s: 1e308 },
        ];
        assert_eq!(filter(&nonsense).estimate(), None);
    }
}
