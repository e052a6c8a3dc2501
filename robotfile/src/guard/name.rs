//! The names in a guard or a variable's source: a variable, or a field of data.

use std::fmt;
use std::ops::Range;

use armor_wire::name::split_data;

/// `battery`, or `power.state` and a field of it such as `power.state.level`.
#[derive(Clone, Debug)]
pub struct Name {
    text: String,
    /// The bytes of its first occurrence in the text.
    pub(crate) at: Range<usize>,
}

impl Name {
    /// Creates a name that is at `at` in a text.
    pub(super) fn new(text: &str, at: Range<usize>) -> Self {
        Self { text: text.into(), at }
    }

    /// The field of data that a whole text names.
    pub fn of_data(text: &str) -> Option<Self> {
        let name = Self::new(text, 0..text.len());
        let is_field = |field: &str| {
            !field.is_empty() && field.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
        };
        (name.data().is_some() && name.fields().iter().all(|field| is_field(field))).then_some(name)
    }

    /// It as written.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Of a field of data, `component.output`; none for a variable.
    pub fn data(&self) -> Option<&str> {
        let dot = self.text.find('.')?;
        let end = self.text[dot + 1..].find('.').map_or(self.text.len(), |len| dot + 1 + len);
        let data = &self.text[..end];
        split_data(data).map(|_| data)
    }

    /// Of a field of data, the fields that lead to it; none where the only value is meant.
    pub fn fields(&self) -> Vec<&str> {
        self.text.split('.').skip(2).collect()
    }

    /// The bytes of its part number `index`, counted between the dots from 0.
    pub(crate) fn part_at(&self, index: usize) -> Range<usize> {
        let mut start = self.at.start;
        for (number, part) in self.text.split('.').enumerate() {
            if number == index {
                return start..start + part.len();
            }
            start += part.len() + 1;
        }
        self.at.clone()
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
