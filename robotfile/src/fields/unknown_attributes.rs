//! Reports the attributes that an element does not have, and those that it lacks: one of the former is
//! often one of the latter, misspelt.

use super::ElementFields;
use crate::code::Code;
use crate::elements;
use crate::finding::{Finding, short};
use crate::source::Location;
use crate::suggestion::suggest_similar;
use crate::tree::Attribute;

impl ElementFields<'_, '_> {
    /// Reports the attributes that were not read, and those that are required and absent.
    pub(super) fn report_strangers(&mut self) {
        let element = self.element;
        let known = self.known.clone();
        let is_stranger = |attribute: &&Attribute| {
            let name = attribute.name.as_str();
            !known.contains(&name) && !name.contains(':') && name != "xmlns"
        };
        let strangers: Vec<_> = element.attributes.iter().filter(is_stranger).collect();
        let guess_known = |attribute: &Attribute| {
            let name = attribute.name.to_ascii_lowercase();
            suggest_similar(&name, known.iter().copied()).or_else(|| {
                let meant = elements::find_meant_attribute(&element.name, &name)?;
                let is_free = known.contains(&meant) && element.attribute(meant).is_none();
                is_free.then(|| format!("did you mean {meant}?"))
            })
        };
        // One that is unknown was probably meant to be the one that is missing.
        if let ([stranger], [missing]) = (strangers.as_slice(), self.missing.as_slice())
            && guess_known(stranger).is_none()
        {
            let message = format!("<{}> has no attribute {}", element.name, short(&stranger.name));
            let at = Location::new(self.source, stranger.name_span);
            let remedy = format!("did you mean {missing}? It is required");
            return self.report(Finding::new(Code::UnknownAttribute, &at, message).remedy(remedy));
        }
        // The name of a parameter in place of the attribute.
        if let ([stranger], ["name", "value"]) = (strangers.as_slice(), self.missing.as_slice())
            && element.name == "parameter"
        {
            let (name, value) = (short(&stranger.name), short(&stranger.value));
            let message = format!("<parameter> has no attribute {name}");
            let at = Location::new(self.source, stranger.name_span);
            let remedy = format!("did you mean name=\"{name}\" value=\"{value}\"?");
            return self.report(Finding::new(Code::UnknownAttribute, &at, message).remedy(remedy));
        }
        for name in std::mem::take(&mut self.missing) {
            let message = format!("<{}> has no attribute {name}", element.name);
            let finding = Finding::new(Code::MissingAttribute, &self.at(), message);
            let example = if name == "version" { "1" } else { "…" };
            self.report(finding.remedy(format!("write {name}=\"{example}\"")));
        }
        let (guessed, unclear): (Vec<_>, Vec<_>) =
            strangers.into_iter().partition(|stranger| guess_known(stranger).is_some());
        for stranger in guessed {
            let message = format!("<{}> has no attribute {}", element.name, short(&stranger.name));
            let at = Location::new(self.source, stranger.name_span);
            let remedy = guess_known(stranger).unwrap_or_default();
            self.findings.push(Finding::new(Code::UnknownAttribute, &at, message).remedy(remedy));
        }
        if let [first, others @ ..] = &unclear[..] {
            self.report_unclear(first, others);
        }
    }

    /// Reports attributes that resemble none of the known ones: together they are one mistake.
    fn report_unclear(&mut self, first: &Attribute, others: &[&Attribute]) {
        let element = self.element;
        let names = std::iter::once(first).chain(others.iter().copied());
        let names: Vec<_> = names.map(|it| short(&it.name).into_owned()).collect();
        let noun = if others.is_empty() { "attribute" } else { "attributes" };
        let message = format!("<{}> has no {noun} {}", element.name, names.join(", "));
        let remedy = match (self.known.as_slice(), find_element_with(&names)) {
            ([], _) if element.name == "check" => {
                "it takes no attributes: write the statement between <check> and </check>".into()
            }
            ([], None) => "it takes no attributes".into(),
            (_, Some(other)) if !others.is_empty() => {
                format!("a <{other}> has them: is this one meant?")
            }
            (known, _) => {
                format!("known attributes: {}; your own need a namespace prefix", known.join(", "))
            }
        };
        let at = |attribute: &Attribute| Location::new(self.source, attribute.name_span);
        let finding = Finding::new(Code::UnknownAttribute, &at(first), message).remedy(remedy);
        let others =
            others.iter().fold(finding, |it, other| it.related(&at(other), "and this one"));
        self.report(others);
    }
}

/// Returns the element that has all these attributes, of those that are often exchanged.
fn find_element_with(names: &[String]) -> Option<&'static str> {
    const ELEMENTS: [(&str, &[&str]); 4] = [
        ("transition", &["from", "to", "on", "when", "after", "timeout", "interval", "priority"]),
        ("place", &["components", "initial", "on-failure"]),
        ("component", &["kind", "rate", "watchdog", "controllable"]),
        ("link", &["from", "to", "keep", "mode"]),
    ];
    let has_all =
        |attributes: &[&str]| names.iter().all(|name| attributes.contains(&name.as_str()));
    ELEMENTS.iter().find(|(_, attributes)| has_all(attributes)).map(|(element, _)| *element)
}
