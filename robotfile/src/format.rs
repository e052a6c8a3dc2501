//! The one layout of a file: an element per line, two spaces deeper per level, at most one blank
//! line in a row. Only white space that means nothing changes; values, texts and comments stay as
//! they are written, and a comment stays on the line of its element.

use std::path::Path;

use crate::code::Code;
use crate::edit::{line_break, quote};
use crate::finding::Finding;
use crate::findings::Findings;
use crate::tree::{Attribute, Element, Node, Tree};
use crate::xml::parse_tree;

/// A start tag that would be longer has each of its attributes on a line, below the first.
const MAX_COLUMNS: usize = 100;
/// The indentation of one level.
const INDENT: &str = "  ";

/// Formats the bytes of the file called `path`. The result has the same meaning, and formatted
/// again it stays as it is. Line breaks are all as the first one.
///
/// # Errors
/// The findings, if it is no XML or breaks a limit, or is not Armor's: then white space may mean
/// something. Other errors of the file do not matter here.
pub fn format(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, Findings> {
    let tree = parse_tree(path, bytes)?;
    if tree.root().name != "armor" {
        let message = format!("the root element is <{}>", tree.root().name);
        let finding = Finding::new(Code::WrongRoot, &tree.root().at(tree.source()), message);
        let mut findings = Findings::default();
        findings.push(finding.remedy("only Armor files are formatted"));
        return Err(findings);
    }
    let formatted = format_tree(&tree);
    // A file just within the limits may be beyond them with its line breaks.
    parse_tree(path, formatted.as_bytes())?;
    Ok(formatted.into_bytes())
}

fn format_tree(tree: &Tree) -> String {
    let text = tree.source().text();
    let mut page = FormattedText { text, out: String::with_capacity(text.len() + text.len() / 4) };
    let mut line = LineState::default();
    for node in tree.before() {
        page.write_node(node, 0, &mut line);
    }
    page.start_line(0, &mut line);
    page.write_element(tree.root(), 0, false);
    for node in tree.after() {
        page.write_node(node, 0, &mut line);
    }
    let mark = if text.starts_with('\u{feff}') { "\u{feff}" } else { "" };
    let lines = page.out.replace("\r\n", "\n").replace('\r', "\n");
    let lines = lines.replace('\n', line_break(text));
    format!("{mark}{lines}{}", line_break(text))
}

/// The white space since the last piece.
#[derive(Default)]
struct LineState {
    /// Whether a sibling precedes it.
    follows: bool,
    /// The line breaks in it.
    breaks: usize,
}

struct FormattedText<'a> {
    text: &'a str,
    out: String,
}

impl<'a> FormattedText<'a> {
    /// Writes a piece among its siblings, none of which is text.
    fn write_node(&mut self, node: &Node, depth: usize, line: &mut LineState) {
        match node {
            Node::Text(..) => line.breaks += self.source_text(node).matches('\n').count(),
            Node::Element(element) => {
                self.start_line(depth, line);
                self.write_element(element, depth, false);
            }
            Node::Comment(_) | Node::Instruction(_) => {
                if line.breaks == 0 && !self.out.is_empty() {
                    self.out.push(' ');
                    line.follows = true;
                } else {
                    self.start_line(depth, line);
                }
                self.out += self.source_text(node);
            }
        }
    }

    /// Starts a line, after a blank one if there was one among the siblings.
    fn start_line(&mut self, depth: usize, line: &mut LineState) {
        if !self.out.is_empty() {
            self.out += if line.follows && line.breaks > 1 { "\n\n" } else { "\n" };
        }
        self.out += &INDENT.repeat(depth);
        *line = LineState { follows: true, breaks: 0 };
    }

    fn write_element(&mut self, element: &Element, depth: usize, in_mission: bool) {
        let in_line = element.children.iter().any(|node| self.is_text(node))
            || element.attribute("xml:space").is_some_and(|space| space.value == "preserve");
        let empty = !in_line && element.children.iter().all(|n| matches!(n, Node::Text(..)));
        self.start_tag(element, depth, if empty { "/>" } else { ">" });
        if empty {
            return;
        }
        if in_line {
            let inner = self.inner_text(element);
            let is_check = in_mission
                && element.name == "check"
                && element.children.iter().all(|node| matches!(node, Node::Text(..)));
            self.out += if is_check { inner.trim_ascii() } else { inner };
        } else {
            let mut line = LineState::default();
            for node in &element.children {
                match node {
                    Node::Element(child) => {
                        self.start_line(depth + 1, &mut line);
                        self.write_element(
                            child,
                            depth + 1,
                            depth == 1 && element.name == "mission",
                        );
                    }
                    node => self.write_node(node, depth + 1, &mut line),
                }
            }
            self.start_line(depth, &mut LineState::default());
        }
        self.out += &format!("</{}>", element.name);
    }

    /// The start tag, on one line or with an attribute per line.
    fn start_tag(&mut self, element: &Element, depth: usize, end: &str) {
        let attributes: Vec<_> =
            element.attributes.iter().map(|a| self.write_attribute(a)).collect();
        let head = format!("<{}", element.name);
        // A value may contain a line break, which is one character in any spelling.
        let columns = |written: &String| written.chars().filter(|c| *c != '\r').count();
        let widths = attributes.iter().map(|written| columns(written) + 1);
        let width = INDENT.len() * depth + head.chars().count() + widths.sum::<usize>() + end.len();
        let space = if width > MAX_COLUMNS {
            format!("\n{}", " ".repeat(INDENT.len() * depth + head.chars().count() + 1))
        } else {
            " ".to_owned()
        };
        self.out += &head;
        for (n, attribute) in attributes.iter().enumerate() {
            self.out += if n == 0 { " " } else { &space };
            self.out += attribute;
        }
        self.out += end;
    }

    fn write_attribute(&self, attribute: &Attribute) -> String {
        let (quote, value) = (quote(self.text, attribute), attribute.value_span);
        format!("{}={quote}{}{quote}", attribute.name, &self.text[value.start()..value.end()])
    }

    /// Returns the text between the tags.
    fn inner_text(&self, element: &Element) -> &'a str {
        let inner = &self.text[element.tag_span.end()..element.span.end()];
        &inner[..inner.rfind("</").unwrap_or(0)]
    }

    /// Whether a node is text that may mean something: not plain white space.
    fn is_text(&self, node: &Node) -> bool {
        matches!(node, Node::Text(..)) && !self.source_text(node).trim_ascii().is_empty()
    }

    fn source_text(&self, node: &Node) -> &'a str {
        &self.text[node.span().start()..node.span().end()]
    }
}
