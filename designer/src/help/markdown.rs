//! The Markdown of the documentation as widgets: paragraphs, lists, tables, examples, links.

use armor_picture::theme;
use eframe::egui::{self, RichText, Ui};

/// A part of a line of text.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Span<'a> {
    Plain(&'a str),
    Strong(&'a str),
    Code(&'a str),
    Link { text: &'a str, target: &'a str },
}

/// Shows a text. Returns the target of the link that was clicked, if `is_known` knows where it leads;
/// of other links only the text is shown.
pub fn show<'a>(ui: &mut Ui, text: &'a str, is_known: &dyn Fn(&str) -> bool) -> Option<&'a str> {
    let mut clicked = None;
    let mut is_code = false;
    for line in text.lines() {
        match line {
            _ if line.starts_with("```") => is_code = !is_code,
            _ if is_code => {
                ui.add(egui::Label::new(RichText::new(line).monospace()).extend());
            }
            "" => ui.add_space(theme::NEAR),
            _ if line.starts_with('#') => drop(ui.strong(line.trim_start_matches('#').trim())),
            // Pictures are not part of the program, and a table needs no line below its head.
            _ if line.starts_with("![") || is_rule(line) => {}
            _ if line.starts_with('|') => {
                let inner = line.trim().trim_matches('|');
                let cells = split_cells(inner);
                ui.horizontal_wrapped(|ui| {
                    ui.spacing_mut().item_spacing.x = 0.0;
                    for (n, cell) in cells.into_iter().enumerate() {
                        if n > 0 {
                            ui.label(" | ");
                        }
                        clicked = show_spans(ui, cell.trim(), is_known).or(clicked);
                    }
                });
            }
            _ => {
                let (indent, line) = match line.trim_start().strip_prefix("- ") {
                    Some(item) => ("\u{2022} ", item),
                    None => ("", line),
                };
                ui.horizontal_wrapped(|ui| {
                    ui.spacing_mut().item_spacing.x = 0.0;
                    if !indent.is_empty() {
                        ui.label(indent);
                    }
                    clicked = show_spans(ui, line, is_known).or(clicked);
                });
            }
        }
    }
    clicked
}

fn is_rule(line: &str) -> bool {
    line.starts_with('|') && line.chars().all(|c| matches!(c, '|' | '-' | ':' | ' '))
}

/// The cells of a row; a `|` in code is part of its cell.
fn split_cells(row: &str) -> Vec<&str> {
    let (mut cells, mut start, mut is_code) = (Vec::new(), 0, false);
    for (at, c) in row.char_indices() {
        match c {
            '`' => is_code = !is_code,
            '|' if !is_code => {
                cells.push(&row[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    cells.push(&row[start..]);
    cells
}

fn show_spans<'a>(ui: &mut Ui, line: &'a str, is_known: &dyn Fn(&str) -> bool) -> Option<&'a str> {
    let mut clicked = None;
    for span in spans(line) {
        match span {
            Span::Plain(text) => drop(ui.label(text)),
            Span::Strong(text) => drop(ui.strong(text)),
            Span::Code(text) => drop(ui.label(RichText::new(text).monospace())),
            Span::Link { text, target } if is_known(target) => {
                if ui.link(text.trim_matches('`')).on_hover_text(target).clicked() {
                    clicked = Some(target);
                }
            }
            Span::Link { text, .. } => drop(ui.label(text.trim_matches('`'))),
        }
    }
    clicked
}

/// The parts of a line. Marks without an end are text.
fn spans(line: &str) -> Vec<Span<'_>> {
    let mut found = Vec::new();
    let (mut rest, mut plain) = (line, line);
    while !rest.is_empty() {
        let Some((span, after)) = marked(rest) else {
            let mut letters = rest.chars();
            letters.next();
            rest = letters.as_str();
            continue;
        };
        let before = &plain[..plain.len() - rest.len()];
        if !before.is_empty() {
            found.push(Span::Plain(before));
        }
        found.push(span);
        (rest, plain) = (after, after);
    }
    if !plain.is_empty() {
        found.push(Span::Plain(plain));
    }
    found
}

/// The marked part that a text begins with, and what follows it.
fn marked(text: &str) -> Option<(Span<'_>, &str)> {
    if let Some((code, after)) = text.strip_prefix('`').and_then(|inner| inner.split_once('`')) {
        return Some((Span::Code(code), after));
    }
    if let Some((strong, after)) = text.strip_prefix("**").and_then(|it| it.split_once("**")) {
        return Some((Span::Strong(strong), after));
    }
    let (text, rest) = text.strip_prefix('[')?.split_once("](")?;
    let (target, after) = rest.split_once(')')?;
    // `[2s,5s]` in a sentence is no link.
    (!text.contains(']')).then_some((Span::Link { text, target }, after))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_split_at_its_marks() {
        let check = |line: &str, expected: &[Span<'_>]| assert_eq!(spans(line), expected, "{line}");
        check("plain", &[Span::Plain("plain")]);
        check(
            "**Names** of `a|b` ([x](y.md#z)).",
            &[
                Span::Strong("Names"),
                Span::Plain(" of "),
                Span::Code("a|b"),
                Span::Plain(" ("),
                Span::Link { text: "x", target: "y.md#z" },
                Span::Plain(")."),
            ],
        );
        check("an interval [2s,5s] or `open", &[Span::Plain("an interval [2s,5s] or `open")]);
        check("\u{fc}ber **\u{e4}**", &[Span::Plain("\u{fc}ber "), Span::Strong("\u{e4}")]);
    }

    #[test]
    fn cells_are_split_outside_code() {
        assert_eq!(split_cells(" a | `x|y` | c "), [" a ", " `x|y` ", " c "]);
        assert!(is_rule("| --- | :-- |") && !is_rule("| a | b |"));
    }
}
