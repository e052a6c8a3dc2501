//! Records of the protocol as text and JSON.

use std::io::Write;
use std::path::Path;

use anyhow::Result;
use armor_robotfile::{Code, Colours, Finding, Location, Source, Span};
use armor_wire::message::WireType;
use armor_wire::{Message, codec, config, schema};
use serde_json::{Value, json};

use crate::arguments::OutputFormat;
use crate::print;
use crate::print::{print_line, print_notice};

/// Returns the record as JSON.
pub fn record_to_json<T: Message + WireType>(record: &T) -> Result<Value> {
    Ok(schema::to_json(&T::schema(), &codec::encode(record)?)?)
}

/// Prints why a value was not written: findings as `armor check` prints them, then the reason.
pub fn print_rejection(
    text: &str,
    findings: &[config::FindingRecord],
    left_out: u32,
    format: OutputFormat,
) -> Result<()> {
    if format == OutputFormat::Json {
        let findings = findings.iter().map(record_to_json).collect::<Result<Vec<_>>>()?;
        return print_line(json!({
            "set": false,
            "reason": text,
            "findings": findings,
            "findings_left_out": left_out,
        }));
    }
    print_findings(findings)?;
    if left_out > 0 {
        print_notice(format_args!("and {left_out} more findings"));
    }
    print_notice(format_args!("error: {text}"));
    Ok(())
}

/// Prints findings on stderr as `armor check` prints them.
pub fn print_findings(findings: &[config::FindingRecord]) -> Result<()> {
    let mut err = std::io::stderr().lock();
    let colours = if print::wants_colours(&err) { Colours::Yes } else { Colours::No };
    for finding in findings {
        writeln!(err, "{}", format_finding(finding, colours))?;
    }
    Ok(())
}

/// Returns the finding with its line underlined, as `armor check` prints it.
fn format_finding(finding: &config::FindingRecord, colours: Colours) -> String {
    let Some(code) = Code::ALL.iter().find(|code| code.as_str() == finding.code) else {
        // The configd is newer than this program.
        let config::FindingRecord { severity, code, message, remedy, .. } = finding;
        return format!("{severity}[{code}]: {message} ({remedy})");
    };
    let local = match locate_finding(finding) {
        Some(at) => Finding::new(*code, &at, &*finding.message),
        None => Finding::nowhere(*code, &*finding.message),
    };
    local.remedy(&*finding.remedy).render(colours)
}

/// Returns the place in a text of which only one line is known; the lines before it are empty.
fn locate_finding(finding: &config::FindingRecord) -> Option<Location> {
    let lines_before = (finding.line as usize).checked_sub(1)?;
    let line_start = lines_before;
    let source = Source::new(
        Path::new(&finding.file),
        format!("{}{}", "\n".repeat(lines_before), finding.source_line),
    );
    let offset = |column: u32| {
        let before = finding.source_line.chars().take((column as usize).saturating_sub(1));
        line_start + before.map(char::len_utf8).sum::<usize>()
    };
    let start = offset(finding.column);
    let is_one_line = finding.end_line == finding.line;
    let end = if is_one_line { offset(finding.end_column) } else { source.text().len() };
    Some(Location::new(&source, Span::new(start, end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_received_finding_looks_like_a_local_one() {
        let text = "<a>\n\t<b ä=\"xy\"/>\n</a>";
        let source = Source::new("a.xml", text);
        let start = text.find("xy").expect("it is in the text");
        let at = Location::new(&source, Span::new(start, start + 2));
        let local = Finding::new(Code::BadValue, &at, "no").remedy("yes");
        let finding = config::FindingRecord {
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
        assert_eq!(format_finding(&finding, Colours::No), local.render(Colours::No));
        let nowhere = config::FindingRecord { line: 0, ..finding.clone() };
        assert_eq!(format_finding(&nowhere, Colours::No), "error[E0019]: no\n = help: yes\n");
        let newer = config::FindingRecord { code: "E9999".into(), ..finding };
        assert_eq!(format_finding(&newer, Colours::No), "error[E9999]: no (yes)");
    }
}
