//! The tree of one XML file, every piece with its span. The source text is kept, so that saving an
//! unchanged file gives the same bytes, and an edit is a change of a span's text.

use std::sync::Arc;

use crate::source::{Location, Source, Span};

/// A file as a tree.
#[derive(Clone, Debug)]
pub struct Tree {
    source: Arc<Source>,
    before: Vec<Node>,
    root: Element,
    after: Vec<Node>,
}

impl Tree {
    pub(crate) fn new(
        source: Arc<Source>,
        before: Vec<Node>,
        root: Element,
        after: Vec<Node>,
    ) -> Self {
        Self { source, before, root, after }
    }

    /// The text the tree was read from.
    pub fn source(&self) -> &Arc<Source> {
        &self.source
    }

    /// The outermost element.
    pub fn root(&self) -> &Element {
        &self.root
    }

    /// The nodes before the outermost element; an XML declaration counts as an instruction.
    pub fn before(&self) -> &[Node] {
        &self.before
    }

    /// The nodes after the outermost element.
    pub fn after(&self) -> &[Node] {
        &self.after
    }

    /// The element at a path: at each level, its number among its parent's elements, from 0. The
    /// empty path is the outermost element.
    pub fn element(&self, path: &[usize]) -> Option<&Element> {
        path.iter().try_fold(&self.root, |element, n| element.elements().nth(*n))
    }

    /// The file's bytes, the same as were read.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.source.text().as_bytes().to_vec()
    }
}

/// `<name attribute="value">children</name>`.
#[derive(Clone, Debug)]
pub struct Element {
    /// The name, with its prefix if it has one.
    pub name: String,
    /// The span of the name in the start tag.
    pub name_span: Span,
    /// From `<` of the start tag to `>` of the end tag.
    pub span: Span,
    /// From `<` to `>` of the start tag; all of [`Self::span`] if the element is `<name/>`.
    pub tag_span: Span,
    /// The attributes in the order of the file.
    pub attributes: Vec<Attribute>,
    /// The nodes between the tags.
    pub children: Vec<Node>,
}

impl Element {
    /// The elements among the children.
    pub fn elements(&self) -> impl Iterator<Item = &Element> {
        self.children.iter().filter_map(|node| match node {
            Node::Element(element) => Some(element),
            _ => None,
        })
    }

    /// The attribute called `name`.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    /// All text directly in the element, joined and without the white space around it, and the
    /// span from its first to its last piece.
    pub fn text(&self) -> (String, Option<Span>) {
        let mut whole = String::new();
        let mut span: Option<Span> = None;
        for node in &self.children {
            if let Node::Text(text, at) = node {
                whole.push_str(text);
                let start = span.map_or(at.start(), Span::start);
                span = Some(Span::new(start, at.end()));
            }
        }
        (whole.trim().to_owned(), span)
    }

    /// Returns whether it has an end tag, so that it may have contents.
    pub fn is_open(&self) -> bool {
        self.span != self.tag_span
    }

    pub(crate) fn at(&self, source: &Arc<Source>) -> Location {
        Location::new(source, self.name_span)
    }
}

/// `name="value"`.
#[derive(Clone, Debug)]
pub struct Attribute {
    /// The name, with its prefix if it has one.
    pub name: String,
    /// The value, with references replaced and white space normalised.
    pub value: String,
    /// The span of the name.
    pub name_span: Span,
    /// The span of the value, without the quotes.
    pub value_span: Span,
}

impl Attribute {
    /// From the first letter of the name to the closing quote.
    pub fn span(&self) -> Span {
        Span::new(self.name_span.start(), self.value_span.end() + 1)
    }
}

/// A node of an element.
#[derive(Clone, Debug)]
pub enum Node {
    /// An element.
    Element(Element),
    /// Text, with references replaced.
    Text(String, Span),
    /// A comment, with its `<!--` and `-->`.
    Comment(Span),
    /// A processing instruction, with its `<?` and `?>`.
    Instruction(Span),
}

impl Node {
    /// Returns its whole span.
    pub fn span(&self) -> Span {
        match self {
            Self::Element(element) => element.span,
            Self::Text(_, span) | Self::Comment(span) | Self::Instruction(span) => *span,
        }
    }
}
