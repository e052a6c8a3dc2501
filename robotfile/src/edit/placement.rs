//! Where a new element goes and how it is indented there: as its neighbours are.

use std::ops::Range;

use crate::edit::patch::Patches;
use crate::source::{Source, Span};
use crate::tree::{Element, Node};

/// A place for elements in a text.
pub(crate) struct Placement {
    /// The bytes that they replace.
    range: Range<usize>,
    /// Written before the first.
    before: String,
    /// Written after the last.
    after: String,
    /// The indentation of their lines.
    pub(crate) indent: String,
    /// The additional indentation of a deeper level.
    pub(crate) unit: String,
    /// The line break, or nothing if their neighbours are on one line.
    line_break: &'static str,
}

impl Placement {
    /// Puts a written element here.
    pub(crate) fn put(&self, written: &str, patches: &mut Patches) {
        patches.replace(self.range.clone(), format!("{}{written}{}", self.before, self.after));
    }

    /// Returns the text between two elements that are inserted here.
    pub(crate) fn between(&self) -> String {
        self.line(&self.indent)
    }

    /// A line break and an indentation, or nothing where all is on one line.
    pub(crate) fn line(&self, indent: &str) -> String {
        if self.line_break.is_empty() {
            String::new()
        } else {
            format!("{}{indent}", self.line_break)
        }
    }

    fn inline(at: usize, before: &str, after: &str) -> Self {
        Self {
            range: at..at,
            before: before.to_owned(),
            after: after.to_owned(),
            indent: String::new(),
            unit: String::new(),
            line_break: "",
        }
    }
}

/// The place for number `index` in the last element of `chain`, whose elements (without one that is
/// being moved) are `siblings`. `chain` leads there from the outermost element.
pub(crate) fn find(
    source: &Source,
    chain: &[&Element],
    siblings: &[&Element],
    index: usize,
) -> Placement {
    let parent = chain[chain.len() - 1];
    let page = EditedText { text: source.text(), chain };
    match (index.checked_sub(1).and_then(|n| siblings.get(n)), siblings.first()) {
        (Some(previous), _) => page.place_behind(parent, previous),
        (None, Some(next)) => page.before_first(parent, next),
        (None, None) => page.first_in(parent),
    }
}

struct EditedText<'a> {
    text: &'a str,
    chain: &'a [&'a Element],
}

impl EditedText<'_> {
    fn place_behind(&self, parent: &Element, previous: &Element) -> Placement {
        let end = line_end(self.text, parent, previous.span.end());
        match (indentation(self.text, previous.span.start()), end) {
            (Some(indent), Some(end)) => self.on_its_line(end, indent),
            _ => {
                let start = previous.span.start();
                let space = start - trailing_blanks(&self.text[..start]);
                Placement::inline(previous.span.end(), &self.text[space..start], "")
            }
        }
    }

    /// Directly behind the start tag, so that comments above the first element stay with it.
    fn before_first(&self, parent: &Element, next: &Element) -> Placement {
        let end = line_end(self.text, parent, parent.tag_span.end());
        let start = next.span.start();
        match (indentation(self.text, start), end) {
            (Some(indent), Some(end)) => self.on_its_line(end, indent),
            (Some(indent), None) => {
                let mut place = self.on_its_line(start, indent);
                place.after = std::mem::take(&mut place.before);
                place
            }
            _ => {
                let space = start - trailing_blanks(&self.text[..start]);
                Placement::inline(start, "", &self.text[space..start])
            }
        }
    }

    fn first_in(&self, parent: &Element) -> Placement {
        let tag_end = parent.tag_span.end();
        let inner = if parent.is_open() { self.inner_range(parent) } else { tag_end..tag_end };
        let text = &self.text[inner.clone()];
        let last = inner.start + text.trim_end().len();
        let tail = &self.text[last..inner.end];
        let has_words =
            parent.children.iter().any(|n| matches!(n, Node::Text(t, _) if !t.trim().is_empty()));
        let Some(outer) = indentation(self.text, parent.span.start()).filter(|_| !has_words) else {
            return self.first_in_line(parent, last);
        };
        let unit = self.indent_unit();
        let comment = parent.children.iter().find_map(|node| match node {
            Node::Comment(at) => indentation(self.text, at.start()),
            _ => None,
        });
        let indent = comment.map_or_else(|| format!("{outer}{unit}"), str::to_owned);
        let mut place = self.on_its_line(last, &indent);
        place.unit = unit;
        if !parent.is_open() {
            place.range = self.text[..tag_end - "/>".len()].trim_end().len()..tag_end;
            place.before = format!(">{}", place.before);
            place.after = format!("{}</{}>", place.line(outer), parent.name);
        } else if !tail.contains('\n') {
            place.range = last..inner.end;
            place.after = place.line(outer);
        }
        place
    }

    /// Into an element that has no line of its own, or has words in it.
    fn first_in_line(&self, parent: &Element, last: usize) -> Placement {
        if parent.is_open() {
            return Placement::inline(last, "", "");
        }
        let end = parent.tag_span.end();
        let start = self.text[..end - "/>".len()].trim_end().len();
        let mut place = Placement::inline(start, ">", &format!("</{}>", parent.name));
        place.range = start..end;
        place
    }

    fn on_its_line(&self, at: usize, indent: &str) -> Placement {
        let line_break = line_break(self.text);
        Placement {
            range: at..at,
            before: format!("{line_break}{indent}"),
            after: String::new(),
            indent: indent.to_owned(),
            unit: self.indent_unit(),
            line_break,
        }
    }

    /// Between the tags.
    fn inner_range(&self, parent: &Element) -> Range<usize> {
        let all = &self.text[..parent.span.end()];
        parent.tag_span.end()..all.rfind("</").unwrap_or(parent.span.end())
    }

    /// Returns the indentation of one level: as at a neighbour, at the parent, or anywhere in the
    /// file.
    fn indent_unit(&self) -> String {
        let parents = self.chain.iter().rev().skip(1);
        let root = self.chain[0];
        let near = parents.flat_map(|e| e.elements()).find_map(|e| self.indent_step(e));
        near.or_else(|| self.indent_step(root))
            .or_else(|| root.elements().find_map(|e| self.step_within(e)))
            .unwrap_or("  ")
            .to_owned()
    }

    /// How much deeper the first child of an element is than the element. Recursion is bounded by
    /// the tree's depth.
    fn step_within(&self, element: &Element) -> Option<&str> {
        self.indent_step(element).or_else(|| element.elements().find_map(|e| self.step_within(e)))
    }

    fn indent_step(&self, element: &Element) -> Option<&str> {
        let outer = indentation(self.text, element.span.start())?;
        let inner = element.elements().find_map(|e| indentation(self.text, e.span.start()))?;
        inner.strip_prefix(outer).filter(|step| !step.is_empty())
    }
}

/// The line break of a text: that of its first line.
pub(crate) fn line_break(text: &str) -> &'static str {
    let first = text.find('\n').unwrap_or(0);
    if text[..first].ends_with('\r') { "\r\n" } else { "\n" }
}

/// Where the line of `at` starts.
pub(crate) fn line_start(text: &str, at: usize) -> usize {
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    let mark = '\u{feff}';
    if start == 0 && text.starts_with(mark) { mark.len_utf8().min(at) } else { start }
}

/// Returns the indentation of the piece at `at`, if it is the first of its line.
pub(crate) fn indentation(text: &str, at: usize) -> Option<&str> {
    let before = &text[line_start(text, at)..at];
    before.bytes().all(|b| matches!(b, b' ' | b'\t')).then_some(before)
}

/// How many spaces and tabs a text ends with.
pub(crate) fn trailing_blanks(text: &str) -> usize {
    text.len() - text.trim_end_matches([' ', '\t']).len()
}

/// Returns the end of the last piece on the line of `at`, without white space, if after `at` there
/// are only comments that belong to it.
pub(crate) fn line_end(text: &str, parent: &Element, at: usize) -> Option<usize> {
    let mut end = at;
    for node in parent.children.iter().filter(|node| node.span().start() >= at) {
        let span = node.span();
        match node {
            Node::Comment(_) | Node::Instruction(_) => end = span.end(),
            Node::Text(..) => match blank_line_end(text, span) {
                Some(true) => return Some(end),
                Some(false) => {}
                None => return None,
            },
            Node::Element(_) => return None,
        }
    }
    // The end tag follows on the same line.
    None
}

/// Whether a blank text ends the line; none if it is not blank.
fn blank_line_end(text: &str, span: Span) -> Option<bool> {
    let piece = &text[span.start()..span.end()];
    let start = piece.trim_start_matches([' ', '\t', '\r']);
    if start.starts_with('\n') {
        return Some(true);
    }
    start.is_empty().then_some(false)
}
