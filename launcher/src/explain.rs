//! `armor explain [CODE]`: the page of a finding, from the catalogue in `docs/errors`.

use std::io::IsTerminal;
use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_robotfile::Code;
use clap::Args;
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print;
use crate::print::{end_printing, print_line, print_wrapped};
use crate::verb::Verb;

/// Explain a finding of `armor check` by its code. Without CODE: list all codes.
#[derive(Args, Debug)]
pub struct ExplainArguments {
    /// A code, such as E0103.
    pub code: Option<String>,
}

impl Verb for ExplainArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_explanation(self.code.as_deref(), format)?.into())
    }
}

/// Prints the page of a code, or a line for each code.
///
/// # Errors
/// If there is no such code.
fn print_explanation(code: Option<&str>, format: OutputFormat) -> Result<CommandEnding> {
    let Some(text) = code else {
        return end_printing(Code::ALL.iter().try_for_each(|code| match format {
            OutputFormat::Json => print_line(describe_code(*code)),
            _ => print_line(format!("{}  {}", code.as_str(), code.title())),
        }));
    };
    let Some(code) = Code::named(text) else {
        bail!("{}", describe_unknown(text));
    };
    let bold = print::wants_colours(&std::io::stdout());
    end_printing(match format {
        OutputFormat::Json => print_line(with_page(code)),
        _ if std::io::stdout().is_terminal() => {
            print_wrapped(for_terminal(code.page(), bold).trim_end())
        }
        _ => print_line(code.page().trim_end()),
    })
}

fn describe_unknown(text: &str) -> String {
    let advice = find_meant(text).map(|code| format!("; did you mean {}?", code.as_str()));
    let advice = advice.unwrap_or_default();
    format!("no finding has the code {text}{advice} (`armor explain` lists all codes)")
}

/// Returns the code with the same letter and number, such as E0103 for `e103`; with another letter
/// if there is none with that one, or with any if none is written.
fn find_meant(text: &str) -> Option<Code> {
    let text = text.trim().to_ascii_uppercase();
    let digits = text.trim_start_matches(|c: char| c.is_ascii_alphabetic());
    let letters = text.strip_suffix(digits)?;
    let number: u16 = digits.parse().ok()?;
    let same = || {
        let number_of = |code: &Code| code.as_str().get(1..)?.parse::<u16>().ok();
        Code::ALL.iter().copied().filter(move |code| number_of(code) == Some(number))
    };
    same().find(|code| code.as_str().starts_with(letters)).or_else(|| same().next())
}

fn describe_code(code: Code) -> serde_json::Value {
    let severity = code.severity().to_string();
    json!({"code": code.as_str(), "severity": severity, "title": code.title()})
}

fn with_page(code: Code) -> serde_json::Value {
    let mut value = describe_code(code);
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
    fn a_code_without_its_zero_or_letter_is_answered_with_the_one_meant() {
        for text in ["E103", "e103", "E00103", "103", "0103", "W0103", "E-0103"] {
            let answer = describe_unknown(text);
            let expects = text != "E-0103";
            assert_eq!(answer.contains("; did you mean E0103? ("), expects, "{answer}");
            assert!(answer.contains(text) && answer.contains("armor explain"), "{answer}");
        }
        for text in ["", "E", "E9999", "é103", "E99999999"] {
            assert!(find_meant(text).is_none(), "{text}");
        }
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
