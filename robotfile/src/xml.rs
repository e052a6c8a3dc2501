//! Bytes → tree: quick-xml's events, with the limits it does not have itself. Whatever the bytes,
//! the work is linear in their number and the tree no deeper than [`MAX_DEPTH`].

use std::path::Path;
use std::sync::Arc;

use quick_xml::events::Event;
use quick_xml::reader::Reader;

use crate::code::Code;
use crate::elements::are_one_name;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::recover::find_open_quote;
use crate::source::{Location, Source, Span};
use crate::start_tag::{TagReader, literal_less_len, unescape};
use crate::tree::{Element, Node, Tree};

/// Longest file in bytes: a thousand components take a fifth of it.
pub const MAX_FILE_BYTES: usize = 1 << 20;
/// Deepest nesting of elements; the format itself needs five.
pub const MAX_DEPTH: usize = 32;
/// Most pieces (elements, texts, comments) of one file. A long file has a third of it; beyond, short
/// elements would cost a hundred times their length in memory.
pub const MAX_PIECES: usize = 100_000;
/// Most attributes of one element; the format itself needs twenty.
pub const MAX_ATTRIBUTES: usize = 64;

/// A file with a zero byte in its first bytes is no text.
const BINARY_HEAD_LEN: usize = 1 << 10;

/// Parses the bytes of the file called `path` as a tree, without interpreting it.
///
/// # Errors
/// The findings, if they are no XML or break a limit.
pub fn parse_tree(path: &Path, bytes: &[u8]) -> Result<Tree, Findings> {
    let mut findings = Findings::default();
    let (_, tree) = parse(path, bytes, &mut findings);
    match tree.filter(|_| !findings.has_errors()) {
        Some(tree) => Ok(tree),
        None => Err(findings.finish()),
    }
}

/// Returns what a file is whose content cannot be shown line by line, and what to do instead; none
/// if it may be text.
fn describe_other_content(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let head = &bytes[..bytes.len().min(BINARY_HEAD_LEN)];
    if head.starts_with(b"\x7fELF") || head.starts_with(b"#!") {
        let remedy = "if it is a component, `armor describe KIND` shows its ports and parameters; \
                      `armor check` takes the XML file that names it";
        return Some(("a program", remedy));
    }
    // XML in UTF-16 has zero bytes too; the finding of its first byte names the remedy.
    let is_utf16 =
        [b"\xff\xfe", b"\xfe\xff", b"<\0", b"\0<"].iter().any(|it| head.starts_with(*it));
    (head.contains(&0) && !is_utf16).then_some(("not text", "check the path"))
}

/// Reads the bytes of the file called `path`. The tree is missing if they are no XML at all or
/// break a limit; problems are added to `findings`.
pub(crate) fn parse(
    path: &Path,
    bytes: &[u8],
    findings: &mut Findings,
) -> (Arc<Source>, Option<Tree>) {
    if let Some((what, remedy)) = describe_other_content(bytes) {
        let message = format!("{} is {what}, and no system or mission file", path.display());
        findings.push(Finding::of_file(Code::Unreadable, path, message).remedy(remedy));
        return (Source::new(path, ""), None);
    }
    if bytes.len() > MAX_FILE_BYTES {
        let head = String::from_utf8_lossy(&bytes[..256]).into_owned();
        let source = Source::new(path, head);
        let message = format!("the file has {} bytes; at most 1 MiB is read", bytes.len());
        findings.push(
            Finding::new(Code::TooLong, &Location::new(&source, Span::new(0, 0)), message)
                .remedy("split it: the mission may name its system by system=\"…\""),
        );
        return (source, None);
    }
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            // Up to the first bad byte the lossy text has the same offsets.
            let source = Source::new(path, String::from_utf8_lossy(bytes));
            let at = Span::new(error.valid_up_to(), error.valid_up_to() + '\u{fffd}'.len_utf8());
            let at = Location::new(&source, at);
            let finding = Finding::new(Code::NotUtf8, &at, "this byte is not UTF-8");
            findings.push(finding.remedy("save the file as UTF-8"));
            return (source, None);
        }
    };
    let source = Source::new(path, text);
    if let Some(marks) = conflict(&source) {
        findings.push(marks);
        return (source, None);
    }
    let tree = Builder::new(&source, findings).run();
    (source, tree)
}

/// The marks that git leaves at the start of lines where two versions contradict each other.
pub(crate) fn conflict(source: &Arc<Source>) -> Option<Finding> {
    let mark_of = |line: &str| {
        ["<<<<<<<", "=======", ">>>>>>>"].into_iter().find(|mark| line.starts_with(mark))
    };
    let mut marks = Vec::new();
    let mut start = 0;
    for line in source.text().split_inclusive('\n') {
        if let Some(mark) = mark_of(line) {
            marks.push(Location::new(source, Span::new(start, start + mark.len())));
        }
        start += line.len();
    }
    let ours = marks.iter().position(|at| at.text().starts_with('<'))?;
    marks.iter().skip(ours).find(|at| at.text().starts_with('>'))?;
    let message = "the file contains the marks of a merge conflict: <<<<<<<, ======= and >>>>>>>";
    let finding = Finding::new(Code::Malformed, &marks[ours], message)
        .remedy("keep the right lines between them, and remove the marks");
    let others = marks.iter().skip(ours + 1).take(2);
    Some(others.fold(finding, |finding, at| finding.related(at, "and here")))
}

/// The open elements, and the findings so far.
struct Builder<'a> {
    source: &'a Arc<Source>,
    findings: &'a mut Findings,
    open: Vec<Element>,
    before: Vec<Node>,
    root: Option<Element>,
    after: Vec<Node>,
    pieces: usize,
    /// Whether the tree still represents the file; if not, it is not returned.
    sound: bool,
}

impl<'a> Builder<'a> {
    fn new(source: &'a Arc<Source>, findings: &'a mut Findings) -> Self {
        Self {
            source,
            findings,
            open: Vec::new(),
            before: Vec::new(),
            root: None,
            after: Vec::new(),
            pieces: 0,
            sound: true,
        }
    }

    fn run(mut self) -> Option<Tree> {
        self.refuse_bad_characters();
        let text = self.source.text();
        let (mut reader, mut base) = read_from(text, 0);
        loop {
            let start = base + position(reader.buffer_position());
            if self.open.last().is_some_and(|top| top.name == "check")
                && let Some(len) = literal_less_len(&text[start..])
            {
                if !self.add_literal_less(Span::new(start, start + len)) {
                    return None;
                }
                (reader, base) = read_from(text, start + len);
                continue;
            }
            if let Some((len, value)) = find_open_quote(&text[start..]) {
                let value = Span::new(start + value.start, start + value.end);
                if !self.add_open_quote(Span::new(start, start + len), value) {
                    return None;
                }
                (reader, base) = read_from(text, start + len);
                continue;
            }
            let event = reader.read_event();
            let span = Span::new(start, base + position(reader.buffer_position()));
            match event {
                Ok(Event::Eof) => break,
                Ok(event) => {
                    if !self.handle_event(&event, span) {
                        return None;
                    }
                }
                Err(error) => {
                    let at = base + position(reader.error_position());
                    let at = Span::new(at, at.max(span.start() + 1));
                    let finding = self.finding(Code::Malformed, at, error.to_string());
                    self.report_malformed(
                        finding.remedy("close what is open, and write < as &lt;"),
                    );
                    return None;
                }
            }
        }
        self.end_of_file()
    }

    /// Counts a piece; false, with a finding, if there are too many.
    fn count_piece(&mut self, span: Span) -> bool {
        self.pieces += 1;
        if self.pieces > MAX_PIECES {
            let message =
                format!("the file has more than {MAX_PIECES} elements, texts and comments");
            let finding =
                self.finding(Code::TooMany, Span::new(span.start(), span.start() + 1), message);
            self.report_malformed(finding.remedy("this is the format's limit"));
            return false;
        }
        true
    }

    /// Takes one event; false if reading on makes no sense.
    fn handle_event(&mut self, event: &Event<'_>, span: Span) -> bool {
        if !self.count_piece(span) {
            return false;
        }
        match event {
            Event::Start(_) | Event::Empty(_) => {
                return self.start_element(matches!(event, Event::Empty(_)), span);
            }
            Event::End(_) => self.end_element(span),
            Event::Text(_) | Event::GeneralRef(_) => self.add_text(span),
            Event::CData(data) => self.push_text(data.to_string(), span),
            Event::Comment(_) => self.add_comment(span),
            Event::PI(_) => self.push_node(Node::Instruction(span)),
            Event::Decl(_) => self.check_declaration(span),
            Event::DocType(_) => {
                let at = Span::new(span.start(), span.end().min(span.start() + "<!DOCTYPE".len()));
                let finding =
                    self.finding(Code::Doctype, at, "a document type declaration is not allowed");
                self.report_malformed(
                    finding.remedy("remove it; robotfile/armor.xsd describes the format"),
                );
                return false;
            }
            Event::Eof => {}
        }
        true
    }

    /// Adds a tag in which the quotes of a value are not closed.
    fn add_open_quote(&mut self, tag: Span, value: Span) -> bool {
        if !self.count_piece(tag) {
            return false;
        }
        let at = Span::new(value.start() - 1, value.end());
        let message = "the quotes of this attribute's value are not closed";
        let finding = self.finding(Code::Malformed, at, message);
        let quote = &self.source.text()[at.start()..value.start()];
        self.report_malformed(
            finding.remedy(format!("write a second {quote} where the value ends")),
        );
        self.sound = false;
        let text = self.source.slice(tag);
        let element = TagReader::new(self.source, tag).read(&mut Findings::default()).element;
        self.open.push(element);
        if text.ends_with("/>") || self.open.len() >= MAX_DEPTH {
            self.close_element();
        }
        true
    }

    fn start_element(&mut self, empty: bool, span: Span) -> bool {
        let tag = TagReader::new(self.source, span).read(self.findings);
        let too_many = tag.too_many_attributes;
        let element = tag.element;
        self.sound &= tag.sound;
        if too_many {
            return false;
        }
        if self.open.len() >= MAX_DEPTH {
            let message = format!("elements are nested more than {MAX_DEPTH} deep here");
            let finding = self.finding(Code::TooDeep, element.name_span, message);
            self.report_malformed(
                finding.remedy("no Armor file needs this; is an end tag missing?"),
            );
            return false;
        }
        if self.open.is_empty() && self.root.is_some() {
            let finding = self.finding(Code::Malformed, element.name_span, "a second root element");
            self.report_malformed(finding.remedy("put everything into one <armor> element"));
            return false;
        }
        self.open.push(element);
        if empty {
            self.close_element();
        }
        true
    }

    fn end_element(&mut self, span: Span) {
        let text = self.source.slice(span);
        let name = text.trim_start_matches("</").trim_end_matches('>').trim_end().to_owned();
        match self.open.iter().rposition(|element| element.name == name) {
            None if self.is_misspelt(&name) => self.close_misspelt(&name, span),
            None => {
                let message = format!("</{name}> closes nothing");
                let finding = self.finding(Code::EndTag, span, message);
                self.report_malformed(
                    finding.remedy("remove it, or write the start tag that it belongs to"),
                );
                self.sound = false;
            }
            Some(at) => {
                while self.open.len() > at + 1 {
                    self.report_unclosed();
                    self.close_element();
                }
                if let Some(top) = self.open.last_mut() {
                    top.span = Span::new(top.span.start(), span.end());
                }
                self.close_element();
            }
        }
    }

    /// Whether the end tag means the element that is open.
    fn is_misspelt(&self, name: &str) -> bool {
        self.open.last().is_some_and(|top| are_one_name(&top.name, name))
    }

    fn close_misspelt(&mut self, name: &str, span: Span) {
        let Some(top) = self.open.last_mut() else { return };
        top.span = Span::new(top.span.start(), span.end());
        let (message, remedy) = (
            format!("</{name}> does not close <{}>", top.name),
            format!("did you mean </{}>?", top.name),
        );
        let start = Location::new(self.source, top.name_span);
        let finding = self.finding(Code::EndTag, span, message).remedy(remedy);
        self.report_malformed(finding.related(&start, "opened here"));
        self.sound = false;
        self.close_element();
    }

    fn report_unclosed(&mut self) {
        let Some(top) = self.open.last() else { return };
        let message = format!("<{}> is not closed", top.name);
        let remedy = format!("write </{}> where it ends, or /> if it is empty", top.name);
        let finding = self.finding(Code::EndTag, top.name_span, message);
        self.report_malformed(finding.remedy(remedy));
        self.sound = false;
    }

    fn close_element(&mut self) {
        let Some(element) = self.open.pop() else { return };
        match self.open.last_mut() {
            Some(parent) => parent.children.push(Node::Element(element)),
            None => self.root = Some(element),
        }
    }

    fn add_text(&mut self, span: Span) {
        let at = Location::new(self.source, span);
        let text = unescape(&at, self.findings);
        self.push_text(text, span);
        if let Some(end) = at.text().find("]]>") {
            let at = Span::new(span.start() + end, span.start() + end + 3);
            let finding = self.finding(Code::Malformed, at, "]]> is not allowed in text");
            self.report_malformed(finding.remedy("write it as ]]&gt;"));
        }
    }

    /// Takes the text of a check that begins with a `<` which compares; false if reading on makes no
    /// sense.
    fn add_literal_less(&mut self, span: Span) -> bool {
        if !self.count_piece(span) {
            return false;
        }
        let at = Span::new(span.start(), span.start() + 1);
        let finding = self.finding(Code::Malformed, at, "< is not allowed in text");
        self.report_malformed(finding.remedy("write it as &lt;"));
        self.sound = false;
        self.add_text(span);
        true
    }

    fn push_text(&mut self, text: String, span: Span) {
        if self.open.is_empty() && !text.trim().is_empty() {
            let finding = self.finding(Code::Malformed, span, "text outside the root element");
            self.report_malformed(finding.remedy("remove it, or make it a comment"));
        }
        self.push_node(Node::Text(text, span));
    }

    fn add_comment(&mut self, span: Span) {
        let text = self.source.slice(span);
        let inner = text.trim_start_matches("<!").trim_end_matches('>');
        let inner = inner.get(2..inner.len().saturating_sub(2)).unwrap_or_default();
        if inner.contains("--") || inner.ends_with('-') {
            let finding = self.finding(Code::Malformed, span, "-- is not allowed in a comment");
            self.report_malformed(finding.remedy("use a single dash"));
        }
        self.push_node(Node::Comment(span));
    }

    fn check_declaration(&mut self, span: Span) {
        if span.start() > '\u{feff}'.len_utf8() || self.root.is_some() || !self.open.is_empty() {
            let finding =
                self.finding(Code::Malformed, span, "the XML declaration is not at the start");
            self.report_malformed(finding.remedy("put it on the first line, or remove it"));
        }
        self.push_node(Node::Instruction(span));
        let tag = TagReader::declaration(self.source, span).read(self.findings);
        self.sound &= tag.sound;
        let given: Vec<_> =
            tag.element.attributes.iter().map(|a| (a.name.as_str(), a.value.as_str())).collect();
        let (version, rest) = given.split_first().unwrap_or((&("", ""), &[]));
        let (encoding, rest) = match rest {
            [("encoding", encoding), rest @ ..] => (*encoding, rest),
            rest => ("UTF-8", rest),
        };
        let standalone = matches!(rest, [] | [("standalone", "yes" | "no")]);
        if !matches!(version, ("version", "1.0" | "1.1")) || !standalone {
            let finding = self.finding(Code::Malformed, span, "this is not an XML declaration");
            self.report_malformed(
                finding.remedy("write <?xml version=\"1.0\" encoding=\"UTF-8\"?>, or remove it"),
            );
        }
        if !encoding.eq_ignore_ascii_case("utf-8") {
            let finding =
                self.finding(Code::NotUtf8, span, "an encoding other than UTF-8 is declared");
            self.report_malformed(
                finding.remedy("save the file as UTF-8 and write encoding=\"UTF-8\""),
            );
        }
    }

    fn push_node(&mut self, node: Node) {
        match self.open.last_mut() {
            Some(top) => top.children.push(node),
            None if self.root.is_none() => self.before.push(node),
            None => self.after.push(node),
        }
    }

    fn end_of_file(mut self) -> Option<Tree> {
        while !self.open.is_empty() {
            self.report_unclosed();
            self.close_element();
        }
        if self.root.is_none() {
            let finding = self.finding(Code::Malformed, Span::new(0, 0), "there is no element");
            self.report_malformed(
                finding.remedy("an Armor file starts with <armor version=\"1\">"),
            );
        }
        let root = self.root.filter(|_| self.sound)?;
        Some(Tree::new(Arc::clone(self.source), self.before, root, self.after))
    }

    fn refuse_bad_characters(&mut self) {
        let bad =
            |c: char| (c < ' ' && !"\t\n\r".contains(c)) || matches!(c, '\u{fffe}' | '\u{ffff}');
        let source = Arc::clone(self.source);
        for (at, c) in source.text().char_indices().filter(|(_, c)| bad(*c)) {
            if self.findings.is_full() {
                return;
            }
            let message = format!("the character U+{:04X} is not allowed in XML", u32::from(c));
            let finding =
                self.finding(Code::BadCharacter, Span::new(at, at + c.len_utf8()), message);
            self.report_malformed(finding.remedy("remove it"));
        }
    }

    fn finding(&self, code: Code, span: Span, message: impl Into<String>) -> Finding {
        Finding::new(code, &Location::new(self.source, span), message)
    }

    fn report_malformed(&mut self, finding: Finding) {
        self.findings.push(finding);
    }
}

/// A reader that leaves end tags and `&` to the builder.
fn tolerant_reader(text: &str) -> Reader<&[u8]> {
    let mut reader = Reader::from_str(text);
    let config = reader.config_mut();
    config.check_end_names = false;
    config.allow_unmatched_ends = true;
    config.allow_dangling_amp = true;
    reader
}

/// A reader of the text from `at` on, and where in the text it counts from: it passes over a byte order
/// mark itself, and counts from behind it.
fn read_from(text: &str, at: usize) -> (Reader<&[u8]>, usize) {
    let rest = &text[at..];
    let mark = if rest.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    (tolerant_reader(rest), at + mark)
}

/// Positions fit `usize` because the text is in memory.
fn position(at: u64) -> usize {
    usize::try_from(at).unwrap_or(usize::MAX)
}
