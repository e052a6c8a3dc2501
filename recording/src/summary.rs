//! What is in a file, without reading its messages.

use std::collections::BTreeMap;

use crate::writer::OutputType;

/// What is known of a recording: the system time at which it began.
pub const BEGIN_KEY: &str = "begun_s";

/// What is in a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordingSummary {
    /// What is known of the recording, such as the name of the system.
    pub about: BTreeMap<String, String>,
    /// It was finished in order. Otherwise it ends where the recorder was ended, and what is known of
    /// it was read from all its messages.
    pub is_complete: bool,
    /// The outputs by name.
    pub outputs: Vec<RecordedOutput>,
    /// The files in it.
    pub files: Vec<RecordedFile>,
    /// When its first and its last message were published, in system time.
    pub span_s: Option<(f64, f64)>,
}

impl RecordingSummary {
    /// When the recording began, in system time. Latched values in it may be older.
    pub fn begin_s(&self) -> Option<f64> {
        let written = self.about.get(BEGIN_KEY).and_then(|text| text.parse().ok());
        written.or(self.span_s.map(|span| span.0))
    }
}

/// An output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedOutput {
    /// Its unique name, `component.output`.
    pub data: String,
    /// The name of its type.
    pub type_name: String,
    /// How ROS calls it.
    pub ros_type: String,
    /// Its layout; empty if another program has written the file.
    pub schema: String,
    /// The layouts that it had before, if its component was replaced by one with another type.
    pub earlier_schemas: Vec<String>,
    /// A late subscriber gets the last value.
    pub latched: bool,
    /// How many messages there are.
    pub messages: u64,
    /// How many the recorder has lost.
    pub lost: u64,
    /// When its first and its last message were published, in system time.
    pub span_s: Option<(f64, f64)>,
}

impl RecordedOutput {
    /// Takes a type that it has from now on.
    pub(crate) fn set_type(&mut self, output_type: OutputType) {
        let OutputType { name, schema, latched } = output_type;
        let before = std::mem::replace(&mut self.schema, schema);
        if !before.is_empty() && before != self.schema && !self.earlier_schemas.contains(&before) {
            self.earlier_schemas.push(before);
        }
        (self.type_name, self.latched) = (name, latched);
    }

    /// Messages per second between the first and the last one.
    pub fn rate_hz(&self) -> Option<f64> {
        let (from_s, to_s) = self.span_s?;
        let rate_hz = self.messages.checked_sub(1)? as f64 / (to_s - from_s);
        (rate_hz.is_finite() && rate_hz > 0.0).then_some(rate_hz)
    }
}

/// The span that also holds a moment.
pub(crate) fn widen(span_s: Option<(f64, f64)>, stamp_s: f64) -> (f64, f64) {
    let (from_s, to_s) = span_s.unwrap_or((stamp_s, stamp_s));
    (from_s.min(stamp_s), to_s.max(stamp_s))
}

/// A file in a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedFile {
    /// Its name.
    pub name: String,
    /// What it is, such as `application/xml`.
    pub media_type: String,
    /// Its length in bytes.
    pub len: u64,
    /// When it appeared, in system time; none for one of the beginning.
    pub stamp_s: Option<f64>,
}
