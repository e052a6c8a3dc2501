//! One line of a log file.

use std::fmt;

use armor_inspect::log::LogLine;
use armor_recording::trail::name_log_level;
use armor_sdk::messages::Log;
use clap::ValueEnum;
use serde_json::json;

use crate::date::format_date;

/// The least level that is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum LeastLevel {
    Trace,
    Debug,
    Info,
    Warn,
    Error,
}

/// A line with its date.
#[derive(Clone, Debug, PartialEq)]
pub struct LogEntry {
    /// Date and time in UTC, as in the file; that of the line before, if it has none.
    pub date: String,
    /// The process that the line is from or about.
    pub name: String,
    level: String,
    text: String,
    time_s: Option<f64>,
}

impl LogEntry {
    /// Parses a line of the log of `name`. `date_before` is that of the line before.
    pub fn parse(name: &str, line: &str, date_before: &str) -> Self {
        let date = line.split_once(' ').map_or("", |(date, _)| date);
        let is_date = date.len() == "2026-11-21T14:30:05.120Z".len() && date.ends_with('Z');
        let parsed = LogLine::of_file(line);
        let date = if is_date { date } else { date_before };
        // A line without a date is of this program all the same: the file could not be written whole.
        let LogLine { time_s, level, text, .. } = parsed;
        Self { date: date.into(), name: name.into(), level, text, time_s }
    }

    /// Makes the entry of a recorded line. `time_s` counts from the beginning of the recording.
    pub fn of_recording(log: Log, time_s: f64) -> Self {
        Self {
            date: format_date(log.stamp),
            level: name_log_level(log.level).into(),
            name: log.name,
            text: log.msg,
            time_s: Some(time_s),
        }
    }

    /// Returns whether it has this level or a higher one; one without a level has info.
    pub fn is_at_least(&self, least: LeastLevel) -> bool {
        let level = match self.level.as_str() {
            "ERROR" => LeastLevel::Error,
            "WARN" => LeastLevel::Warn,
            "DEBUG" => LeastLevel::Debug,
            "TRACE" => LeastLevel::Trace,
            _ => LeastLevel::Info,
        };
        level >= least
    }

    /// Returns the line as `armor run --format json` prints it.
    pub fn to_json(&self) -> serde_json::Value {
        json!({
            "event": "log",
            "time_s": self.time_s,
            "date": self.date,
            "name": self.name,
            "level": if self.level.is_empty() { None } else { Some(&self.level) },
            "message": self.text,
        })
    }
}

impl fmt::Display for LogEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { date, name, level, text, .. } = self;
        write!(f, "{date} {name:12} {level:>5} {text}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_a_date_a_level_and_a_text() {
        let line = "2026-11-21T14:30:05.120Z   12.345 mapper  WARN slow port=7";
        let entry = LogEntry::parse("mapper", line, "");
        let expected = "2026-11-21T14:30:05.120Z mapper        WARN slow port=7";
        assert_eq!(entry.to_string(), expected);
        assert!(entry.is_at_least(LeastLevel::Warn) && !entry.is_at_least(LeastLevel::Error));
        assert_eq!(entry.to_json()["time_s"], json!(12.345));
        let plain = LogEntry::parse("mapper", "torn line", "2026-11-21T14:30:05.120Z");
        assert!(plain.is_at_least(LeastLevel::Info) && !plain.is_at_least(LeastLevel::Warn));
        assert_eq!(plain.date, entry.date);
    }
}
