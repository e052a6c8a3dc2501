//! Reads a file whose tags do not match or are malformed, so that all of its other problems are
//! found in the same pass. The strict reader (`xml.rs`) has refused the file and reported why; this
//! module reports nothing, and the result is never run or written.

use std::ops::Range;
use std::sync::Arc;

use crate::code::Code;
use crate::elements::{are_one_name, may_contain};
use crate::findings::Findings;
use crate::source::{Location, Source, Span};
use crate::start_tag::{TagReader, literal_less_len, unescape};
use crate::tree::{Element, Node};
use crate::xml::{MAX_DEPTH, MAX_PIECES, conflict};

/// The part that could be read.
pub(crate) struct Recovered {
    pub(crate) root: Element,
    /// Whether every tag was understood, so that a missing element was really not written.
    pub(crate) is_whole: bool,
}

/// Beyond a limit, or without text, there is nothing to recover.
const HOPELESS: [Code; 6] = [
    Code::TooLong,
    Code::NotUtf8,
    Code::Doctype,
    Code::TooDeep,
    Code::TooManyAttributes,
    Code::TooMany,
];

/// Reads the file in which the strict reader found `refused`. The work is linear in its length.
pub(crate) fn recover(source: &Arc<Source>, refused: &Findings) -> Option<Recovered> {
    let is_hopeless = refused.iter().any(|finding| HOPELESS.contains(&finding.code));
    if is_hopeless || conflict(source).is_some() {
        return None;
    }
    let mut reader = RecoveryReader { source, at: 0, open: Vec::new(), root: None, is_whole: true };
    let mut pieces = 0;
    while reader.root.is_none() && reader.read_piece() {
        pieces += 1;
        if pieces > MAX_PIECES || reader.open.len() > MAX_DEPTH {
            return None;
        }
    }
    while !reader.open.is_empty() {
        reader.close_element(false);
    }
    Some(Recovered { root: reader.root?, is_whole: reader.is_whole })
}

struct RecoveryReader<'a> {
    source: &'a Arc<Source>,
    /// The offset of the next piece.
    at: usize,
    open: Vec<Element>,
    root: Option<Element>,
    is_whole: bool,
}

impl<'a> RecoveryReader<'a> {
    fn rest(&self) -> &'a str {
        &self.source.text()[self.at..]
    }

    /// Takes one tag, text or comment; false at the end.
    fn read_piece(&mut self) -> bool {
        const SKIPPED: [(&str, &str); 3] = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        let rest = self.rest();
        if rest.is_empty() {
            return false;
        }
        if let Some((_, end)) = SKIPPED.iter().find(|(start, _)| rest.starts_with(start)) {
            let end_at = rest.find(end).map(|at| at + end.len());
            self.is_whole &= end_at.is_some();
            self.at += end_at.unwrap_or(rest.len());
            return true;
        }
        let (len, is_tag) = match rest.strip_prefix('<') {
            Some(_) => (tag_len(rest), true),
            None => (rest.find('<').unwrap_or(rest.len()), false),
        };
        // In a check, a `<` may compare; the strict reader has reported it.
        let in_check = self.open.last().is_some_and(|top| top.name == "check");
        let (len, is_tag) = match in_check.then(|| literal_less_len(rest)).flatten() {
            Some(len) => (len, false),
            None => (len, is_tag),
        };
        let span = Span::new(self.at, self.at + len);
        self.at += len;
        match (is_tag, rest[..len].strip_prefix("</")) {
            (false, _) => self.add_text(span),
            (true, Some(name)) => self.end_element(name.trim_end_matches('>').trim_end(), span),
            (true, None) => return self.start_element(span),
        }
        true
    }

    fn add_text(&mut self, span: Span) {
        let Some(top) = self.open.last_mut() else { return };
        // The rest of a malformed tag looks like text.
        if self.is_whole || top.name == "check" {
            let at = Location::new(self.source, span);
            let text = unescape(&at, &mut Findings::default());
            top.children.push(Node::Text(text, span));
        }
    }

    fn start_element(&mut self, span: Span) -> bool {
        let text = self.source.slice(span);
        let tag = TagReader::new(self.source, span).read(&mut Findings::default());
        if tag.too_many_attributes {
            self.is_whole = false;
            return false;
        }
        self.is_whole &= tag.sound && text.ends_with('>');
        self.open.push(tag.element);
        if text.ends_with("/>") {
            self.close_element(true);
        }
        true
    }

    fn end_element(&mut self, name: &str, span: Span) {
        let exact = self.open.iter().rposition(|element| element.name == name);
        let last = self.open.len().saturating_sub(1);
        let is_meant = |element: &&Element| are_one_name(&element.name, name);
        let meant = || self.open.last().filter(is_meant).map(|_| last);
        let Some(at) = exact.or_else(meant) else { return };
        while self.open.len() > at + 1 {
            self.close_element(false);
        }
        if let Some(top) = self.open.last_mut() {
            top.span = Span::new(top.span.start(), span.end());
        }
        self.close_element(true);
    }

    /// Closes the innermost element. If it has no end tag in the file, the elements after it have
    /// become its content; those that belong to an outer element are moved there.
    fn close_element(&mut self, by_the_file: bool) {
        let Some(mut element) = self.open.pop() else { return };
        let mut follow = Vec::new();
        if !by_the_file {
            self.is_whole &= element.name != "layout";
            let foreign = element.children.iter().position(|node| match node {
                Node::Element(child) => {
                    !may_contain(&element.name, &child.name)
                        && self.open.iter().any(|outer| may_contain(&outer.name, &child.name))
                }
                _ => false,
            });
            follow = foreign.map(|at| element.children.split_off(at)).unwrap_or_default();
        }
        match self.open.last_mut() {
            Some(parent) => {
                parent.children.push(Node::Element(element));
                parent.children.append(&mut follow);
            }
            None => self.root = Some(element),
        }
    }
}

/// Returns the tag at the start of `text` if a quote in it is not closed: its length, and the bytes
/// of the value whose quote is missing. The next quote of the file, which seems to close it, is in
/// another tag: behind a `<` on another line, or directly after a `>`.
pub(crate) fn find_open_quote(text: &str) -> Option<(usize, Range<usize>)> {
    let is_tag = text.as_bytes().get(1).is_some_and(u8::is_ascii_alphabetic);
    if !text.starts_with('<') || !is_tag {
        return None;
    }
    let (mut quote, mut is_next_line, mut values) = (None, false, Vec::new());
    for (at, byte) in text.bytes().enumerate().skip(1) {
        match (byte, quote) {
            (b'<', Some((_, start))) if is_next_line || text[..at].ends_with('>') => {
                let after = text.as_bytes().get(at + 1)?;
                if !(after.is_ascii_alphabetic() || matches!(after, b'/' | b'!' | b'?')) {
                    return None;
                }
                let last = &text[start..at];
                let last = last[..last.find(['\n', '\r', '>']).unwrap_or(last.len())].len();
                let last = text[start..start + last].trim_end_matches([' ', '/']).len();
                values.push(start..start + last);
                let line = &text[..text[start..].find('\n').map_or(at, |n| start + n)];
                let len = line[start..].find('>').map_or(line.len(), |n| start + n + 1);
                // A value that ends like the begin of the next attribute has swallowed that.
                let is_cut = |value: &Range<usize>| {
                    let name = text[value.clone()].strip_suffix('=');
                    name.is_some_and(|it| it.contains(char::is_whitespace))
                };
                let open = values.iter().position(is_cut).unwrap_or(values.len() - 1);
                return Some((len, values.swap_remove(open)));
            }
            (b'<', _) | (b'>', None) => return None,
            (b'\n', Some(_)) => is_next_line = true,
            (b'"' | b'\'', None) => (quote, is_next_line) = (Some((byte, at + 1)), false),
            (byte, Some((open, start))) if byte == open => {
                values.push(start..at);
                quote = None;
            }
            _ => {}
        }
    }
    None
}

/// Bytes of the tag at the start of `text`: to its `>` outside of quotes; to the first `>` if a
/// quote is not closed before the next `<`; to that `<` if there is none.
fn tag_len(text: &str) -> usize {
    let mut quote = None;
    let mut first = None;
    for (at, byte) in text.bytes().enumerate().skip(1) {
        match (byte, quote) {
            (b'<', _) => return first.unwrap_or(at),
            (b'>', None) => return at + 1,
            (b'>', Some(_)) => first = first.or(Some(at + 1)),
            (b'"' | b'\'', None) => quote = Some(byte),
            (byte, Some(open)) if byte == open => quote = None,
            _ => {}
        }
    }
    first.unwrap_or(text.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The elements as `name(children)`, and `!` if something is missing.
    fn check(text: &str, expected: &str) {
        let source = Source::new("a.xml", text);
        let recovered = recover(&source, &Findings::default()).expect("something");
        let whole = if recovered.is_whole { "" } else { "!" };
        assert_eq!(format!("{}{whole}", shown(&recovered.root)), expected, "{text}");
    }

    fn shown(element: &Element) -> String {
        let children: Vec<_> = element.elements().map(shown).collect();
        match children.as_slice() {
            [] => element.name.clone(),
            children => format!("{}({})", element.name, children.join(" ")),
        }
    }

    #[test]
    fn elements_after_an_unclosed_one_become_its_siblings() {
        check(
            "<armor><system><component><parameter/><component/><link/></system></armor>",
            "armor(system(component(parameter) component link))",
        );
        check("<armor><system><component/><mission/></armor>", "armor(system(component) mission)");
        check(
            "<armor><system><component><link></system><mission><place>",
            "armor(system(component link) mission(place))",
        );
    }

    #[test]
    fn an_end_tag_that_closes_nothing_is_passed_over() {
        check("<armor><system></component><link/></system></armor>", "armor(system(link))");
        check(
            "<armor><system><component></componant><link/></system></armor>",
            "armor(system(component link))",
        );
    }

    #[test]
    fn a_malformed_tag_costs_itself_and_no_more() {
        check(
            "<armor><system><component name=\"a/><link/></system></armor>",
            "armor(system(component link))!",
        );
        check(
            "<armor><system><link a=\"1\" b/><link/></system></armor>",
            "armor(system(link link))!",
        );
        check("<armor><system><link<link/></system></armor>", "armor(system(link link))!");
        check("<armor><system/><!-- <mission/></armor>", "armor(system)!");
    }

    #[test]
    fn beyond_a_limit_nothing_is_recovered() {
        let deep = Source::new("a.xml", "<a>".repeat(MAX_DEPTH + 1));
        assert!(recover(&deep, &Findings::default()).is_none());
        let many = Source::new("a.xml", format!("<a>{}", "<b/>".repeat(MAX_PIECES)));
        assert!(recover(&many, &Findings::default()).is_none());
        assert!(recover(&Source::new("a.xml", "hello"), &Findings::default()).is_none());
    }
}
