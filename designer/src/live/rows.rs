//! Lines of text that take as many rows as they need, all of one height: which line stands where.
//! Only what can be seen is laid out, so that a long log costs no more than a short one.

use std::borrow::Cow;
use std::ops::Range;

/// Narrower than this text is not read: it is cut off instead.
const LEAST_COLUMNS: usize = 20;

/// How many rows each line takes.
#[derive(Debug, Default)]
pub struct Rows {
    columns: usize,
    /// The row after each line.
    ends: Vec<usize>,
}

impl Rows {
    /// Begins again, with rows of this number of characters.
    pub fn begin(&mut self, columns: usize) {
        self.columns = columns.max(LEAST_COLUMNS);
        self.ends.clear();
    }

    /// Whether rows have this number of characters.
    pub fn are(&self, columns: usize) -> bool {
        self.columns == columns.max(LEAST_COLUMNS)
    }

    /// Adds a line whose text is shown after `prefix` other characters.
    pub fn push(&mut self, text: &str, prefix: usize) {
        let rows = self.wrap(text, prefix).lines().count().max(1);
        self.ends.push(self.len() + rows);
    }

    /// The text of a line, broken into its rows.
    pub fn wrap<'a>(&self, text: &'a str, prefix: usize) -> Cow<'a, str> {
        wrap(text, self.columns.saturating_sub(prefix).max(LEAST_COLUMNS))
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.ends.last().copied().unwrap_or_default()
    }

    /// How many lines there are.
    pub fn lines(&self) -> usize {
        self.ends.len()
    }

    /// The lines that stand in these rows.
    pub fn within(&self, rows: Range<usize>) -> Range<usize> {
        let first = self.ends.partition_point(|end| *end <= rows.start);
        let last = self.ends.partition_point(|end| *end < rows.end);
        first..(last + 1).min(self.ends.len())
    }

    /// The rows of a line.
    pub fn of(&self, line: usize) -> Range<usize> {
        let start = line.checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[line]
    }
}

/// The text with a break where a row would be longer: after a space, if one is near.
fn wrap(text: &str, columns: usize) -> Cow<'_, str> {
    if text.len() <= columns {
        return Cow::Borrowed(text);
    }
    let mut broken = String::with_capacity(text.len() + text.len() / columns + 1);
    let mut rest = text;
    while let Some((end, _)) = rest.char_indices().nth(columns) {
        let row = &rest[..end];
        let after_space = row.rfind(' ').map(|at| at + 1).filter(|at| *at > end / 2);
        let (row, next) = rest.split_at(after_space.unwrap_or(end));
        broken.push_str(row);
        broken.push('\n');
        rest = next;
    }
    broken.push_str(rest);
    Cow::Owned(broken)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_ends_after_a_word_or_where_it_must() {
        let check = |text: &str, expected: &str| assert_eq!(wrap(text, 8), expected);
        check("short", "short");
        check("four words are here", "four \nwords \nare here");
        check("abcdefghijklmnop", "abcdefgh\nijklmnop");
        check("äöüäöüäöüä", "äöüäöüäö\nüä");
        check("a bcdefghijk", "a bcdefg\nhijk");
    }

    #[test]
    fn lines_are_found_by_their_rows() {
        let mut rows = Rows::default();
        rows.begin(30);
        let long = "x".repeat(45);
        for text in ["one", &long, "three", ""] {
            rows.push(text, 10);
        }
        assert_eq!((rows.len(), rows.lines()), (6, 4), "45 characters in rows of 20");
        assert_eq!((rows.of(0), rows.of(1), rows.of(3)), (0..1, 1..4, 5..6));
        assert_eq!(rows.within(0..1), 0..1);
        assert_eq!(rows.within(2..3), 1..2);
        assert_eq!(rows.within(3..6), 1..4);
        assert_eq!(rows.within(0..99), 0..4);
        rows.begin(30);
        assert_eq!(rows.within(0..5), 0..0);
    }
}
