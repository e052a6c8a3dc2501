//! XML as a tree, for GPX and KML: local names, attributes and text; bounded in depth and size.

use quick_xml::events::Event;
use quick_xml::{Reader, XmlVersion};

use crate::error::{MOST_POSITIONS, PlanReadError};

/// How deep elements may be nested: KML's folders are the deepest.
const MOST_DEPTH: usize = 64;
/// A position needs some elements: name, altitude, time and extensions.
const MOST_ELEMENTS: usize = 8 * MOST_POSITIONS;

/// One element.
#[derive(Debug, Default)]
pub(crate) struct XmlElement {
    /// Its name without a prefix.
    pub name: String,
    attributes: Vec<(String, String)>,
    pub children: Vec<XmlElement>,
    /// The text directly in it.
    pub text: String,
}

impl XmlElement {
    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(of, _)| of == name).map(|(_, value)| value.as_str())
    }

    pub(crate) fn child(&self, name: &str) -> Option<&XmlElement> {
        self.children.iter().find(|child| child.name == name)
    }

    /// The text of a child, without space around it; nothing if it is empty.
    pub(crate) fn text_of(&self, name: &str) -> Option<&str> {
        self.child(name).map(|child| child.text.trim()).filter(|text| !text.is_empty())
    }
}

/// Reads a document into its root element.
pub(crate) fn read_xml(text: &str, format: &'static str) -> Result<XmlElement, PlanReadError> {
    let syntax = |reason: String| PlanReadError::Syntax { format, reason };
    let mut reader = Reader::from_str(text);
    // The bottom contains the root; each open element lies above its parent.
    let mut open = vec![XmlElement::default()];
    let mut count = 0;
    loop {
        let position = reader.buffer_position();
        let event =
            reader.read_event().map_err(|error| syntax(format!("byte {position}: {error}")))?;
        match event {
            Event::Start(start) => {
                count += 1;
                if open.len() > MOST_DEPTH {
                    return Err(syntax(format!(
                        "more than {MOST_DEPTH} elements within each other"
                    )));
                }
                open.push(element_of(&start).map_err(syntax)?);
            }
            Event::Empty(start) => {
                count += 1;
                let element = element_of(&start).map_err(syntax)?;
                if let Some(parent) = open.last_mut() {
                    parent.children.push(element);
                }
            }
            Event::End(_) => {
                if let (Some(element), Some(parent)) = (open.pop(), open.last_mut()) {
                    parent.children.push(element);
                }
            }
            Event::Text(content) => add_text(&mut open, &content.xml10_content()),
            Event::CData(content) => add_text(&mut open, &content.xml10_content()),
            Event::GeneralRef(reference) => {
                let name: &str = &reference;
                let character = match reference.resolve_char_ref() {
                    Ok(Some(character)) => Some(character.to_string()),
                    _ => quick_xml::escape::resolve_predefined_entity(name).map(str::to_owned),
                };
                let character =
                    character.ok_or_else(|| syntax(format!("the entity &{name}; is not read")))?;
                add_text(&mut open, &character);
            }
            Event::Eof => break,
            _ => {}
        }
        if count > MOST_ELEMENTS {
            return Err(PlanReadError::TooMany { most: MOST_ELEMENTS });
        }
    }
    if open.len() > 1 {
        let name = open.pop().map(|element| element.name).unwrap_or_default();
        return Err(syntax(format!("the element <{name}> does not end")));
    }
    open.pop()
        .and_then(|mut bottom| bottom.children.pop())
        .ok_or_else(|| syntax("there is no element".to_owned()))
}

fn add_text(open: &mut [XmlElement], content: &str) {
    if let Some(element) = open.last_mut() {
        element.text.push_str(content);
    }
}

fn element_of(start: &quick_xml::events::BytesStart<'_>) -> Result<XmlElement, String> {
    let name = start.local_name().into_inner().to_owned();
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| error.to_string())?;
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|error| error.to_string())?;
        let name = attribute.key.local_name().into_inner().to_owned();
        attributes.push((name, value.into_owned()));
    }
    Ok(XmlElement { name, attributes, children: Vec::new(), text: String::new() })
}

/// Text within XML; control characters, which XML does not have, are left out.
pub(crate) fn escape_xml(text: &str) -> String {
    let text: String = text.chars().filter(|character| !character.is_control()).collect();
    quick_xml::escape::escape(&text).into_owned()
}
