//! When a key expires, in words.

use std::time::{SystemTime, UNIX_EPOCH};

use jiff::Timestamp;
use jiff::tz::TimeZone;

/// Seconds of a day.
pub const DAY_S: i64 = 24 * 60 * 60;
/// How many days ahead the end of a key is announced.
const NOTICES: [i64; 3] = [1, 7, 30];

/// Returns the shortest of the notice times that has begun, in days; 0 if the key has expired.
pub fn find_notice(not_after_s: i64, now_s: i64) -> Option<i64> {
    let left_s = not_after_s - now_s;
    if left_s < 0 {
        return Some(0);
    }
    NOTICES.into_iter().find(|days| left_s <= days * DAY_S)
}

/// Returns the announcement of the end of a key, if it is time for one.
pub fn describe_notice(name: &str, not_after_s: i64, now_s: i64) -> Option<String> {
    let date = format_date(not_after_s);
    let days = (not_after_s - now_s) / DAY_S;
    let when = match find_notice(not_after_s, now_s)? {
        0 => format!("has expired ({date})"),
        _ if days == 0 => format!("expires within a day ({date})"),
        _ if days == 1 => format!("expires in 1 day ({date})"),
        _ => format!("expires in {days} days ({date})"),
    };
    Some(format!("the key of {name} {when}; where the authority's key is: armor keys renew {name}"))
}

/// This host's wall clock, in seconds since 1970.
pub fn now_s() -> i64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(now.as_secs()).unwrap_or(i64::MAX)
}

/// The day, in UTC.
pub fn format_date(seconds: i64) -> String {
    match Timestamp::from_second(seconds) {
        Ok(time) => time.to_zoned(TimeZone::UTC).date().to_string(),
        Err(_) => "an unknown date".into(),
    }
}

/// The minute, in UTC.
pub fn format_time(seconds: i64) -> String {
    match Timestamp::from_second(seconds) {
        Ok(time) => {
            let time = time.to_zoned(TimeZone::UTC).datetime();
            format!("{} {:02}:{:02} UTC", time.date(), time.hour(), time.minute())
        }
        Err(_) => "an unknown time".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_written_to_the_minute() {
        assert_eq!(format_time(1_800_000_059), "2027-01-15 08:00 UTC");
        assert_eq!(format_time(i64::MAX), "an unknown time");
    }

    #[test]
    fn the_end_is_announced_30_7_and_1_days_ahead() {
        let end_s = 1_800_000_000;
        for (left_s, notice) in [
            (31 * DAY_S, None),
            (30 * DAY_S + 1, None),
            (30 * DAY_S, Some(30)),
            (7 * DAY_S + 1, Some(30)),
            (7 * DAY_S, Some(7)),
            (DAY_S + 1, Some(7)),
            (DAY_S, Some(1)),
            (0, Some(1)),
            (-1, Some(0)),
        ] {
            assert_eq!(find_notice(end_s, end_s - left_s), notice, "{left_s} s before the end");
            let text = describe_notice("alice", end_s, end_s - left_s);
            assert_eq!(text.is_some(), notice.is_some());
            let remedy = |text: String| {
                text.contains("2027-01-15") && text.contains("armor keys renew alice")
            };
            assert!(text.is_none_or(remedy));
        }
    }
}
