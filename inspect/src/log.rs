//! The log of a run: lines as `armor run` prints them in JSON and writes them into files, parsed
//! and kept up to a bound.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use serde_json::Value;

use crate::wake::{WakeCallback, spawn_detached};

/// Bytes of text that are kept. Older lines are forgotten; the files of the run have all of them.
const MAX_LEN: usize = 16 << 20;
/// Longest part of a line of a file that is kept.
const MAX_LINE_LEN: usize = 64 << 10;
/// How much of an existing file is read.
const TAIL_LEN: u64 = 256 << 10;
/// Time between two looks at a file.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Seconds since the start of the run, if the line has them.
    pub time_s: Option<f64>,
    /// The process that the line is from or about.
    pub name: String,
    /// `ERROR`, `WARN`, `INFO`, `DEBUG`, `TRACE`, or empty if the line has none.
    pub level: String,
    /// The message.
    pub text: String,
}

impl LogLine {
    /// Returns a line from this program itself.
    pub fn own_line(name: &str, level: &str, text: impl Into<String>) -> Self {
        Self { time_s: None, name: name.into(), level: level.into(), text: text.into() }
    }

    /// Parses a line as `armor run --format json` prints it: of a log, a finding, or anything else.
    pub fn of_json(text: &str) -> Self {
        let Ok(Value::Object(line)) = serde_json::from_str(text) else {
            return Self::own_line("armor", "", text);
        };
        let word = |key: &str| line.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
        match word("event").as_str() {
            "log" => Self {
                time_s: line.get("time_s").and_then(Value::as_f64),
                name: word("name"),
                level: word("level"),
                text: word("message"),
            },
            "end" => Self::own_line("launcher", "INFO", format!("ended: {}", word("how"))),
            _ if line.contains_key("code") => {
                let level = match word("severity").as_str() {
                    "error" => "ERROR",
                    "warning" => "WARN",
                    _ => "INFO",
                };
                let place = match (word("file").as_str(), line.get("line")) {
                    ("", _) | (_, None) => String::new(),
                    (file, Some(row)) => format!(" ({file}:{row})"),
                };
                let text = format!("{}: {}{place}", word("code"), word("message"));
                Self::own_line("check", level, text)
            }
            _ => Self::own_line("armor", "", text),
        }
    }

    /// Parses a line of `logs/all.log`: date, time, name, level in five columns, text.
    pub fn of_file(text: &str) -> Self {
        let parts = || -> Option<Self> {
            let is_date = |word: &str| word.ends_with('Z') && word.contains('T');
            let undated = text.split_once(' ').filter(|(word, _)| is_date(word));
            let undated = undated.map_or(text, |(_, rest)| rest);
            let (time, rest) = undated.trim_start().split_once(' ')?;
            let (name, rest) = rest.split_once(' ')?;
            let (level, text) = (rest.get(..5)?, rest.get(5..)?);
            let is_level = ["", "ERROR", "WARN", "INFO", "DEBUG", "TRACE"].contains(&level.trim());
            if !is_level {
                return None;
            }
            Some(Self {
                time_s: Some(time.parse().ok()?),
                name: name.into(),
                level: level.trim().into(),
                text: text.strip_prefix(' ').unwrap_or(text).into(),
            })
        };
        parts().unwrap_or_else(|| Self::own_line("armor", "", text))
    }

    fn len(&self) -> usize {
        size_of::<Self>() + self.name.len() + self.level.len() + self.text.len()
    }
}

/// Lines, the oldest first. Clones are the same log.
#[derive(Clone, Default)]
pub struct RunLog {
    lines: Arc<Mutex<Lines>>,
}

#[derive(Default)]
struct Lines {
    lines: VecDeque<Arc<LogLine>>,
    len: usize,
    forgotten: u64,
}

impl RunLog {
    /// Adds a line.
    pub fn push(&self, line: LogLine) {
        let mut lines = self.lines.lock();
        lines.len += line.len();
        lines.lines.push_back(Arc::new(line));
        while lines.len > MAX_LEN
            && let Some(oldest) = lines.lines.pop_front()
        {
            lines.len -= oldest.len();
            lines.forgotten += 1;
        }
    }

    /// Returns how many lines were added, including forgotten ones.
    pub fn count(&self) -> u64 {
        let lines = self.lines.lock();
        lines.forgotten + lines.lines.len() as u64
    }

    /// Returns whether both are the same log.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.lines, &other.lines)
    }

    /// Returns the lines from number `from` on, and the number of the first of them. Lines count
    /// from 0, and forgotten ones keep their numbers.
    pub fn since(&self, from: u64) -> (u64, Vec<Arc<LogLine>>) {
        let lines = self.lines.lock();
        let first = from.max(lines.forgotten);
        let skip = usize::try_from(first - lines.forgotten).unwrap_or(usize::MAX);
        (first, lines.lines.iter().skip(skip).cloned().collect())
    }
}

/// Follows the log file of a run of this host until it is dropped.
pub struct Tail {
    is_closing: Arc<AtomicBool>,
}

impl Tail {
    /// Begins to add the lines of `path`, starting up to 256 KiB before its end; `wake` is called
    /// when there are new ones.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(path: &Path, log: RunLog, wake: WakeCallback) -> std::io::Result<Self> {
        let is_closing = Arc::new(AtomicBool::new(false));
        let closing = Arc::clone(&is_closing);
        let mut file = FollowedFile::new(path);
        spawn_detached("look-log", move || {
            while !closing.load(Ordering::Relaxed) {
                if file.read_new_lines(&log) {
                    wake();
                }
                std::thread::sleep(LOOK_EVERY);
            }
        })?;
        Ok(Self { is_closing })
    }
}

impl Drop for Tail {
    fn drop(&mut self) {
        self.is_closing.store(true, Ordering::Relaxed);
    }
}

/// A file that grows.
struct FollowedFile {
    path: PathBuf,
    at: u64,
    is_begun: bool,
    /// A line whose end has not been written yet.
    begun: Vec<u8>,
}

impl FollowedFile {
    fn new(path: &Path) -> Self {
        Self { path: path.into(), at: 0, is_begun: false, begun: Vec::new() }
    }

    /// Adds the new lines; returns whether there were any.
    fn read_new_lines(&mut self, log: &RunLog) -> bool {
        let Ok(mut file) = File::open(&self.path) else { return false };
        let len = file.metadata().map_or(0, |about| about.len());
        if len < self.at {
            // Another run has overwritten the file.
            (self.at, self.is_begun) = (0, false);
            self.begun.clear();
        }
        let mut is_cut = false;
        if !std::mem::replace(&mut self.is_begun, true) && len > TAIL_LEN {
            (self.at, is_cut) = (len - TAIL_LEN, true);
        }
        let mut bytes = Vec::new();
        let from = file.seek(SeekFrom::Start(self.at)).and_then(|_| {
            // Bytes written in the meantime are read next time.
            file.take(len - self.at).read_to_end(&mut bytes)
        });
        let Ok(read) = from else { return false };
        self.at += read as u64;
        let mut lines = bytes.split(|byte| *byte == b'\n').peekable();
        if is_cut {
            lines.next();
        }
        let mut is_new = false;
        while let Some(line) = lines.next() {
            let room = MAX_LINE_LEN.saturating_sub(self.begun.len());
            self.begun.extend_from_slice(&line[..line.len().min(room)]);
            if lines.peek().is_some() {
                log.push(LogLine::of_file(&String::from_utf8_lossy(&self.begun)));
                self.begun.clear();
                is_new = true;
            }
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(time_s: Option<f64>, name: &str, level: &str, text: &str) -> LogLine {
        LogLine { time_s, name: name.into(), level: level.into(), text: text.into() }
    }

    #[test]
    fn lines_are_read_as_armor_prints_them() {
        let check = |text: &str, expected: LogLine| assert_eq!(LogLine::of_json(text), expected);
        check(
            r#"{"event":"log","time_s":1.5,"name":"laser","stream":"stderr","level":"WARN","message":"slow"}"#,
            line(Some(1.5), "laser", "WARN", "slow"),
        );
        check(
            r#"{"event":"log","time_s":1.5,"name":"laser","stream":"stdout","level":null,"message":"hi"}"#,
            line(Some(1.5), "laser", "", "hi"),
        );
        check(
            r#"{"event":"end","how":"interrupted","code":130}"#,
            line(None, "launcher", "INFO", "ended: interrupted"),
        );
        check(
            r#"{"severity":"error","code":"E0103","message":"no such kind","file":"a.xml","line":7}"#,
            line(None, "check", "ERROR", "E0103: no such kind (a.xml:7)"),
        );
        check("panicked at", line(None, "armor", "", "panicked at"));
    }

    #[test]
    fn lines_are_read_as_armor_writes_them() {
        let check = |text: &str, expected: LogLine| assert_eq!(LogLine::of_file(text), expected);
        check("  12.346 laser  INFO up port=7", line(Some(12.346), "laser", "INFO", "up port=7"));
        check(
            "2026-11-21T14:30:05.120Z   12.346 laser  INFO up port=7",
            line(Some(12.346), "laser", "INFO", "up port=7"),
        );
        check("   0.100 laser ERROR no", line(Some(0.1), "laser", "ERROR", "no"));
        check("   0.100 laser       indented", line(Some(0.1), "laser", "", "indented"));
        check("7 lines were left out", line(None, "armor", "", "7 lines were left out"));
        check("", line(None, "armor", "", ""));
    }

    #[test]
    fn memory_is_bounded_and_lines_keep_their_numbers() {
        let log = RunLog::default();
        let text = "x".repeat(MAX_LEN / 4);
        for number in 0..6 {
            log.push(line(Some(f64::from(number)), "laser", "", &text));
        }
        assert_eq!(log.count(), 6);
        let (first, lines) = log.since(0);
        assert_eq!((first, lines.len()), (3, 3), "four and their names do not fit");
        assert_eq!(lines[0].time_s, Some(3.0));
        let (first, lines) = log.since(5);
        assert_eq!((first, lines.len()), (5, 1));
        assert_eq!(log.since(6).1.len(), 0);
    }
}
