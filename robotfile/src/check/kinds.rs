//! Components whose kind is probably another one: what the file uses of them is that of another kind.

use std::collections::BTreeMap;

use armor_wire::manifest::Manifest;

use crate::check::names::listed;
use crate::check::uses::{ComponentUses, Use, has};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Component, Configuration, System};
use crate::source::Location;
use crate::suggestion::suggest_similar;

/// Checks the kinds of all components, and removes from `kinds` those that are probably wrong.
pub(super) fn check(
    configuration: &Configuration,
    manifests: &Manifests,
    kinds: &mut BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let system = &configuration.system;
    let uses = ComponentUses::collect(configuration);
    for [one, other] in find_exchanged_kinds(system, &uses, kinds) {
        for component in [one, other] {
            kinds.remove(component.name.value.as_str());
            drop_uses_of(&component.name.value, findings);
        }
        findings.push(report_exchanged_kinds(one, other));
    }
    for [one, other] in find_exchanged_names(system, &uses, kinds) {
        for component in [one, other] {
            kinds.remove(component.name.value.as_str());
            drop_uses_of(&component.name.value, findings);
        }
        findings.push(report_exchanged_names(one, other));
    }
    // What is used of a name that is given twice may be that of the other component.
    let given_twice = |name: &str, findings: &Findings| {
        findings.iter().any(|it| {
            it.code == Code::DuplicateComponent
                && it.at.as_ref().is_some_and(|at| at.text() == name)
        })
    };
    for component in &system.components {
        let name = component.name.value.as_str();
        if given_twice(name, findings) {
            kinds.remove(name);
            continue;
        }
        let (Some(manifest), Some(uses)) = (kinds.get(name), uses.get(name)) else { continue };
        let mut found = Findings::default();
        if report_other_kind(component, manifest, uses, manifests, &mut found) {
            kinds.remove(name);
            drop_uses_of(name, findings);
            findings.extend(found);
        }
    }
}

/// Names the only kind that has all that is used of a component whose kind is unknown, if no kind has a
/// similar name.
pub(super) fn advise_by_uses(
    component: &Component,
    uses: &BTreeMap<String, ComponentUses>,
    manifests: &Manifests,
    findings: &mut Findings,
) {
    let name = component.name.value.as_str();
    let Some(meant) = uses.get(name).and_then(|uses| find_meant_kind(name, uses, manifests)) else {
        return;
    };
    let is_it = |it: &&mut Finding| {
        let is_there = it.at.as_ref().is_some_and(|at| at.is_at(&component.kind.at));
        it.code == Code::UnknownKind && is_there && !it.remedy.starts_with("did you mean")
    };
    for finding in findings.iter_mut().filter(is_it) {
        finding.remedy =
            format!("did you mean {}? It has all that {name} uses; {}", meant.kind, finding.remedy);
    }
}

/// Names the only kind that has all that is used of a component, and needs nothing else, where its own
/// needs a parameter that is not given.
pub(super) fn advise_complete_kind(
    system: &System,
    uses: &BTreeMap<String, ComponentUses>,
    manifests: &Manifests,
    findings: &mut Findings,
) {
    for finding in findings.iter_mut().filter(|it| it.code == Code::ParameterUnassigned) {
        let is_its = |it: &&Component| finding.at.as_ref().is_some_and(|at| it.name.at.is_at(at));
        let Some(component) = system.components.iter().find(is_its) else { continue };
        let name = component.name.value.as_str();
        let Some(uses) = uses.get(name) else { continue };
        let is_complete = |kind: &&Manifest| {
            uses.is_known_to(kind) && uses.find_missing(kind).is_empty() && kind.reports_done
        };
        let mut complete = manifests.values().filter(is_complete);
        if let (Some(meant), None) = (complete.next(), complete.next())
            && meant.kind != component.kind.value
        {
            finding.remedy = format!(
                "{}; or did you mean kind=\"{}\"? It has all that {name} uses",
                finding.remedy, meant.kind
            );
        }
    }
}

/// Drops findings about events, ports and parameters of a component whose kind is wrong: they are
/// those of another kind.
fn drop_uses_of(name: &str, findings: &mut Findings) {
    let is_it = |at: &Location| {
        let before = at.source.text().get(..at.span.start()).unwrap_or_default();
        let component = before.strip_suffix('.').and_then(|before| before.strip_suffix(name));
        component.is_some_and(|before| !before.ends_with(is_of_name))
            || at.text().split('.').next() == Some(name)
    };
    findings.retain(|finding| {
        let is_of_kind = matches!(finding.code, Code::UnknownEvent | Code::UnknownPort);
        !is_of_kind || !finding.at.as_ref().is_some_and(is_it)
    });
}

fn is_of_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_')
}

/// The components whose kind is known, with what the file uses of them.
fn list_used<'a, 'b>(
    system: &'a System,
    uses: &'b BTreeMap<String, ComponentUses>,
    kinds: &BTreeMap<&str, &'b Manifest>,
) -> Vec<(&'a Component, &'b Manifest, &'b ComponentUses)> {
    let used = system.components.iter().filter_map(|component| {
        let name = component.name.value.as_str();
        Some((component, *kinds.get(name)?, uses.get(name)?))
    });
    used.collect()
}

/// Finds the pairs of components of which one has parameters or links that its kind does not know,
/// and the kind of the other knows all of them, and the same holds in reverse.
fn find_exchanged_kinds<'a>(
    system: &'a System,
    uses: &BTreeMap<String, ComponentUses>,
    kinds: &BTreeMap<&str, &Manifest>,
) -> Vec<[&'a Component; 2]> {
    let used = list_used(system, uses, kinds);
    let mut pairs: Vec<[&Component; 2]> = Vec::new();
    for (one, kind, uses) in used.iter().filter(|(_, kind, uses)| !uses.is_known_to(kind)) {
        // A link in the wrong direction is another mistake.
        if uses.iter().filter(|it| !has(kind, *it)).all(|it| has(kind, reverse(it))) {
            continue;
        }
        let is_partner =
            |(other, of_other, by_other): &&(&Component, &Manifest, &ComponentUses)| {
                let is_wrong =
                    !by_other.is_known_to(of_other) || !by_other.find_missing(of_other).is_empty();
                other.name.value != one.name.value
                    && of_other.kind != kind.kind
                    && is_wrong
                    && uses.is_known_to(of_other)
                    && by_other.is_known_to(kind)
            };
        let mut partners = used.iter().filter(is_partner);
        let (Some((other, ..)), None) = (partners.next(), partners.next()) else { continue };
        let is_known =
            |pair: &[&Component; 2]| pair.iter().any(|it| it.name.value == one.name.value);
        if !pairs.iter().any(is_known) {
            pairs.push([*one, *other]);
        }
    }
    pairs
}

/// Finds the pairs of components of which one has links or parameters of places that its kind does not
/// know, and the kind of the other knows all of them, and the same in reverse, while the parameters in
/// the element of each are those of its own kind.
fn find_exchanged_names<'a>(
    system: &'a System,
    uses: &BTreeMap<String, ComponentUses>,
    kinds: &BTreeMap<&str, &Manifest>,
) -> Vec<[&'a Component; 2]> {
    let used = list_used(system, uses, kinds);
    // What the file names outside of the element.
    let is_named = |component: &Component, it: &(Use, &str)| {
        it.0 != Use::Parameter || component.parameter(it.1).is_none()
    };
    let knows = |kind: &Manifest, component: &Component, uses: &ComponentUses| {
        uses.iter().filter(|it| is_named(component, it)).all(|it| has(kind, it))
    };
    // A single parameter of a place may be meant for another component.
    let lacks = |kind: &Manifest, component: &Component, uses: &ComponentUses| {
        let named = uses.iter().filter(|it| is_named(component, it));
        // A link in the wrong direction is another mistake.
        let is_unknown = |it: &(Use, &str)| !has(kind, *it) && !has(kind, reverse(*it));
        let unknown: Vec<_> = named.filter(is_unknown).collect();
        unknown.len() > 1 || unknown.iter().any(|it| matches!(it.0, Use::Input | Use::Output))
    };
    let is_of_kind = |component: &Component, kind: &Manifest| {
        component.parameters.iter().all(|it| has(kind, (Use::Parameter, &it.name.value)))
    };
    let mut pairs = Vec::new();
    for (number, (one, kind, uses)) in used.iter().enumerate() {
        let is_partner =
            |(other, of_other, by_other): &&(&Component, &Manifest, &ComponentUses)| {
                of_other.kind != kind.kind
                    && (lacks(kind, one, uses) || lacks(of_other, other, by_other))
                    && knows(of_other, one, uses)
                    && knows(kind, other, by_other)
                    && [(one, kind), (other, of_other)].iter().all(|it| is_of_kind(it.0, it.1))
                    && !one.parameters.is_empty().min(other.parameters.is_empty())
            };
        let mut partners = used[number + 1..].iter().filter(is_partner);
        if let (Some((other, ..)), None) = (partners.next(), partners.next()) {
            pairs.push([*one, *other]);
        }
    }
    // Of three that fit each other, it is not known which two.
    if pairs.len() == 1 { pairs } else { Vec::new() }
}

fn report_exchanged_names(one: &Component, other: &Component) -> Finding {
    let (first, second) = (&one.name, &other.name);
    let message = format!(
        "the names of {} and {} seem to be exchanged: what the file uses of each is that of the other",
        first.value, second.value
    );
    Finding::new(Code::UnknownPort, &first.at, message)
        .remedy(format!(
            "write name=\"{}\" here and name=\"{}\" for the other one",
            second.value, first.value
        ))
        .related(&second.at, "exchanged with this one")
}

fn report_exchanged_kinds(one: &Component, other: &Component) -> Finding {
    let message = format!(
        "the kinds of {} and {} seem to be exchanged: each has what the other uses",
        one.name.value, other.name.value
    );
    Finding::new(Code::UnknownPort, &one.kind.at, message)
        .remedy(format!(
            "write kind=\"{}\" here and kind=\"{}\" for {}",
            other.kind.value, one.kind.value, other.name.value
        ))
        .related(&other.kind.at, "exchanged with this one")
}

/// The same port at the other end of a link.
fn reverse((is, name): (Use, &str)) -> (Use, &str) {
    let is = match is {
        Use::Input => Use::Output,
        Use::Output => Use::Input,
        other => other,
    };
    (is, name)
}

/// Reports a component whose kind lacks what the file uses of it, while exactly one other kind has it
/// all. That a single name is unknown, and nothing is missing, is a mistake in that name.
fn report_other_kind(
    component: &Component,
    manifest: &Manifest,
    uses: &ComponentUses,
    manifests: &Manifests,
    findings: &mut Findings,
) -> bool {
    let unknown: Vec<_> = uses.iter().filter(|it| !has(manifest, *it)).collect();
    let missing = uses.find_missing(manifest);
    if let Some(named) = manifests.get(&component.name.value)
        && unknown.is_empty()
        && !missing.is_empty()
        && uses.is_known_to(named)
        && uses.find_missing(named).is_empty()
    {
        findings.push(report_named_kind(component, manifest, named, &missing));
        return true;
    }
    // A kind that lists no events may report any.
    let is_certain = unknown.iter().any(|(is, _)| *is != Use::Event);
    if !is_certain || unknown.len() + missing.len() < 2 {
        return false;
    }
    let name = component.name.value.as_str();
    let Some(other) = find_meant_kind(name, uses, manifests) else { return false };
    let is_any = |wanted: Use| unknown.iter().any(|(is, _)| *is == wanted);
    let has_ports = is_any(Use::Input) || is_any(Use::Output);
    let code = match is_any(Use::Parameter) {
        true => Code::UnknownParameter,
        false => Code::UnknownPort,
    };
    let plural = if unknown.len() > 1 { "s" } else { "" };
    let nouns = [
        (is_any(Use::Parameter), format!("parameter{plural}")),
        (has_ports, format!("port{plural}")),
        (is_any(Use::Event), format!("event{plural}")),
    ];
    let nouns: Vec<_> = nouns.iter().filter(|(is, _)| *is).map(|(_, noun)| noun.as_str()).collect();
    let needs = match missing.as_slice() {
        [] => String::new(),
        missing => format!(", and needs {}", listed(missing.iter().copied())),
    };
    let message = format!(
        "{} has no {} called {}{needs}; {} has all that {name} uses",
        with_article(&component.kind.value),
        nouns.join(" and "),
        listed(unknown.iter().map(|(_, name)| *name)),
        with_article(&other.kind)
    );
    let finding = Finding::new(code, &component.kind.at, message);
    findings.push(finding.remedy(format!("did you mean kind=\"{}\"?", other.kind)));
    true
}

/// The finding for a component that is called like another kind, and gives all that this one needs but
/// not what its own kind needs.
fn report_named_kind(
    component: &Component,
    manifest: &Manifest,
    named: &Manifest,
    missing: &[&str],
) -> Finding {
    let needs = listed(missing.iter().copied());
    let message = format!(
        "{} is {}, which needs {needs}; {} needs no more than is given",
        component.name.value,
        with_article(&manifest.kind),
        with_article(&named.kind)
    );
    let is_parameter = |it: &&&str| manifest.parameters.iter().any(|given| given.name == ***it);
    let code = match missing.iter().find(is_parameter) {
        Some(_) => Code::ParameterUnassigned,
        None => Code::InputUnfed,
    };
    Finding::new(code, &component.kind.at, message)
        .remedy(format!("did you mean kind=\"{}\"? Otherwise give it {needs}", named.kind))
}

/// The letters that the name of a component and that of its kind have in common at their beginning.
const MIN_SHARED_LEN: usize = 3;

/// Returns the only kind that has all that is used of a component: of several, the only one that also
/// needs nothing else, or else the one that the component is named after.
pub(super) fn find_meant_kind<'a>(
    name: &str,
    uses: &ComponentUses,
    manifests: &'a Manifests,
) -> Option<&'a Manifest> {
    let knowing: Vec<_> = manifests.values().filter(|kind| uses.is_known_to(kind)).collect();
    let only = |kinds: &[&'a Manifest]| match kinds {
        [only] => Some(*only),
        _ => None,
    };
    let complete: Vec<_> =
        knowing.iter().copied().filter(|kind| uses.find_missing(kind).is_empty()).collect();
    // As `home` is after `homing`, and `writer` after `map-writer`.
    let is_named = |kind: &&&Manifest| {
        let mut words = kind.kind.split('-').chain(std::iter::once(&*kind.kind));
        words.any(|word| {
            let shared = word.chars().zip(name.chars()).take_while(|(a, b)| a == b).count();
            shared >= MIN_SHARED_LEN || suggest_similar(name, std::iter::once(word)).is_some()
        })
    };
    only(&knowing)
        .or_else(|| only(&complete))
        .or_else(|| only(&complete.iter().filter(is_named).copied().collect::<Vec<_>>()))
}

fn with_article(kind: &str) -> String {
    let article = if kind.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {kind}")
}
