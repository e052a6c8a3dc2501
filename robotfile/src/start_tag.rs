//! One start tag → name and attributes, each with its span; and references in text → characters.

use std::sync::Arc;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::source::{Location, Source, Span};
use crate::tree::{Attribute, Element};
use crate::xml::MAX_ATTRIBUTES;

/// The contents of a start tag.
pub(crate) struct Tag {
    pub(crate) element: Element,
    /// Whether all of it was understood.
    pub(crate) sound: bool,
    pub(crate) too_many_attributes: bool,
}

/// Walks through the text of a tag.
pub(crate) struct TagReader<'a> {
    source: &'a Arc<Source>,
    span: Span,
    /// Offset in the source of the next character.
    at: usize,
    /// Offset in the source of `>` or `/>`.
    end: usize,
}

impl<'a> TagReader<'a> {
    /// `span` is the whole tag with its angle brackets.
    pub(crate) fn new(source: &'a Arc<Source>, span: Span) -> Self {
        let text = source.slice(span);
        let inner = text.strip_suffix('>').unwrap_or(text);
        let inner = inner.strip_suffix('/').unwrap_or(inner);
        Self { source, span, at: span.start() + 1, end: span.start() + inner.len().max(1) }
    }

    /// `span` is a whole XML declaration, which is written like a tag.
    pub(crate) fn declaration(source: &'a Arc<Source>, span: Span) -> Self {
        let (start, end) = (span.start() + "<?".len(), span.end() - "?>".len());
        Self { source, span, at: start.min(end), end }
    }

    pub(crate) fn read(mut self, findings: &mut Findings) -> Tag {
        let name_span = self.until(|c| c.is_ascii_whitespace());
        let name = self.source.slice(name_span).to_owned();
        let mut tag = Tag {
            element: Element {
                name,
                name_span,
                span: self.span,
                tag_span: self.span,
                attributes: Vec::new(),
                children: Vec::new(),
            },
            sound: true,
            too_many_attributes: false,
        };
        if !is_xml_name(&tag.element.name) {
            let finding = self.finding(Code::Malformed, name_span, "this is not an element name");
            findings.push(finding.remedy("write a literal < as &lt;"));
            tag.sound = false;
        }
        let mut count = 0;
        loop {
            let is_apart = self.skip_space();
            if self.at >= self.end {
                return tag;
            }
            count += 1;
            if count > MAX_ATTRIBUTES {
                let message =
                    format!("<{}> has more than {MAX_ATTRIBUTES} attributes", tag.element.name);
                let finding = self.finding(Code::TooManyAttributes, name_span, message);
                findings.push(finding.remedy("no element of an Armor file needs so many"));
                tag.too_many_attributes = true;
                return tag;
            }
            let Some(attribute) = self.read_attribute(is_apart, findings) else {
                tag.sound = false;
                return tag;
            };
            self.add_attribute(&mut tag.element, attribute, findings);
        }
    }

    /// Adds the attribute, unless there is one of its name.
    fn add_attribute(&self, element: &mut Element, attribute: Attribute, findings: &mut Findings) {
        if let Some(first) = element.attribute(&attribute.name) {
            let first = Location::new(self.source, first.name_span);
            let message = format!("{} is written twice", attribute.name);
            let finding = self.finding(Code::DuplicateAttribute, attribute.name_span, message);
            findings.push(finding.remedy("keep one of them").related(&first, "first here"));
        } else {
            element.attributes.push(attribute);
        }
    }

    /// `name="value"`; none, with a finding, if it is not of that form.
    fn read_attribute(&mut self, is_apart: bool, findings: &mut Findings) -> Option<Attribute> {
        let name_span = self.until(|c| c.is_ascii_whitespace() || matches!(c, '=' | '"' | '\''));
        let name = self.source.slice(name_span).to_owned();
        if !is_xml_name(&name) {
            let span = Span::new(name_span.start(), name_span.end().max(self.at + 1).min(self.end));
            findings.push(self.malformed_attribute(span, "this is not an attribute name"));
            return None;
        }
        if !is_apart {
            findings.push(
                self.malformed_attribute(name_span, "a space is missing before this attribute"),
            );
        }
        match self.read_quoted() {
            Ok(value_span) => {
                let value = self.unescape_value(value_span, findings);
                Some(Attribute { name, value, name_span, value_span })
            }
            Err(problem) => {
                findings.push(self.malformed_attribute(name_span, problem));
                None
            }
        }
    }

    /// Returns the span of the value, after its `=` and inside its quotes.
    fn read_quoted(&mut self) -> Result<Span, &'static str> {
        const TYPOGRAPHIC: [char; 8] = [
            '\u{201c}', '\u{201d}', '\u{201e}', '\u{201f}', '\u{2018}', '\u{2019}', '\u{ab}',
            '\u{bb}',
        ];
        self.skip_space();
        if !self.rest().starts_with('=') {
            return Err("this attribute has no value");
        }
        self.at += 1;
        self.skip_space();
        if self.rest().starts_with(TYPOGRAPHIC) {
            return Err(
                "the quotation marks of this attribute are typographic: XML has the straight \" \
                 and ' alone",
            );
        }
        let quote = self.rest().chars().next().filter(|c| matches!(c, '"' | '\''));
        let quote = quote.ok_or("the value of this attribute is not in quotes")?;
        self.at += 1;
        let span = self.until(|c| c == quote);
        if self.at >= self.end {
            return Err("the quotes of this attribute's value are not closed");
        }
        self.at += 1;
        Ok(span)
    }

    fn unescape_value(&self, span: Span, findings: &mut Findings) -> String {
        let at = Location::new(self.source, span);
        if let Some(less) = at.text().find('<') {
            let here = at.part(less, less + 1);
            let finding = Finding::new(Code::Malformed, &here, "< is not allowed in a value");
            findings.push(finding.remedy("write it as &lt;"));
        }
        unescape(&at, findings)
    }

    fn malformed_attribute(&self, span: Span, message: &str) -> Finding {
        self.finding(Code::Malformed, span, message).remedy("write attributes as name=\"value\"")
    }

    fn until(&mut self, stop: impl Fn(char) -> bool) -> Span {
        let rest = self.rest();
        let len = rest.find(stop).unwrap_or(rest.len());
        let span = Span::new(self.at, self.at + len);
        self.at += len;
        span
    }

    fn skip_space(&mut self) -> bool {
        let rest = self.rest();
        let len = rest.len() - rest.trim_start_matches([' ', '\t', '\r', '\n']).len();
        self.at += len;
        len > 0
    }

    fn rest(&self) -> &'a str {
        self.source.slice(Span::new(self.at.min(self.end), self.end))
    }

    fn finding(&self, code: Code, span: Span, message: impl Into<String>) -> Finding {
        Finding::new(code, &Location::new(self.source, span), message)
    }
}

/// Returns the length of a text up to its second `<` if it begins with a `<` that compares two values
/// and begins no tag. That is the case in a check, which contains no elements.
pub(crate) fn literal_less_len(text: &str) -> Option<usize> {
    let rest = text.strip_prefix('<')?;
    let len = 1 + rest.find('<').unwrap_or(rest.len());
    let is_markup = rest.starts_with(['/', '!', '?']);
    let is_tag = rest.starts_with(|c: char| c.is_alphabetic() || matches!(c, '_' | ':'))
        && text[..len].contains('>');
    (!is_markup && !is_tag).then_some(len)
}

/// Replaces the five entities of XML and character references, and white space by spaces as XML
/// requires for attributes. Each unknown reference is a finding and stays as it is written, so that
/// the rest of the file is still checked.
pub(crate) fn unescape(at: &Location, findings: &mut Findings) -> String {
    let raw = at.text();
    let mut out = String::with_capacity(raw.len());
    let mut rest = 0;
    while let Some(found) = raw[rest..].find('&') {
        let start = rest + found;
        push_normalised(&mut out, &raw[rest..start]);
        // No reference is longer than this; a lone & must not scan the whole text.
        let window = raw.len().min(start + 16);
        let len = raw.as_bytes()[start..window].iter().position(|b| *b == b';').map(|len| len + 1);
        let character = len.and_then(|len| parse_reference(&raw[start + 1..start + len - 1]));
        // Both characters of && are one mistake.
        let is_and = raw[start..].starts_with("&&");
        let len = len.unwrap_or(1 + usize::from(is_and));
        match character {
            Some(c) => out.push(c),
            None => {
                let here = at.part(start, start + len);
                out.push_str(here.text());
                let message = format!("{} is not a known entity", here.text());
                let is_number = |text: &str| {
                    let text = text.strip_prefix("&#").unwrap_or_default();
                    let (digits, radix) =
                        text.strip_prefix('x').map_or((text, 10), |hex| (hex, 16));
                    let digits = digits.strip_suffix(';').unwrap_or_default();
                    !digits.is_empty() && digits.chars().all(|c| c.is_digit(radix))
                };
                findings.push(if is_and {
                    let finding =
                        Finding::new(Code::UnknownEntity, &here, "&& is not allowed in XML");
                    finding.remedy("write and: guards and checks have the words and, or, not")
                } else if is_number(here.text()) {
                    let message = format!("{} is not a character that XML allows", here.text());
                    Finding::new(Code::BadCharacter, &here, message).remedy("remove it")
                } else {
                    let finding = Finding::new(Code::UnknownEntity, &here, message);
                    finding.remedy("write & as &amp;")
                });
            }
        }
        rest = start + len;
    }
    push_normalised(&mut out, &raw[rest..]);
    out
}

/// Returns the lengths of the character at byte `at` of a text: as written, and as [`unescape`]
/// reads it.
pub(crate) fn character(text: &Location, at: usize) -> (usize, usize) {
    let rest = text.text().get(at..).unwrap_or_default();
    let Some(first) = rest.chars().next() else { return (1, 0) };
    if rest.starts_with("\r\n") {
        return (2, 1);
    }
    let mut window = rest.as_bytes().iter().take(16);
    let end = window.position(|b| *b == b';').filter(|_| first == '&');
    match end.and_then(|end| Some((end + 1, parse_reference(&rest[1..end])?))) {
        Some((len, c)) => (len, c.len_utf8()),
        None => (first.len_utf8(), first.len_utf8()),
    }
}

fn push_normalised(out: &mut String, text: &str) {
    let mut previous = ' ';
    for c in text.chars() {
        match c {
            '\n' if previous == '\r' => {}
            '\n' | '\r' | '\t' => out.push(' '),
            other => out.push(other),
        }
        previous = c;
    }
}

fn parse_reference(name: &str) -> Option<char> {
    let number = |digits: &str, radix| {
        let plain = !digits.is_empty() && digits.chars().all(|c| c.is_digit(radix));
        let code = plain.then(|| u32::from_str_radix(digits, radix).ok()).flatten()?;
        char::from_u32(code)
            .filter(|c| *c >= ' ' || "\t\n\r".contains(*c))
            .filter(|c| !matches!(c, '\u{fffe}' | '\u{ffff}'))
    };
    match name {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "apos" => Some('\''),
        "quot" => Some('"'),
        _ => match name.strip_prefix('#')? {
            hex if hex.starts_with('x') => number(&hex[1..], 16),
            decimal => number(decimal, 10),
        },
    }
}

/// Whether XML would take it as a name (of letters, digits, `_-.:`, not starting with a digit).
pub(crate) fn is_xml_name(name: &str) -> bool {
    let start = |c: char| c.is_alphabetic() || matches!(c, '_' | ':');
    let part = |c: char| c.is_alphanumeric() || matches!(c, '_' | ':' | '-' | '.' | '\u{b7}');
    name.starts_with(start) && name.chars().all(part)
}
