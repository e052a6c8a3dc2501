//! Moments as people read them in logs: date and time of day in UTC, to the millisecond.

pub use armor_robotfile::format_date;

/// Returns the time of day alone, `14:30:05.120`.
pub fn format_clock_time(since_1970_s: f64) -> String {
    let date = format_date(since_1970_s);
    let time = date.split_once('T').map_or(date.as_str(), |(_, time)| time);
    time.trim_end_matches('Z').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_has_its_date_and_milliseconds() {
        let moment_s = 1_795_357_805.12;
        assert_eq!(format_date(moment_s), "2026-11-22T14:30:05.120Z");
        assert_eq!(format_clock_time(moment_s), "14:30:05.120");
        assert_eq!(format_date(0.9996), "1970-01-01T00:00:01.000Z");
    }
}
