//! One XML element with its attributes, read with limits.

use std::borrow::Cow;

use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;

use crate::fault::{DrawingFault, shorten_text};
use crate::{limits, numbers};

/// An element's name and attributes, entities resolved.
pub(super) struct DrawingElement<'a> {
    pub(super) name: &'a str,
    attributes: Vec<(&'a str, Cow<'a, str>)>,
}

impl<'a> DrawingElement<'a> {
    pub(super) fn read(tag: &'a BytesStart<'_>) -> Result<Self, DrawingFault> {
        let name = tag.name().into_inner();
        let mut attributes = Vec::new();
        for attribute in tag.attributes() {
            if attributes.len() == limits::ATTRIBUTES {
                return Err(DrawingFault::TooManyAttributes(shorten_text(name)));
            }
            let attribute = attribute.map_err(|e| DrawingFault::Xml(e.to_string()))?;
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|e| DrawingFault::Xml(e.to_string()))?;
            attributes.push((attribute.key.into_inner(), value));
        }
        Ok(Self { name, attributes })
    }

    pub(super) fn text(&self, attribute: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| *key == attribute).map(|(_, value)| value.as_ref())
    }

    pub(super) fn number(&self, attribute: &'static str) -> Result<Option<f64>, DrawingFault> {
        self.text(attribute)
            .map(|text| numbers::lone_number(text).ok_or_else(|| self.bad_number(attribute, text)))
            .transpose()
    }

    /// A width, height or radius, which must be there and not negative.
    pub(super) fn size(&self, attribute: &'static str) -> Result<f64, DrawingFault> {
        let value = self.number(attribute)?.ok_or_else(|| DrawingFault::MissingAttribute {
            element: shorten_text(self.name),
            attribute,
        })?;
        if value < 0.0 {
            return Err(DrawingFault::NegativeSize { attribute, value });
        }
        Ok(value)
    }

    pub(super) fn bad_number(&self, attribute: &str, text: &str) -> DrawingFault {
        DrawingFault::BadNumber { attribute: attribute.to_owned(), value: shorten_text(text) }
    }

    pub(super) fn has_class(&self, class: &str) -> bool {
        self.text("class").is_some_and(|c| c.split_whitespace().any(|c| c == class))
    }

    /// Whether the robot shall not see it, nor what is in it: an annotation, hidden, or something
    /// that is never drawn.
    pub(super) fn is_ignored(&self) -> bool {
        let is_annotation = self.has_class("annotation");
        let is_hidden = self.text("display") == Some("none")
            || self.text("style").is_some_and(|style| {
                style.split(';').any(|rule| {
                    rule.split_once(':')
                        .is_some_and(|(key, v)| key.trim() == "display" && v.trim() == "none")
                })
            });
        is_annotation || is_hidden || self.is_never_solid()
    }

    /// Text and what SVG does not draw; names with a prefix belong to drawing programs.
    fn is_never_solid(&self) -> bool {
        matches!(self.name, "defs" | "desc" | "metadata" | "style" | "text" | "title")
            || self.name.contains(':')
    }
}
