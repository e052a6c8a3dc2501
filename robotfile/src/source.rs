//! The text of one file, and places in it: every name, number and finding knows where it was
//! written. A [`Location`] keeps its [`Source`] alive, so a finding can be shown long after.

use std::fmt;
use std::ops::Deref;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// One file as it was read.
pub struct Source {
    path: PathBuf,
    text: String,
    line_starts: Vec<u32>,
}

impl Source {
    /// Takes the text of the file called `path`. The path is shown, not opened.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<String>) -> Arc<Self> {
        let text = text.into();
        let line_starts = std::iter::once(0)
            .chain(text.match_indices('\n').map(|(at, _)| clamp_offset(at + 1)))
            .collect();
        Arc::new(Self { path: path.into(), text, line_starts })
    }

    /// The path as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder against which the relative paths of this file are resolved.
    pub fn folder(&self) -> PathBuf {
        self.path.parent().map(Path::to_path_buf).unwrap_or_default()
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the text with some pieces replaced, in any order; none of them overlap.
    pub fn text_with(&self, replaced: &[(Span, String)]) -> String {
        let mut text = self.text().to_owned();
        let mut replaced: Vec<_> = replaced.iter().collect();
        replaced.sort_by_key(|(span, _)| std::cmp::Reverse(*span));
        for (span, new) in replaced {
            text.replace_range(span.start()..span.end(), new);
        }
        text
    }

    /// Line and column of a byte offset, both counted from 1; columns count characters.
    pub fn line_column(&self, at: usize) -> (usize, usize) {
        let at = self.text.floor_char_boundary(at);
        let line = self.line_starts.partition_point(|start| *start as usize <= at);
        let start = self.line_starts[line - 1] as usize;
        (line, self.text[start..at].chars().count() + 1)
    }

    /// Returns the text of a span, clamped to the source and to whole characters.
    pub(crate) fn slice(&self, span: Span) -> &str {
        let end = self.text.floor_char_boundary(span.end().min(self.text.len()));
        &self.text[self.text.floor_char_boundary(span.start().min(end))..end]
    }

    /// The text of a line counted from 1, without its line break, and its byte offset.
    pub(crate) fn line(&self, line: usize) -> (&str, usize) {
        let start = self.line_starts[line - 1] as usize;
        let end = self.line_starts.get(line).map_or(self.text.len(), |next| *next as usize);
        (self.text[start..end].trim_end_matches(['\n', '\r']), start)
    }
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Source({})", self.path.display())
    }
}

/// Bytes `start..end` of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Span {
    start: u32,
    end: u32,
}

impl Span {
    /// The bytes from `start` up to, not including, `end`.
    pub fn new(start: usize, end: usize) -> Self {
        Self { start: clamp_offset(start), end: clamp_offset(end.max(start)) }
    }

    /// The first byte.
    pub fn start(self) -> usize {
        self.start as usize
    }

    /// The byte after the last.
    pub fn end(self) -> usize {
        self.end as usize
    }
}

/// A piece of a file.
#[derive(Clone, Debug)]
pub struct Location {
    /// The file.
    pub source: Arc<Source>,
    /// The bytes in it.
    pub span: Span,
}

impl Location {
    /// Whether the other one lies in this one.
    pub(crate) fn contains(&self, other: &Self) -> bool {
        self.source.path() == other.source.path()
            && self.span.start() <= other.span.start()
            && other.span.end() <= self.span.end()
    }

    /// Whether both are the same piece of the same file.
    pub fn is_at(&self, other: &Self) -> bool {
        self.span == other.span && self.source.path() == other.source.path()
    }

    /// Creates the location of the bytes `span` of `source`, clamped to the source.
    pub fn new(source: &Arc<Source>, span: Span) -> Self {
        let text = source.text();
        let end = text.floor_char_boundary(span.end().min(text.len()));
        let start = text.floor_char_boundary(span.start().min(end));
        Self { source: Arc::clone(source), span: Span::new(start, end) }
    }

    /// Returns the text at the location.
    pub fn text(&self) -> &str {
        self.source.slice(self.span)
    }

    /// Line and column of the first character, counted from 1.
    pub fn line_column(&self) -> (usize, usize) {
        self.source.line_column(self.span.start())
    }

    /// A part of this location: `range` in bytes from its start.
    pub(crate) fn part(&self, start: usize, end: usize) -> Self {
        let from = self.span.start();
        let end = (from + end).min(self.span.end());
        Self::new(&self.source, Span::new((from + start).min(end), end))
    }
}

/// `file:line:column`.
impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.line_column();
        write!(f, "{}:{line}:{column}", self.source.path().display())
    }
}

/// A value and where it was written.
#[derive(Clone, Debug)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Where.
    pub at: Location,
}

impl<T> Spanned<T> {
    /// `value`, written at `at`.
    pub fn new(value: T, at: Location) -> Self {
        Self { value, at }
    }

    /// The same place with another value.
    pub(crate) fn with<U>(&self, value: U) -> Spanned<U> {
        Spanned::new(value, self.at.clone())
    }
}

impl<T> Deref for Spanned<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

/// The path without `.` and `..` where that needs no disk, for telling files apart.
pub(crate) fn plain_path(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

/// Offsets fit `u32` because no source is longer than the 1 MiB limit (longer ones are cut).
fn clamp_offset(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_lines_start_at_one() {
        let source = Source::new("a.xml", "äb\n\ncd");
        assert_eq!(source.line_column(0), (1, 1));
        assert_eq!(source.line_column(2), (1, 2));
        assert_eq!(source.line_column(4), (2, 1));
        assert_eq!(source.line_column(6), (3, 2));
        assert_eq!(source.line_column(99), (3, 3));
        assert_eq!(source.line(1).0, "äb");
        assert_eq!(source.line(3).0, "cd");
    }

    #[test]
    fn a_location_never_leaves_its_source() {
        let source = Source::new("a.xml", "äb");
        let at = Location::new(&source, Span::new(1, 99));
        assert_eq!(at.text(), "äb");
        assert_eq!(at.to_string(), "a.xml:1:1");
    }
}
