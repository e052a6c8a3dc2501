//! Renders findings as text: the line of the file, the piece underlined, and the remedy.
//!
//! ```text
//! error[E0104]: the input slam.scan is fed twice
//!   --> rover.xml:12:33
//!    |
//! 12 |     <link from="rear.scan" to="slam.scan"/>
//!    |                                ^^^^^^^^^
//!    = help: remove one of the two links
//! ```
//!
//! Not `annotate-snippets`: it takes 32 ms for a finding in a line of 1 MiB (so 16 s for 500 of
//! them), and of a line that is cut before it would print the wrong column.

use std::fmt::Write;

use crate::finding::{Finding, Severity};
use crate::findings::Findings;
use crate::source::Location;

/// Characters of a line that are shown; a longer line is cut around the piece that matters.
const SHOWN_WIDTH: usize = 110;

/// Whether to write colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colours {
    /// ANSI escapes.
    Yes,
    /// Plain text.
    No,
}

impl Colours {
    fn paint(self, style: &str, text: &str) -> String {
        match self {
            Colours::Yes => format!("\x1b[{style}m{text}\x1b[0m"),
            Colours::No => text.to_owned(),
        }
    }
}

impl Findings {
    /// All findings, one below the other, and a line that counts them; empty if there are none.
    pub fn render(&self, colours: Colours) -> String {
        let mut out = String::new();
        for finding in self {
            out += &finding.render(colours);
            out.push('\n');
        }
        out += &self.summary();
        out
    }

    /// `2 errors, 1 warning`, with a line break; empty if nothing was found.
    fn summary(&self) -> String {
        let all = [Severity::Error, Severity::Warning, Severity::Note].into_iter();
        let counts: Vec<_> = all.filter_map(|severity| self.counted(severity)).collect();
        if counts.is_empty() { String::new() } else { counts.join(", ") + "\n" }
    }
}

impl Finding {
    /// This finding in several lines; a note without those of the file.
    pub fn render(&self, colours: Colours) -> String {
        let style = match self.severity() {
            Severity::Error => "1;31",
            Severity::Warning => "1;33",
            Severity::Note => "1;36",
        };
        let head = format!("{}[{}]", self.severity(), self.code.as_str());
        let message = printable(&self.message);
        let mut out =
            format!("{}: {}\n", colours.paint(style, &head), colours.paint("1", &message));
        let related = self.related.iter().map(|(at, _)| at);
        let lines = self.at.iter().chain(related).map(|at| at.line_column().0);
        let mut margin = lines.max().map_or(0, |line| line.to_string().len());
        if let (Some(at), Severity::Note) = (&self.at, self.severity()) {
            // A note has only its location, without lines of the file, so that it does not hide
            // what matters.
            margin = 0;
            let _ = writeln!(out, " {} {at}", colours.paint("1;34", "-->"));
        } else if let Some(at) = &self.at {
            Snippet { at, margin, arrow: "-->", mark: ("^", style), label: "" }
                .write(&mut out, colours);
        }
        for (at, label) in &self.related {
            Snippet { at, margin, arrow: ":::", mark: ("-", "1;34"), label }
                .write(&mut out, colours);
        }
        if !self.remedy.is_empty() {
            let remedy = printable(&self.remedy);
            let _ = writeln!(out, "{:margin$} {} {remedy}", "", colours.paint("1;34", "= help:"));
        }
        out
    }
}

/// One line of the file with the location underlined.
struct Snippet<'a> {
    at: &'a Location,
    /// Width of the column of line numbers.
    margin: usize,
    arrow: &'a str,
    /// The character that underlines, and its style.
    mark: (&'a str, &'a str),
    label: &'a str,
}

impl Snippet<'_> {
    fn write(&self, out: &mut String, colours: Colours) {
        let Self { at, margin, .. } = *self;
        let (line, _) = at.line_column();
        let (text, line_start) = at.source.line(line);
        let end = (at.span.end() - line_start).min(text.len());
        let start = (at.span.start() - line_start).min(end);
        let before = text[..start].chars().count();
        let marked = text[start..end].chars().count().max(1);
        // A cut line shows some of the text before the piece.
        let is_cut = before + marked > SHOWN_WIDTH;
        let skipped = if is_cut { before.saturating_sub(SHOWN_WIDTH / 3) } else { 0 };
        let shown: String = text.chars().skip(skipped).take(SHOWN_WIDTH).collect();
        let lead = if skipped > 0 { "…" } else { "" };
        let tail = if text.chars().count() > skipped + SHOWN_WIDTH { "…" } else { "" };
        let marks = marked.min(SHOWN_WIDTH - (before - skipped).min(SHOWN_WIDTH - 1));
        let indent = before - skipped + lead.chars().count();
        let bar = colours.paint("1;34", "|");
        let arrow = colours.paint("1;34", self.arrow);
        let number = colours.paint("1;34", &format!("{line:>margin$}"));
        let marks = colours.paint(self.mark.1, &self.mark.0.repeat(marks));
        let under = format!("{:indent$}{marks} {}", "", self.label);
        let _ = writeln!(out, "{:margin$}{arrow} {at}", "");
        let _ = writeln!(out, "{:margin$} {bar}", "");
        let _ = writeln!(out, "{number} {bar} {lead}{}{tail}", printable(&shown));
        let _ = writeln!(out, "{:margin$} {bar} {}", "", under.trim_end());
    }
}

/// Control characters shown as one visible character each, so that columns stay right and no
/// file writes escapes to a terminal.
fn printable(text: &str) -> String {
    let visible = |c: char| match c {
        '\t' => ' ',
        c if c.is_control() => '\u{b7}',
        // Characters that change the direction of text would hide other text.
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{b7}',
        c => c,
    };
    text.chars().map(visible).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Code;
    use crate::source::{Source, Span};

    fn rendered(text: &str, span: Span) -> String {
        let source = Source::new("a.xml", text);
        Finding::new(Code::BadValue, &Location::new(&source, span), "no")
            .remedy("yes")
            .render(Colours::No)
    }

    #[test]
    fn the_piece_is_underlined() {
        let shown = rendered("<a>\n\t<b ä=\"xy\"/>", Span::new(12, 14));
        let wanted = [
            "error[E0019]: no",
            " --> a.xml:2:8",
            "  |",
            "2 |  <b ä=\"xy\"/>",
            "  |        ^^",
            "  = help: yes",
            "",
        ];
        assert_eq!(shown, wanted.join("\n"));
    }

    #[test]
    fn a_long_line_is_cut_around_the_piece() {
        let text = format!("{}HERE{}", "x".repeat(5000), "y".repeat(5000));
        let shown = rendered(&text, Span::new(5000, 5004));
        let lines: Vec<_> = shown.lines().collect();
        assert!(lines.iter().all(|line| line.chars().count() < SHOWN_WIDTH + 10), "{shown}");
        let here = lines[3].chars().position(|c| c == 'H');
        assert_eq!(here, lines[4].chars().position(|c| c == '^'));
    }

    #[test]
    fn a_span_of_several_lines_and_an_empty_one_are_shown() {
        assert!(rendered("ab\ncd", Span::new(1, 5)).contains("\n  |  ^\n"));
        assert!(rendered("", Span::new(0, 0)).contains("\n  | ^\n"));
        assert!(rendered("ab\n", Span::new(3, 3)).contains("a.xml:2:1"));
    }

    #[test]
    fn no_escape_reaches_the_terminal() {
        assert!(!rendered("\x1b[2J\u{202e}", Span::new(0, 1)).contains(['\x1b', '\u{202e}']));
    }
}
