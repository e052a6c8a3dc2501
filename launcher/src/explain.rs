//! `armor explain [CODE]`: the page of a finding, from the catalogue in `docs/errors`.

use std::io::IsTerminal;

use anyhow::{Result, bail};
use armor_robotfile::Code;
use serde_json::json;

use crate::arguments::Format;
use crate::exit::Ending;
use crate::inspect_cli::{printed, say};
use crate::print;

/// Prints the page of a code, or a line for each code.
///
/// # Errors
/// If there is no such code.
pub fn run(code: Option<&str>, format: Format) -> Result<Ending> {
    let Some(text) = code else {
        return printed(Code::ALL.iter().try_for_each(|code| match format {
            Format::Json => say(described(*code)),
            _ => say(format!("{}  {}", code.as_str(), code.title())),
        }));
    };
    let Some(code) = Code::named(text) else {
        bail!("no finding has the code {text}; `armor explain` lists them all");
    };
    let bold = print::coloured(&std::io::stdout());
    printed(match format {
        Format::Json => say(with_page(code)),
        _ if std::io::stdout().is_terminal() => say(for_terminal(code.page(), bold).trim_end()),
        _ => say(code.page().trim_end()),
    })
}

fn described(code: Code) -> serde_json::Value {
    let severity = code.severity().to_string();
    json!({"code": code.as_str(), "severity": severity, "title": code.title()})
}

fn with_page(code: Code) -> serde_json::Value {
    let mut value = described(code);
    value["page"] = code.page().into();
    value
}

/// The Markdown of a page without its marks: headings bold, blocks indented, links by their text.
fn for_terminal(page: &str, bold: bool) -> String {
    let mut out = String::new();
    let mut in_block = false;
    for line in page.lines() {
        if line.starts_with("```") {
            in_block = !in_block;
        } else if in_block {
            out += &format!("    {line}\n");
        } else if let Some((_, heading)) = line.split_once("# ").filter(|_| line.starts_with('#')) {
            let (start, end) = if bold { ("\x1b[1m", "\x1b[0m") } else { ("", "") };
            out += &format!("{start}{heading}{end}\n");
        } else {
            out += &(without_links(line) + "\n");
        }
    }
    out
}

/// `[text](target)` as `text`.
fn without_links(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once('[') {
        out += before;
        match after.split_once("](").and_then(|(text, after)| Some((text, after.split_once(')')?)))
        {
            Some((text, (_, behind))) if !text.contains('[') => {
                out += text;
                rest = behind;
            }
            _ => {
                out.push('[');
                rest = after;
            }
        }
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_readable_in_a_terminal() {
        let page = "# E1: a\n\nSee [E2](E2.md), [a-z] `[2s,5s]`.\n\n```xml\n# <a>\n```\n## What\n";
        let plain = "E1: a\n\nSee E2, [a-z] `[2s,5s]`.\n\n    # <a>\nWhat\n";
        assert_eq!(for_terminal(page, false), plain);
        assert!(for_terminal(page, true).starts_with("\x1b[1mE1: a\x1b[0m\n"));
    }

    #[test]
    fn every_page_has_its_parts() {
        for code in Code::ALL {
            let page = for_terminal(code.page(), false);
            assert!(page.starts_with(&format!("{}: {}\n", code.as_str(), code.title())), "{page}");
            assert!(page.contains("\nExample\n") && page.contains("\nWhat to do\n"), "{page}");
            assert!(!page.contains("```"), "{page}");
        }
    }
}
