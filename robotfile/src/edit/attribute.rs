//! The patches that set or remove an attribute or a text.

use std::ops::Range;

use crate::edit::error::EditError;
use crate::edit::new_element::{escape_text, escape_value};
use crate::edit::patch::Patches;
use crate::source::Source;
use crate::start_tag::is_xml_name;
use crate::tree::{Attribute, Element, Node};

/// Gives an attribute a value in its own quotes, or removes it with the space before it. A new one
/// goes behind the last, in the same quotes, on a line of its own if that one has one.
pub(crate) fn set(
    source: &Source,
    element: &Element,
    name: &str,
    value: Option<&str>,
    patches: &mut Patches,
) -> Result<(), EditError> {
    let text = source.text();
    match (element.attribute(name), value) {
        (None, None) => {}
        (Some(attribute), Some(value)) => {
            if attribute.value != value {
                let quote = quote(text, attribute);
                let span = attribute.value_span;
                patches.replace(span.start()..span.end(), escape_value(value, quote));
            }
        }
        (Some(attribute), None) => {
            let start = text[..attribute.name_span.start()].trim_end().len();
            patches.replace(start..attribute.span().end(), "");
        }
        (None, Some(value)) => {
            if !is_xml_name(name) {
                return Err(EditError::BadXmlName { name: name.into() });
            }
            let (at, space, quote) = match element.attributes.last() {
                None => (element.name_span.end(), " ", '"'),
                Some(last) => {
                    let space = space_before(text, last.name_span.start());
                    (last.span().end(), space, quote(text, last))
                }
            };
            let value = escape_value(value, quote);
            patches.replace(at..at, format!("{space}{name}={quote}{value}{quote}"));
        }
    }
    Ok(())
}

/// The quotes around an attribute's value.
pub(crate) fn quote(text: &str, attribute: &Attribute) -> char {
    if text[..attribute.span().end()].ends_with('\'') { '\'' } else { '"' }
}

/// Returns the white space before an attribute if it contains a line break, else one space.
fn space_before(text: &str, at: usize) -> &str {
    let space = &text[text[..at].trim_end().len()..at];
    if space.contains('\n') { space } else { " " }
}

/// Replaces the first piece of text by `new` and removes the other pieces; white space, comments
/// and elements around them stay.
pub(crate) fn set_text(source: &Source, element: &Element, new: &str, patches: &mut Patches) {
    let new = new.trim();
    if element.text().0 == new {
        return;
    }
    let text = source.text();
    let mut escaped = escape_text(new);
    for range in text_words(text, element) {
        patches.replace(range, std::mem::take(&mut escaped));
    }
    if escaped.is_empty() {
        return;
    }
    if element.is_open() {
        let at = element.tag_span.end();
        patches.replace(at..at, escaped);
    } else {
        let end = element.tag_span.end();
        let start = text[..end - "/>".len()].trim_end().len();
        patches.replace(start..end, format!(">{escaped}</{}>", element.name));
    }
}

/// Returns the range of the text of an element, without the white space around it, if it is one
/// piece without CDATA.
pub(crate) fn text_run(text: &str, element: &Element) -> Option<Range<usize>> {
    let mut words = text_words(text, element);
    let only = words.pop().filter(|_| words.is_empty())?;
    (!text[only.clone()].contains("<![CDATA[")).then_some(only)
}

/// The pieces of text between comments and elements, without the white space around them.
fn text_words(text: &str, element: &Element) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for node in &element.children {
        let Node::Text(_, span) = node else { continue };
        match runs.last_mut() {
            Some(last) if last.end == span.start() => last.end = span.end(),
            _ => runs.push(span.start()..span.end()),
        }
    }
    let trim = |run: Range<usize>| {
        let piece = &text[run.clone()];
        let start = run.start + piece.len() - piece.trim_start().len();
        start..start + piece.trim().len()
    };
    runs.into_iter().map(trim).filter(|run| !run.is_empty()).collect()
}
