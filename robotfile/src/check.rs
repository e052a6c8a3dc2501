//! Checks a file as a whole: its parts against each other, and against the manifests of its
//! components. One pass finds everything; no check stops at the first finding.

mod activity;
mod any_type;
mod claims;
mod companions;
mod concurrency;
mod crossed;
mod cut_short;
mod dates;
mod drawn;
mod drawn_exits;
mod drawn_zones;
mod effectless;
mod ending;
mod endless;
mod entrances;
mod exclusive;
mod exits;
mod fed_inputs;
mod feedback;
mod followers;
mod frames;
mod frozen;
mod goals;
mod graph;
mod guards;
mod kinds;
mod layout;
mod links;
mod lone_activation;
mod lost_outputs;
mod manifests;
mod meant_inputs;
mod mission;
mod misspelt_declaration;
mod names;
mod needed_frames;
mod order;
mod paths;
mod ports;
mod rates;
mod reach;
mod reports;
mod short_times;
mod starved;
mod system;
mod times;
mod transition;
mod twice;
mod unawaited_ends;
mod undeclared;
mod unused;
mod unused_done;
mod uses;
mod value_effects;

use std::collections::BTreeSet;

use crate::check::activity::Activity;
use crate::code::Code;
use crate::elements::are_one_name;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::load::Reading;
use crate::manifests::Manifests;
use crate::model::{Configuration, System};
use crate::overrides::{self, Override};
use crate::source::Location;

pub use dates::passed_dates;
pub use frames::{BASE_FRAME, MOVING_FRAMES};
pub use guards::within;
pub use paths::{NeededPath, needed_paths};
pub use system::RESERVED_NAMES;
pub use times::check_times;

/// Applies the overrides to the file and checks the result; without manifests only the file itself
/// is checked. The findings are sorted by file and line.
pub fn check(
    mut reading: Reading,
    overrides: &[Override],
    manifests: Option<&Manifests>,
) -> Reading {
    let mut findings = std::mem::take(&mut reading.findings);
    drop_end_tags(&mut findings);
    drop_guesses(&mut findings);
    findings.merge_same(are_ends_of_one_link);
    findings.merge_same(are_same_name);
    if let Some(configuration) = &mut reading.configuration {
        let mut found = Findings::default();
        findings.retain(|finding| !repeats_malformed(finding, &configuration.system));
        system::keep_first(&mut configuration.system, &mut found);
        by_itself(configuration, manifests, &mut found);
        reports::check(configuration, manifests, &mut found);
        guards::check(configuration, manifests, &mut found);
        claims::check(configuration, &mut found);
        overrides::apply(configuration, overrides, &mut found);
        if let Some(manifests) = manifests {
            manifests::check(configuration, manifests, &mut found);
            manifests::explain_attributes(&configuration.system, manifests, &mut findings);
            undeclared::explain(configuration, Some(manifests), &mut found);
            fill_parameters(configuration, manifests);
        } else {
            undeclared::explain(configuration, None, &mut found);
        }
        // If a name is misspelt, the thing that was meant only seems to be unused.
        if !findings.has_errors() && !found.has_errors() {
            if let Some(manifests) = manifests {
                unused::check(configuration, manifests, &mut found);
                crossed::check(&configuration.system, manifests, &mut found);
                rates::check(&configuration.system, manifests, &mut found);
                frames::check_parents(&configuration.system, manifests, &mut found);
                value_effects::check(configuration, manifests, &mut found);
                paths::check_own_files(configuration, manifests, &mut found);
            }
            without_errors(configuration, manifests, &mut found);
        }
        followers::drop_followers(&mut found, &configuration.system);
        followers::drop_followers_of_reading(&mut found, &findings);
        misspelt_declaration::blame(configuration, &mut found);
        let is_partial = reading.is_partial;
        findings.absorb(found, |f| !is_partial || !f.code.is_of_something_missing());
    }
    reading.findings = findings.finish();
    reading
}

/// Gives the components what the file states once for all of them, as if it assigned their parameters:
/// its frames, and the zones of its map. [`check`](crate::check()) does it; a caller does it for a
/// configuration that is not checked.
pub fn fill_parameters(configuration: &mut Configuration, manifests: &Manifests) {
    frames::fill_frames(configuration, manifests);
    drawn_zones::fill_zones(configuration, manifests);
}

/// Drops findings about end tags whose start tag is misspelt, which is a finding already.
fn drop_end_tags(findings: &mut Findings) {
    let place = |at: &Location| (at.source.path().to_path_buf(), at.span);
    let unknown = findings
        .iter()
        .filter(|finding| matches!(finding.code, Code::UnknownElement | Code::WrongRoot));
    let unknown: BTreeSet<_> =
        unknown.filter_map(|finding| finding.at.as_ref()).map(place).collect();
    let is_repeated = |finding: &Finding| {
        let Some((start, _)) = finding.related.first() else { return false };
        let end = finding.at.as_ref().map_or("", Location::text);
        let name = end.trim_start_matches("</").trim_end_matches('>').trim();
        unknown.contains(&place(start)) && are_one_name(start.text(), name)
    };
    findings.retain(|finding| finding.code != Code::EndTag || !is_repeated(finding));
}

/// Returns whether both ends of one link are malformed in the same manner: `from="laser" to="mapper"`.
fn are_ends_of_one_link(first: &Finding, other: &Finding) -> bool {
    let line = |finding: &Finding| Some(finding.at.as_ref()?.line_column().0);
    let is_end = |finding: &Finding, end: &str| {
        finding.code == Code::BadValue && finding.message.starts_with(end)
    };
    is_end(first, "from: ")
        && is_end(other, "to: ")
        && first.remedy == other.remedy
        && line(first) == line(other)
}

/// Returns whether both report the same malformed name: where it is given, and where it is used.
fn are_same_name(first: &Finding, other: &Finding) -> bool {
    let is_one = |finding: &Finding| finding.code == Code::BadName;
    let text = |finding: &Finding| finding.at.as_ref().map(|at| at.text().to_owned());
    is_one(first)
        && is_one(other)
        && !text(first).is_none_or(|it| it.is_empty())
        && text(first) == text(other)
}

/// Drops findings about names and values on the line of something that is not closed, such as a quotation mark:
/// which of its characters belong to them is only a guess.
fn drop_guesses(findings: &mut Findings) {
    let line = |at: &Location| (at.source.path().to_path_buf(), at.line_column().0);
    let malformed = findings.iter().filter(|finding| finding.code == Code::Malformed);
    let malformed: Vec<_> = malformed
        .filter(|finding| finding.message.contains("not closed"))
        .filter_map(|finding| finding.at.as_ref())
        .map(|at| (line(at), at.span.start()))
        .collect();
    let is_guess = |finding: &Finding| {
        use Code::{BadName, BadValue, UnknownAttribute, UnknownElement};
        matches!(finding.code, BadName | BadValue | UnknownElement | UnknownAttribute)
            && finding.at.as_ref().is_some_and(|at| {
                malformed
                    .iter()
                    .any(|(there, start)| line(at) == *there && at.span.start() >= *start)
            })
    };
    if !malformed.is_empty() {
        findings.retain(|finding| !is_guess(finding));
    }
}

/// Returns whether the finding repeats, for a use of a component's name, that the name is
/// malformed.
fn repeats_malformed(finding: &Finding, system: &System) -> bool {
    let Some(at) = &finding.at else { return false };
    let used = match finding.code {
        Code::BadName => at.text(),
        Code::BadValue => at.text().rsplit_once('.').map_or("", |(component, _)| component),
        _ => return false,
    };
    let is_there = || system.components.iter().any(|component| component.name.at.span == at.span);
    system.unreadable.is_malformed(used) && !is_there()
}

/// Runs the checks that need no manifests; with them one finds more.
fn by_itself(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    let system = &configuration.system;
    system::check(system, manifests, findings);
    frames::check(system, findings);
    links::check(system, findings);
    links::merge_short_queues(findings);
    mission::check(configuration, manifests, findings);
    for mission in configuration.missions() {
        let period = configuration.mission.as_ref().and_then(|main| main.period.as_ref());
        transition::check(mission, period, findings);
        order::check(mission, findings);
        twice::advise_identical(mission, findings);
        twice::check_implied(mission, findings);
        let is_whole =
            configuration.mission.as_ref().is_some_and(|main| std::ptr::eq(main, mission));
        drawn::check(mission, system, is_whole, findings);
        entrances::check(mission, findings);
        endless::check(mission, findings);
        effectless::check(mission, findings);
    }
}

/// Runs the checks of a file without errors for what seems to be missing in it.
fn without_errors(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    system::expect_components(&configuration.system, findings);
    links::check_circles(&configuration.system, findings);
    layout::check_system(&configuration.system, findings);
    if let Some(mission) = &configuration.mission {
        cut_short::check(mission, findings);
    }
    reports::check_always_active(configuration, findings);
    let unawaited =
        manifests.map(|it| unused_done::find_unawaited(configuration, it)).unwrap_or_default();
    let is_never_done = |name: &str| {
        let component = configuration.system.component(name);
        let kind = component.and_then(|it| manifests?.get(&it.kind.value));
        kind.is_some_and(|kind| !kind.reports_done)
    };
    let mut is_reached = true;
    for mission in configuration.missions() {
        layout::check_mission(mission, findings);
        short_times::check(mission, &configuration.system, findings);
        times::check(mission, &configuration.system, findings);
        let is_main = configuration.mission.as_ref().is_some_and(|it| std::ptr::eq(it, mission));
        ending::check(mission, is_main, findings);
        // With its sub-missions it may be larger than a mission may be, which is a finding then.
        if let Ok(whole) = configuration.flatten(mission) {
            is_reached &= reach::check(mission, &whole, is_main, findings);
            unused_done::check(mission, &unawaited, findings);
            goals::check(mission, &whole, is_main, &is_never_done, findings);
        }
    }
    value_effects::merge_by_timeout(findings);
    reach::drop_explained(configuration, findings);
    // Nothing is active in a place that is never reached, which is a finding already.
    if is_reached
        && let Ok(Some(whole)) = configuration.flattened()
        && let Some(activity) = Activity::of(&whole)
    {
        frozen::check(&activity, &configuration.system, manifests, findings);
        if let Some(manifests) = manifests {
            starved::check(&activity, &configuration.system, manifests, findings);
        }
        feedback::check(&activity, &configuration.system, findings);
        findings.merge_same(Finding::is_of_same_frozen);
        lone_activation::advise(configuration, findings);
    }
    if let Some(manifests) = manifests {
        unawaited_ends::check(configuration, manifests, findings);
    }
}
