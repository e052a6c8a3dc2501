//! Lines, tables and colours on stdout.

use std::io::{self, IsTerminal, Write};

use anyhow::Result;

use crate::exit::CommandEnding;

/// Prints one line on stdout and flushes it.
///
/// # Errors
/// If stdout cannot be written.
pub fn print_line(line: impl std::fmt::Display) -> Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}")?;
    out.flush()?;
    Ok(())
}

/// Returns how a command ends that has printed: a reader that closes the pipe early is no failure.
pub fn end_printing(result: Result<()>) -> Result<CommandEnding> {
    match result {
        Ok(()) => Ok(CommandEnding::Fine),
        Err(error) => match error.downcast_ref::<io::Error>() {
            Some(io) if io.kind() == io::ErrorKind::BrokenPipe => Ok(CommandEnding::Fine),
            _ => Err(error),
        },
    }
}

/// Aligns `rows` under `headings`; numbers to the right.
pub fn format_table(headings: &[&str], rows: &[Vec<String>]) -> String {
    let widths: Vec<usize> = (0..headings.len())
        .map(|column| {
            let cells = rows.iter().filter_map(|row| row.get(column));
            let longest = cells.map(|cell| cell.chars().count()).max().unwrap_or(0);
            longest.max(headings[column].chars().count())
        })
        .collect();
    let right: Vec<bool> = (0..headings.len())
        .map(|column| {
            let mut cells = rows.iter().filter_map(|row| row.get(column)).peekable();
            cells.peek().is_some() && cells.all(|cell| is_number(cell))
        })
        .collect();
    let headings: Vec<String> = headings.iter().map(ToString::to_string).collect();
    let mut out = String::new();
    for row in [&headings].into_iter().chain(rows) {
        let mut line = String::new();
        for (column, cell) in row.iter().enumerate() {
            let width = widths[column];
            line +=
                &if right[column] { format!("{cell:>width$}") } else { format!("{cell:width$}") };
            line += "  ";
        }
        out += line.trim_end();
        out.push('\n');
    }
    out
}

/// Returns whether to write colours: on a terminal, unless `NO_COLOR` is set.
pub fn wants_colours(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Returns whether a cell is a number, with or without a unit, or empty.
fn is_number(cell: &str) -> bool {
    cell == "-" || cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_and_numbers_stand_to_the_right() {
        let rows = [["laser", "7"], ["größe", "1234"]].map(|row| row.map(String::from).to_vec());
        let expected = "NAME   PID\nlaser     7\ngröße  1234\n".replace("PID\n", " PID\n");
        assert_eq!(format_table(&["NAME", "PID"], &rows), expected);
    }
}
