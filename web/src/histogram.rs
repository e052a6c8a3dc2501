//! A histogram of times, as Prometheus reads it: cumulative buckets, a sum and a count.

use std::fmt::Write;

/// Upper bounds of the buckets, in seconds: from a local link to a call that hangs.
pub(crate) const BOUNDS_S: [f64; 14] =
    [1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 2.5e-2, 5e-2, 0.1, 0.25, 0.5, 1.0, 5.0];

/// Counts of times in buckets.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TimeHistogram {
    /// One for each bound, and one for all above the last.
    counts: [u64; BOUNDS_S.len() + 1],
    sum_s: f64,
}

impl TimeHistogram {
    /// Counts one time; a negative one, of two clocks that differ, counts as zero.
    pub(crate) fn add(&mut self, time_s: f64) {
        if !time_s.is_finite() {
            return;
        }
        let time_s = time_s.max(0.0);
        self.counts[BOUNDS_S.partition_point(|bound_s| *bound_s < time_s)] += 1;
        self.sum_s += time_s;
    }

    /// Writes its series; `labels` are those of every line, without braces.
    pub(crate) fn write_series(&self, text: &mut String, name: &str, labels: &str) {
        let comma = if labels.is_empty() { "" } else { "," };
        let mut below = 0;
        for (bound_s, count) in BOUNDS_S.iter().zip(self.counts) {
            below += count;
            let _ = writeln!(text, "{name}_bucket{{{labels}{comma}le=\"{bound_s}\"}} {below}");
        }
        below += self.counts[BOUNDS_S.len()];
        let _ = writeln!(text, "{name}_bucket{{{labels}{comma}le=\"+Inf\"}} {below}");
        let braces = if labels.is_empty() { String::new() } else { format!("{{{labels}}}") };
        let _ = writeln!(text, "{name}_sum{braces} {}", self.sum_s);
        let _ = writeln!(text, "{name}_count{braces} {below}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_are_cumulative_and_bounds_are_inclusive() {
        let mut histogram = TimeHistogram::default();
        for time_s in [1e-4, 0.02, 9.0, -1.0, f64::NAN] {
            histogram.add(time_s);
        }
        let mut text = String::new();
        histogram.write_series(&mut text, "t", "data=\"a.b\"");
        let count = |le: &str| {
            let start = format!("t_bucket{{data=\"a.b\",le=\"{le}\"}} ");
            text.lines().find_map(|line| line.strip_prefix(&start)).map(str::to_owned)
        };
        assert_eq!(count("0.0001").as_deref(), Some("2"));
        assert_eq!(count("0.025").as_deref(), Some("3"));
        assert_eq!(count("5").as_deref(), Some("3"));
        assert_eq!(count("+Inf").as_deref(), Some("4"));
        assert!(text.contains("t_count{data=\"a.b\"} 4"), "{text}");
    }
}
