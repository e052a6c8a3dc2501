//! Findings: the problems of a file, their locations, and the remedies.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::ser::{Serialize, SerializeStruct, Serializer};

use crate::code::Code;
use crate::source::Location;
use crate::trace::{FiringTrace, MissionDuration};

/// The findings that are kept of one reading. A file with a million problems is refused for the
/// first few hundred, and a list without end helps no user.
pub const MAX_FINDINGS: usize = 500;

/// The severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The file is refused.
    Error,
    /// The file is accepted, but probably does not mean what was intended.
    Warning,
    /// Information.
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

/// One problem of a file.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The kind of finding.
    pub code: Code,
    /// The problem, in one sentence.
    pub message: String,
    /// The location; none if the finding is not about a piece of text (a file that cannot be read).
    pub at: Option<Location>,
    /// The file, for a finding that is about a file and not about a piece of its text.
    pub file: Option<PathBuf>,
    /// The remedy.
    pub remedy: String,
    /// Other locations that belong to it, each with a label ("first fed here").
    pub related: Vec<(Location, String)>,
    /// The firings that show it, if there are any.
    pub trace: Option<FiringTrace>,
    /// The duration of the mission, for the finding that reports it.
    pub takes: Option<MissionDuration>,
    /// Whether a transition never fires because of it.
    pub(crate) stops_transition: bool,
    /// Further places of the same mistake; of [`Code::More`], how many findings were left out.
    more: usize,
}

impl Finding {
    /// Creates a finding about the text at `at`.
    pub fn new(code: Code, at: &Location, message: impl Into<String>) -> Self {
        Self { at: Some(at.clone()), ..Self::nowhere(code, message) }
    }

    /// Creates a finding without a location.
    pub fn nowhere(code: Code, message: impl Into<String>) -> Self {
        let message = bounded(message.into());
        Self {
            code,
            message,
            at: None,
            file: None,
            remedy: String::new(),
            related: Vec::new(),
            trace: None,
            takes: None,
            stops_transition: false,
            more: 0,
        }
    }

    /// Creates a finding about a file whose text is unknown.
    pub fn of_file(code: Code, file: &Path, message: impl Into<String>) -> Self {
        Self { file: Some(file.to_path_buf()), ..Self::nowhere(code, message) }
    }

    /// Sets the remedy.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = bounded(remedy.into());
        self
    }

    /// Adds another location that belongs to it.
    #[must_use]
    pub fn related(mut self, at: &Location, label: impl Into<String>) -> Self {
        self.related.push((at.clone(), label.into()));
        self
    }

    /// Sets the firings that show it.
    #[must_use]
    pub fn trace(mut self, trace: FiringTrace) -> Self {
        self.trace = Some(trace);
        self
    }

    /// Records that a transition never fires because of it.
    #[must_use]
    pub(crate) fn stops_transition(self) -> Self {
        Self { stops_transition: true, ..self }
    }

    /// Returns the severity.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }

    /// Returns whether both report the same name, which is unknown or cannot be used.
    fn is_same_name(&self, other: &Self) -> bool {
        let names = [
            Code::UnknownComponent,
            Code::UnknownPlace,
            Code::UnknownVariable,
            Code::NotControllable,
        ];
        names.contains(&self.code)
            && self.code == other.code
            && matches!((&self.at, &other.at), (Some(a), Some(b)) if a.text() == b.text() && a.source.path() == b.source.path())
    }

    /// Merges another mention of the same name into this finding.
    fn fold_mention(&mut self, other: Self) {
        if self.more > 0 {
            let own = self.message.rfind(FOLDED).unwrap_or(self.message.len());
            self.message.truncate(own);
        }
        self.more += 1 + other.more;
        let further = other.at.into_iter().map(|at| (at, "and here".to_owned()));
        self.related.extend(further.chain(other.related));
        self.related.truncate(MAX_RELATED);
        let places = if self.more == 1 { "place" } else { "places" };
        self.message += &format!("{FOLDED}{} more {places}", self.more);
    }

    fn left_out(count: usize) -> Self {
        let message = match count {
            1 => "1 more finding was left out".to_owned(),
            n => format!("{n} more findings were left out"),
        };
        let finding = Self::nowhere(Code::More, message);
        Self { more: count, ..finding.remedy("fix the first ones and check again") }
    }
}

/// The text of a message before the number of further places.
const FOLDED: &str = ", and named in ";
/// Further places of the same mistake that are shown.
const MAX_RELATED: usize = 3;
/// Characters of a name or value that a message shows.
const MAX_SHOWN: usize = 60;
/// Characters of a word, of a whole message, and of a piece of the file in JSON.
const MAX_WORD: usize = 200;
const MAX_MESSAGE: usize = 2000;
const MAX_TEXT: usize = 200;

/// Returns a name or value as messages show it: in a file it may have a megabyte.
pub(crate) fn short(text: &str) -> std::borrow::Cow<'_, str> {
    cut(text, MAX_SHOWN)
}

/// Returns the first `most` characters, the last of them an ellipsis if there are more.
fn cut(text: &str, most: usize) -> std::borrow::Cow<'_, str> {
    match text.char_indices().nth(most) {
        None => text.into(),
        Some(_) => text.chars().take(most - 1).chain(['…']).collect::<String>().into(),
    }
}

/// Returns the message with long words cut, so that it stays readable with any names and values.
fn bounded(text: String) -> String {
    if text.len() <= MAX_WORD {
        return text;
    }
    let is_long = |word: &str| word.chars().nth(MAX_WORD).is_some();
    let words = text.split(' ').map(|word| if is_long(word) { short(word) } else { word.into() });
    let words: Vec<_> = words.collect();
    cut(&words.join(" "), MAX_MESSAGE).into_owned()
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
/// (from 1, the end exclusive) and text, absent for findings about no text, which have a file at most; related;
/// trace, circle and takes where there are some.
impl Serialize for Finding {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut out = serializer.serialize_struct("Finding", 15)?;
        out.serialize_field("severity", &self.severity().to_string())?;
        out.serialize_field("code", self.code.as_str())?;
        out.serialize_field("message", &self.message)?;
        out.serialize_field("remedy", &self.remedy)?;
        if let Some(at) = &self.at {
            serialize_location(&mut out, at)?;
        } else if let Some(file) = &self.file {
            out.serialize_field("file", &file.to_string_lossy())?;
        }
        let related: Vec<_> =
            self.related.iter().map(|(at, label)| Related { at, label }).collect();
        out.serialize_field("related", &related)?;
        if let Some(FiringTrace { firings, circle, is_late }) = &self.trace {
            out.serialize_field("trace", firings)?;
            if *is_late {
                out.serialize_field("late", is_late)?;
            }
            if !circle.is_empty() {
                out.serialize_field("circle", circle)?;
            }
        }
        if let Some(takes) = &self.takes {
            out.serialize_field("takes", takes)?;
        }
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
    out.serialize_field("text", &cut(at.text(), MAX_TEXT))
}

/// All findings of a reading, at most [`MAX_FINDINGS`].
#[derive(Clone, Debug, Default)]
pub struct Findings {
    list: Vec<Finding>,
    left_out: usize,
    /// Whether the list ends with the finding that counts those left out, if there are any.
    is_finished: bool,
}

impl Findings {
    /// Adds a finding, or counts it if the list is full. An error then replaces a warning: a file
    /// must not be accepted because it has many warnings. Another mention of an unknown name is
    /// merged into the first.
    pub fn push(&mut self, finding: Finding) {
        self.list.pop_if(|last| last.code == Code::More);
        if finding.code == Code::More {
            self.left_out += finding.more;
        } else if let Some(first) = self.list.iter_mut().find(|f| f.is_same_name(&finding)) {
            first.fold_mention(finding);
        } else if self.list.len() < MAX_FINDINGS {
            self.list.push(finding);
        } else {
            self.left_out += 1;
            self.make_room(finding);
        }
        self.add_left_out();
    }

    /// Replaces a finding that is not an error by an error.
    fn make_room(&mut self, finding: Finding) {
        let is_minor = |other: &Finding| other.severity() != Severity::Error;
        if finding.severity() == Severity::Error
            && let Some(other) = self.list.iter_mut().rfind(|other| is_minor(other))
        {
            *other = finding;
        }
    }

    fn add_left_out(&mut self) {
        if self.is_finished && self.left_out > 0 {
            self.list.push(Finding::left_out(self.left_out));
        }
    }

    /// Returns the number of findings, with those left out.
    pub(crate) fn total(&self) -> usize {
        self.list.iter().map(|finding| 1 + finding.more).sum::<usize>() + self.left_out
    }

    /// Removes the findings for which `keep` is false.
    pub(crate) fn retain(&mut self, keep: impl Fn(&Finding) -> bool) {
        self.list.retain(keep);
    }

    /// Adds all findings of another reading.
    pub fn extend(&mut self, others: impl IntoIterator<Item = Finding>) {
        others.into_iter().for_each(|finding| self.push(finding));
    }

    /// Adds the findings of another list for which `keep` is true, and the number of those that it
    /// left out.
    pub(crate) fn absorb(&mut self, others: Self, keep: impl Fn(&Finding) -> bool) {
        self.left_out += others.left_out;
        self.extend(others.list.into_iter().filter(keep));
    }

    /// Adds the findings of another reading that are new: the same code at the same location is the
    /// same mistake.
    pub fn extend_new(&mut self, others: impl IntoIterator<Item = Finding>) {
        for finding in others {
            let place = |finding: &Finding| finding.at.as_ref().map(ToString::to_string);
            let known =
                self.list.iter().any(|f| f.code == finding.code && place(f) == place(&finding));
            if !known {
                self.push(finding);
            }
        }
    }

    /// Returns the findings that `known` does not have: the same code with the same message is the
    /// same mistake, wherever it has moved to in the file.
    #[must_use]
    pub fn without_known(&self, known: &Self) -> Self {
        let mut known: Vec<_> = known.list.iter().map(|it| (it.code, &it.message)).collect();
        let mut new = Self::default();
        for finding in &self.list {
            match known.iter().position(|it| *it == (finding.code, &finding.message)) {
                // Each known finding stands for one: a second one like it is new.
                Some(at) => drop(known.swap_remove(at)),
                None => new.push(finding.clone()),
            }
        }
        new
    }

    /// Returns whether there are no findings, not even notes.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Returns whether the file is refused.
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }

    /// Returns the number of findings of a severity (among those kept).
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|finding| finding.severity() == severity).count()
    }

    /// Returns the number of findings of a severity, in words: `1 error`, `2 errors`, `500 or more
    /// errors` where some were left out; none if there are none.
    pub fn counted(&self, severity: Severity) -> Option<String> {
        Some(match self.count(severity) {
            0 => return None,
            n if self.left_out > 0 && severity != Severity::Note => {
                format!("{n} or more {severity}s")
            }
            1 => format!("1 {severity}"),
            n => format!("{n} {severity}s"),
        })
    }

    /// Returns the code of the first error, or else of the first warning.
    pub fn gravest(&self) -> Option<Code> {
        let codes = self.iter().map(|finding| finding.code);
        codes.filter(|code| code.severity() != Severity::Note).min_by_key(|code| code.severity())
    }

    /// Returns the findings in the order of the files and their lines.
    pub fn iter(&self) -> std::slice::Iter<'_, Finding> {
        self.list.iter()
    }

    /// Returns the findings, to add to them.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Finding> {
        self.list.iter_mut()
    }

    /// Returns whether the list is full, so that a suggestion need not be computed.
    pub(crate) fn is_full(&self) -> bool {
        self.list.len() >= MAX_FINDINGS
    }

    /// Returns the errors and warnings, and the finding that counts those left out.
    #[must_use]
    pub fn without_notes(&self) -> Self {
        let is_kept = |f: &&Finding| f.severity() != Severity::Note || f.code == Code::More;
        Self { list: self.list.iter().filter(is_kept).cloned().collect(), ..*self }
    }

    /// Sorts by file and location; findings without a location come first, the one that counts
    /// those left out last.
    pub fn sort(&mut self) {
        let place = |finding: &Finding| {
            finding.at.as_ref().map(|at| (at.source.path().to_path_buf(), at.span, finding.code))
        };
        self.list.sort_by_key(|finding| (finding.code == Code::More, place(finding)));
    }

    /// Sorts, and adds the finding that counts those left out, also after later additions.
    pub(crate) fn finish(mut self) -> Self {
        self.list.retain(|finding| finding.code != Code::More);
        self.sort();
        self.is_finished = true;
        self.add_left_out();
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
        assert_eq!(findings.counted(Severity::Error).as_deref(), Some("1 or more errors"));
        let last = findings.finish().into_iter().last().map(|finding| finding.message);
        assert_eq!(last.as_deref(), Some("501 more findings were left out"));
    }

    #[test]
    fn later_additions_are_counted_once() {
        let many = |count| {
            let mut findings = Findings::default();
            (0..count).for_each(|_| findings.push(Finding::nowhere(Code::NoSystem, "an error")));
            findings.finish()
        };
        let mut findings = many(4000);
        findings.push(Finding::nowhere(Code::NotPlayed, "an error"));
        findings.push(Finding::nowhere(Code::FileMissing, "a warning"));
        findings.extend(many(501));
        findings.sort();
        for findings in [findings.without_notes(), findings.clone().finish(), findings] {
            let notes = findings.iter().filter(|finding| finding.code == Code::More);
            let notes: Vec<_> = notes.map(|finding| finding.message.as_str()).collect();
            assert_eq!(notes, ["4003 more findings were left out"]);
            assert_eq!(findings.count(Severity::Error), MAX_FINDINGS);
        }
    }

    #[test]
    fn a_name_that_is_missing_in_many_places_is_one_finding() {
        let source = crate::source::Source::new("a.xml", "laser ".repeat(1000));
        let mut findings = Findings::default();
        for n in 0..1000 {
            let at = Location::new(&source, crate::source::Span::new(6 * n, 6 * n + 5));
            findings.push(Finding::new(Code::UnknownComponent, &at, "there is no laser"));
        }
        let found: Vec<_> = findings.finish().into_iter().collect();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].message, "there is no laser, and named in 999 more places");
        assert_eq!(found[0].related.len(), MAX_RELATED);
    }

    #[test]
    fn a_message_stays_short_whatever_the_value() {
        let value = "x".repeat(900_000);
        let finding = Finding::nowhere(Code::BadValue, format!("no {value}")).remedy(&*value);
        assert_eq!(finding.message.chars().count(), 3 + MAX_SHOWN);
        assert_eq!(finding.remedy.chars().count(), MAX_SHOWN);
        let finding = Finding::nowhere(Code::BadValue, "x ".repeat(500_000));
        assert_eq!(finding.message.chars().count(), MAX_MESSAGE);
        let source = crate::source::Source::new("a.xml", &*value);
        let at = Location::new(&source, crate::source::Span::new(0, value.len()));
        let json = serde_json::to_string(&Finding::new(Code::BadValue, &at, "no")).unwrap();
        assert!(json.len() < 1000, "{json}");
    }

    #[test]
    fn one_about_a_file_names_it() {
        let finding = Finding::of_file(Code::Unreadable, Path::new("m/a.xml"), "it cannot be read");
        let json = serde_json::to_value(&finding).unwrap();
        assert_eq!((&json["file"], json.get("line")), (&"m/a.xml".into(), None));
        let nowhere = Finding::nowhere(Code::NoDirectory, "there is none");
        assert!(serde_json::to_value(&nowhere).unwrap().get("file").is_none());
    }
}
