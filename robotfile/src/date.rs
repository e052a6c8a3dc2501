//! Dates in UTC as the file writes them. Pure: nothing here asks for the current time. The calendar
//! is `jiff`'s.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use jiff::SignedDuration;
use jiff::civil::DateTime;

const SECOND_NS: i128 = 1_000_000_000;
/// The moment from which dates are counted.
const EPOCH: DateTime = DateTime::constant(1970, 1, 1, 0, 0, 0, 0);

/// A moment in UTC, to the nanosecond; days without leap seconds, as the clocks of computers have
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Date {
    /// Nanoseconds since the beginning of 1970.
    ns: i128,
}

impl Date {
    /// Returns the moment that is `time` after the beginning of 1970.
    pub fn since_1970(time: Duration) -> Self {
        Self { ns: as_nanoseconds(time) }
    }

    /// Returns the moment that is so many nanoseconds after the beginning of 1970.
    pub(crate) fn after_1970_ns(ns: i128) -> Self {
        Self { ns }
    }

    /// Returns the nanoseconds since the beginning of 1970; negative before.
    pub(crate) fn since_1970_ns(self) -> i128 {
        self.ns
    }

    /// Returns the moment that is `time` later.
    #[must_use]
    pub fn later(self, time: Duration) -> Self {
        Self { ns: self.ns + as_nanoseconds(time) }
    }

    /// Returns the moment that is `time` earlier.
    #[must_use]
    pub fn earlier(self, time: Duration) -> Self {
        Self { ns: self.ns - as_nanoseconds(time) }
    }

    /// Returns the time from `earlier` to this moment; none if `earlier` is later.
    pub fn after(self, earlier: Self) -> Option<Duration> {
        let ns = self.ns.checked_sub(earlier.ns).filter(|ns| *ns >= 0)?;
        let seconds = u64::try_from(ns / SECOND_NS).unwrap_or(u64::MAX);
        Some(Duration::new(seconds, (ns % SECOND_NS) as u32))
    }
}

fn as_nanoseconds(time: Duration) -> i128 {
    i128::from(time.as_secs()) * SECOND_NS + i128::from(time.subsec_nanos())
}

/// Parses `2026-11-21T14:30Z`, optionally with seconds and their fraction; digits below a
/// nanosecond are cut off.
impl FromStr for Date {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fraction = fraction_digits(text)
            .ok_or("a date in UTC is expected, such as 2026-11-21T14:30:00Z".to_owned())?;
        // Only digits are at these places; without seconds there are none at the last.
        let number = |at: usize, len: usize| {
            text.get(at..at + len).and_then(|digits| digits.parse::<i16>().ok()).unwrap_or(0)
        };
        let pair = |at: usize| number(at, 2) as i8;
        let digits: String = fraction.chars().chain("000000000".chars()).take(9).collect();
        let subsecond_ns = digits.parse().unwrap_or(0);
        let civil = DateTime::new(
            number(0, 4),
            pair(5),
            pair(8),
            pair(11),
            pair(14),
            pair(17),
            subsecond_ns,
        )
        .map_err(|_| "there is no such day or no such time of day".to_owned())?;
        Ok(Self { ns: civil.duration_since(EPOCH).as_nanos() })
    }
}

/// Returns the digits of the second's fraction, if the text has the form of a date.
fn fraction_digits(text: &str) -> Option<&str> {
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

/// Writes the date as in a file, with seconds, and with a fraction if it has one.
impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = i64::try_from(self.ns.div_euclid(SECOND_NS)).unwrap_or(i64::MAX);
        let ns = self.ns.rem_euclid(SECOND_NS) as i32;
        let civil = EPOCH.saturating_add(SignedDuration::new(seconds, ns));
        write!(f, "{}", civil.strftime("%Y-%m-%dT%H:%M:%S%.fZ"))
    }
}

/// Returns a moment as people read it in logs, to the millisecond: `2026-11-21T14:30:05.120Z` for a
/// time in seconds since the beginning of 1970.
pub fn format_date(since_1970_s: f64) -> String {
    let ms = (since_1970_s.max(0.0) * 1e3).round() as u64;
    let seconds = Date::since_1970(Duration::from_secs(ms / 1000)).to_string();
    format!("{}.{:03}Z", seconds.trim_end_matches('Z'), ms % 1000)
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
