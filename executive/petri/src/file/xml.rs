//! Parses XML into a small tree of elements with their offsets. Drops namespace prefixes and
//! elements that are not needed (drawings, other tools' data), and enforces limits that quick-xml
//! lacks.

use super::numeral::shorten;
use super::{FileError, NetFault, fault_at};
use quick_xml::XmlVersion;
use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesRef, BytesStart, Event};
use quick_xml::reader::Reader;

/// Deepest nesting; three levels of pages need twenty.
const MAX_DEPTH: usize = 64;
/// Most elements: a million arcs with their inscriptions.
const MAX_ELEMENTS: usize = 4_000_000;
/// Most attributes of one element.
const MAX_ATTRIBUTES: usize = 64;

/// `<name attribute="value">text, elements</name>`.
#[derive(Debug, Default)]
pub(super) struct XmlElement {
    /// Without its prefix.
    pub name: String,
    pub attributes: Vec<(String, String)>,
    /// All text directly in it.
    pub text: String,
    pub children: Vec<XmlElement>,
    /// Offset of its `<`.
    pub at: usize,
}

impl XmlElement {
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    pub fn child(&self, name: &str) -> Option<&XmlElement> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns the text of a PNML label: in `<text>`, or in `<value>` as older files have it.
    pub fn label(&self) -> &str {
        let inner = self.child("text").or_else(|| self.child("value"));
        inner.unwrap_or(self).text.trim()
    }
}

/// Parses the text and returns the root element. `unread` selects elements to drop with their
/// content.
pub(super) fn parse(
    text: &str,
    unread: impl Fn(&XmlElement) -> bool,
) -> Result<XmlElement, FileError> {
    let mut reader = Reader::from_str(text);
    let mut open: Vec<XmlElement> = Vec::new();
    let mut root = None;
    let mut left_out = 0usize;
    let mut elements = 0usize;
    loop {
        let at = byte_offset(reader.buffer_position());
        let fail = |fault| fault_at(text, at, fault);
        let event = reader.read_event().map_err(|error| {
            let at = byte_offset(reader.error_position());
            fault_at(text, at, NetFault::Xml(error.to_string()))
        })?;
        match event {
            Event::Eof => break,
            Event::DocType(_) => {
                return Err(fail(NetFault::Limit(
                    "a document type declaration is not read; remove it",
                )));
            }
            Event::Start(_) if left_out > 0 => {
                left_out += 1;
                if left_out > MAX_DEPTH {
                    return Err(fail(NetFault::Limit(
                        "elements are nested more than 64 deep here",
                    )));
                }
            }
            Event::End(_) if left_out > 0 => left_out -= 1,
            Event::Start(start) => {
                let element = read_element(&start, at).map_err(fail)?;
                elements += 1;
                if open.len() >= MAX_DEPTH {
                    return Err(fail(NetFault::Limit(
                        "elements are nested more than 64 deep here",
                    )));
                }
                if elements > MAX_ELEMENTS {
                    return Err(fail(NetFault::Limit("the file has more than 4,000,000 elements")));
                }
                if unread(&element) {
                    left_out = 1;
                } else {
                    open.push(element);
                }
            }
            Event::Empty(start) if left_out == 0 => {
                elements += 1;
                if elements > MAX_ELEMENTS {
                    return Err(fail(NetFault::Limit("the file has more than 4,000,000 elements")));
                }
                let element = read_element(&start, at).map_err(fail)?;
                if !unread(&element) {
                    close_element(element, &mut open, &mut root).map_err(fail)?;
                }
            }
            Event::End(_) => {
                let element = open
                    .pop()
                    .ok_or_else(|| fail(NetFault::Xml("an end tag closes nothing".into())))?;
                close_element(element, &mut open, &mut root).map_err(fail)?;
            }
            Event::Text(piece) if left_out == 0 => {
                push_text(&mut open, &piece.xml10_content());
            }
            Event::CData(piece) if left_out == 0 => push_text(&mut open, &piece.xml10_content()),
            Event::GeneralRef(reference) if left_out == 0 => {
                push_text(&mut open, &resolve_entity(&reference).map_err(fail)?);
            }
            _ => {}
        }
    }
    let end = |what: &str| fault_at(text, text.len(), NetFault::Xml(what.into()));
    if !open.is_empty() || left_out > 0 {
        return Err(end("the file ends within an element"));
    }
    root.ok_or_else(|| end("there is no element"))
}

fn close_element(
    element: XmlElement,
    open: &mut [XmlElement],
    root: &mut Option<XmlElement>,
) -> Result<(), NetFault> {
    match open.last_mut() {
        Some(parent) => parent.children.push(element),
        None if root.is_some() => return Err(NetFault::Xml("a second root element".into())),
        None => *root = Some(element),
    }
    Ok(())
}

fn push_text(open: &mut [XmlElement], text: &str) {
    if let Some(top) = open.last_mut() {
        top.text.push_str(text);
    }
}

fn read_element(start: &BytesStart<'_>, at: usize) -> Result<XmlElement, NetFault> {
    let local = |name: &str| name.rsplit(':').next().unwrap_or(name).to_owned();
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| NetFault::Xml(error.to_string()))?;
        if attributes.len() == MAX_ATTRIBUTES {
            return Err(NetFault::Limit("an element has more than 64 attributes here"));
        }
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|error| NetFault::Xml(error.to_string()))?;
        attributes.push((local(attribute.key.as_ref()), value.into_owned()));
    }
    let name = local(start.name().as_ref());
    Ok(XmlElement { name, attributes, at, ..XmlElement::default() })
}

fn resolve_entity(reference: &BytesRef<'_>) -> Result<String, NetFault> {
    let unknown =
        || NetFault::Xml(format!("unknown entity &{};", shorten(&reference.xml10_content())));
    if reference.is_char_ref() {
        let character = reference.resolve_char_ref().map_err(|_| unknown())?;
        return character.map(String::from).ok_or_else(unknown);
    }
    resolve_predefined_entity(&reference.xml10_content()).map(str::to_owned).ok_or_else(unknown)
}

/// Positions fit `usize` because the text is in memory.
fn byte_offset(at: u64) -> usize {
    usize::try_from(at).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_has_names_texts_and_offsets() {
        let root =
            parse("<a>\n <n:b x='1&amp;2'>t&#65;<![CDATA[<]]></n:b><skip><b/></skip></a>", |e| {
                e.name == "skip"
            });
        let root = root.unwrap();
        assert_eq!(root.children.len(), 1);
        let b = &root.children[0];
        assert_eq!((b.name.as_str(), b.text.as_str(), b.at), ("b", "tA<", 5));
        assert_eq!(b.attribute("x"), Some("1&2"));
    }

    #[test]
    fn malformed_xml_is_refused() {
        let fails = |text: &str| parse(text, |_| false).unwrap_err().fault;
        for text in ["", "<a>", "<a></b>", "<a/><b/>", "<a>&x;</a>", "<a x=1/>", "<a x='1' x='2'/>"]
        {
            assert!(matches!(fails(text), NetFault::Xml(_)), "{text}");
        }
        assert!(matches!(fails("<!DOCTYPE a><a/>"), NetFault::Limit(_)));
        assert!(matches!(fails(&"<a>".repeat(65)), NetFault::Limit(_)));
    }
}
