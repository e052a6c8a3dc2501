//! Findings: what is wrong with a file, where, and what to do about it.

use std::fmt;

use serde::ser::{Serialize, SerializeStruct, Serializer};

use crate::code::Code;
use crate::source::Location;

/// Findings kept of one reading. A file of a million faults is refused as well by the first few
/// hundred, and a listener that never ends helps nobody.
pub const MAX_FINDINGS: usize = 500;

/// How grave a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The file is refused.
    Error,
    /// The file is taken, but is probably not what was meant.
    Warning,
    /// Worth knowing.
    Note,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        })
    }
}

/// One thing that is wrong.
#[derive(Clone, Debug)]
pub struct Finding {
    /// What kind of finding it is.
    pub code: Code,
    /// What is wrong here, in one sentence.
    pub message: String,
    /// Where; none if it is about no text (a file that cannot be read).
    pub at: Option<Location>,
    /// What to do.
    pub remedy: String,
    /// Other places that belong to it, each with a few words ("first fed here").
    pub related: Vec<(Location, String)>,
}

impl Finding {
    /// A finding about the text at `at`.
    pub fn new(code: Code, at: &Location, message: impl Into<String>) -> Self {
        Self { at: Some(at.clone()), ..Self::nowhere(code, message) }
    }

    /// A finding about no text in particular.
    pub fn nowhere(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), at: None, remedy: String::new(), related: Vec::new() }
    }

    /// Says what to do.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = remedy.into();
        self
    }

    /// Shows another place that belongs to it.
    #[must_use]
    pub fn related(mut self, at: &Location, label: impl Into<String>) -> Self {
        self.related.push((at.clone(), label.into()));
        self
    }

    /// How grave it is.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}

/// One line: `file:line:column: error[E0103]: message (remedy)`.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(at) = &self.at {
            write!(f, "{at}: ")?;
        }
        write!(f, "{}[{}]: {}", self.severity(), self.code.as_str(), self.message)?;
        if self.remedy.is_empty() { Ok(()) } else { write!(f, " ({})", self.remedy) }
    }
}

/// The JSON form: severity, code, message, remedy; file, line, column, end_line, end_column
/// (from 1, the end exclusive) and text, absent for findings about no text; related.
impl Serialize for Finding {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Finding", 11)?;
        out.serialize_field("severity", &self.severity().to_string())?;
        out.serialize_field("code", self.code.as_str())?;
        out.serialize_field("message", &self.message)?;
        out.serialize_field("remedy", &self.remedy)?;
        if let Some(at) = &self.at {
            serialize_location(&mut out, at)?;
        }
        let related: Vec<_> =
            self.related.iter().map(|(at, label)| Related { at, label }).collect();
        out.serialize_field("related", &related)?;
        out.end()
    }
}

struct Related<'a> {
    at: &'a Location,
    label: &'a str,
}

impl Serialize for Related<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Related", 7)?;
        out.serialize_field("label", self.label)?;
        serialize_location(&mut out, self.at)?;
        out.end()
    }
}

fn serialize_location<S: SerializeStruct>(out: &mut S, at: &Location) -> Result<(), S::Error> {
    let (line, column) = at.line_column();
    let (end_line, end_column) = at.source.line_column(at.span.end());
    out.serialize_field("file", &at.source.path().to_string_lossy())?;
    out.serialize_field("line", &line)?;
    out.serialize_field("column", &column)?;
    out.serialize_field("end_line", &end_line)?;
    out.serialize_field("end_column", &end_column)?;
    out.serialize_field("text", at.text())
}

/// All findings of a reading, at most [`MAX_FINDINGS`].
#[derive(Clone, Debug, Default)]
pub struct Findings {
    list: Vec<Finding>,
    left_out: usize,
}

impl Findings {
    /// Adds one, or counts it if there are too many already. Room is made for an error: a file is
    /// not taken because its warnings were many.
    pub fn push(&mut self, finding: Finding) {
        if self.list.len() < MAX_FINDINGS {
            self.list.push(finding);
            return;
        }
        self.left_out += 1;
        let is_minor = |other: &Finding| other.severity() != Severity::Error;
        if finding.severity() == Severity::Error
            && let Some(other) = self.list.iter_mut().rfind(|other| is_minor(other))
        {
            *other = finding;
        }
    }

    /// Adds all of another reading.
    pub fn extend(&mut self, others: impl IntoIterator<Item = Finding>) {
        others.into_iter().for_each(|finding| self.push(finding));
    }

    /// Adds those of another list that are to be kept, and how many that one left out.
    pub(crate) fn absorb(&mut self, others: Self, keep: impl Fn(&Finding) -> bool) {
        self.left_out += others.left_out;
        self.extend(others.list.into_iter().filter(keep));
    }

    /// Whether nothing was found, not even a note.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether the file is refused.
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }

    /// How many of a severity were found (among those kept).
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|finding| finding.severity() == severity).count()
    }

    /// The findings in the order of the files and their lines.
    pub fn iter(&self) -> std::slice::Iter<'_, Finding> {
        self.list.iter()
    }

    /// Whether no more will be kept, so that a search for suggestions is in vain.
    pub(crate) fn is_full(&self) -> bool {
        self.list.len() >= MAX_FINDINGS
    }

    /// The errors and warnings among them.
    #[must_use]
    pub fn without_notes(&self) -> Self {
        let kept = self.list.iter().filter(|finding| finding.severity() != Severity::Note);
        Self { list: kept.cloned().collect(), left_out: 0 }
    }

    /// Sorts by file and place; what is about no text goes first, that others were left out last.
    pub fn sort(&mut self) {
        let place = |finding: &Finding| {
            finding.at.as_ref().map(|at| (at.source.path().to_path_buf(), at.span, finding.code))
        };
        self.list.sort_by_key(|finding| (finding.code == Code::More, place(finding)));
    }

    /// Sorts and says how many were left out.
    pub(crate) fn finish(mut self) -> Self {
        self.sort();
        if self.left_out > 0 {
            let message = match self.left_out {
                1 => "1 more finding was left out".to_owned(),
                n => format!("{n} more findings were left out"),
            };
            let more = Finding::nowhere(Code::More, message);
            self.list.push(more.remedy("mend the first ones and check again"));
            self.left_out = 0;
        }
        self
    }
}

impl IntoIterator for Findings {
    type Item = Finding;
    type IntoIter = std::vec::IntoIter<Finding>;
    fn into_iter(self) -> Self::IntoIter {
        self.list.into_iter()
    }
}

impl<'a> IntoIterator for &'a Findings {
    type Item = &'a Finding;
    type IntoIter = std::slice::Iter<'a, Finding>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_never_hide_that_there_are_errors() {
        let mut findings = Findings::default();
        for _ in 0..2 * MAX_FINDINGS {
            findings.push(Finding::nowhere(Code::NoSafePlace, "a warning"));
        }
        assert!(!findings.has_errors());
        findings.push(Finding::nowhere(Code::NoSystem, "an error"));
        assert!(findings.has_errors());
        assert_eq!(findings.count(Severity::Warning), MAX_FINDINGS - 1);
        let last = findings.finish().into_iter().last().map(|finding| finding.message);
        assert_eq!(last.as_deref(), Some("501 more findings were left out"));
    }
}
