//! Reads the attributes and children of one element, reporting those that are missing, malformed or
//! unknown. A malformed name or value is reported once and then still used where that is harmless,
//! so that one mistake does not cause ten findings.

mod unknown_attributes;

use std::sync::Arc;
use std::time::Duration;

use armor_wire::name::is_name;
use armor_wire::quantity::Dimension;

use crate::code::Code;
use crate::elements;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::model::Port;
use crate::source::{Location, Source, Spanned};
use crate::suggestion::{list_choices, suggest_choice, suggest_similar};
use crate::tree::{Attribute, Element, Node};
use crate::wanted_quantity::{read_duration, read_number, read_number_in, read_rate_hz};

/// The attributes of one element, being read.
pub(crate) struct ElementFields<'a, 'f> {
    element: &'a Element,
    source: &'a Arc<Source>,
    findings: &'f mut Findings,
    known: Vec<&'static str>,
    /// The attributes that are required and absent.
    missing: Vec<&'static str>,
}

impl<'a, 'f> ElementFields<'a, 'f> {
    pub(crate) fn new(
        element: &'a Element,
        source: &'a Arc<Source>,
        findings: &'f mut Findings,
    ) -> Self {
        Self { element, source, findings, known: Vec::new(), missing: Vec::new() }
    }

    /// Returns the location of the element's name.
    pub(crate) fn at(&self) -> Location {
        self.element.at(self.source)
    }

    pub(crate) fn report(&mut self, finding: Finding) {
        self.findings.push(finding);
    }

    /// Returns the value as written.
    pub(crate) fn text(&mut self, name: &'static str) -> Option<Spanned<String>> {
        self.known.push(name);
        let attribute = self.element.attribute(name)?;
        Some(Spanned::new(attribute.value.clone(), self.value_at(attribute)))
    }

    /// Returns the value as written; its absence is a finding.
    pub(crate) fn required(&mut self, name: &'static str) -> Option<Spanned<String>> {
        let value = self.text(name);
        // A misspelt attribute is a finding already.
        let is_unknown = |it: &&Attribute| !self.known.contains(&it.name.as_str());
        let mut others = self.element.attributes.iter().filter(is_unknown);
        let is_misspelt = others.any(|other| {
            let written = other.name.to_ascii_lowercase();
            suggest_similar(&written, std::iter::once(name)).is_some()
                || elements::find_meant_attribute(&self.element.name, &written) == Some(name)
        });
        if value.is_none() && !is_misspelt {
            self.missing.push(name);
        }
        value
    }

    /// Returns a name, even if it is malformed.
    pub(crate) fn name(&mut self, name: &'static str) -> Option<Spanned<String>> {
        let value = self.text(name)?;
        self.check_name(&value);
        Some(value)
    }

    /// Returns a name; its absence is a finding.
    pub(crate) fn required_name(&mut self, name: &'static str) -> Option<Spanned<String>> {
        let value = self.required(name)?;
        self.check_name(&value);
        Some(value)
    }

    /// Returns names separated by spaces.
    pub(crate) fn names(&mut self, name: &'static str) -> Vec<Spanned<String>> {
        let Some(attribute) = self.text(name) else { return Vec::new() };
        let raw = attribute.at.text();
        let has_commas = raw.contains([',', ';']);
        let between = |c: char| c.is_ascii_whitespace() || (has_commas && matches!(c, ',' | ';'));
        let words = raw.split(between).filter(|word| !word.is_empty()).map(|word| {
            // Both slices are of one string, so the difference is the word's offset.
            let start = word.as_ptr() as usize - raw.as_ptr() as usize;
            Spanned::new(word.to_owned(), attribute.at.part(start, start + word.len()))
        });
        let words: Vec<_> = words.collect();
        if has_commas {
            let message = format!("{name}: names are separated by spaces");
            let names: Vec<_> = words.iter().map(|word| without_brackets(&word.value)).collect();
            let finding = Finding::new(Code::BadValue, &attribute.at, message);
            self.report(finding.remedy(format!("write {name}=\"{}\"", names.join(" "))));
        } else {
            words.iter().for_each(|word| self.check_name(word));
        }
        self.refuse_repeats(&words);
        words
    }

    fn refuse_repeats(&mut self, words: &[Spanned<String>]) {
        let mut seen = std::collections::BTreeMap::new();
        for word in words {
            if let Some(first) = seen.insert(word.value.as_str(), &word.at) {
                let message = format!("{} is listed twice", short(&word.value));
                let finding = Finding::new(Code::DuplicateInList, &word.at, message);
                self.report(finding.remedy("remove one of them").related(first, "first here"));
            }
        }
    }

    /// `true` or `false`.
    pub(crate) fn flag(&mut self, name: &'static str, default: bool) -> bool {
        self.choice(name, &[("true", true), ("false", false)]).map_or(default, |flag| flag.value)
    }

    /// Returns the choice for one of a few words.
    pub(crate) fn choice<T: Copy>(
        &mut self,
        name: &'static str,
        choices: &[(&str, T)],
    ) -> Option<Spanned<T>> {
        let value = self.text(name)?;
        let found = choices.iter().find(|(word, _)| *word == value.value);
        if found.is_none() {
            let words = choices.iter().map(|(word, _)| *word);
            self.bad_value(name, &value, list_choices(&value.value, words));
        }
        found.map(|(_, choice)| value.with(*choice))
    }

    /// Returns a value that is one of a few words, or is read by `read`.
    pub(crate) fn word_or<T>(
        &mut self,
        name: &'static str,
        words: &[&str],
        read: impl FnOnce(&str) -> Result<T, String>,
    ) -> Option<Spanned<T>> {
        self.converted(name, |text| {
            read(text).map_err(|expected| match suggest_choice(text, words.iter().copied()) {
                Some(guess) => format!("{guess} {expected}"),
                None => expected,
            })
        })
    }

    /// A duration such as `0.2s`.
    pub(crate) fn duration(&mut self, name: &'static str) -> Option<Spanned<Duration>> {
        self.converted(name, read_duration)
    }

    /// A duration above zero.
    pub(crate) fn longer_than_nothing(&mut self, name: &'static str) -> Option<Spanned<Duration>> {
        self.converted(name, |text| match read_duration(text)? {
            Duration::ZERO => Err("a duration above zero is expected".into()),
            longer => Ok(longer),
        })
    }

    /// A rate such as `10Hz`, in hertz.
    pub(crate) fn rate_hz(&mut self, name: &'static str) -> Option<Spanned<f64>> {
        self.converted(name, read_rate_hz)
    }

    /// A number with or without a unit, in SI.
    pub(crate) fn quantity(&mut self, name: &'static str) -> Option<Spanned<f64>> {
        self.converted(name, read_number)
    }

    /// A number with a unit of this quantity, a length or an angle, in SI.
    pub(crate) fn number_in(
        &mut self,
        name: &'static str,
        dimension: Dimension,
    ) -> Option<Spanned<f64>> {
        self.converted(name, |text| read_number_in(text, dimension))
    }

    /// A whole number of at most nine digits, at least `least`.
    pub(crate) fn count(&mut self, name: &'static str, least: u32) -> Option<Spanned<u32>> {
        self.converted(name, |text| {
            digits(text)
                .and_then(|digits| digits.parse().ok())
                .filter(|count| *count >= least)
                .ok_or_else(|| format!("a whole number from {least} to 999999999 is expected"))
        })
    }

    /// `component.port`, or `component.event`.
    pub(crate) fn dotted(&mut self, name: &'static str) -> Option<Port> {
        let value = self.text(name)?;
        self.split_port(name, value)
    }

    /// `component.port`; its absence is a finding.
    pub(crate) fn required_dotted(&mut self, name: &'static str) -> Option<Port> {
        let value = self.required(name)?;
        self.split_port(name, value)
    }

    fn split_port(&mut self, name: &str, value: Spanned<String>) -> Option<Port> {
        let Some(dot) =
            value.value.find('.').filter(|_| armor_wire::name::split_data(&value.value).is_some())
        else {
            self.bad_value(
                name,
                &value,
                match name {
                    "on" => "a component and its report are expected, such as explorer.done",
                    _ => "two names joined by a dot are expected, such as laser.scan",
                }
                .into(),
            );
            return None;
        };
        let part = |start: usize, end: usize| {
            Spanned::new(value.value[start..end].to_owned(), value.at.part(start, end))
        };
        let component = part(0, dot);
        let port = part(dot + 1, value.value.len());
        Some(Port { component, port, at: value.at })
    }

    /// A value read by `read`, whose error states what is expected.
    pub(crate) fn converted<T>(
        &mut self,
        name: &'static str,
        read: impl FnOnce(&str) -> Result<T, String>,
    ) -> Option<Spanned<T>> {
        let value = self.text(name)?;
        match read(&value.value) {
            Ok(read) => Some(value.with(read)),
            Err(expected) => {
                self.bad_value(name, &value, expected);
                None
            }
        }
    }

    /// Reports a finding if more than one of these attributes is present.
    pub(crate) fn only_one_of(&mut self, names: &[&str]) {
        let element = self.element;
        let mut given = names.iter().filter_map(|name| element.attribute(name));
        if let (Some(first), Some(second)) = (given.next(), given.next()) {
            let message = format!("{} and {} exclude each other", first.name, second.name);
            let first = Location::new(self.source, first.name_span);
            let second = Location::new(self.source, second.name_span);
            let finding = Finding::new(Code::Clash, &second, message);
            self.report(finding.remedy("keep one of them").related(&first, "the other one"));
        }
    }

    /// Reports the attribute, if it is present, as one that has no effect, with the reason. A misspelt
    /// attribute may be the one that gives it an effect, so all must have been read before.
    pub(crate) fn without_effect(&mut self, name: &str, why: &str) {
        if let Some(at) = self.attribute_at(name).filter(|_| !self.has_strangers()) {
            let finding = Finding::new(Code::NoEffect, &at, format!("{name} has no effect here"));
            self.report(finding.remedy(why));
        }
    }

    /// Whether the attribute is present with this value.
    pub(crate) fn has_value(&self, name: &str, value: &str) -> bool {
        self.element.attribute(name).is_some_and(|it| it.value == value)
    }

    /// Returns the location of the attribute's name, if it is present.
    pub(crate) fn attribute_at(&self, name: &str) -> Option<Location> {
        let attribute = self.element.attribute(name)?;
        Some(Location::new(self.source, attribute.name_span))
    }

    /// Returns whether the element has attributes that were not read so far.
    pub(crate) fn has_strangers(&self) -> bool {
        let mut names = self.element.attributes.iter().map(|attribute| attribute.name.as_str());
        names.any(|name| !name.contains(':') && name != "xmlns" && !self.known.contains(&name))
    }

    /// Reports attributes that were not read, children other than `allowed`, and stray text;
    /// returns the allowed children.
    pub(crate) fn finish(mut self, allowed: &[&'static str]) -> Vec<&'a Element> {
        let element = self.element;
        let has_text = element
            .children
            .iter()
            .any(|node| matches!(node, Node::Text(text, _) if !text.trim().is_empty()));
        let is_value = |name: &mut &str| has_text && *name == "value";
        let stray_value = self.missing.pop_if(is_value);
        self.report_strangers();
        let mut children = Vec::new();
        for node in &element.children {
            match node {
                Node::Element(child) if allowed.contains(&child.name.as_str()) => {
                    children.push(child);
                }
                Node::Element(child) => self.unknown_element(child, allowed),
                Node::Text(text, span) if !text.trim().is_empty() => {
                    let at = without_space(&Location::new(self.source, *span));
                    let message = format!("text is not allowed in <{}>", element.name);
                    let finding = Finding::new(Code::StrayText, &at, message);
                    // A value between the tags was probably meant for the attribute.
                    let remedy = match stray_value {
                        Some("value") => {
                            format!("write it as an attribute: value=\"{}\"", short(text.trim()))
                        }
                        _ => "remove it, or make it a comment".into(),
                    };
                    self.report(finding.remedy(remedy));
                }
                _ => {}
            }
        }
        children
    }

    /// Like [`Self::finish`], for an element that contains only text.
    pub(crate) fn finish_text(mut self) {
        self.report_strangers();
        let element = self.element;
        element.elements().for_each(|child| self.unknown_element(child, &[]));
    }

    fn unknown_element(&mut self, child: &Element, allowed: &[&'static str]) {
        let finding =
            elements::report_unknown_element(child, &self.element.name, allowed, self.source);
        self.report(finding);
    }

    fn check_name(&mut self, value: &Spanned<String>) {
        if !is_name(&value.value) {
            let message = match value.value.as_str() {
                "" => "the name is empty".to_owned(),
                name => format!("`{}` is not a name", short(name)),
            };
            let finding = Finding::new(Code::BadName, &value.at, message);
            let rule = "a name starts with a letter, followed by letters, digits, _ and -; at most 64 characters";
            let bare = without_brackets(&value.value);
            let mut names = bare.split([',', ';']).map(without_brackets);
            self.report(finding.remedy(match names.next() {
                Some(name) if is_name(name) && name != value.value => {
                    format!("one name is expected, without brackets, commas or quotation marks, such as {name}")
                }
                _ => rule.to_owned(),
            }));
        }
    }

    pub(crate) fn bad_value<T>(&mut self, name: &str, value: &Spanned<T>, expected: String) {
        let message = match value.at.text() {
            "" => format!("{name} is empty"),
            text => format!("{name}: `{}` is not valid", short(text)),
        };
        self.report(Finding::new(Code::BadValue, &value.at, message).remedy(expected));
    }

    fn value_at(&self, attribute: &Attribute) -> Location {
        Location::new(self.source, attribute.value_span)
    }
}

/// Returns a word of a list without the marks that a list has in JSON or CSV.
fn without_brackets(word: &str) -> &str {
    word.trim_matches(|c: char| "[]{}()\"'".contains(c) || c.is_ascii_whitespace())
}

/// Returns the location without the white space around the text.
fn without_space(at: &Location) -> Location {
    let (text, len) = (at.text(), at.text().len());
    at.part(len - text.trim_start().len(), text.trim_end().len())
}

/// `text` if it is one to nine digits.
pub(crate) fn digits(text: &str) -> Option<&str> {
    (matches!(text.len(), 1..=9) && text.bytes().all(|b| b.is_ascii_digit())).then_some(text)
}
