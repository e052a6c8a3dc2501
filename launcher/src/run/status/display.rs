//! Where and when the status is written. On a terminal the line is redrawn in place, and everything
//! else that is printed goes above it; elsewhere it is a plain line now and then.

use std::io::{IsTerminal, Write, stderr, stdout};
use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use rustix::fs::{FileType, fstat};

use super::line::RunStatus;

/// Shortest time between two plain lines of the same marking.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Erases the current line. The cursor stands at its beginning afterwards.
const ERASE: &str = "\r\x1b[2K";
/// Without and with wrapping: a line wider than the terminal is cut by it, for one that wraps could
/// not be erased.
const NO_WRAP: &str = "\x1b[?7l";
const WRAP: &str = "\x1b[?7h";

/// The status line of a run. Clones share it.
#[derive(Clone)]
pub struct StatusLine {
    shared: Arc<Mutex<DrawnStatus>>,
}

/// What stands on the terminal.
enum DrawnStatus {
    /// stderr is a device such as /dev/null.
    Discarded,
    /// stderr is not a terminal.
    Plain(PlainLines),
    /// The line as it is drawn; empty if it is not.
    Terminal(String),
}

impl StatusLine {
    /// Makes a line for stderr as it is.
    ///
    /// Where stdout is a pipe, as with `armor run FILE | tee log`, what is read from it may be
    /// printed on the same terminal at any time, so that no line can be kept below it.
    pub fn for_stderr() -> Self {
        let is_pipe = is_of_type(stdout(), FileType::Fifo);
        let drawn = if stderr().is_terminal() && !is_pipe {
            DrawnStatus::Terminal(String::new())
        } else if !stderr().is_terminal() && is_of_type(stderr(), FileType::CharacterDevice) {
            DrawnStatus::Discarded
        } else {
            DrawnStatus::Plain(PlainLines::default())
        };
        Self { shared: Arc::new(Mutex::new(drawn)) }
    }

    /// Returns whether stderr is discarded, so that there is nothing to observe for.
    pub fn is_discarded(&self) -> bool {
        matches!(*self.shared.lock(), DrawnStatus::Discarded)
    }

    /// Returns whether the line is redrawn in place.
    pub fn is_live(&self) -> bool {
        matches!(*self.shared.lock(), DrawnStatus::Terminal(_))
    }

    /// Shows a status. Errors are ignored: a closed stderr must not end a run.
    pub fn show(&self, status: &RunStatus) {
        match &mut *self.shared.lock() {
            DrawnStatus::Discarded => {}
            DrawnStatus::Plain(lines) => {
                if let Some(line) = lines.choose(status) {
                    let _ = writeln!(stderr(), "status: {line}");
                }
            }
            DrawnStatus::Terminal(line) => {
                *line = status.to_line();
                draw_line(line);
            }
        }
    }

    /// Shows a text on a terminal, and nowhere else.
    pub fn show_text(&self, text: String) {
        if let DrawnStatus::Terminal(line) = &mut *self.shared.lock()
            && *line != text
        {
            *line = text;
            draw_line(line);
        }
    }

    /// Erases the line, prints, and draws the line again below.
    pub fn print_above<R>(&self, print: impl FnOnce() -> R) -> R {
        let drawn = self.shared.lock();
        let line = match &*drawn {
            DrawnStatus::Terminal(line) if !line.is_empty() => line,
            _ => return print(),
        };
        let _ = write!(stderr(), "{ERASE}");
        let result = print();
        draw_line(line);
        result
    }

    /// Erases the line for good.
    pub fn finish(&self) {
        let mut drawn = self.shared.lock();
        if let DrawnStatus::Terminal(line) = &mut *drawn
            && !std::mem::take(line).is_empty()
        {
            let _ = write!(stderr(), "{ERASE}");
        }
    }
}

fn is_of_type(stream: impl AsFd, file_type: FileType) -> bool {
    fstat(stream).is_ok_and(|stat| FileType::from_raw_mode(stat.st_mode) == file_type)
}

fn draw_line(line: &str) {
    // One write, so that no other process's output comes between.
    let _ = stderr().write_all(format!("{ERASE}{NO_WRAP}{line}{WRAP}").as_bytes());
}

/// Chooses what is worth a plain line.
#[derive(Debug, Default)]
struct PlainLines {
    places: Vec<String>,
    written_s: Option<f64>,
}

impl PlainLines {
    /// Returns the line to write: at every change of the marking, and otherwise at most one in ten
    /// seconds.
    fn choose(&mut self, status: &RunStatus) -> Option<String> {
        if status.is_empty() {
            return None;
        }
        // While a firing is under way no place may be marked; the change is complete afterwards.
        let is_change = !status.places.is_empty() && status.places != self.places;
        let is_due = self
            .written_s
            .is_none_or(|written_s| status.elapsed_s - written_s >= PLAIN_EVERY.as_secs_f64());
        if !(is_change || is_due) {
            return None;
        }
        if is_change {
            self.places.clone_from(&status.places);
        }
        self.written_s = Some(status.elapsed_s);
        Some(status.to_line())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_line_is_written_at_a_change_of_the_marking_and_every_ten_seconds() {
        let mut lines = PlainLines::default();
        let mut check = |elapsed_s: f64, places: &[&str], expected: bool| {
            let places = places.iter().map(ToString::to_string).collect();
            let status = RunStatus { elapsed_s, places, ..RunStatus::default() };
            assert_eq!(lines.choose(&status).is_some(), expected, "at {elapsed_s} s");
        };
        check(0.0, &[], false);
        check(0.5, &["explore"], true);
        check(9.0, &["explore"], false);
        check(9.5, &[], false);
        check(10.0, &["return"], true);
        check(19.9, &["return"], false);
        check(20.0, &["return"], true);
    }
}
