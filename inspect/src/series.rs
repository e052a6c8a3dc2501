//! One value over time, with a bounded number of points.

use std::collections::VecDeque;

/// Most points of one series: twenty seconds of a value that arrives at 1 kHz.
pub const MAX_POINTS: usize = 20_000;

/// Values with their times, the oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    points: VecDeque<[f64; 2]>,
    forgotten: u64,
}

impl Series {
    /// Adds a value, if it is finite. A time before the last one clears the series: time has jumped
    /// back, and a line across the jump would show values that never existed.
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

    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Returns how many older points were forgotten.
    pub fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Returns the newest point.
    pub fn last(&self) -> Option<[f64; 2]> {
        self.points.back().copied()
    }

    /// Returns the points from `from_s` on, at most about `count` of them: the lowest and the
    /// highest of each stretch, so that no spike is lost.
    pub fn thin_points(&self, from_s: f64, count: usize) -> Vec<[f64; 2]> {
        let first = self.points.partition_point(|[time_s, _]| *time_s < from_s);
        // One point before the window, so that the line reaches the edge of the plot.
        let points: Vec<_> = self.points.range(first.saturating_sub(1)..).copied().collect();
        let stretches = (count / 2).max(1);
        if points.len() <= stretches * 2 {
            return points;
        }
        let len = points.len().div_ceil(stretches);
        points.chunks(len).flat_map(extremes).collect()
    }
}

/// Returns the lowest and the highest point, in order of time.
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
    fn memory_is_bounded_and_forgotten_points_are_counted() {
        let mut series = Series::default();
        for index in 0..MAX_POINTS + 3 {
            series.push(index as f64, 1.0);
        }
        assert_eq!((series.len(), series.forgotten()), (MAX_POINTS, 3));
        assert_eq!(series.last().map(|point| point[0]), Some((MAX_POINTS + 2) as f64));
    }

    #[test]
    fn a_jump_back_in_time_clears_the_series_and_nan_is_ignored() {
        let mut series = Series::default();
        series.push(5.0, 1.0);
        series.push(6.0, f64::NAN);
        series.push(1.0, 2.0);
        assert_eq!(series.thin_points(0.0, 100), [[1.0, 2.0]]);
    }

    #[test]
    fn thinning_keeps_every_spike() {
        let mut series = Series::default();
        for index in 0..10_000 {
            series.push(f64::from(index), if index == 5_432 { 9.0 } else { 0.0 });
        }
        let thin = series.thin_points(0.0, 200);
        assert!(thin.len() <= 200, "{}", thin.len());
        assert!(thin.contains(&[5_432.0, 9.0]));
        assert!(thin.is_sorted_by(|a, b| a[0] <= b[0]));
        assert_eq!(
            series.thin_points(9_998.0, 200),
            [[9_997.0, 0.0], [9_998.0, 0.0], [9_999.0, 0.0]]
        );
    }
}
