//! Moments of the world's calendar: dates in UTC as the file writes them. Pure: nothing here asks
//! what time it is.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

const SECOND_NS: i128 = 1_000_000_000;
const DAY_S: i64 = 86_400;

/// A moment in UTC, to the nanosecond; days without leap seconds, as the clocks of computers have
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Date {
    /// Nanoseconds since the beginning of 1970.
    ns: i128,
}

impl Date {
    /// The moment so long after the beginning of 1970.
    pub fn since_1970(time: Duration) -> Self {
        Self { ns: nanoseconds(time) }
    }

    /// So much later.
    #[must_use]
    pub fn later(self, time: Duration) -> Self {
        Self { ns: self.ns + nanoseconds(time) }
    }

    /// So much earlier.
    #[must_use]
    pub fn earlier(self, time: Duration) -> Self {
        Self { ns: self.ns - nanoseconds(time) }
    }

    /// How long from `earlier` to this one; none if that is later.
    pub fn after(self, earlier: Self) -> Option<Duration> {
        let ns = self.ns.checked_sub(earlier.ns).filter(|ns| *ns >= 0)?;
        let seconds = u64::try_from(ns / SECOND_NS).unwrap_or(u64::MAX);
        Some(Duration::new(seconds, (ns % SECOND_NS) as u32))
    }
}

fn nanoseconds(time: Duration) -> i128 {
    i128::from(time.as_secs()) * SECOND_NS + i128::from(time.subsec_nanos())
}

/// `2026-11-21T14:30Z`, with seconds and their fraction if wanted; what is finer than a nanosecond
/// is cut off.
impl FromStr for Date {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fraction = fraction(text)
            .ok_or("a date in UTC is expected, such as 2026-11-21T14:30:00Z".to_owned())?;
        let number = |at: usize, len: usize| {
            text.get(at..at + len).and_then(|digits| digits.parse::<i64>().ok()).unwrap_or(0)
        };
        let (year, month, day) = (number(0, 4), number(5, 2), number(8, 2));
        let (hour, minute, second) = (number(11, 2), number(14, 2), number(17, 2));
        if !(1..=days_of(year, month)).contains(&day) || hour > 23 || minute > 59 || second > 59 {
            return Err("there is no such day or no such time of day".into());
        }
        let seconds = day_number(year, month, day) * DAY_S + hour * 3600 + minute * 60 + second;
        let digits: String = fraction.chars().chain("000000000".chars()).take(9).collect();
        Ok(Self { ns: i128::from(seconds) * SECOND_NS + digits.parse().unwrap_or(0) })
    }
}

/// The digits of the second's fraction, if the text has the shape of a date.
fn fraction(text: &str) -> Option<&str> {
    let shape: String = text.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
    let rest = shape.strip_prefix("0000-00-00T00:00")?.strip_suffix('Z')?;
    let digits = match rest.strip_prefix(":00") {
        None if rest.is_empty() => 0,
        Some("") => 0,
        Some(rest) => {
            let digits = rest.strip_prefix('.')?;
            let fits = !digits.is_empty() && digits.bytes().all(|byte| byte == b'0');
            fits.then_some(digits.len())?
        }
        None => return None,
    };
    let end = text.len() - 1;
    text.get(end - digits..end)
}

/// As it is written, with seconds, and with a fraction where there is one.
impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seconds, ns) = (self.ns.div_euclid(SECOND_NS), self.ns.rem_euclid(SECOND_NS));
        let seconds = seconds as i64;
        let (day, rest) = (seconds.div_euclid(DAY_S), seconds.rem_euclid(DAY_S));
        let (year, month, day) = civil(day);
        let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}")?;
        if ns > 0 {
            write!(f, ".{}", format!("{ns:09}").trim_end_matches('0'))?;
        }
        f.write_str("Z")
    }
}

fn is_leap(year: i64) -> bool {
    year % 4 == 0 && year % 100 != 0 || year % 400 == 0
}

fn days_of(year: i64, month: i64) -> i64 {
    match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 => 28 + i64::from(is_leap(year)),
        _ => 0,
    }
}

/// The first day of a year, counted from that of 1970: in the Gregorian calendar, backwards too.
fn year_number(year: i64) -> i64 {
    let leaps = |years: i64| years.div_euclid(4) - years.div_euclid(100) + years.div_euclid(400);
    (year - 1970) * 365 + leaps(year - 1) - leaps(1969)
}

fn day_number(year: i64, month: i64, day: i64) -> i64 {
    year_number(year) + (1..month).map(|month| days_of(year, month)).sum::<i64>() + day - 1
}

/// Year, month and day of the day so many days after the first of 1970.
fn civil(day: i64) -> (i64, i64, i64) {
    // 400 years have 146,097 days; this is one year too late at most.
    let mut year = 1970 + day.saturating_mul(400).div_euclid(146_097) + 1;
    while year_number(year) > day {
        year -= 1;
    }
    let mut rest = day - year_number(year);
    let mut month = 1;
    while rest >= days_of(year, month) {
        rest -= days_of(year, month);
        month += 1;
    }
    (year, month, rest + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_of_the_calendar() {
        for good in ["2026-11-21T14:30Z", "2028-02-29T23:59:59.5Z", "2000-02-29T00:00:00Z"] {
            assert!(good.parse::<Date>().is_ok(), "{good}");
        }
        for bad in [
            "",
            "Z",
            "tomorrow",
            "2026-11-21",
            "2026-11-21T14:30",
            "2026-11-31T14:30Z",
            "2026-13-01T14:30Z",
            "2026-00-01T14:30Z",
            "2027-02-29T14:30Z",
            "2100-02-29T14:30Z",
            "2026-11-21T24:00Z",
            "2026-11-21T14:60Z",
            "2026-11-21T14:30:61Z",
            "2026-11-21T14:30:00.Z",
            "2026-11-21T14:30:00.é0Z",
        ] {
            assert!(bad.parse::<Date>().is_err(), "{bad}");
        }
    }

    #[test]
    fn dates_are_the_seconds_that_every_clock_counts() {
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0),
            ("2000-02-29T12:00:00Z", 951_825_600),
            ("2001-09-09T01:46:40Z", 1_000_000_000),
            ("2038-01-19T03:14:08Z", 2_147_483_648),
            ("9999-12-31T23:59:59Z", 253_402_300_799),
        ] {
            let date = Date::since_1970(Duration::from_secs(seconds));
            assert_eq!(text.parse(), Ok(date));
            assert_eq!(date.to_string(), text);
        }
    }

    #[test]
    fn the_days_of_ten_thousand_years_are_written_and_read_alike() {
        let mut date: Date = "0000-01-01T06:07:08.25Z".parse().expect("a date");
        let mut days = 0;
        while date < "9999-12-31T00:00Z".parse().expect("a date") {
            let text = date.to_string();
            assert_eq!(text.parse(), Ok(date), "{text}");
            // Thirteen days share no divisor with weeks, months or years.
            date = date.later(Duration::from_secs(13 * 86_400));
            days += 13;
        }
        assert!((3_652_424..3_652_424 + 13).contains(&days), "{days}");
    }

    #[test]
    fn dates_sort_and_differ_as_their_moments() {
        let sorted = [
            "1969-12-31T23:59:59.9Z",
            "2026-11-21T14:30Z",
            "2026-11-21T14:30:00.5Z",
            "2026-11-21T14:30:01Z",
            "2026-11-21T14:31Z",
            "2026-12-01T00:00:00Z",
        ]
        .map(|text| text.parse::<Date>().expect("a date"));
        assert!(sorted.is_sorted_by(|a, b| a < b));
        assert_eq!(sorted[2].after(sorted[1]), Some(Duration::from_millis(500)));
        assert_eq!(sorted[1].after(sorted[2]), None);
        assert_eq!(sorted[2].earlier(Duration::from_millis(500)), sorted[1]);
        assert_eq!("2026-11-21T14:30:00.000Z".parse(), Ok(sorted[1]));
        assert_eq!(sorted[0].to_string(), "1969-12-31T23:59:59.9Z");
    }
}
