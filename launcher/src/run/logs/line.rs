//! One line of output: whose, when, how grave, and its text made safe for a terminal.

use std::sync::Arc;

use super::Level;

/// Where a line came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// A process's standard output.
    Out,
    /// A process's standard error.
    Err,
    /// The launcher's own words about a process.
    Launcher,
}

/// A line as it is shown and kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Seconds since the start of the run.
    pub time_s: f64,
    /// Who speaks or is spoken of.
    pub name: Arc<str>,
    /// Where it came from.
    pub stream: Stream,
    /// How grave it is; empty if the line does not say.
    pub level: &'static str,
    /// What is said.
    pub text: String,
}

const LEVELS: [&str; 5] = ["ERROR", "WARN", "INFO", "DEBUG", "TRACE"];

impl Line {
    /// A line of the launcher's own.
    pub fn said(time_s: f64, name: &str, level: Level, text: String) -> Self {
        let level = match level {
            Level::Error => "ERROR",
            Level::Warn => "WARN",
            Level::Info => "INFO",
        };
        Self { time_s, name: name.into(), stream: Stream::Launcher, level, text }
    }

    /// A line as a process wrote it: `LEVEL text`, or any text.
    pub fn read(time_s: f64, name: Arc<str>, stream: Stream, bytes: &[u8]) -> Self {
        let text = printable(&String::from_utf8_lossy(bytes));
        let (level, text) = match text.trim_start().split_once(' ') {
            Some((first, rest)) => match LEVELS.iter().find(|level| **level == first) {
                Some(level) => (*level, rest.trim_start().to_owned()),
                None => ("", text),
            },
            None => ("", text),
        };
        Self { time_s, name, stream, level, text }
    }

    /// About how much memory it takes, in bytes.
    pub fn size(&self) -> usize {
        size_of::<Self>() + self.text.len()
    }
}

/// Without terminal control: a component must not be able to recolour or rewrite the screen.
fn printable(text: &str) -> String {
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
            let line = Line::read(0.0, "x".into(), Stream::Err, bytes);
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
