//! One time for the system: each process estimates how far the registry's clock is from its own
//! monotonic clock, from NTP's four stamps (RFC 5905, section 8), and knows how wrong it may be.

use std::collections::VecDeque;

/// How many exchanges the estimate looks back on.
const WINDOW: usize = 8;

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

/// The offset as known now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// System time minus own monotonic clock, in seconds.
    pub offset_s: f64,
    /// Half the round trip it was measured with, in seconds: the error is at most that.
    pub error_s: f64,
}

/// Filters exchanges: of the last few, the one with the shortest round trip is believed (NTP's clock
/// filter), because what delays a packet also makes it lie.
#[derive(Clone, Debug, Default)]
pub struct ClockFilter {
    recent: VecDeque<Exchange>,
}

impl ClockFilter {
    /// Takes in an exchange. One that went backwards in time is ignored.
    pub fn add(&mut self, exchange: Exchange) {
        let stamps = [exchange.asked_s, exchange.received_s, exchange.sent_s, exchange.answered_s];
        if exchange.round_trip_s() < 0.0 || stamps.iter().any(|stamp| !stamp.is_finite()) {
            return;
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

    /// The best estimate so far.
    pub fn estimate(&self) -> Option<Estimate> {
        let best =
            self.recent.iter().min_by(|a, b| a.round_trip_s().total_cmp(&b.round_trip_s()))?;
        Some(Estimate { offset_s: best.offset_s(), error_s: best.round_trip_s() / 2.0 })
    }
}
