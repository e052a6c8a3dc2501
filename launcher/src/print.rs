//! Lines, tables and colours on stdout, and notices on stderr. Every command prints through this
//! module, so that a closed pipe ends it quietly.

mod table;

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::os::fd::AsFd;
use std::thread;

use anyhow::Result;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;
use thiserror::Error;

use crate::exit::CommandEnding;
use table::count_columns;
pub use table::{Table, flatten_text, wrap_lines, wrap_text};

/// Columns of a terminal that does not report its size.
const USUAL_WIDTH: usize = 80;

/// Longer lines are hard to read.
const WIDEST_HELP: usize = 100;

/// The reader of stdout has closed it: it has seen enough, so the command ends without a failure.
#[derive(Clone, Copy, Debug, Error)]
#[error("stdout is closed")]
pub struct StdoutClosed;

/// Prints one line on stdout and flushes it.
///
/// # Errors
/// [`StdoutClosed`], or another reason why stdout cannot be written.
pub fn print_line(line: impl Display) -> Result<()> {
    print_text(format_args!("{line}\n"))
}

/// Prints text on stdout as it is and flushes it.
///
/// # Errors
/// [`StdoutClosed`], or another reason why stdout cannot be written.
pub fn print_text(text: impl Display) -> Result<()> {
    let mut out = io::stdout().lock();
    match write!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(StdoutClosed.into()),
        written => Ok(written?),
    }
}

/// Prints one line on stderr, wrapped if that is a terminal. A closed stderr is ignored: the result
/// of a command does not depend on it.
pub fn print_notice(line: impl Display) {
    let line = line.to_string();
    let _ = match width_of(&io::stderr()) {
        Some(width) => writeln!(io::stderr(), "{}", wrap_lines(&line, width)),
        None => writeln!(io::stderr(), "{line}"),
    };
}

/// Returns whether no line of `text` is wider than the terminal that stderr is, if it is one.
pub fn fits_stderr(text: &str) -> bool {
    let is_narrow = |width: usize| text.lines().all(|line| count_columns(line) <= width);
    width_of(&io::stderr()).is_none_or(is_narrow)
}

/// Prints text for people on stdout, wrapped if that is a terminal.
///
/// # Errors
/// As [`print_line`].
pub fn print_wrapped(text: impl Display) -> Result<()> {
    let text = text.to_string();
    match terminal_width() {
        Some(width) => print_line(wrap_lines(&text, width)),
        None => print_line(text),
    }
}

/// Returns how a command ends that has printed: a reader that closes the pipe early is no failure.
///
/// # Errors
/// Any other error.
pub fn end_printing(result: Result<()>) -> Result<CommandEnding> {
    match result {
        Ok(()) => Ok(CommandEnding::Fine),
        Err(error) if error.is::<StdoutClosed>() => Ok(CommandEnding::Fine),
        Err(error) => Err(error),
    }
}

/// Ends this process, as a command that succeeded, as soon as the reader of stdout closes it. For
/// commands that may wait for a long time between two lines: a write alone would notice it only at
/// the next line.
pub fn end_when_stdout_closes() {
    let wait = || {
        let stdout = io::stdout();
        // No events are asked for: the kernel reports a hang-up and a closed pipe in any case.
        let mut fds = [PollFd::new(&stdout, PollFlags::empty())];
        while poll(&mut fds, None).is_err_and(|error| error == Errno::INTR) {}
        if fds[0].revents().intersects(PollFlags::ERR | PollFlags::HUP) {
            std::process::exit(i32::from(CommandEnding::Fine.code()));
        }
    };
    // Without the thread the end is noticed at the next line.
    let _ = thread::Builder::new().name("stdout".into()).spawn(wait);
}

/// Returns the columns of the terminal that stdout is; none if it is no terminal.
pub fn terminal_width() -> Option<usize> {
    width_of(&io::stdout())
}

fn width_of(stream: &(impl IsTerminal + AsFd)) -> Option<usize> {
    if !stream.is_terminal() {
        return None;
    }
    let columns = rustix::termios::tcgetwinsize(stream).map_or(0, |size| size.ws_col);
    Some(if columns == 0 { USUAL_WIDTH } else { usize::from(columns) })
}

/// Returns the columns of help texts: those of the terminal, as far as lines are easy to read.
pub fn help_width() -> usize {
    terminal_width().unwrap_or(USUAL_WIDTH).min(WIDEST_HELP)
}

/// Returns whether to write colours: on a terminal, unless `NO_COLOR` is set.
pub fn wants_colours(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
