//! Tree → model, one file at a time.

mod mission;
mod system;
mod transition;

use std::sync::Arc;

use crate::code::Code;
use crate::doubts::Doubts;
use crate::fields::Fields;
use crate::finding::{Finding, Findings, short};
use crate::mission::Mission;
use crate::model::System;
use crate::source::{Location, Source};
use crate::tree::Element;

/// Most components, places, transitions and so on of a mission or system, of each sort.
pub const MAX_ELEMENTS: usize = 4096;
/// Most links of a system.
pub const MAX_LINKS: usize = 16_384;

/// What one file holds.
pub(crate) struct Contents {
    pub(crate) system: Option<System>,
    pub(crate) mission: Option<Mission>,
    /// The `<armor>` tag.
    pub(crate) at: Location,
    /// Whether there is an element that was probably meant as a `<system>`.
    pub(crate) is_system_misspelt: bool,
}

/// Reads the root element. None if it is not ours at all.
pub(crate) fn contents(
    root: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<Contents> {
    let at = root.at(source);
    if root.name != "armor" {
        let message = format!("the root element is <{}>", short(&root.name));
        let finding = Finding::new(Code::WrongRoot, &at, message);
        findings.push(finding.remedy("an Armor file starts with <armor version=\"1\">"));
        return None;
    }
    crate::namespaces::check(root, source, findings);
    let mut fields = Fields::new(root, source, findings);
    if let Some(version) = fields.required("version").filter(|version| version.value != "1") {
        let message = format!("version {} of the format is not known", short(&version.value));
        let finding = Finding::new(Code::WrongRoot, &version.at, message);
        fields.report(finding.remedy("this program reads version=\"1\""));
    }
    let children = fields.finish(&["system", "mission"]);
    let of = |name| children.iter().copied().filter(move |child| child.name == name);
    let system = only(of("system"), source, findings);
    let mission = only(of("mission"), source, findings);
    Some(Contents {
        system: system.map(|element| system::read(element, source, findings)),
        mission: mission.map(|element| mission::read(element, source, findings)),
        at,
        is_system_misspelt: root.elements().any(|child| Doubts::is_meant(child, "system")),
    })
}

/// The first; further ones are findings.
fn only<'a>(
    mut elements: impl Iterator<Item = &'a Element>,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<&'a Element> {
    let first = elements.next()?;
    for other in elements {
        let message = format!("<{}> is there twice", other.name);
        let finding = Finding::new(Code::DuplicateElement, &other.at(source), message);
        findings.push(finding.remedy("keep one of them").related(&first.at(source), "first here"));
    }
    Some(first)
}

/// Adds to a list up to a limit; false, once with a finding, beyond it.
fn add<T>(list: &mut Vec<T>, item: T, limit: usize, at: &Location, findings: &mut Findings) {
    if list.len() < limit {
        list.push(item);
        return;
    }
    // Reported once: the list does not grow beyond the limit, so only its first excess counts.
    let already = findings.iter().any(|finding| {
        finding.code == Code::TooMany
            && finding.at.as_ref().is_some_and(|other| other.text() == at.text())
    });
    if !already {
        let message = format!("there are more than {limit} <{}>", at.text());
        findings
            .push(Finding::new(Code::TooMany, at, message).remedy("this is the format's limit"));
    }
}
