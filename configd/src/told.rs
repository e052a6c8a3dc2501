//! Findings and changes in the records of the protocol, and when a change takes effect.

use armor_robotfile::{
    Change, Configuration, Difference, Findings, Location, Subject, differences,
};
use armor_wire::config::{self, MAX_TOLD, cut};

use crate::versions::Rules;

/// The first findings, and how many more there are.
pub(crate) fn findings(findings: &Findings) -> (Vec<config::Finding>, u32) {
    let told = findings.iter().take(MAX_TOLD).map(|finding| {
        let mut told = config::Finding {
            severity: finding.severity().to_string(),
            code: finding.code.as_str().into(),
            message: cut(&*finding.message),
            remedy: cut(&*finding.remedy),
            ..config::Finding::default()
        };
        if let Some(at) = &finding.at {
            place(at, &mut told);
        } else if let Some(file) = &finding.file {
            told.file = cut(file.to_string_lossy());
        }
        told
    });
    (told.collect(), left_out(findings.iter().len()))
}

fn place(at: &Location, told: &mut config::Finding) {
    let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (line, column) = at.line_column();
    let (end_line, end_column) = at.source.line_column(at.span.end());
    told.file = cut(at.source.path().to_string_lossy());
    (told.line, told.column) = (number(line), number(column));
    (told.end_line, told.end_column) = (number(end_line), number(end_column));
    told.text = cut(at.text());
    told.source_line = cut(at.source.text().lines().nth(line - 1).unwrap_or_default());
}

/// The first changes from one version to another with their effects, and how many more there are.
pub(crate) fn changes(
    before: &Configuration,
    after: &Configuration,
    rules: &Rules,
) -> (Vec<config::Change>, u32) {
    let differences = differences(before, after);
    let told = differences.iter().take(MAX_TOLD).map(|difference| {
        let (change, aspect, before, after_it) = match &difference.change {
            Change::Added { what } => ("added", "", "", what.as_str()),
            Change::Removed { what } => ("removed", "", what.as_str(), ""),
            Change::Changed { aspect, before, after } => {
                ("changed", aspect.as_str(), before.as_str(), after.as_str())
            }
        };
        config::Change {
            subject: difference.subject.to_string(),
            name: cut(&*difference.name),
            change: change.into(),
            aspect: cut(aspect),
            before: cut(before),
            after: cut(after_it),
            text: cut(difference.to_string()),
            effect: cut(effect(difference, after, rules)),
        }
    });
    (told.collect(), left_out(differences.len()))
}

fn left_out(len: usize) -> u32 {
    u32::try_from(len.saturating_sub(MAX_TOLD)).unwrap_or(u32::MAX)
}

/// When a change takes effect. A component asks for its parameters, its rate and its links when it
/// starts; the launcher reads the file once; the executive judges a new mission by itself.
fn effect(difference: &Difference, after: &Configuration, rules: &Rules) -> String {
    let at_next_start = |component: &str| format!("takes effect when {component} is started again");
    let name = difference.name.as_str();
    match (difference.subject, &difference.change) {
        (Subject::Parameter, _) => {
            let (component, parameter) = name.split_once('.').unwrap_or((name, ""));
            let kind = after.system.component(component).map(|found| found.kind.value.as_str());
            if rules.is_overridden(component, parameter) {
                format!("has no effect: --set gives {name} its value")
            } else if kind.is_some_and(|kind| rules.is_live(kind, parameter)) {
                format!("reaches {component} at once")
            } else {
                at_next_start(component)
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
            | Subject::Variable
            | Subject::Place
            | Subject::Exclusive
            | Subject::Transition
            | Subject::Submission,
            _,
        ) => "takes effect once the executive finds it safe from where the mission stands".into(),
        _ => "takes effect when the system is run again".into(),
    }
}
