//! Findings that only follow from others. Where a name is given twice or reserved, the name that it
//! replaced seems to be missing, and what is linked to the one seems to be linked to the other.

mod declarations;

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Port, System};
use crate::source::{Location, Span};

/// Drops them. They appear when the name is fixed, if they are more than that.
pub(super) fn drop_followers(findings: &mut Findings, system: &System) {
    // What comes after meetings that wait for each other is reached by none of the routes.
    if findings.iter().any(|finding| finding.code == Code::MeetingsInCircle) {
        findings.retain(|finding| finding.code != Code::UnreachablePlace);
    }
    // As many names may be missing as are given twice.
    for (taken, missing) in [
        (&[Code::DuplicateComponent, Code::ReservedName][..], Code::UnknownComponent),
        (&[Code::DuplicatePlace], Code::UnknownPlace),
        (&[Code::DuplicateVariable], Code::UnknownVariable),
    ] {
        let given_twice = findings.iter().filter(|it| taken.contains(&it.code)).count();
        // A name may be missing in several files.
        if (1..=given_twice).contains(&names_at(findings, missing).len()) {
            findings.retain(|finding| finding.code != missing);
        }
    }
    // Which of the two variables a guard names is not known.
    let variables = names_at(findings, Code::DuplicateVariable);
    findings.retain(|finding| {
        use Code::{CountSyntax, GuardConstant, GuardType, GuardUnit, NotSettable, NothingSets};
        let is_of_value = matches!(
            finding.code,
            CountSyntax | GuardConstant | GuardType | GuardUnit | NotSettable | NothingSets
        );
        !is_of_value || !variables.iter().any(|name| finding.message.contains(name))
    });
    let ends = find_ends_of_duplicates(findings, system);
    findings.retain(|finding| {
        let is_inside = |at: &Location| {
            ends.iter().any(|end| {
                end.component.at.source.path() == at.source.path()
                    && end.component.at.span.start() <= at.span.start()
                    && at.span.end() <= end.port.at.span.end()
            })
        };
        !matches!(finding.code, Code::UnknownPort | Code::WrongDirection)
            || !finding.at.as_ref().is_some_and(is_inside)
    });
    // An emergency is one only if it leads to an end of the mission, whose name is wrong.
    let unknown: BTreeSet<_> = findings
        .iter()
        .filter(|finding| finding.code == Code::UnknownPlace)
        .filter_map(|finding| finding.at.as_ref().map(element_of))
        .collect();
    findings.retain(|finding| {
        finding.code != Code::NoInput
            || !finding.at.as_ref().is_some_and(|at| unknown.contains(&element_of(at)))
    });
    // That another transition never fires follows from the missing condition.
    let exits: Vec<_> = findings
        .iter()
        .filter(|finding| finding.code == Code::ImmediateExit)
        .filter_map(|finding| finding.at.as_ref().map(|at| at.span))
        .collect();
    findings.retain(|finding| {
        finding.code != Code::NeverFires
            || !finding.related.iter().any(|(at, _)| exits.contains(&at.span))
    });
    drop_followers_of_ends(findings);
    // One that may not be frozen is in no place, once this is corrected.
    let fixed = names_at(findings, Code::NotControllable);
    findings.retain(|finding| {
        finding.code != Code::ReportNeverSent
            || finding
                .at
                .as_ref()
                .is_none_or(|at| !fixed.contains(at.text().split('.').next().unwrap_or_default()))
    });
    declarations::merge_decided(findings);
    drop_exits_of_wrong_guards(findings);
    explain_wrong_field(findings);
    explain_missing_output(findings);
    explain_unused_done(findings);
    declarations::drop_unused_of_report(findings);
    declarations::merge_outside_domain(findings);
    declarations::explain_lost_components(findings);
    // Where from and to are exchanged, nothing leads to the place that is named as from.
    let exchanged: BTreeSet<_> = findings
        .iter()
        .filter(|finding| finding.code == Code::ReportNeverSent)
        .flat_map(|finding| finding.related.iter().map(|(at, _)| place_of(at)))
        .collect();
    findings.retain(|finding| {
        finding.code != Code::UnreachablePlace
            || finding.at.as_ref().is_none_or(|at| !exchanged.contains(&place_of(at)))
    });
    // That a component feeds itself is why its work is unused.
    let unused = names_at(findings, Code::WorkUnused);
    findings.retain(|finding| {
        let of = |at: &Location| at.text().split('.').next().is_some_and(|it| unused.contains(it));
        finding.code != Code::LinkToItself || !finding.at.as_ref().is_some_and(of)
    });
    // A variable that lost its source is set by nothing, and follows no data.
    let unset = names_at(findings, Code::NothingSets);
    findings.retain(|finding| {
        let follows =
            |name: &String| finding.message.contains(&format!(": {name} follows no data"));
        finding.code != Code::GuardConstant || !unset.iter().any(follows)
    });
    // Where a guard is wrong or missing, the variable that nothing uses may be the one that it should
    // name.
    let lacks_guard = |it: &Finding| matches!(it.code, Code::GuardConstant | Code::ImmediateExit);
    if findings.iter().any(lacks_guard) {
        name_unused_variable(findings);
        findings.retain(|finding| finding.code != Code::UnusedVariable);
    }
    // One value that is wrong for all that it is compared with.
    findings.merge_same(|first, other| {
        first.code == other.code
            && match first.code {
                Code::GuardUnit | Code::GuardConstant => first.message == other.message,
                Code::ShorterThanPeriod => true,
                _ => false,
            }
    });
    // A component that its place lost, where parameters are set for it, is in no place therefore.
    let forgotten = names_at(findings, Code::ForeignParameter);
    findings.retain(|finding| {
        finding.code != Code::ExclusiveTogether
            || !finding.message.contains(" is in no place")
            || finding.at.as_ref().is_none_or(|at| !forgotten.contains(at.text()))
    });
    // A component of a set that is in no place is one mistake, also if a check names it.
    let mut inactive: BTreeSet<_> = names_at(findings, Code::ExclusiveTogether);
    inactive.extend(forgotten);
    findings.retain(|finding| {
        finding.code != Code::UnknownComponent
            || finding.at.as_ref().is_none_or(|at| !inactive.contains(at.text()))
    });
}

/// That a transition marks a safe place together with work follows from a safe place that the mission
/// leads on from: another one is meant.
fn drop_followers_of_ends(findings: &mut Findings) {
    let left: BTreeSet<_> = findings
        .iter()
        .filter(|finding| finding.code == Code::NeverFires && finding.stops_transition)
        .filter_map(|finding| finding.at.as_ref().map(|at| at.text().to_owned()))
        .collect();
    findings.retain(|finding| {
        finding.code != Code::EndsTooSoon
            || !finding.at.as_ref().is_some_and(|at| left.contains(at.text()))
    });
}

/// What a transition waits for is not known if its guard compares values of other quantities.
fn drop_exits_of_wrong_guards(findings: &mut Findings) {
    let wrong = findings.iter().filter(|finding| finding.code == Code::GuardUnit);
    let wrong: BTreeSet<_> =
        wrong.filter_map(|finding| finding.at.as_ref().map(element_of)).collect();
    findings.retain(|finding| {
        finding.code != Code::ImmediateExit
            || !finding.at.as_ref().is_some_and(|at| wrong.contains(&element_of(at)))
    });
}

/// Names the only variable that no guard uses where a condition is missing.
fn name_unused_variable(findings: &mut Findings) {
    let mut unused = findings.iter().filter(|it| it.code == Code::UnusedVariable);
    let (Some(only), None) = (unused.next(), unused.next()) else { return };
    let Some(name) = only.at.clone() else { return };
    for finding in findings.iter_mut().filter(|it| it.code == Code::ImmediateExit) {
        finding.related.push((name.clone(), "no guard uses this variable".to_owned()));
    }
}

/// Merges that the done of a component is not waited for with what it explains: a tie of two failures,
/// a place that nothing leads to, a report that is waited for in its place.
fn explain_unused_done(findings: &mut Findings) {
    let done: Vec<_> = findings.iter().filter(|it| it.code == Code::DoneUnused).cloned().collect();
    let [only] = &done[..] else { return };
    let has = |code: Code| findings.iter().any(|finding| finding.code == code);
    let has_other = has(Code::ReportNeverSent) || has(Code::NoInput);
    let is_unreachable = has(Code::UnreachablePlace);
    let is_failure_tie =
        |finding: &Finding| finding.code == Code::Tie && finding.remedy.starts_with("was on=");
    // The same of a sub-mission, found in the whole mission.
    let is_same = |finding: &Finding| {
        let place = |it: &Finding| it.at.as_ref().map(place_of);
        finding.code == Code::GoalByFailure && place(finding) == place(only)
    };
    findings.retain(|finding| !is_failure_tie(finding) && !is_same(finding));
    for place in findings.iter_mut().filter(|it| it.code == Code::UnreachablePlace) {
        place.related.extend(only.at.clone().map(|at| (at, only.message.clone())));
    }
    if has_other || is_unreachable {
        findings.retain(|finding| finding.code != Code::DoneUnused);
    }
}

/// Guards that compare a variable with values of another quantity, and a domain that does not fit its
/// field either: the variable probably follows the wrong field.
fn explain_wrong_field(findings: &mut Findings) {
    let name_in = |finding: &Finding| {
        if finding.code != Code::GuardUnit {
            return None;
        }
        let of_guard = finding.message.strip_prefix('`').and_then(|it| it.split_once("` is a "));
        let of_domain = finding.message.split_once(" has no unit, but ").map(|(_, it)| it);
        let of_domain = of_domain.filter(|it| !it.starts_with('`'));
        let of_domain = of_domain.and_then(|it| it.split(' ').next());
        let name = of_guard.map(|(name, _)| name).or(of_domain);
        name.map(ToOwned::to_owned)
    };
    findings
        .merge_same(|first, other| name_in(first).is_some() && name_in(first) == name_in(other));
    for finding in findings.iter_mut().filter(|finding| !finding.related.is_empty()) {
        if let Some(name) = name_in(finding) {
            finding.remedy = format!(
                "is another field meant in the source of {name}? What it is compared with does not \
                 fit this one"
            );
        }
    }
}

/// The only place that nothing leads to is probably where the only transition without an output was to
/// lead.
fn explain_missing_output(findings: &mut Findings) {
    let only = |code: Code| {
        let mut all = findings.iter().filter(|finding| finding.code == code);
        all.next().filter(|_| all.next().is_none())
    };
    let (Some(_), Some(place)) = (only(Code::NoOutput), only(Code::UnreachablePlace)) else {
        return;
    };
    let Some(place) = place.at.clone().filter(|_| place.related.is_empty()) else { return };
    for finding in findings.iter_mut().filter(|finding| finding.code == Code::NoOutput) {
        finding.remedy =
            format!("did you mean to=\"{}\"? Otherwise {}", place.text(), finding.remedy);
        finding.related.push((place.clone(), "no transition leads to this place".to_owned()));
    }
    findings.retain(|finding| finding.code != Code::UnreachablePlace);
}

/// Drops what only follows from parts of the file that could not be read: what they set or activate is
/// not known.
pub(super) fn drop_followers_of_reading(found: &mut Findings, reading: &Findings) {
    let has = |codes: &[Code]| reading.iter().any(|finding| codes.contains(&finding.code));
    if found.has_errors() || reading.has_errors() {
        found.retain(|finding| finding.code != Code::NothingSets);
    }
    if has(&[Code::UnknownAttribute, Code::UnknownElement]) {
        found.retain(|finding| finding.code != Code::ReportNeverSent);
    }
    declarations::drop_misplaced(found, reading);
    declarations::drop_decided_of_malformed(found, reading);
    // The attribute that an element seems to lack is there, but misspelt.
    let strangers = reading.iter().filter(|finding| finding.code == Code::UnknownAttribute);
    let misspelt: BTreeSet<_> =
        strangers.filter_map(|finding| finding.at.as_ref().map(element_of)).collect();
    // A variable that is only half declared cannot be used yet.
    let half_declared = names_at(reading, Code::NotSettable);
    found.retain(|finding| {
        let Some(at) = &finding.at else { return true };
        match finding.code {
            Code::NoEffect | Code::NoSafePlace | Code::NoGoal => {
                !misspelt.contains(&element_of(at))
            }
            Code::UnusedVariable => !half_declared.contains(at.text()),
            _ => true,
        }
    });
    // What a sub-mission is called whose element cannot be read is not known.
    let is_of_submission = |it: &Finding| {
        matches!(it.code, Code::UnknownAttribute | Code::MissingAttribute)
            && it.message.starts_with("<submission>")
    };
    if reading.iter().any(is_of_submission) {
        found.retain(|finding| {
            !matches!(finding.code, Code::UnknownTransition | Code::UnknownPlace)
                || finding.at.as_ref().is_none_or(|at| !at.text().contains('.'))
        });
    }
    if has(&[Code::IncludeMissing, Code::IncludeCycle]) {
        found.retain(|finding| {
            finding.code != Code::UnknownComponent
                || !finding.message.starts_with("no place activates")
        });
    }
}

/// Returns the ends of links that name a component whose name is given twice.
fn find_ends_of_duplicates<'a>(findings: &Findings, system: &'a System) -> Vec<&'a Port> {
    let names = names_at(findings, Code::DuplicateComponent);
    let ends = system.links.iter().flat_map(|link| [&link.from, &link.to]);
    ends.filter(|end| names.contains(&end.component.value)).collect()
}

/// The place of a location among those of all files.
fn place_of(at: &Location) -> (PathBuf, Span) {
    (at.source.path().to_path_buf(), at.span)
}

/// The file of a location in a start tag, and where that tag begins.
fn element_of(at: &Location) -> (PathBuf, usize) {
    let before = at.source.text().get(..=at.span.start()).unwrap_or_default();
    (at.source.path().to_path_buf(), before.rfind('<').unwrap_or_default())
}

fn names_at(findings: &Findings, code: Code) -> BTreeSet<String> {
    let of_code = findings.iter().filter(|finding| finding.code == code);
    of_code.filter_map(|finding| Some(finding.at.as_ref()?.text().to_owned())).collect()
}
