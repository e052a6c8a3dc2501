//! A line as people or programs get it on stdout.

use std::fmt::Write;

use serde_json::json;

use super::{LogLine, LogStream};
use crate::arguments::OutputFormat;
use crate::date::format_date;
use crate::print;

/// Longest name that the others are lined up with.
const MAX_WIDTH: usize = 20;
/// Colours that can be distinguished on black and on white (xterm's 256).
const COLOURS: [u8; 12] = [33, 35, 36, 63, 67, 71, 99, 133, 137, 143, 168, 173];

/// How lines look.
pub struct Renderer {
    format: OutputFormat,
    colours: bool,
    width: usize,
}

impl Renderer {
    /// With colours if stdout is a terminal and `NO_COLOR` is not set.
    pub fn for_stdout(names: &[&str], format: OutputFormat) -> Self {
        Self::new(names, format, print::wants_colours(&std::io::stdout()))
    }

    /// Makes a renderer with or without colours.
    pub fn new(names: &[&str], format: OutputFormat, colours: bool) -> Self {
        let width = names.iter().map(|name| name.len()).max().unwrap_or(0).min(MAX_WIDTH);
        Self { format, colours, width }
    }

    /// Appends the line with its end.
    pub fn render(&self, line: &LogLine, out: &mut String) {
        let result = match self.format {
            OutputFormat::Json => writeln!(out, "{}", line_to_json(line)),
            _ if self.colours => {
                let (name, level) = (colour_of(&line.name), level_colour(line.level));
                writeln!(
                    out,
                    "\x1b[2m{:8.3}\x1b[0m \x1b[38;5;{name}m{:width$}\x1b[0m {level}{:>5}\x1b[0m {}",
                    line.time_s,
                    line.name,
                    line.level,
                    line.text,
                    width = self.width
                )
            }
            _ => writeln!(out, "{}", Plain(line, self.width)),
        };
        result.expect("a string takes any text");
    }

    /// Appends that lines were left out because the terminal was too slow.
    pub fn left_out(&self, count: u64, out: &mut String) {
        let text = format!("{count} lines were left out: the terminal is too slow (see the files)");
        let line = LogLine::of_launcher(0.0, "launcher", super::LogLevel::Warn, text);
        self.render(&line, out);
    }
}

/// `12.345 simulator   INFO message`.
pub struct Plain<'a>(pub &'a LogLine, pub usize);

impl std::fmt::Display for Plain<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self(line, width) = self;
        write!(f, "{:8.3} {:width$} {:>5} {}", line.time_s, line.name, line.level, line.text)
    }
}

/// A line of a file: `2026-11-21T14:30:05.120Z   12.345 simulator  INFO message`.
pub struct Dated<'a>(pub &'a LogLine);

impl std::fmt::Display for Dated<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", format_date(self.0.date_s), Plain(self.0, 0))
    }
}

fn line_to_json(line: &LogLine) -> serde_json::Value {
    let stream = match line.stream {
        LogStream::Out => "stdout",
        LogStream::Err => "stderr",
        LogStream::Launcher => "launcher",
    };
    json!({
        "event": "log",
        "time_s": (line.time_s * 1e3).round() / 1e3,
        "date": format_date(line.date_s),
        "name": &*line.name,
        "stream": stream,
        "level": if line.level.is_empty() { None } else { Some(line.level) },
        "message": line.text,
    })
}

/// The same name has the same colour in every run.
fn colour_of(name: &str) -> u8 {
    COLOURS[(armor_wire::schema::hash_text(name) % COLOURS.len() as u64) as usize]
}

fn level_colour(level: &str) -> &'static str {
    match level {
        "ERROR" => "\x1b[31m",
        "WARN" => "\x1b[33m",
        "INFO" => "",
        _ => "\x1b[2m",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(format: OutputFormat, colours: bool, expected: &str) {
        let line = LogLine::read(12.3456, "laser".into(), LogStream::Err, b"INFO up port=7");
        let line = LogLine { date_s: 1_795_357_805.12, ..line };
        assert_eq!(
            Dated(&line).to_string(),
            "2026-11-22T14:30:05.120Z   12.346 laser  INFO up port=7"
        );
        let mut out = String::new();
        Renderer::new(&["laser", "simulator"], format, colours).render(&line, &mut out);
        assert_eq!(out, expected);
    }

    #[test]
    fn a_line_for_people_for_terminals_and_for_programs() {
        check(OutputFormat::Text, false, "  12.346 laser      INFO up port=7\n");
        check(
            OutputFormat::Json,
            false,
            concat!(
                r#"{"date":"2026-11-22T14:30:05.120Z","event":"log","level":"INFO","#,
                r#""message":"up port=7","name":"laser","#,
                r#""stream":"stderr","time_s":12.346}"#,
                "\n"
            ),
        );
        let colour = colour_of("laser");
        let text = format!(
            "\x1b[2m  12.346\x1b[0m \x1b[38;5;{colour}mlaser    \x1b[0m  INFO\x1b[0m up port=7\n"
        );
        check(OutputFormat::Text, true, &text);
    }
}
