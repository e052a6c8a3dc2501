//! Times as people read them.

use std::time::Duration;

/// Returns a time as people say it, to the millisecond: `6 min 30 s`.
pub fn time_in_words(time: Duration) -> String {
    let whole_s = time.as_secs();
    let (hours, minutes) = (whole_s / 3600, whole_s / 60 % 60);
    let rest = time - Duration::from_secs(whole_s / 60 * 60);
    let mut parts = Vec::new();
    if hours > 0 {
        parts.push(format!("{hours} h"));
    }
    if minutes > 0 {
        parts.push(format!("{minutes} min"));
    }
    if !rest.is_zero() || parts.is_empty() {
        let seconds = format!("{:.3}", rest.as_secs_f64());
        parts.push(format!("{} s", seconds.trim_end_matches('0').trim_end_matches('.')));
    }
    parts.join(" ")
}

/// Returns a time in nanoseconds to a tenth of a second: what is computed of speeds is not more exact.
pub(crate) fn estimate_in_words(ns: i128) -> String {
    let tenths = (ns.unsigned_abs() + 50_000_000) / 100_000_000;
    let time = Duration::from_millis(u64::try_from(tenths * 100).unwrap_or(u64::MAX));
    let words = time_in_words(time);
    if ns < 0 && tenths > 0 { format!("-{words}") } else { words }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_in_the_units_that_people_use() {
        let words = [0, 500, 90_000, 3_600_000, 3_660_500]
            .map(|ms| time_in_words(Duration::from_millis(ms)));
        assert_eq!(words, ["0 s", "0.5 s", "1 min 30 s", "1 h", "1 h 1 min 0.5 s"]);
        let words = [12_340_000_000, -90_060_000_000, -1].map(estimate_in_words);
        assert_eq!(words, ["12.3 s", "-1 min 30.1 s", "0 s"]);
    }
}
