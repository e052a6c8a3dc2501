//! What has gone wrong, with its time, until the operator acknowledges it.

use std::collections::{BTreeSet, VecDeque};

/// Most alerts that are kept; the oldest is forgotten first.
const MAX_ALERTS: usize = 100;

/// Something that has gone wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Alert {
    /// When, by the host's clock, in seconds.
    pub since_s: f64,
    /// What, in words.
    pub text: String,
    /// Whether the operator has seen it.
    pub is_acknowledged: bool,
    /// Whether it is of a run before this one.
    pub is_earlier: bool,
}

/// The alerts, the newest last, and the conditions that hold now.
#[derive(Clone, Debug, Default)]
pub struct AlertList {
    alerts: VecDeque<Alert>,
    present: BTreeSet<String>,
}

impl AlertList {
    /// Returns the alerts, the newest first.
    pub fn newest_first(&self) -> impl Iterator<Item = &Alert> {
        self.alerts.iter().rev()
    }

    /// Returns how many the operator has not seen.
    pub fn count_new(&self) -> usize {
        self.alerts.iter().filter(|alert| !alert.is_acknowledged).count()
    }

    /// Adds an alert.
    pub fn raise(&mut self, text: impl Into<String>, now_s: f64) {
        if self.alerts.len() == MAX_ALERTS {
            self.alerts.pop_front();
        }
        let text = text.into();
        let alert = Alert { since_s: now_s, text, is_acknowledged: false, is_earlier: false };
        self.alerts.push_back(alert);
    }

    /// Takes the conditions that hold now: each that is new becomes an alert.
    pub fn update_conditions(&mut self, now: impl IntoIterator<Item = String>, now_s: f64) {
        let present: BTreeSet<_> = now.into_iter().collect();
        let new: Vec<_> = present.difference(&self.present).cloned().collect();
        self.present = present;
        for text in new {
            self.raise(text, now_s);
        }
    }

    /// Forgets the conditions, as those of another run may be new. The alerts stay, as those of an
    /// earlier run.
    pub fn end_conditions(&mut self) {
        self.present.clear();
        self.alerts.iter_mut().for_each(|alert| alert.is_earlier = true);
    }

    /// Marks all as seen.
    pub fn acknowledge_all(&mut self) {
        for alert in &mut self.alerts {
            alert.is_acknowledged = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_is_one_alert_until_it_has_ended_and_begins_again() {
        let mut list = AlertList::default();
        list.update_conditions(["no scan".to_owned()], 1.0);
        list.update_conditions(["no scan".to_owned()], 2.0);
        assert_eq!(list.count_new(), 1);
        list.acknowledge_all();
        list.update_conditions([], 3.0);
        assert_eq!((list.count_new(), list.newest_first().count()), (0, 1));
        list.update_conditions(["no scan".to_owned()], 4.0);
        assert_eq!(list.newest_first().next().map(|alert| alert.since_s), Some(4.0));
        assert_eq!(list.count_new(), 1);
    }

    #[test]
    fn alerts_of_an_earlier_run_are_told_apart() {
        let mut list = AlertList::default();
        list.update_conditions(["no scan".to_owned()], 1.0);
        list.end_conditions();
        list.update_conditions(["no scan".to_owned()], 5.0);
        let earlier: Vec<_> = list.newest_first().map(|alert| alert.is_earlier).collect();
        assert_eq!((earlier, list.count_new()), (vec![false, true], 2));
    }

    #[test]
    fn the_oldest_are_forgotten() {
        let mut list = AlertList::default();
        for n in 0..300 {
            list.raise(n.to_string(), f64::from(n));
        }
        assert_eq!(list.newest_first().count(), MAX_ALERTS);
        assert_eq!(list.newest_first().next().map(|alert| alert.text.as_str()), Some("299"));
    }
}
