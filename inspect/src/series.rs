//! One value over time, as far back as memory is spent on it.

use std::collections::VecDeque;

/// Most points of one series: what a plot of a fast value holds for twenty seconds at 1 kHz.
pub const MAX_POINTS: usize = 20_000;

/// Values with their times, the oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    points: VecDeque<[f64; 2]>,
    forgotten: u64,
}

impl Series {
    /// Adds a value, if it is a number. One of an earlier time than the last starts anew: time has
    /// jumped, and a line across would tell what never was.
    pub fn push(&mut self, time_s: f64, value: f64) {
        if !time_s.is_finite() || !value.is_finite() {
            return;
        }
        if self.points.back().is_some_and(|[last_s, _]| time_s < *last_s) {
            self.points.clear();
        }
        if self.points.len() == MAX_POINTS {
            self.points.pop_front();
            self.forgotten += 1;
        }
        self.points.push_back([time_s, value]);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// How many older ones were left out.
    pub fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// The newest.
    pub fn last(&self) -> Option<[f64; 2]> {
        self.points.back().copied()
    }

    /// The points from `from_s` on, at most about `count` of them: of each stretch of time its
    /// lowest and highest, so that no spike is lost.
    pub fn thinned(&self, from_s: f64, count: usize) -> Vec<[f64; 2]> {
        let first = self.points.partition_point(|[time_s, _]| *time_s < from_s);
        // One before the window, so that its line reaches the edge.
        let points: Vec<_> = self.points.range(first.saturating_sub(1)..).copied().collect();
        let stretches = (count / 2).max(1);
        if points.len() <= stretches * 2 {
            return points;
        }
        let len = points.len().div_ceil(stretches);
        points.chunks(len).flat_map(extremes).collect()
    }
}

/// The lowest and the highest point, in their order.
fn extremes(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + use<> {
    let by_value = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
    let low = points.iter().min_by(by_value).copied();
    let high = points.iter().max_by(by_value).copied();
    let mut both: Vec<_> = low.into_iter().chain(high.filter(|high| Some(*high) != low)).collect();
    both.sort_by(|a, b| a[0].total_cmp(&b[0]));
    both.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded_and_what_was_left_out_is_counted() {
        let mut series = Series::default();
        for index in 0..MAX_POINTS + 3 {
            series.push(index as f64, 1.0);
        }
        assert_eq!((series.len(), series.forgotten()), (MAX_POINTS, 3));
        assert_eq!(series.last().map(|point| point[0]), Some((MAX_POINTS + 2) as f64));
    }

    #[test]
    fn a_jump_back_in_time_starts_anew_and_no_number_is_left_out() {
        let mut series = Series::default();
        series.push(5.0, 1.0);
        series.push(6.0, f64::NAN);
        series.push(1.0, 2.0);
        assert_eq!(series.thinned(0.0, 100), [[1.0, 2.0]]);
    }

    #[test]
    fn thinning_keeps_every_spike() {
        let mut series = Series::default();
        for index in 0..10_000 {
            series.push(f64::from(index), if index == 5_432 { 9.0 } else { 0.0 });
        }
        let thin = series.thinned(0.0, 200);
        assert!(thin.len() <= 200, "{}", thin.len());
        assert!(thin.contains(&[5_432.0, 9.0]));
        assert!(thin.is_sorted_by(|a, b| a[0] <= b[0]));
        assert_eq!(series.thinned(9_998.0, 200), [[9_997.0, 0.0], [9_998.0, 0.0], [9_999.0, 0.0]]);
    }
}
