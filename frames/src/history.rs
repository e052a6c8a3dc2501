//! The samples of a moving edge, ordered by stamp, and the one at a moment.

use std::collections::VecDeque;

use nalgebra::Isometry3;

/// How far the samples of an edge reach back from the newest, in seconds, as in tf.
pub const HISTORY_S: f64 = 10.0;
/// Most samples of one edge: 10 s at 400 Hz, 256 KiB. Beyond it the oldest are dropped.
pub const MAX_SAMPLES: usize = 4096;

/// Where the child was in its parent at a moment.
#[derive(Clone, Copy, Debug)]
struct Sample {
    stamp_s: f64,
    parent_from_child: Isometry3<f64>,
}

/// The samples of a moving edge: at least one.
#[derive(Clone, Debug)]
pub(crate) struct TransformHistory {
    samples: VecDeque<Sample>,
}

/// Why a history has no transform at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutsideHistory {
    TooOld,
    TooNew,
}

impl TransformHistory {
    pub(crate) fn new(stamp_s: f64, parent_from_child: Isometry3<f64>) -> Self {
        Self { samples: [Sample { stamp_s, parent_from_child }].into() }
    }

    pub(crate) fn oldest_s(&self) -> f64 {
        self.samples.front().map_or(f64::NAN, |sample| sample.stamp_s)
    }

    pub(crate) fn newest_s(&self) -> f64 {
        self.samples.back().map_or(f64::NAN, |sample| sample.stamp_s)
    }

    /// Adds a sample where its stamp belongs; one with the stamp of another replaces it, as a
    /// correction. Returns false if it is older than what is kept.
    pub(crate) fn add(&mut self, stamp_s: f64, parent_from_child: Isometry3<f64>) -> bool {
        if stamp_s < self.newest_s() - HISTORY_S {
            return false;
        }
        let sample = Sample { stamp_s, parent_from_child };
        let index = self.samples.partition_point(|other| other.stamp_s < stamp_s);
        match self.samples.get_mut(index) {
            Some(same) if same.stamp_s == stamp_s => *same = sample,
            _ => self.samples.insert(index, sample),
        }
        let horizon_s = self.newest_s() - HISTORY_S;
        while self.samples.len() > MAX_SAMPLES || self.oldest_s() < horizon_s {
            self.samples.pop_front();
        }
        true
    }

    /// The transform at a moment: that of a sample, or between two of them the translation
    /// linearly and the rotation on the shortest arc (slerp).
    pub(crate) fn at(&self, stamp_s: f64) -> Result<Isometry3<f64>, OutsideHistory> {
        let index = self.samples.partition_point(|sample| sample.stamp_s < stamp_s);
        let Some(after) = self.samples.get(index) else { return Err(OutsideHistory::TooNew) };
        if after.stamp_s == stamp_s {
            return Ok(after.parent_from_child);
        }
        let before = index.checked_sub(1).and_then(|index| self.samples.get(index));
        let Some(before) = before else { return Err(OutsideHistory::TooOld) };
        let share = (stamp_s - before.stamp_s) / (after.stamp_s - before.stamp_s);
        let (from, to) = (before.parent_from_child, after.parent_from_child);
        let between = from.try_lerp_slerp(&to, share, f64::EPSILON);
        // Two opposite rotations have no shortest arc; the nearer of the two is a true one.
        Ok(between.unwrap_or(if share < 0.5 { from } else { to }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn x(x_m: f64) -> Isometry3<f64> {
        Isometry3::translation(x_m, 0.0, 0.0)
    }

    fn x_at(history: &TransformHistory, stamp_s: f64) -> Result<f64, OutsideHistory> {
        history.at(stamp_s).map(|transform| transform.translation.x)
    }

    #[test]
    fn a_late_sample_is_put_where_it_belongs() {
        let mut history = TransformHistory::new(1.0, x(1.0));
        assert!(history.add(3.0, x(3.0)));
        assert_eq!(x_at(&history, 2.0), Ok(2.0));
        assert!(history.add(2.0, x(7.0)));
        assert_eq!((x_at(&history, 2.0), x_at(&history, 2.5)), (Ok(7.0), Ok(5.0)));
        assert_eq!((history.oldest_s(), history.newest_s()), (1.0, 3.0));
    }

    #[test]
    fn a_second_sample_of_one_moment_replaces_the_first() {
        let mut history = TransformHistory::new(1.0, x(1.0));
        assert!(history.add(2.0, x(2.0)) && history.add(2.0, x(4.0)) && history.add(1.0, x(0.0)));
        assert_eq!(history.samples.len(), 2);
        assert_eq!((x_at(&history, 1.5), x_at(&history, 2.0)), (Ok(2.0), Ok(4.0)));
    }

    #[test]
    fn only_ten_seconds_are_kept_and_older_samples_are_refused() {
        let mut history = TransformHistory::new(0.0, x(0.0));
        assert!(history.add(10.0, x(10.0)));
        assert_eq!(x_at(&history, 0.0), Ok(0.0), "ten seconds are kept whole");
        assert!(history.add(10.5, x(10.5)));
        assert_eq!(x_at(&history, 5.0), Err(OutsideHistory::TooOld));
        assert!(!history.add(0.4, x(0.0)));
        assert_eq!((history.oldest_s(), history.samples.len()), (10.0, 2));
    }

    #[test]
    fn the_number_of_samples_is_limited() {
        let mut history = TransformHistory::new(0.0, x(0.0));
        for index in 1..=2 * MAX_SAMPLES {
            assert!(history.add(index as f64 * 1e-3, x(0.0)));
        }
        assert_eq!(history.samples.len(), MAX_SAMPLES);
        assert_eq!(history.newest_s(), 2.0 * MAX_SAMPLES as f64 * 1e-3);
    }

    #[test]
    fn opposite_rotations_give_one_of_the_arcs_and_no_panic() {
        let turned = |yaw_rad| Isometry3::rotation(nalgebra::Vector3::z() * yaw_rad);
        let mut history = TransformHistory::new(0.0, turned(0.0));
        assert!(history.add(1.0, turned(std::f64::consts::PI)));
        let angle = history.at(0.25).expect("it is between the two").rotation.angle();
        assert!((angle - std::f64::consts::FRAC_PI_4).abs() < 1e-9, "{angle}");
    }
}
