//! The dates of lines in the logs of a run.

/// The moments, in seconds since 1970, of the lines that contain `text` and are not before `from_s`.
pub fn find_moments(log: &str, text: &str, from_s: f64) -> Vec<f64> {
    let lines = log.lines().filter(|line| line.contains(text));
    // Dates of lines have milliseconds.
    lines.filter_map(parse_date).filter(|at_s| *at_s >= from_s - 0.001).collect()
}

/// Reads `2026-11-21T14:30:05.120Z` at the beginning of a line.
fn parse_date(line: &str) -> Option<f64> {
    let (date, rest) = line.split_once('T')?;
    let time = rest.get(..rest.find('Z')?)?;
    let mut date = date.split('-').map(|part| part.parse::<i64>().ok());
    let (year, month, day) = (date.next()??, date.next()??, date.next()??);
    let mut time = time.split(':').map(|part| part.parse::<f64>().ok());
    let (hours, minutes, seconds) = (time.next()??, time.next()??, time.next()??);
    Some(count_days(year, month, day) as f64 * 86_400.0 + hours * 3600.0 + minutes * 60.0 + seconds)
}

/// Days since 1970-01-01, in the Gregorian calendar, counted in years that begin in March.
fn count_days(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dates_of_lines_are_read() {
        let log = "2026-11-21T14:30:05.120Z   12.345 mapper  INFO arm is cut off\nno date, cut off\n\
                   2000-02-29T00:00:00.500Z    1.000 x WARN arm is cut off (why)\n";
        assert_eq!(find_moments(log, "cut off", 951_782_400.5), [1_795_271_405.12, 951_782_400.5]);
        assert_eq!(find_moments(log, "cut off", 951_782_401.0), [1_795_271_405.12]);
        assert_eq!(parse_date("1970-01-01T00:00:01Z"), Some(1.0));
    }
}
