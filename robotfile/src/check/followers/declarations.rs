//! What follows from a declaration: one in the wrong element, a domain that is too small, a place
//! that lost its components, a variable of which the guard was lost.

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::source::Location;

/// What is declared in the wrong element, such as a `<variable>` in the system, is not missing.
pub(super) fn drop_misplaced(found: &mut Findings, reading: &Findings) {
    let misplaced = reading.iter().filter(|finding| finding.code == Code::UnknownElement);
    let names: Vec<_> = misplaced
        .filter_map(|finding| {
            let at = finding.at.as_ref()?;
            Some((noun_of(at.text())?, attribute_of(start_tag_of(at), "name")?))
        })
        .collect();
    found.retain(|finding| {
        let is_it = |at: &Location| {
            names.iter().any(|(code, name)| finding.code == *code && at.text() == *name)
        };
        names.is_empty() || !finding.at.as_ref().is_some_and(is_it)
    });
}

/// The finding for a name of such an element that is missing.
fn noun_of(element: &str) -> Option<Code> {
    Some(match element {
        "component" => Code::UnknownComponent,
        "place" => Code::UnknownPlace,
        "variable" => Code::UnknownVariable,
        _ => return None,
    })
}

/// A transition that waits for a report that does not exist, and has no guard, probably lost the guard
/// that used the variable.
pub(super) fn drop_unused_of_report(findings: &mut Findings) {
    let lost_guard = |finding: &Finding| {
        let at = finding.at.as_ref().filter(|_| finding.code == Code::UnknownEvent);
        at.is_some_and(|at| attribute_of(start_tag_of(at), "when").is_none())
    };
    if findings.iter().any(lost_guard) {
        findings.retain(|finding| finding.code != Code::UnusedVariable);
    }
}

/// A value outside the domain of a variable, and comparisons that this domain decides: the domain or
/// that value is the one mistake. A comparison that is never true is one only if it is with that value.
pub(super) fn merge_outside_domain(findings: &mut Findings) {
    let domain_of = |finding: &Finding| -> Option<(String, String)> {
        let message = finding.message.as_str();
        let (domain, value) =
            message.split_once(", and `").filter(|_| message.ends_with("outside"))?;
        let value = value.split('`').next()?.to_owned();
        Some((domain.to_owned(), value)).filter(|_| finding.code == Code::CountSyntax)
    };
    let is_decided = |finding: &Finding, (domain, value): &(String, String)| {
        let has_value = || finding.message.split([' ', '`']).any(|word| word == value.as_str());
        finding.code == Code::GuardConstant
            && (finding.message.ends_with(&format!("always true: {domain}"))
                || (finding.message.ends_with(&format!("always false: {domain}")) && has_value()))
    };
    let outside: Vec<_> = findings.iter().filter_map(domain_of).collect();
    findings.merge_same(|first, other| {
        domain_of(first).is_some_and(|domain| is_decided(other, &domain))
    });
    // A comparison that comes first in the file follows too.
    findings.retain(|finding| !outside.iter().any(|domain| is_decided(finding, domain)));
    for finding in findings.iter_mut().filter(|it| !it.related.is_empty()) {
        let Some((domain, value)) = domain_of(finding) else { continue };
        let name = domain.split(' ').next().unwrap_or_default();
        finding.remedy = format!(
            "widen the domain of {name}, which is compared with such a value too; or set it to \
             another value than {value}"
        );
    }
}

/// A variable that begins outside of its domain: the domain or that value is the one mistake, also of
/// the comparisons that this domain decides.
pub(super) fn drop_decided_of_malformed(found: &mut Findings, reading: &Findings) {
    let names: Vec<_> = reading
        .iter()
        .filter(|it| it.code == Code::BadValue && it.message.starts_with("initial: "))
        .filter_map(|it| attribute_of(start_tag_of(it.at.as_ref()?), "name"))
        .map(|name| format!(": {name} is "))
        .collect();
    found.retain(|finding| {
        finding.code != Code::GuardConstant
            || !names.iter().any(|name| finding.message.contains(name))
    });
}

/// Several comparisons that one domain decides: it is the one mistake.
pub(super) fn merge_decided(findings: &mut Findings) {
    let domain_of = |finding: &Finding| {
        let (_, domain) = finding.message.split_once("` is always ")?;
        let (_, domain) = domain.split_once(": ")?;
        let is_domain = finding.code == Code::GuardConstant && domain.contains(" is ");
        is_domain.then(|| domain.to_owned())
    };
    findings.merge_same(|first, other| {
        domain_of(first).is_some() && domain_of(first) == domain_of(other)
    });
    for finding in findings.iter_mut().filter(|it| !it.related.is_empty()) {
        let Some(domain) = domain_of(finding) else { continue };
        let name = domain.split(' ').next().unwrap_or_default();
        finding.remedy = format!(
            "widen the domain of {name}, which decides all of them, or compare with values within it"
        );
    }
}

/// Exclusive components that are in no place, and the only place with `on-failure` and without
/// components: these are its own.
pub(super) fn explain_lost_components(findings: &mut Findings) {
    let is_passive =
        |it: &&Finding| it.code == Code::NoEffect && it.message.starts_with("on-failure has");
    let mut passive = findings.iter().filter(is_passive);
    let (Some(passive), None) = (passive.next(), passive.next()) else { return };
    let Some(at) = passive.at.clone() else { return };
    let Some(place) = attribute_of(start_tag_of(&at), "name").map(str::to_owned) else { return };
    let mut lost = findings
        .iter_mut()
        .filter(|it| it.code == Code::ExclusiveTogether && it.message.contains(" is in no place"));
    let (Some(lost), None) = (lost.next(), lost.next()) else { return };
    let name = lost.at.as_ref().map_or("", Location::text);
    lost.remedy = format!(
        "did you mean components=\"{name}\" in {place}? Otherwise activate it in another place, or \
         remove it from the set"
    );
    let label = format!("{place} has an on-failure, and no components");
    lost.related.push((at.clone(), label));
    findings.retain(|finding| {
        finding.code != Code::NoEffect || !finding.at.as_ref().is_some_and(|it| it.is_at(&at))
    });
}

/// The start tag that a location lies in.
fn start_tag_of(at: &Location) -> &str {
    let text = at.source.text();
    let start = text.get(..=at.span.start()).and_then(|before| before.rfind('<'));
    let tag = text.get(start.unwrap_or_default()..).unwrap_or_default();
    tag.split_once('>').map_or(tag, |(tag, _)| tag)
}

/// The value of an attribute in a start tag, as written.
fn attribute_of<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let mut attributes = tag.split_whitespace();
    let value = attributes.find_map(|it| it.strip_prefix(name)?.strip_prefix('='))?;
    let quote = value.chars().next()?;
    value.strip_prefix(quote)?.split(quote).next()
}
