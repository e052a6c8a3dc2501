//! The names that a check knows, and the finding for one that it does not.

use std::collections::BTreeMap;

use armor_wire::name::is_name;

use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::model::Component;
use crate::source::{Location, Spanned};
use crate::suggestion::suggest_similar;
use crate::unreadable::UnreadableParts;

/// The names of one kind of thing, each once.
pub(super) struct KnownNames<'a> {
    /// The kind of thing, such as "place".
    pub(super) noun: &'static str,
    pub(super) known: BTreeMap<&'a str, &'a Location>,
    /// Of components: each kind with the name of a component of it.
    kinds: Vec<(&'a str, &'a str)>,
    /// Names that may exist in unreadable parts of the file.
    unreadable: Option<&'a UnreadableParts>,
}

impl<'a> KnownNames<'a> {
    /// Collects the names in their order; a name that occurs again is a finding.
    pub(super) fn collect(
        noun: &'static str,
        duplicate: Code,
        names: impl Iterator<Item = &'a Spanned<String>>,
        findings: &mut Findings,
    ) -> Self {
        let mut known: BTreeMap<&str, &Location> = BTreeMap::new();
        for name in names {
            if let Some(first) = known.get(name.value.as_str()) {
                let (message, remedy) = match duplicate {
                    Code::DuplicateParameter => {
                        (format!("a second value for {}", name.value), "remove one of the two")
                    }
                    _ => (
                        format!("a second {noun} called {}", name.value),
                        "remove it, or give it another name",
                    ),
                };
                let finding = Finding::new(duplicate, &name.at, message);
                findings.push(finding.remedy(remedy).related(first, "first here"));
            } else {
                known.insert(&name.value, &name.at);
            }
        }
        Self { noun, known, kinds: Vec::new(), unreadable: None }
    }

    /// Adds the kinds of components, which are written in place of their names by mistake.
    pub(super) fn of_kinds(self, components: &'a [Component]) -> Self {
        let kinds = components.iter().map(|it| (it.kind.value.as_str(), it.name.value.as_str()));
        Self { kinds: kinds.collect(), ..self }
    }

    /// Adds the names that may exist in unreadable parts.
    pub(super) fn including(self, unreadable: &'a UnreadableParts) -> Self {
        Self { unreadable: Some(unreadable), ..self }
    }

    /// Returns whether the name is known; if not, it is a finding, unless an unreadable part may
    /// have it.
    pub(super) fn expect(
        &self,
        name: &Spanned<String>,
        unknown: Code,
        findings: &mut Findings,
    ) -> bool {
        let known = self.known.contains_key(name.value.as_str());
        // A malformed name is a finding already.
        if !known && !is_name(&name.value) {
            return false;
        }
        if !known && !self.unreadable.is_some_and(|unreadable| unreadable.may_contain(&name.value))
        {
            let message = format!("there is no {} called {}", self.noun, short(&name.value));
            let remedy = if findings.is_full() { None } else { self.guess(&name.value) };
            let remedy = remedy.unwrap_or_else(|| match self.known.is_empty() {
                true => format!("add it: there is no {} at all", self.noun),
                false => format!("add it, or name one of: {}", self.listed()),
            });
            findings.push(Finding::new(unknown, &name.at, message).remedy(remedy));
        }
        known
    }

    fn guess(&self, name: &str) -> Option<String> {
        let mut of_kind = self.kinds.iter().filter(|(kind, _)| *kind == name);
        if let (Some((kind, component)), None) = (of_kind.next(), of_kind.next()) {
            return Some(format!("{kind} is the kind of {component}: did you mean {component}?"));
        }
        suggest_similar(name, self.known.keys().copied())
    }

    fn listed(&self) -> String {
        listed(self.known.keys().copied())
    }
}

/// Reports a name that is none of `known`, such as the name of a port.
pub(super) fn report_unknown<'a>(
    code: Code,
    name: &Spanned<String>,
    noun: &str,
    known: impl Iterator<Item = &'a str> + Clone,
    findings: &mut Findings,
) {
    let message = format!("there is no {noun} called {}", short(&name.value));
    let guess = if findings.is_full() { None } else { suggest_similar(&name.value, known.clone()) };
    let remedy = guess.unwrap_or_else(|| match known.clone().next() {
        None => "there are none".into(),
        Some(_) => format!("there are: {}", listed(known)),
    });
    findings.push(Finding::new(code, &name.at, message).remedy(remedy));
}

/// Returns the first dozen names, and the number of the others.
pub(super) fn listed<'a>(mut names: impl Iterator<Item = &'a str>) -> String {
    const SHOWN: usize = 12;
    let shown: Vec<_> = names.by_ref().take(SHOWN).collect();
    let (names, more) = (shown, names.count());
    match (names.is_empty(), more) {
        (true, _) => "there are none".into(),
        (_, 0) => names.join(", "),
        _ => format!("{} and {more} more", names.join(", ")),
    }
}

/// Returns the first dozen names as a sentence lists them: `a, b and c`.
pub(super) fn joined<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let list = listed(names);
    match list.rsplit_once(", ") {
        Some((first, last)) if !list.ends_with(" more") => format!("{first} and {last}"),
        _ => list,
    }
}
