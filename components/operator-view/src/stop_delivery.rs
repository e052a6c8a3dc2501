//! How far a STOP or its release has come: ordered, published by the component, accepted by
//! subscribers. What is not confirmed is sent again at the next connection.

/// An order that is not confirmed within this time is not delivered, in seconds.
const CONFIRMED_WITHIN_S: f64 = 0.5;

/// The last order of STOP or Release, and its confirmation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StopDelivery {
    last: Option<StopOrder>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct StopOrder {
    is_on: bool,
    ordered_s: f64,
    /// The number of links that have accepted it, when it is published.
    accepted: Option<usize>,
}

/// What is known of a STOP that is active.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StopStatus {
    /// It was sent just now.
    Sent,
    /// The component has not confirmed it: the robot may be moving.
    NotDelivered,
    /// It is published, and no link accepts it.
    NoSubscriber,
    /// Data that are recent enough to show the robot at rest are missing.
    OldData,
    /// No input is linked that shows whether the robot stands.
    Unmeasured,
    /// The robot moves, at this speed in m/s.
    Moving(f64),
    /// The robot is at rest.
    Stands,
}

impl StopDelivery {
    /// Takes an order at `now_s` of the host's clock. A STOP that is confirmed stays so if it is
    /// ordered again.
    pub fn order(&mut self, is_on: bool, now_s: f64) {
        if self.last.is_none_or(|last| last.is_on != is_on) {
            self.last = Some(StopOrder { is_on, ordered_s: now_s, accepted: None });
        }
    }

    /// Returns what must be sent first over a new connection: STOP as long as it is active, and a
    /// Release that was not confirmed. It then needs a new confirmation.
    pub fn begin_again(&mut self, now_s: f64) -> Option<bool> {
        let last = self.last.as_mut()?;
        if last.is_on || last.accepted.is_none() {
            (last.accepted, last.ordered_s) = (None, now_s);
            return Some(last.is_on);
        }
        None
    }

    /// Takes what the component has published, and how many links have accepted it. Returns
    /// whether STOP is active there and was not known here.
    pub fn confirm(&mut self, is_on: bool, to: usize, now_s: f64) -> bool {
        match &mut self.last {
            Some(last) if last.is_on == is_on => last.accepted = Some(to),
            // It is of an earlier order.
            Some(_) => {}
            None => {
                self.last = Some(StopOrder { is_on, ordered_s: now_s, accepted: Some(to) });
                return is_on;
            }
        }
        false
    }

    /// When the last order was given, or sent again, in seconds.
    pub fn ordered_s(&self) -> f64 {
        self.last.map_or(f64::NEG_INFINITY, |last| last.ordered_s)
    }

    /// Returns why STOP is not in force at the subscribers, if it is not.
    pub fn problem(&self, now_s: f64, is_cut: bool) -> Option<StopStatus> {
        let last = self.last.filter(|last| last.is_on)?;
        match last.accepted {
            None if is_cut || now_s - last.ordered_s >= CONFIRMED_WITHIN_S => {
                Some(StopStatus::NotDelivered)
            }
            None => Some(StopStatus::Sent),
            Some(0) => Some(StopStatus::NoSubscriber),
            Some(_) if is_cut => Some(StopStatus::OldData),
            Some(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stop_stays_undelivered_until_it_is_confirmed_and_goes_first_over_a_new_connection() {
        let mut delivery = StopDelivery::default();
        assert_eq!(delivery.begin_again(0.0), None);
        delivery.order(true, 1.0);
        assert_eq!(delivery.problem(1.1, false), Some(StopStatus::Sent));
        assert_eq!(delivery.problem(1.1, true), Some(StopStatus::NotDelivered));
        assert_eq!(delivery.problem(1.6, false), Some(StopStatus::NotDelivered), "it hangs");
        assert_eq!(delivery.begin_again(3.0), Some(true));
        assert_eq!(delivery.problem(3.1, false), Some(StopStatus::Sent));
        assert!(!delivery.confirm(false, 1, 3.1), "that is of an order before");
        assert_eq!(delivery.problem(3.1, false), Some(StopStatus::Sent));
        delivery.confirm(true, 0, 3.2);
        assert_eq!(delivery.problem(3.2, false), Some(StopStatus::NoSubscriber));
        delivery.confirm(true, 1, 3.3);
        delivery.order(true, 3.4);
        assert_eq!(delivery.problem(9.0, false), None);
        assert_eq!(delivery.begin_again(9.0), Some(true), "a new component may not know it");
        delivery.order(false, 10.0);
        assert_eq!(delivery.begin_again(11.0), Some(false), "the release was not confirmed");
        delivery.confirm(false, 1, 11.1);
        assert_eq!(delivery.begin_again(12.0), None);
    }

    #[test]
    fn a_stop_of_an_earlier_window_is_adopted() {
        let mut delivery = StopDelivery::default();
        assert!(!delivery.confirm(false, 1, 1.0));
        let mut delivery = StopDelivery::default();
        assert!(delivery.confirm(true, 1, 1.0));
        assert_eq!(delivery.problem(9.0, false), None);
    }
}
