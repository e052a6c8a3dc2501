//! Other values of a transition: its report, its guard, its times, its question.

use armor_robotfile::tree::Element;
use armor_robotfile::{Code, Finding};

use super::counting::is_single;
use super::places::CLOSE;
use super::words::share_word;
use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;
use crate::repair::likeness::are_related;

/// Ranks, next to those of places.
const REPORT: i32 = 21;
const GUARD: i32 = 21;
/// The same where a fault is about the values that guards compare.
pub(super) const GUARD_AT_FAULT: i32 = 12;
const QUESTION: i32 = 17;
const QUESTION_WRITTEN: i32 = 14;
const CONDITION: i32 = 22;
/// The rank of the operator who fires a transition, where it waits for nothing and fires before others.
const OPERATOR: i32 = 8;
/// How much less likely a guard is that only excludes one value.
const UNEQUAL: i32 = 2;
/// How much likelier a component is after which the transition is named.
const NAMED_AFTER: i32 = 6;
/// Each operator with the one that is true where it is false. Those come first that begin with
/// another one.
const OPPOSITES: [(&str, &str); 6] =
    [("<=", ">"), (">=", "<"), ("==", "!="), ("!=", "=="), ("<", ">="), (">", "<=")];
/// The operator that is true for smaller values than that at which a count ends.
const BELOW: [(&str, &str); 1] = [("==", "<")];
/// Each operator with that of the exchanged sides.
const MIRRORED: [(&str, &str); 6] =
    [("<=", ">="), (">=", "<="), ("==", "=="), ("!=", "!="), ("<", ">"), (">", "<")];
/// The time for an answer, if it is missing: as the findings about it suggest.
const ANSWER_WITHIN: &str = "30s";

impl MissionElements<'_> {
    pub(super) fn values_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(transition);
        let mut push = |attribute: &str, new: &str, rank: i32| {
            let edit = match transition.attribute(attribute) {
                Some(old) if old.value == new => None,
                Some(old) => Some(self.with_value(transition, old, new)),
                None => self.with_attribute(transition, attribute, new),
            };
            edits.extend(edit.map(|edit| edit.ranked(rank - close)));
        };
        if let Some((component, event)) = value(transition, "on").and_then(|on| on.split_once('.'))
        {
            let name = value(transition, "name").unwrap_or("");
            let likeness = |other: &str| if are_related(name, other) { NAMED_AFTER } else { 0 };
            for other in self.components_of(transition).into_iter().filter(|it| *it != component) {
                let rank = REPORT + likeness(component) - likeness(other);
                push("on", &format!("{other}.{event}"), rank);
            }
            if event == "failed" {
                let all = self.components_of(transition);
                all.iter().for_each(|it| push("on", &format!("{it}.done"), REPORT + 1));
            }
        }
        for other in self.other_guards(transition) {
            // A guard that is missing altogether is at fault where a count has no end.
            let is_written = value(transition, "when").is_some();
            let is_at_fault = match is_written {
                true => self.is_about_values(),
                false => self.has_fault(&[Code::ValueOutside]),
            };
            let rank = if is_at_fault { GUARD_AT_FAULT } else { GUARD };
            let set = close - CLOSE * self.closeness_of_guard(transition);
            let unequal = if other.contains("!=") { UNEQUAL } else { 0 };
            push("when", &other, rank + set + unequal);
        }
        if self.fires_unasked(transition) {
            push("operator", "true", OPERATOR);
        }
        let has_time = value(transition, "answer-within").is_some();
        match value(transition, "autonomy") {
            Some("confirm") if has_time => {
                push("unanswered", "fire", QUESTION);
                if value(transition, "lost-link").is_some() {
                    push("lost-link", "fire", QUESTION_WRITTEN);
                }
            }
            Some("confirm") => push("answer-within", ANSWER_WITHIN, QUESTION),
            _ if has_time => push("autonomy", "confirm", QUESTION),
            _ => {}
        }
    }

    /// Fewer conditions: without a place that it reads, or that keeps it from firing.
    pub(super) fn conditions_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(transition);
        self.arcs_of_transition(transition, edits);
        let conditions = ["read", "inhibitor"];
        for inner in transition.elements().filter(|it| conditions.contains(&it.name.as_str())) {
            edits.push(self.without_inner(transition, inner).ranked(CONDITION - close));
        }
    }

    /// Whether a fault is that the transition always fires before others, and nothing but a guard keeps it
    /// from firing in a place in which nothing works.
    fn fires_unasked(&self, transition: &Element) -> bool {
        let name = value(transition, "name").unwrap_or("");
        let moments =
            ["on", "timeout", "after", "interval", "operator", "autonomy", "class", "priority"];
        let waits = moments.iter().any(|it| transition.attribute(it).is_some());
        let is_before = |fault: &Finding| {
            let before = fault.message.split_once(" always fires before");
            let names = before.and_then(|it| it.0.rsplit_once(": ")).map_or("", |it| it.1);
            names.split([',', ' ']).any(|word| word == name)
        };
        !waits
            && value(transition, "when").is_some()
            && self.components_of(transition).is_empty()
            && self.faults.iter().any(is_before)
    }

    /// The components of the places that a transition leads on from.
    fn components_of(&self, transition: &Element) -> Vec<&str> {
        let from = value(transition, "from").unwrap_or("");
        let places = self.places.iter().filter(|place| {
            value(place, "name").is_some_and(|name| from.split_whitespace().any(|it| it == name))
        });
        places.filter_map(|it| value(it, "components")).flat_map(str::split_whitespace).collect()
    }
}

impl MissionElements<'_> {
    /// Other guards of a transition: what the guard of another one that waits for the same excludes,
    /// and its own comparison the other way round.
    fn other_guards(&self, transition: &Element) -> Vec<String> {
        let guard = value(transition, "when");
        let is_rival = |other: &&&Element| {
            let same = |attribute: &str| value(other, attribute) == value(transition, attribute);
            // The one that ends a count may take the tokens of a fork, too.
            let shares = match guard {
                Some(_) => same("from"),
                None => share_word(value(transition, "from"), value(other, "from")),
            };
            shares && same("on") && value(other, "name") != value(transition, "name")
        };
        let rivals = self.transitions.iter().filter(is_rival);
        // An operator repeats what a count ends, too.
        let has_no_end = guard.is_none() && self.has_fault(&[Code::ValueOutside]);
        let rivals = rivals.filter(|_| value(transition, "on").is_some() || has_no_end);
        // Where a count ends at a value, it continues below it.
        let opposites = rivals.flat_map(|it| {
            let guard = value(it, "when").unwrap_or("");
            [with_operator(guard, OPPOSITES), with_operator(guard, BELOW)].into_iter().flatten()
        });
        let mirrored = guard.and_then(|guard| with_operator(guard, MIRRORED));
        let all = mirrored.into_iter().chain(opposites);
        all.filter(|other| Some(other.as_str()) != guard).collect()
    }
}

/// A guard that is a single comparison, with another operator.
fn with_operator<const N: usize>(guard: &str, operators: [(&str, &str); N]) -> Option<String> {
    let (at, (old, new)) = operators.iter().find_map(|it| Some((guard.find(it.0)?, it)))?;
    (is_single(guard) && old != new)
        .then(|| format!("{}{new}{}", &guard[..at], &guard[at + old.len()..]))
}
