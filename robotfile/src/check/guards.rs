//! Variables and guards: whether every name in them exists, and whether types and units of the
//! values match. The types of data are known from the manifests; without these, only the file
//! itself is checked.

mod data;
mod sets;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use self::data::{ANY_NUMBER, DataFields, FieldRange};
use crate::check::names::listed;
use crate::claim::Claim;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::{Guard, Meaning, Name, Type, is_never_true, judge};
use crate::manifests::Manifests;
use crate::mission::Mission;
use crate::model::Configuration;
use crate::source::{Location, Spanned};
use crate::suggestion::suggest_similar;

pub(super) fn check(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    let data = DataFields::of(&configuration.system, manifests);
    for mission in configuration.missions() {
        check_one(mission, &data, findings);
    }
}

fn check_one(mission: &Mission, data: &DataFields<'_>, findings: &mut Findings) {
    let mut variables = BTreeMap::new();
    let mut used = BTreeSet::new();
    for variable in &mission.variables {
        let mut found = Findings::default();
        variables.insert(variable.name.value.as_str(), data.variable(variable, &mut found));
        if !found.is_empty() {
            // Its findings must be fixed first.
            used.insert(variable.name.value.clone());
        }
        findings.extend(found);
    }
    let mut all_read = true;
    for when in mission.transitions.iter().filter_map(|transition| transition.when.as_ref()) {
        let guard = match Guard::parse(&when.value) {
            Ok(guard) => guard,
            Err(error) => {
                all_read = false;
                // An unknown XML entity is a finding already.
                let mut of_xml = Findings::default();
                crate::start_tag::unescape(&when.at, &mut of_xml);
                if !of_xml.is_empty() {
                    continue;
                }
                let at = within(when, error.at);
                findings
                    .push(Finding::new(Code::GuardSyntax, &at, error.message).remedy(error.remedy));
                continue;
            }
        };
        let texts = find_texts(&guard, when, &variables, data);
        let mut meanings = Vec::new();
        for name in guard.names() {
            if let Some(text) = texts.iter().find(|text| text.as_str() == name.as_str()) {
                let at = within(when, name.at.clone());
                let message = format!("{text} is a text, not a variable");
                let finding = Finding::new(Code::UnknownVariable, &at, message);
                findings.push(finding.remedy(format!("write it in single quotes: '{text}'")));
                meanings.push(None);
                continue;
            }
            used.insert(name.as_str().to_owned());
            meanings.push(match name.data() {
                Some(_) => data
                    .field(name, when, findings)
                    .map(|is| measured_meaning(is, data.find_range(name))),
                None => known_variable(name, when, &variables, findings),
            });
        }
        // With a wrong name, nothing more can be checked.
        let Some(meanings) = meanings.into_iter().collect::<Option<Vec<_>>>() else {
            all_read = false;
            continue;
        };
        for problem in judge(&guard, &when.value, &meanings) {
            let at = within(when, problem.at);
            let finding = Finding::new(problem.code, &at, problem.message).remedy(problem.remedy);
            let stops = problem.code == Code::GuardConstant && is_never_true(&guard, &meanings);
            findings.push(if stops { finding.stops_transition() } else { finding });
        }
    }
    let in_guards = used.clone();
    all_read &= sets::check(mission, &variables, &mut used, findings);
    if !all_read || mission.unreadable.in_moves {
        return;
    }
    used.extend(claimed_names(mission));
    for variable in &mission.variables {
        let (name, counts) = (&variable.name.value, variable.counts().is_some());
        let is_set = sets::is_set(mission, variable);
        let is_unique = mission.variables.iter().filter(|it| it.name.value == *name).count() == 1;
        if !used.contains(name) && (is_set || is_unique) {
            let message = match is_set {
                true => format!("no guard uses {name}"),
                false => format!("no guard uses {name}, and no transition sets it"),
            };
            let finding = Finding::new(Code::UnusedVariable, &variable.name.at, message);
            findings.push(finding.remedy("use it in a when=\"…\", or remove it"));
        } else if in_guards.contains(name) && !is_set && counts {
            let message = format!("no transition sets {name}, so its value never changes");
            let finding = Finding::new(Code::NothingSets, &variable.name.at, message);
            findings.push(finding.remedy(
                "set it: <set variable=\"…\" value=\"…\"/> in a transition; or make it follow data \
                 with source=\"…\"",
            ));
        }
    }
}

/// Returns the names in a guard that are no variables but texts that a field in the same guard can
/// have: their quotes were forgotten.
fn find_texts(
    guard: &Guard,
    when: &Spanned<String>,
    variables: &BTreeMap<&str, Meaning>,
    data: &DataFields<'_>,
) -> Vec<String> {
    let is_unknown = |name: &&Name| name.data().is_none() && !variables.contains_key(name.as_str());
    let unknown: Vec<_> = guard.names().iter().filter(is_unknown).map(Name::as_str).collect();
    if unknown.is_empty() {
        return Vec::new();
    }
    let mut unheard = Findings::default();
    let mut types = guard.names().iter().filter_map(|name| match name.data() {
        Some(_) => data.field(name, when, &mut unheard),
        None => variables.get(name.as_str()).map(|meaning| meaning.is.clone()),
    });
    types
        .find_map(|is| match is {
            Type::Text(Some(choices)) => {
                let is_known = |text: &&str| choices.iter().any(|choice| choice == text);
                let texts: Vec<_> =
                    unknown.iter().copied().filter(is_known).map(str::to_owned).collect();
                Some(texts).filter(|texts| !texts.is_empty())
            }
            _ => None,
        })
        .unwrap_or_default()
}

/// Returns the names in the checks of a mission.
fn claimed_names(mission: &Mission) -> BTreeSet<String> {
    let claims = mission.checks.iter().filter_map(|text| Claim::parse(&text.value).ok());
    let names = |claim: Claim| {
        let names = claim.names().into_iter().map(|(_, name)| name.as_str().to_owned());
        names.collect::<Vec<_>>()
    };
    claims.flat_map(names).collect()
}

fn measured_meaning(is: Type, range: Option<FieldRange>) -> Meaning {
    let (within, domain) =
        range.map_or_else(|| (ANY_NUMBER, "any value".into()), |range| (range.ends, range.text));
    Meaning { is, within, domain, is_measured: true }
}

fn known_variable(
    name: &Name,
    when: &Spanned<String>,
    variables: &BTreeMap<&str, Meaning>,
    findings: &mut Findings,
) -> Option<Meaning> {
    if let Some(meaning) = variables.get(name.as_str()) {
        return Some(meaning.clone());
    }
    let message = format!("there is no variable called {name}");
    let known = variables.keys().copied();
    let before_minus =
        |known: &&str| name.as_str().strip_prefix(*known).is_some_and(|rest| rest.starts_with('-'));
    let remedy = match known.clone().find(before_minus) {
        Some(_) => "put spaces around a minus: without them it is part of the name".into(),
        None => suggest_similar(name.as_str(), known.clone()).unwrap_or_else(|| {
            format!(
                "declare a <variable>, or name a field of data as component.output.field; \
                 variables: {}",
                listed(known)
            )
        }),
    };
    let at = within(when, name.at.clone());
    findings.push(Finding::new(Code::UnknownVariable, &at, message).remedy(remedy));
    None
}

/// Returns the bytes `range` of a text as a location in the file, where `&lt;` is longer than the
/// character.
pub fn within(text: &Spanned<String>, range: Range<usize>) -> Location {
    let raw = text.at.text();
    let (mut at, mut read) = (0, 0);
    let mut ends = [raw.len(); 2];
    let mut found = 0;
    loop {
        while found < 2 && read >= [range.start, range.end][found] {
            // The first byte of the next character, the last of the one before.
            ends[found] = at;
            found += 1;
        }
        if found == 2 || at >= raw.len() {
            break;
        }
        let (len, written) = crate::start_tag::character(&text.at, at);
        (at, read) = (at + len, read + written);
    }
    text.at.part(ends[0].min(ends[1]), ends[1])
}
