//! The example files that are mutated, and what their elements and attributes are.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use armor_robotfile::Span;
use armor_robotfile::tree::{Attribute, Element};
use armor_robotfile::{Colours, parse_tree};

/// The examples that a simulator plays to the end without a person and without recorded data.
const NAMES: [&str; 9] = [
    "appointment.xml",
    "dock.xml",
    "explore-and-map.xml",
    "meeting.xml",
    "office-fast.xml",
    "office.xml",
    "patrol.xml",
    "rounds.xml",
    "survey.xml",
];

/// What the value of an attribute stands for. A value may be replaced by another one of its sort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ValueSort {
    /// The name that an element gives itself.
    OwnName,
    /// `component.output`.
    Output,
    /// `component.input`.
    Input,
    /// A place, or several.
    Place,
    /// A component, or several.
    Component,
    /// `component.event`.
    Report,
    /// A variable.
    Variable,
    /// A kind of component.
    Kind,
    /// Any other value; only values of the same attribute of the same element can stand for it.
    Other,
}

/// An attribute of an example.
#[derive(Clone, Debug)]
pub struct KnownAttribute {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
    /// What its value stands for.
    pub sort: ValueSort,
    /// From the first letter of its name to the closing quote.
    pub span: Span,
    /// Its value without the quotes.
    pub value_span: Span,
}

/// An element of an example.
#[derive(Clone, Debug)]
pub struct KnownElement {
    /// Its name.
    pub name: String,
    /// The number of its parent in [`Example::elements`]; the outermost element has none.
    pub parent: Option<usize>,
    /// Its attributes in the order of the file.
    pub attributes: Vec<KnownAttribute>,
    /// From `<` of the start tag to `>` of the end tag.
    pub span: Span,
    /// From `<` to `>` of the start tag.
    pub tag_span: Span,
    /// Its text, if it has one and contains no element.
    pub text_span: Option<Span>,
}

/// An example file.
#[derive(Clone, Debug)]
pub struct Example {
    /// Its path.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// All its elements in the order of the file, the outermost one first.
    pub elements: Vec<KnownElement>,
}

impl Example {
    /// Reads the examples in the folder `missions`.
    ///
    /// # Errors
    /// If one of them cannot be read or is not XML.
    pub fn read_all(missions: &Path) -> Result<Vec<Self>> {
        NAMES.iter().map(|name| Self::read(&missions.join(name))).collect()
    }

    fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        Self::parse(path, text)
    }

    /// Parses `text` as the file at `path`.
    ///
    /// # Errors
    /// If it is not XML.
    pub fn parse(path: &Path, text: String) -> Result<Self> {
        let tree = parse_tree(path, text.as_bytes())
            .map_err(|findings| anyhow!("{}", findings.render(Colours::No)))?;
        let mut elements = Vec::new();
        list_elements(tree.root(), None, &mut elements);
        Ok(Self { path: path.to_path_buf(), text, elements })
    }

    /// Its name without its folder.
    pub fn file_name(&self) -> &str {
        self.path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
    }

    /// The text of a piece.
    pub fn piece(&self, span: Span) -> &str {
        &self.text[span.start()..span.end()]
    }

    /// The start tag of an element, on one line.
    pub fn tag_line(&self, element: usize) -> String {
        let tag = self.piece(self.elements[element].tag_span);
        tag.split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

fn list_elements(element: &Element, parent: Option<usize>, into: &mut Vec<KnownElement>) {
    let number = into.len();
    into.push(KnownElement {
        name: element.name.clone(),
        parent,
        attributes: element.attributes.iter().map(|it| know_attribute(element, it)).collect(),
        span: element.span,
        tag_span: element.tag_span,
        text_span: element.text().1.filter(|_| element.elements().next().is_none()),
    });
    for child in element.elements() {
        list_elements(child, Some(number), into);
    }
}

fn know_attribute(element: &Element, attribute: &Attribute) -> KnownAttribute {
    KnownAttribute {
        name: attribute.name.clone(),
        value: attribute.value.clone(),
        sort: sort_of(&element.name, &attribute.name),
        span: attribute.span(),
        value_span: attribute.value_span,
    }
}

fn sort_of(element: &str, attribute: &str) -> ValueSort {
    match (element, attribute) {
        ("parameter", "component") | (_, "components") => ValueSort::Component,
        (_, "name") => ValueSort::OwnName,
        ("link", "from") | ("clock", "source") => ValueSort::Output,
        ("link", "to") => ValueSort::Input,
        ("transition", "from" | "to")
        | ("mission", "goal" | "safe")
        | ("submission", "in" | "out") => ValueSort::Place,
        ("transition", "on") => ValueSort::Report,
        ("set", "variable") => ValueSort::Variable,
        ("component", "kind") => ValueSort::Kind,
        _ => ValueSort::Other,
    }
}
