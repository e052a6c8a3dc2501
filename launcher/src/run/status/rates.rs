//! Rates of links that have fallen below what they were.

use std::collections::BTreeMap;

/// A rate has fallen when it is below this share of the usual one.
const FALLEN_SHARE: f64 = 0.5;
/// Links slower than this are driven by events, so a lower rate is normal, in Hz.
const SLOWEST_HZ: f64 = 2.0;
/// Measurements until a rate counts as usual; they are a second apart.
const MEASUREMENTS: u32 = 5;
/// Weight of a measurement in the usual rate and its deviation, as moving averages.
const WEIGHT: f64 = 0.1;
/// A link is steady if its rate deviates on average by less than this share. The links of events
/// (goals, markings) are not: a pause between two events is no fault.
const STEADY_SHARE: f64 = 0.25;

/// A link whose rate has fallen.
#[derive(Clone, Debug, PartialEq)]
pub struct FallenRate {
    /// The link, `component.output -> component.input`.
    pub link: String,
    /// Its rate now, in Hz.
    pub rate_hz: f64,
    /// Its rate before, in Hz.
    pub usual_hz: f64,
}

#[derive(Clone, Copy, Debug)]
struct UsualRate {
    usual_hz: f64,
    deviation_hz: f64,
    measurements: u32,
}

impl UsualRate {
    fn first(rate_hz: f64) -> Self {
        Self { usual_hz: rate_hz, deviation_hz: 0.0, measurements: 0 }
    }

    fn is_known(&self) -> bool {
        self.measurements >= MEASUREMENTS
            && self.usual_hz >= SLOWEST_HZ
            && self.deviation_hz < STEADY_SHARE * self.usual_hz
    }

    fn add(&mut self, rate_hz: f64) {
        let difference_hz = rate_hz - self.usual_hz;
        self.usual_hz += WEIGHT * difference_hz;
        self.deviation_hz += WEIGHT * (difference_hz.abs() - self.deviation_hz);
        self.measurements += 1;
    }
}

/// The usual rate of each link.
#[derive(Debug, Default)]
pub struct RateHistory {
    links: BTreeMap<String, UsualRate>,
}

impl RateHistory {
    /// Takes the rates of all links that are up and whose components are active, and returns those
    /// that have fallen. A link that is left out is forgotten: a component of it is frozen or gone,
    /// and its later rate is a new one.
    pub fn update(&mut self, rates: impl IntoIterator<Item = (String, f64)>) -> Vec<FallenRate> {
        let mut before = std::mem::take(&mut self.links);
        let mut fallen = Vec::new();
        for (link, rate_hz) in rates {
            let mut usual = before.remove(&link).unwrap_or(UsualRate::first(rate_hz));
            if usual.is_known() && rate_hz < FALLEN_SHARE * usual.usual_hz {
                // The usual rate stays as it was, so that the fall is shown for as long as it
                // lasts.
                let (link, usual_hz) = (link.clone(), usual.usual_hz);
                fallen.push(FallenRate { link, rate_hz, usual_hz });
            } else {
                usual.add(rate_hz);
            }
            self.links.insert(link, usual);
        }
        fallen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn update(history: &mut RateHistory, rate_hz: f64) -> Vec<FallenRate> {
        history.update([("a.x -> b.x".to_owned(), rate_hz)])
    }

    #[test]
    fn a_rate_that_falls_by_half_is_reported_until_it_recovers() {
        let mut history = RateHistory::default();
        for _ in 0..MEASUREMENTS {
            assert_eq!(update(&mut history, 10.0), []);
        }
        for _ in 0..100 {
            let fallen = update(&mut history, 4.0);
            assert_eq!((fallen[0].rate_hz, fallen[0].usual_hz), (4.0, 10.0));
        }
        assert_eq!(update(&mut history, 9.0), []);
    }

    #[test]
    fn new_slow_and_interrupted_links_are_not_reported() {
        let mut history = RateHistory::default();
        assert_eq!(update(&mut history, 10.0), []);
        assert_eq!(update(&mut history, 1.0), [], "it has only begun");
        let mut history = RateHistory::default();
        for rate_hz in [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.1] {
            assert_eq!(update(&mut history, rate_hz), [], "it is sent by events");
        }
        for _ in 0..MEASUREMENTS {
            update(&mut history, 10.0);
        }
        assert_eq!(history.update([]), []);
        assert_eq!(update(&mut history, 1.0), [], "it was paused, and is a new one");
    }

    #[test]
    fn a_link_of_events_has_no_usual_rate() {
        let mut history = RateHistory::default();
        for burst in [20.0, 0.0, 0.0, 18.0, 0.0, 22.0, 0.0, 0.0, 0.0, 19.0].repeat(5) {
            assert_eq!(update(&mut history, burst), []);
        }
    }
}
