//! `<transition>` → [`Transition`].

use std::sync::Arc as Shared;
use std::time::Duration;

use crate::code::Code;
use crate::fields::{ElementFields, digits};
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{
    Arc, ArcKind, Autonomy, Interval, LostLink, Missed, ReportRef, SetVariable, Transition,
};
use crate::source::{Source, Spanned};
use crate::tree::{Attribute, Element};
use crate::wanted_quantity::read_duration;

/// Reads one; None if it has no name.
pub(super) fn read(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<Transition> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let mut arcs = short_form(&mut fields);
    let autonomy_at = ["operator", "autonomy"].iter().find_map(|name| fields.attribute_at(name));
    let within = fields.duration("answer-within");
    let autonomy = read_autonomy(&mut fields, within.as_deref().copied());
    let named = name.is_some();
    let mut transition = Transition {
        name: name.unwrap_or_else(|| Spanned::new(String::new(), fields.at())),
        arcs: Vec::new(),
        sets: Vec::new(),
        on: fields.dotted("on").map(|on| ReportRef { component: on.component, event: on.port }),
        interval: read_interval(&mut fields),
        when: fields.text("when"),
        priority: fields.converted("priority", parse_priority).map_or(0, |priority| priority.value),
        class: super::mission::class(&mut fields),
        autonomy,
        lost_link: fields
            .choice("lost-link", &[("fire", LostLink::Fire), ("wait", LostLink::Wait)]),
        not_before: fields.converted("not-before", str::parse),
        not_after: fields.converted("not-after", str::parse),
        missed: fields.choice(
            "missed",
            &[("fire", Missed::Fire), ("skip", Missed::Skip), ("fail", Missed::Fail)],
        ),
        on_stop_fail: fields.name("on-stop-fail"),
        on_start_fail: fields.name("on-start-fail"),
        overrun: fields.name("overrun"),
        autonomy_at,
        answer_at: within.map(|within| within.at),
        is_doubtful: false,
    };
    let words: [(&str, &[&str]); 2] =
        [("operator", &["true", "false"]), ("autonomy", &["auto", "confirm", "operator"])];
    let is_clear = |(name, words): &(&str, &[&str])| {
        element.attribute(name).is_none_or(|it| words.contains(&it.value.as_str()))
    };
    without_effect(&transition, words.iter().all(is_clear), &mut fields);
    super::mission::report_default_class(&mut fields);
    for child in fields.finish(&["arc", "read", "inhibitor", "reset", "set"]) {
        if child.name == "set" {
            transition.sets.extend(read_set(child, source, findings));
        } else {
            arcs.extend(read_arc(child, source, findings));
        }
    }
    refuse_repeats(&arcs, findings);
    transition.arcs = arcs;
    named.then_some(transition)
}

/// The first rows of the table below are about an operator.
const AUTONOMY_ROWS: usize = 3;

/// Reports attributes that have no effect because this transition lacks another one.
fn without_effect(
    transition: &Transition,
    has_clear_autonomy: bool,
    fields: &mut ElementFields<'_, '_>,
) {
    let confirms = matches!(transition.autonomy, Autonomy::Confirm { .. });
    let has_last_date = fields.attribute_at("not-after").is_some();
    let has_deadline =
        transition.interval.as_ref().is_none_or(|interval| interval.latest.is_some());
    let table = [
        (
            transition.autonomy != Autonomy::Auto,
            "lost-link",
            "no operator is asked about this transition: write operator=\"true\" or \
             autonomy=\"confirm\", or remove it",
        ),
        (
            confirms,
            "answer-within",
            "this transition asks no operator: write autonomy=\"confirm\", or remove it",
        ),
        (
            confirms && fields.attribute_at("answer-within").is_some(),
            "unanswered",
            match confirms {
                true => {
                    "without a time the question waits for its answer without end: write \
                     answer-within=\"30s\", or remove it"
                }
                false => {
                    "there is no question to answer here: write autonomy=\"confirm\" and \
                     answer-within=\"30s\", or remove it"
                }
            },
        ),
        (
            has_last_date,
            "missed",
            "without a last date there is nothing to miss: write not-after, or remove it",
        ),
        (
            has_deadline,
            "overrun",
            "without a latest time it cannot be late: write timeout or interval, or remove it",
        ),
    ];
    // An autonomy that cannot be read may be the one that they need.
    let mut is_reported = !has_clear_autonomy;
    for (number, (_, name, why)) in
        table.into_iter().enumerate().filter(|(_, (matters, ..))| !matters)
    {
        // Without an operator, what is asked and what is answered are one mistake.
        if number < AUTONOMY_ROWS
            && (fields.attribute_at(name).is_none() || std::mem::replace(&mut is_reported, true))
        {
            continue;
        }
        fields.without_effect(name, why);
    }
}

fn short_form(fields: &mut ElementFields<'_, '_>) -> Vec<Arc> {
    let arc = |kind| move |place| Arc { kind, place, weight: 1 };
    let from: Vec<_> = fields.names("from").into_iter().map(arc(ArcKind::Take)).collect();
    from.into_iter().chain(fields.names("to").into_iter().map(arc(ArcKind::Put))).collect()
}

/// `<arc from=…/>`, `<arc to=…/>`, `<read place=…/>`, `<inhibitor place=…/>`, `<reset place=…/>`.
fn read_arc(element: &Element, source: &Shared<Source>, findings: &mut Findings) -> Option<Arc> {
    let is_unknown = |it: &Attribute| {
        !["from", "to", "weight"].contains(&it.name.as_str()) && !it.name.contains(':')
    };
    let mut fields = ElementFields::new(element, source, findings);
    let (kind, place) = match element.name.as_str() {
        "read" => (ArcKind::Read, fields.required_name("place")),
        "inhibitor" => (ArcKind::Inhibitor, fields.required_name("place")),
        "reset" => (ArcKind::Reset, fields.required_name("place")),
        _ => {
            fields.only_one_of(&["from", "to"]);
            match (fields.name("from"), fields.name("to")) {
                (None, Some(to)) => (ArcKind::Put, Some(to)),
                // A misspelt attribute is a finding already.
                (None, None) if element.attributes.iter().any(is_unknown) => (ArcKind::Take, None),
                (None, None) => {
                    let finding =
                        Finding::new(Code::NoArcs, &fields.at(), "this arc joins no place");
                    fields.report(finding.remedy("write from=\"…\" or to=\"…\""));
                    (ArcKind::Take, None)
                }
                (from, _) => (ArcKind::Take, from),
            }
        }
    };
    let weight = if kind == ArcKind::Reset { None } else { fields.count("weight", 1) };
    fields.finish(&[]);
    Some(Arc { kind, place: place?, weight: weight.map_or(1, |weight| weight.value) })
}

/// `<set variable="round" value="round + 1"/>`.
fn read_set(
    element: &Element,
    source: &Shared<Source>,
    findings: &mut Findings,
) -> Option<SetVariable> {
    let mut fields = ElementFields::new(element, source, findings);
    let (variable, value) = (fields.required_name("variable"), fields.required("value"));
    fields.finish(&[]);
    Some(SetVariable { variable: variable?, value: value? })
}

fn refuse_repeats(arcs: &[Arc], findings: &mut Findings) {
    let mut seen = std::collections::BTreeMap::new();
    for arc in arcs {
        let place = &arc.place;
        // A name that a list has twice is a finding already.
        let is_listed = |it: &Finding| {
            let is_there = it.at.as_ref().is_some_and(|at| at.is_at(&place.at));
            it.code == Code::DuplicateInList && is_there
        };
        if let Some(first) = seen.insert((arc.kind, place.value.as_str()), &place.at)
            && !findings.iter().any(is_listed)
        {
            let message = format!("{} has two arcs of the same kind here", place.value);
            let finding = Finding::new(Code::DuplicateArc, &place.at, message);
            findings
                .push(finding.remedy("write one arc with a weight").related(first, "first here"));
        }
    }
}

/// `timeout="T"` is `[T,T]`, `after="T"` is `[T,∞)`, `interval="[a,b]"` is itself.
fn read_interval(fields: &mut ElementFields<'_, '_>) -> Option<Spanned<Interval>> {
    fields.only_one_of(&["timeout", "after", "interval"]);
    let timeout = fields.duration("timeout").map(|t| t.with(exact_interval(t.value)));
    let after =
        fields.duration("after").map(|t| t.with(Interval { earliest: t.value, latest: None }));
    let interval = fields.converted("interval", interval_of);
    timeout.or(after).or(interval)
}

fn exact_interval(after: Duration) -> Interval {
    Interval { earliest: after, latest: Some(after) }
}

fn interval_of(text: &str) -> Result<Interval, String> {
    let expected = || "an interval such as [2s,5s] or [2s,inf) is expected".to_owned();
    let inner =
        text.strip_prefix('[').and_then(|text| text.split_once(',')).ok_or_else(expected)?;
    let earliest = read_duration(inner.0.trim())?;
    if inner.1.trim() == "inf)" {
        return Ok(Interval { earliest, latest: None });
    }
    let latest = read_duration(inner.1.strip_suffix(']').ok_or_else(expected)?.trim())?;
    if latest < earliest {
        return Err("the interval ends before it begins".into());
    }
    Ok(Interval { earliest, latest: Some(latest) })
}

fn parse_priority(text: &str) -> Result<i32, String> {
    digits(text.strip_prefix('-').unwrap_or(text))
        .and_then(|_| text.parse().ok())
        .ok_or_else(|| "a whole number from -999999999 to 999999999 is expected".into())
}

/// `operator="true"` is `autonomy="operator"`.
fn read_autonomy(fields: &mut ElementFields<'_, '_>, within: Option<Duration>) -> Autonomy {
    fields.only_one_of(&["operator", "autonomy"]);
    let operator = fields.flag("operator", false);
    let unanswered = fields.choice("unanswered", &[("fire", true), ("decline", false)]);
    let confirm = Autonomy::Confirm {
        within,
        fire_unanswered: unanswered.is_some_and(|unanswered| unanswered.value),
    };
    let chosen = fields.choice(
        "autonomy",
        &[("auto", Autonomy::Auto), ("confirm", confirm), ("operator", Autonomy::Operator)],
    );
    match chosen {
        Some(chosen) => chosen.value,
        None if operator => Autonomy::Operator,
        None => Autonomy::Auto,
    }
}
