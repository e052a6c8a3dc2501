//! Records of the protocol as people and programs get them.

use std::io::Write;
use std::path::Path;

use anyhow::Result;
use armor_robotfile::{Code, Colours, Finding, Location, Source, Span};
use armor_wire::message::WireType;
use armor_wire::{Message, codec, config, schema};
use serde_json::{Value, json};

use crate::arguments::Format;
use crate::inspect_cli::say;
use crate::print;

/// The record as JSON.
pub fn json_of<T: Message + WireType>(record: &T) -> Result<Value> {
    Ok(schema::to_json(&T::schema(), &codec::encode(record)?)?)
}

/// Says why a value was not written: findings as `armor check` shows them, then the reason.
pub fn say_rejected(
    text: &str,
    findings: &[config::FindingRecord],
    left_out: u32,
    format: Format,
) -> Result<()> {
    if format == Format::Json {
        let findings = findings.iter().map(json_of).collect::<Result<Vec<_>>>()?;
        return say(json!({
            "set": false,
            "reason": text,
            "findings": findings,
            "findings_left_out": left_out,
        }));
    }
    let mut err = std::io::stderr().lock();
    let colours = if print::coloured(&err) { Colours::Yes } else { Colours::No };
    for finding in findings {
        writeln!(err, "{}", in_words(finding, colours))?;
    }
    if left_out > 0 {
        writeln!(err, "and {left_out} more findings")?;
    }
    writeln!(err, "error: {text}")?;
    Ok(())
}

/// The finding with its line underlined, as where it was found.
fn in_words(told: &config::FindingRecord, colours: Colours) -> String {
    let Some(code) = Code::ALL.iter().find(|code| code.as_str() == told.code) else {
        // Of a newer configd than this program.
        let config::FindingRecord { severity, code, message, remedy, .. } = told;
        return format!("{severity}[{code}]: {message} ({remedy})");
    };
    let finding = match location(told) {
        Some(at) => Finding::new(*code, &at, &*told.message),
        None => Finding::nowhere(*code, &*told.message),
    };
    finding.remedy(&*told.remedy).render(colours)
}

/// The place in a text of which only the one line is known; the lines before it are empty.
fn location(told: &config::FindingRecord) -> Option<Location> {
    let lines_before = (told.line as usize).checked_sub(1)?;
    let line_start = lines_before;
    let source = Source::new(
        Path::new(&told.file),
        format!("{}{}", "\n".repeat(lines_before), told.source_line),
    );
    let offset = |column: u32| {
        let before = told.source_line.chars().take((column as usize).saturating_sub(1));
        line_start + before.map(char::len_utf8).sum::<usize>()
    };
    let start = offset(told.column);
    let is_one_line = told.end_line == told.line;
    let end = if is_one_line { offset(told.end_column) } else { source.text().len() };
    Some(Location::new(&source, Span::new(start, end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_told_finding_looks_as_where_it_was_found() {
        let text = "<a>\n\t<b ä=\"xy\"/>\n</a>";
        let source = Source::new("a.xml", text);
        let start = text.find("xy").expect("it is there");
        let at = Location::new(&source, Span::new(start, start + 2));
        let found = Finding::new(Code::BadValue, &at, "no").remedy("yes");
        let told = config::FindingRecord {
            severity: config::FindingSeverity::Error,
            code: "E0019".into(),
            message: "no".into(),
            remedy: "yes".into(),
            file: "a.xml".into(),
            line: 2,
            column: 8,
            end_line: 2,
            end_column: 10,
            text: "xy".into(),
            source_line: "\t<b ä=\"xy\"/>".into(),
        };
        assert_eq!(in_words(&told, Colours::No), found.render(Colours::No));
        let nowhere = config::FindingRecord { line: 0, ..told.clone() };
        assert_eq!(in_words(&nowhere, Colours::No), "error[E0019]: no\n = help: yes\n");
        let newer = config::FindingRecord { code: "E9999".into(), ..told };
        assert_eq!(in_words(&newer, Colours::No), "error[E9999]: no (yes)");
    }
}
