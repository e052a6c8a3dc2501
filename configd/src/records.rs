//! Findings and changes as the records of the protocol, and when a change takes effect.

use armor_robotfile::mission::Place;
use armor_robotfile::{
    Change, Configuration, Difference, Findings, Location, Severity, Subject, differences,
};
use armor_wire::config::{self, ChangeKind, ChangeSubject, FindingSeverity, MAX_RECORDS, cut_text};

use crate::versions::rules::VersionRules;

/// Returns the first [`MAX_RECORDS`] findings, and the number of further ones.
pub(crate) fn finding_records(findings: &Findings) -> (Vec<config::FindingRecord>, u32) {
    let records = findings.iter().take(MAX_RECORDS).map(|finding| {
        let mut record = config::FindingRecord {
            severity: severity_of(finding.severity()),
            code: finding.code.as_str().into(),
            message: cut_text(&*finding.message),
            remedy: cut_text(&*finding.remedy),
            ..config::FindingRecord::default()
        };
        if let Some(at) = &finding.at {
            set_location(at, &mut record);
        } else if let Some(file) = &finding.file {
            record.file = cut_text(file.to_string_lossy());
        }
        record
    });
    (records.collect(), left_out(findings.iter().len()))
}

fn set_location(at: &Location, record: &mut config::FindingRecord) {
    let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (line, column) = at.line_column();
    let (end_line, end_column) = at.source.line_column(at.span.end());
    record.file = cut_text(at.source.path().to_string_lossy());
    (record.line, record.column) = (number(line), number(column));
    (record.end_line, record.end_column) = (number(end_line), number(end_column));
    record.text = cut_text(at.text());
    record.source_line = cut_text(at.source.text().lines().nth(line - 1).unwrap_or_default());
}

/// Returns the first [`MAX_RECORDS`] changes between two versions with their effects, and the
/// number of further ones. `is_unrequested`: whether a component runs and has not requested a
/// parameter.
pub(crate) fn change_records(
    before: &Configuration,
    after: &Configuration,
    rules: &VersionRules,
    is_unrequested: &dyn Fn(&str, &str) -> bool,
) -> (Vec<config::ChangeRecord>, u32) {
    let differences = differences(before, after);
    let records = differences.iter().take(MAX_RECORDS).map(|difference| {
        let (change, aspect, before, after_it) = match &difference.change {
            Change::Added { what } => (ChangeKind::Added, "", "", what.as_str()),
            Change::Removed { what } => (ChangeKind::Removed, "", what.as_str(), ""),
            Change::Changed { aspect, before, after } => {
                (ChangeKind::Changed, aspect.as_str(), before.as_str(), after.as_str())
            }
        };
        config::ChangeRecord {
            subject: subject_of(difference.subject),
            name: cut_text(&*difference.name),
            change,
            aspect: cut_text(aspect),
            before: cut_text(before),
            after: cut_text(after_it),
            text: cut_text(difference.to_string()),
            effect: cut_text(describe_effect(difference, after, rules, is_unrequested)),
        }
    });
    (records.collect(), left_out(differences.len()))
}

fn severity_of(severity: Severity) -> FindingSeverity {
    match severity {
        Severity::Error => FindingSeverity::Error,
        Severity::Warning => FindingSeverity::Warning,
        Severity::Note => FindingSeverity::Note,
    }
}

fn subject_of(subject: Subject) -> ChangeSubject {
    match subject {
        Subject::System => ChangeSubject::System,
        Subject::Host => ChangeSubject::Host,
        Subject::Frame => ChangeSubject::Frame,
        Subject::Component => ChangeSubject::Component,
        Subject::Parameter => ChangeSubject::Parameter,
        Subject::Link => ChangeSubject::Link,
        // The message has no words for what is drawn: it is the mission's, under its own name.
        Subject::Mission | Subject::Map | Subject::Mark | Subject::Route => ChangeSubject::Mission,
        Subject::Variable => ChangeSubject::Variable,
        Subject::Place => ChangeSubject::Place,
        Subject::Exclusive => ChangeSubject::Exclusive,
        Subject::Transition => ChangeSubject::Transition,
        Subject::Submission => ChangeSubject::Submission,
    }
}

fn left_out(len: usize) -> u32 {
    u32::try_from(len.saturating_sub(MAX_RECORDS)).unwrap_or(u32::MAX)
}

/// Returns the places whose value of the parameter has priority while they are marked.
fn list_places_that_set<'a>(
    configuration: &'a Configuration,
    component: &str,
    parameter: &str,
) -> Vec<&'a str> {
    let places = configuration.mission.iter().flat_map(|mission| &mission.places);
    let sets_it = |place: &&Place| {
        place.parameters.iter().any(|given| {
            given.component.value == component && given.parameter.name.value == parameter
        })
    };
    places.filter(sets_it).map(|place| place.name.value.as_str()).collect()
}

/// Describes when a change takes effect. A component requests its parameters, rate and links when
/// it starts; the launcher reads the file once; the executive decides itself when to take a new
/// mission.
fn describe_effect(
    difference: &Difference,
    after: &Configuration,
    rules: &VersionRules,
    is_unrequested: &dyn Fn(&str, &str) -> bool,
) -> String {
    let at_next_start = |component: &str| format!("takes effect when {component} is started again");
    let name = difference.name.as_str();
    match (difference.subject, &difference.change) {
        (Subject::Parameter, _) => {
            let (component, parameter) = name.split_once('.').unwrap_or((name, ""));
            let kind = after.system.component(component).map(|found| found.kind.value.as_str());
            if rules.is_overridden(component, parameter) {
                format!("has no effect: --set gives {name} its value")
            } else if is_unrequested(component, parameter) {
                format!(
                    "reaches {component} only when {component} requests {parameter}, which it \
                     declares but has not requested"
                )
            } else if !kind.is_some_and(|kind| rules.is_live(kind, parameter)) {
                at_next_start(component)
            } else {
                let places = list_places_that_set(after, component, parameter);
                if places.is_empty() {
                    format!("reaches {component} immediately")
                } else {
                    format!(
                        "reaches {component} immediately, but not while one of these places is \
                         marked, which set it themselves: {}",
                        places.join(", ")
                    )
                }
            }
        }
        (Subject::Component, Change::Changed { aspect, .. })
            if aspect == "rate" || aspect == "controllable" =>
        {
            at_next_start(name)
        }
        (Subject::Link, _) => {
            let input = name.rsplit("-> ").next().unwrap_or(name);
            at_next_start(input.split('.').next().unwrap_or(input))
        }
        (
            Subject::Mission
            | Subject::Map
            | Subject::Mark
            | Subject::Route
            | Subject::Variable
            | Subject::Place
            | Subject::Exclusive
            | Subject::Transition
            | Subject::Submission,
            _,
        ) => "takes effect once the executive finds it safe from where the mission stands".into(),
        // The parameters that it fills are changes of their own.
        (Subject::Frame, _) => "takes effect with the parameters that have the frames".into(),
        (Subject::System | Subject::Host | Subject::Component, _) => {
            "takes effect when the system is run again".into()
        }
    }
}
