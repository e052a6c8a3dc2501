//! Lines, tables and colours on stdout, and notices on stderr. Every command prints through this
//! module, so that a closed pipe ends it quietly.

mod table;

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};

use anyhow::Result;
use thiserror::Error;

use crate::exit::CommandEnding;
pub use table::{Table, flatten_text, wrap_text};

/// Columns of a terminal that does not report its size.
const USUAL_WIDTH: usize = 80;

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

/// Prints one line on stderr. A closed stderr is ignored: the result of a command does not depend on
/// it.
pub fn print_notice(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
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

/// Returns the columns of the terminal that stdout is; none if it is no terminal.
pub fn terminal_width() -> Option<usize> {
    let stdout = io::stdout();
    if !stdout.is_terminal() {
        return None;
    }
    let columns = rustix::termios::tcgetwinsize(&stdout).map_or(0, |size| size.ws_col);
    Some(if columns == 0 { USUAL_WIDTH } else { usize::from(columns) })
}

/// Returns whether to write colours: on a terminal, unless `NO_COLOR` is set.
pub fn wants_colours(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
