//! An element that is not in the file yet, and how it is written there.

use crate::edit::error::EditError;
use crate::edit::placement::Placement;
use crate::start_tag::is_xml_name;

/// An element to be put into a file.
///
/// ```
/// use armor_robotfile::NewElement;
///
/// let component = NewElement::new("component")
///     .attribute("name", "laser")
///     .attribute("kind", "simulator")
///     .child(NewElement::new("parameter").attribute("name", "world").attribute("value", "a.svg"));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NewElement {
    name: String,
    attributes: Vec<(String, String)>,
    children: Vec<NewElement>,
    text: String,
    comments: Vec<String>,
}

impl NewElement {
    /// An element with this name and nothing in it.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Adds an attribute, behind those it has.
    #[must_use]
    pub fn attribute(mut self, name: impl Into<String>, value: impl Into<String>) -> Self {
        self.attributes.push((name.into(), value.into()));
        self
    }

    /// Adds an element in it, behind those it has.
    #[must_use]
    pub fn child(mut self, child: NewElement) -> Self {
        self.children.push(child);
        self
    }

    /// Gives it a text; white space around it is not kept.
    #[must_use]
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.text = text.into();
        self
    }

    /// Adds a comment above it, below those it has. What XML does not allow in a comment is replaced:
    /// control characters and line breaks by a space, two hyphens by `- -`.
    #[must_use]
    pub fn comment(mut self, text: &str) -> Self {
        self.comments.push(clean_comment(text));
        self
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The element as it is written at a place, without the indentation of its first line.
    pub(crate) fn render(&self, place: &Placement) -> Result<String, EditError> {
        let mut out = String::new();
        self.write(place, &place.indent, &mut out)?;
        Ok(out)
    }

    fn write(&self, place: &Placement, indent: &str, out: &mut String) -> Result<(), EditError> {
        let names = std::iter::once(&self.name).chain(self.attributes.iter().map(|(name, _)| name));
        for name in names {
            if !is_xml_name(name) {
                return Err(EditError::BadXmlName { name: name.clone() });
            }
        }
        for comment in &self.comments {
            *out += &format!("<!-- {comment} -->{}", place.line(indent));
        }
        *out += &format!("<{}", self.name);
        for (name, value) in &self.attributes {
            *out += &format!(" {name}=\"{}\"", escape_value(value, '"'));
        }
        let text = self.text.trim();
        if text.is_empty() && self.children.is_empty() {
            *out += "/>";
            return Ok(());
        }
        *out += &format!(">{}", escape_text(text));
        let inner = format!("{indent}{}", place.unit);
        for child in &self.children {
            *out += &place.line(&inner);
            child.write(place, &inner, out)?;
        }
        if !self.children.is_empty() {
            *out += &place.line(indent);
        }
        *out += &format!("</{}>", self.name);
        Ok(())
    }
}

fn clean_comment(text: &str) -> String {
    let is_allowed = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    let mut cleaned = String::with_capacity(text.len());
    for c in text.trim().chars() {
        if c == '-' && cleaned.ends_with('-') {
            cleaned.push(' ');
        }
        cleaned.push(if is_allowed(c) { c } else { ' ' });
    }
    cleaned
}

/// A value as it is written between quotes of this kind, so that reading it gives the value again.
pub(crate) fn escape_value(value: &str, quote: char) -> String {
    let mut out = String::with_capacity(value.len());
    for c in value.chars() {
        match c {
            '"' if quote == '"' => out += "&quot;",
            '\'' if quote == '\'' => out += "&apos;",
            c => push_escaped(c, &mut out),
        }
    }
    out
}

/// A text as it is written between tags, so that reading it gives the text again.
pub(crate) fn escape_text(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '>' if out.ends_with("]]") => out += "&gt;",
            c => push_escaped(c, &mut out),
        }
    }
    out
}

/// Line breaks and tabs are written as references because readers make spaces of them.
fn push_escaped(c: char, out: &mut String) {
    match c {
        '&' => *out += "&amp;",
        '<' => *out += "&lt;",
        '\n' => *out += "&#10;",
        '\r' => *out += "&#13;",
        '\t' => *out += "&#9;",
        c => out.push(c),
    }
}
