//! One edit of one file.

use std::sync::Arc;

use armor_robotfile::{Location, OfferedEdit, Source, Span};

/// Some pieces of a file, each replaced by another text.
#[derive(Clone, Debug)]
pub(super) struct FileEdit {
    /// What is replaced, in any order; none of them overlap.
    pub replaced: Vec<(Span, String)>,
    /// The place of the mistake.
    pub at: Location,
    /// The result as it is written, such as `from="drive"`.
    pub result: String,
    /// The name of the element, if the result does not show it.
    pub element: String,
    /// What may be meant as it is, and what to do if it is not.
    pub question: Option<(String, String)>,
    /// Whether the result is an element that is added.
    pub is_missing: bool,
    /// The lower, the likelier.
    pub rank: i32,
    /// Of those that are equally likely, the nearest is named first: how far the element is from
    /// those of the place that is meant, in bytes.
    pub distance: usize,
}

impl FileEdit {
    /// An edit of an element of this name, or of one whose result shows what it is.
    pub fn new(
        replaced: Vec<(Span, String)>,
        at: Location,
        result: String,
        element: Option<&str>,
    ) -> Self {
        Self {
            replaced,
            at,
            result,
            element: element.unwrap_or("").to_owned(),
            question: None,
            is_missing: false,
            rank: 0,
            distance: 0,
        }
    }

    pub fn ranked(self, rank: i32) -> Self {
        Self { rank, ..self }
    }

    /// The text of a file, with the edit if it is in this one.
    pub fn text_of(&self, source: &Arc<Source>) -> String {
        if source.path() == self.at.source.path() {
            source.text_with(&self.replaced)
        } else {
            source.text().to_owned()
        }
    }

    /// The edit for a tool. None if its result is not complete, such as a transition without a name.
    pub fn offered(&self) -> Option<OfferedEdit> {
        (!self.result.contains('…')).then(|| OfferedEdit {
            source: Arc::clone(&self.at.source),
            replaced: self.replaced.clone(),
            result: self.result.clone(),
            element: self.element.clone(),
        })
    }

    /// `from="drive" in start`.
    pub fn in_words(&self) -> String {
        match self.element.as_str() {
            "" => self.result.clone(),
            element => format!("{} in {element}", self.result),
        }
    }
}
