//! A finding: a problem of a file, its location, and the remedy.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::ser::{Serialize, SerializeStruct, Serializer};

use crate::code::Code;
use crate::offered_edit::OfferedEdit;
use crate::source::Location;
use crate::trace::{FiringTrace, MissionDuration};

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
    /// Edits that are each a remedy: they were tried.
    pub edits: Vec<OfferedEdit>,
    /// Other locations that belong to it, each with a label ("first fed here").
    pub related: Vec<(Location, String)>,
    /// The firings that show it, if there are any.
    pub trace: Option<FiringTrace>,
    /// The duration of the mission, for the finding that reports it.
    pub takes: Option<MissionDuration>,
    /// Whether a transition never fires because of it.
    pub(crate) stops_transition: bool,
    /// Whether it may follow from any other finding.
    pub(crate) may_follow: bool,
    /// The components that it reports as frozen at the wrong time; those of the same are one mistake.
    pub(crate) frozen: Vec<String>,
    /// Further places of the same mistake; of [`Code::More`], how many findings were left out.
    pub(crate) more: usize,
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
            edits: Vec::new(),
            related: Vec::new(),
            trace: None,
            takes: None,
            stops_transition: false,
            may_follow: false,
            frozen: Vec::new(),
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

    /// Offers edits that are each a remedy.
    #[must_use]
    pub fn offer(mut self, edits: impl IntoIterator<Item = OfferedEdit>) -> Self {
        self.edits.extend(edits);
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

    /// Records that it may follow from any other finding, as what only the times or the values of the
    /// mission show.
    #[must_use]
    pub fn may_follow(self) -> Self {
        Self { may_follow: true, ..self }
    }

    /// Records that a transition never fires because of it.
    #[must_use]
    pub(crate) fn stops_transition(self) -> Self {
        Self { stops_transition: true, ..self }
    }

    /// Records the components that it reports as frozen at the wrong time.
    #[must_use]
    pub(crate) fn frozen<'a>(mut self, components: impl IntoIterator<Item = &'a str>) -> Self {
        self.frozen = components.into_iter().map(str::to_owned).collect();
        self
    }

    /// Returns whether both say of the same component that it is frozen at the wrong time.
    pub(crate) fn is_of_same_frozen(&self, other: &Self) -> bool {
        self.frozen.iter().any(|name| other.frozen.contains(name))
    }

    /// Adds another place of the same mistake.
    pub(crate) fn merge_place(&mut self, other: Self) {
        self.related.extend(other.at.map(|at| (at, other.message)));
        self.related.truncate(MAX_PLACES);
    }

    /// Moves a result of the proof to the finding that explains it: to its place, with its message and
    /// remedy. It stays an error if it is one, and what it showed is related.
    pub(crate) fn move_to_cause(&mut self, cause: Self) {
        self.remedy = cause.remedy;
        let Some(at) = cause.at else { return };
        let message = std::mem::replace(&mut self.message, cause.message);
        let own = self.at.replace(at).map(|at| (at, message));
        let mut related = cause.related;
        related.extend(own);
        related.append(&mut self.related);
        self.related = related;
    }

    /// Returns the severity.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }

    /// Returns whether it reports a name that is unknown or cannot be used.
    pub(crate) fn is_about_name(&self) -> bool {
        use Code::{NotControllable, UnknownComponent, UnknownHost, UnknownPlace, UnknownVariable};
        matches!(
            self.code,
            UnknownComponent | UnknownHost | UnknownPlace | UnknownVariable | NotControllable
        )
    }

    /// Returns whether both report the same name.
    pub(crate) fn is_same_name(&self, other: &Self) -> bool {
        // The names of components are those of the whole system, others those of one mission.
        let is_of_system = || {
            use Code::{NotControllable, UnknownComponent, UnknownHost};
            matches!(self.code, UnknownComponent | UnknownHost | NotControllable)
        };
        let is_same_place = |a: &Location, b: &Location| {
            a.text() == b.text() && (is_of_system() || a.source.path() == b.source.path())
        };
        self.is_about_name()
            && self.code == other.code
            && matches!((&self.at, &other.at), (Some(a), Some(b)) if is_same_place(a, b))
    }

    /// Merges another mention of the same name into this finding.
    pub(crate) fn fold_mention(&mut self, other: Self) {
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

    pub(crate) fn left_out(count: usize) -> Self {
        let message = match count {
            1 => "1 more finding was left out".to_owned(),
            n => format!("{n} more findings were left out"),
        };
        let finding = Self::nowhere(Code::More, message);
        Self { more: count, ..finding.remedy("fix the first ones and check again") }
    }
}

/// The text of a message before the number of further places.
const FOLDED: &str = "; it is also named in ";
/// Further places of the same mistake that are shown.
pub(crate) const MAX_RELATED: usize = 3;
/// The same of findings that are merged, each with its message.
const MAX_PLACES: usize = 8;
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

#[cfg(test)]
mod tests {
    use super::*;

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
