//! An edit of a file that a tool can offer next to a finding.

use std::sync::Arc;

use crate::source::{Source, Span};

/// An edit of one file after which a finding is gone.
#[derive(Clone, Debug)]
pub struct OfferedEdit {
    /// The file, with the text that the edit is made on.
    pub source: Arc<Source>,
    /// Pieces of the text and what each is replaced by, in any order; none of them overlap.
    pub replaced: Vec<(Span, String)>,
    /// The result as it is written, such as `from="drive"`.
    pub result: String,
    /// The name of the element that is edited; may be empty.
    pub element: String,
}

impl OfferedEdit {
    /// Returns the text of the file with the edit.
    pub fn text(&self) -> String {
        self.source.text_with(&self.replaced)
    }
}
