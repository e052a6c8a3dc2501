//! One line of output: process, time, level, and its text made safe for a terminal.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use super::LogLevel;

/// Where a line came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogStream {
    /// A process's standard output.
    Out,
    /// A process's standard error.
    Err,
    /// The launcher's own message about a process.
    Launcher,
}

/// A line as it is shown and kept.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Seconds since the start of the run.
    pub time_s: f64,
    /// Seconds since the beginning of 1970, by the wall clock.
    pub date_s: f64,
    /// The process that wrote it, or that it is about.
    pub name: Arc<str>,
    /// Where it came from.
    pub stream: LogStream,
    /// Its level; empty if the line has none.
    pub level: &'static str,
    /// The message.
    pub text: String,
}

const LEVELS: [&str; 5] = ["ERROR", "WARN", "INFO", "DEBUG", "TRACE"];

impl LogLine {
    /// Makes a line of the launcher.
    pub fn of_launcher(time_s: f64, name: &str, level: LogLevel, text: String) -> Self {
        let level = match level {
            LogLevel::Error => "ERROR",
            LogLevel::Warn => "WARN",
            LogLevel::Info => "INFO",
        };
        let stream = LogStream::Launcher;
        Self { time_s, date_s: wall_clock_s(), name: name.into(), stream, level, text }
    }

    /// A line as a process wrote it: `LEVEL text`, or any text.
    pub fn read(time_s: f64, name: Arc<str>, stream: LogStream, bytes: &[u8]) -> Self {
        let text = strip_control_characters(&String::from_utf8_lossy(bytes));
        let (level, text) = match text.trim_start().split_once(' ') {
            Some((first, rest)) => match LEVELS.iter().find(|level| **level == first) {
                Some(level) => (*level, rest.trim_start().to_owned()),
                None => ("", text),
            },
            None => ("", text),
        };
        Self { time_s, date_s: wall_clock_s(), name, stream, level, text }
    }

    /// About how much memory it takes, in bytes.
    pub fn size(&self) -> usize {
        size_of::<Self>() + self.text.len()
    }
}

/// Read for every line: the wall clock of a robot may be set while it runs.
fn wall_clock_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

/// Removes control characters: a component must not be able to recolour or rewrite the screen.
fn strip_control_characters(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        match c {
            '\x1b' => {
                // A control sequence goes to its final byte; any other escape is two characters.
                if chars.next() == Some('[') {
                    chars.find(|c| ('@'..='~').contains(c));
                }
            }
            '\t' => out.push(c),
            c if c.is_control() => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_taken_apart_and_made_safe() {
        let check = |bytes: &[u8], level: &str, text: &str| {
            let line = LogLine::read(0.0, "x".into(), LogStream::Err, bytes);
            assert_eq!((line.level, line.text.as_str()), (level, text), "{bytes:?}");
        };
        check(b"INFO ready port=7", "INFO", "ready port=7");
        check(b" WARN slow", "WARN", "slow");
        check(b"INFORMATION is power", "", "INFORMATION is power");
        check(b"hello\r", "", "hello");
        check(b"", "", "");
        check(b"a\xffb", "", "a\u{fffd}b");
        check(b"\x1b[31mred\x1b[0m \x07\x1b]0;title", "", "red 0;title");
        check(b"\x1b[", "", "");
    }
}
