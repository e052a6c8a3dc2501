//! Whether what was read holds together: within the file, and against the manifests of the
//! components that it names. Everything is looked at in one pass; nothing stops at the first.

mod claims;
mod dates;
mod endless;
mod graph;
mod guards;
mod links;
mod manifests;
mod mission;
mod order;
mod paths;
mod ports;
mod reach;
mod system;
mod transition;
mod unused;

use std::collections::BTreeMap;

use armor_wire::manifest::Manifest;

use crate::code::Code;
use crate::doubts::Doubts;
use crate::finding::{Finding, Findings, short};
use crate::load::Reading;
use crate::model::{Configuration, System};
use crate::overrides::{self, Override};
use crate::source::{Location, Spanned};
use crate::suggestion::suggest_similar;

pub use dates::passed_dates;
pub use paths::{NeededPath, needed_paths};

/// The manifests of all kinds that there are, by kind.
pub type Manifests = BTreeMap<String, Manifest>;

/// Puts the overrides over the file and checks the whole; without manifests only what the file
/// says by itself. The findings come sorted by file and line.
pub fn check(
    mut reading: Reading,
    overrides: &[Override],
    manifests: Option<&Manifests>,
) -> Reading {
    let mut findings = std::mem::take(&mut reading.findings);
    if let Some(configuration) = &mut reading.configuration {
        let mut found = Findings::default();
        findings.retain(|finding| !repeats_malformed(finding, &configuration.system));
        system::keep_first(&mut configuration.system, &mut found);
        by_itself(configuration, &mut found);
        guards::check(configuration, manifests, &mut found);
        claims::check(configuration, &mut found);
        overrides::apply(configuration, overrides, &mut found);
        if let Some(manifests) = manifests {
            manifests::check(configuration, manifests, &mut found);
            // With a mistake in a name, what it meant only seems to be unused.
            if !findings.has_errors() && !found.has_errors() {
                unused::check(configuration, manifests, &mut found);
            }
        }
        let is_partial = reading.is_partial;
        findings.absorb(found, |f| !is_partial || !f.code.is_of_something_missing());
    }
    reading.findings = findings.finish();
    reading
}

/// Whether it only says once more that the name of a component is malformed: where it is used.
fn repeats_malformed(finding: &Finding, system: &System) -> bool {
    let Some(at) = &finding.at else { return false };
    let used = match finding.code {
        Code::BadName => at.text(),
        Code::BadValue => at.text().rsplit_once('.').map_or("", |(component, _)| component),
        _ => return false,
    };
    let is_there = || system.components.iter().any(|component| component.name.at.span == at.span);
    system.doubts.is_malformed(used) && !is_there()
}

/// What needs no manifests.
fn by_itself(configuration: &Configuration, findings: &mut Findings) {
    let system = &configuration.system;
    system::check(system, findings);
    links::check(system, findings);
    mission::check(configuration, findings);
    for mission in configuration.missions() {
        transition::check(mission, findings);
        order::check(mission, findings);
        endless::check(mission, findings);
    }
}

/// Names of one sort, each once.
struct Names<'a> {
    /// What such a name is for, such as "place".
    noun: &'static str,
    known: BTreeMap<&'a str, &'a Location>,
    /// What else may be there.
    doubts: Option<&'a Doubts>,
}

impl<'a> Names<'a> {
    /// Takes the names in their order; one that is there already is a finding.
    fn collect(
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
                    _ => (format!("a second {noun} called {}", name.value), "give it another name"),
                };
                let finding = Finding::new(duplicate, &name.at, message);
                findings.push(finding.remedy(remedy).related(first, "first here"));
            } else {
                known.insert(&name.value, &name.at);
            }
        }
        Self { noun, known, doubts: None }
    }

    /// The same names, and those that could not be read.
    fn beside(self, doubts: &'a Doubts) -> Self {
        Self { doubts: Some(doubts), ..self }
    }

    /// Whether the name is known; if not, it is a finding, unless it may be there all the same.
    fn expect(&self, name: &Spanned<String>, unknown: Code, findings: &mut Findings) -> bool {
        let known = self.known.contains_key(name.value.as_str());
        if !known && !self.doubts.is_some_and(|doubts| doubts.may_hold(&name.value)) {
            let message = format!("there is no {} called {}", self.noun, short(&name.value));
            let remedy = if findings.is_full() { None } else { self.guess(&name.value) };
            let remedy =
                remedy.unwrap_or_else(|| format!("add it, or name one of: {}", self.listed()));
            findings.push(Finding::new(unknown, &name.at, message).remedy(remedy));
        }
        known
    }

    fn guess(&self, name: &str) -> Option<String> {
        suggest_similar(name, self.known.keys().copied())
    }

    fn listed(&self) -> String {
        listed(self.known.keys().copied())
    }
}

/// The first dozen names, and how many more there are.
fn listed<'a>(mut names: impl Iterator<Item = &'a str>) -> String {
    const SHOWN: usize = 12;
    let shown: Vec<_> = names.by_ref().take(SHOWN).collect();
    let (names, more) = (shown, names.count());
    match (names.is_empty(), more) {
        (true, _) => "none is there".into(),
        (_, 0) => names.join(", "),
        _ => format!("{} and {more} more", names.join(", ")),
    }
}
