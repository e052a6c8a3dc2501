//! Counts that are wrong: a variable that is not set, or set to another value, and guards with another
//! operator, another number or another variable.

use armor_robotfile::tree::Element;
use armor_robotfile::{Code, Span};

use super::attributes::GUARD_AT_FAULT;
use super::places::CLOSE;
use super::{MissionElements, escape, value};
use crate::repair::file_edit::FileEdit;

/// Ranks, next to those of guards: what is missing, then what is written otherwise.
const SET: i32 = 15;
const NUMBER: i32 = 17;
const VARIABLE: i32 = 18;
const BEGINS: i32 = 2;
/// How much likelier another step is wrong than a guard: counts go up by one.
const OTHER_STEP: i32 = 4;
/// How much likelier they are where a fault is about the values that guards compare.
const AT_FAULT: i32 = 2;
/// Each operator with the one that differs only where both sides are equal.
const STRICT: [(&str, &str); 6] =
    [("<=", "<"), (">=", ">"), ("==", ">="), ("!=", "<"), ("<", "<="), (">", ">=")];

impl MissionElements<'_> {
    /// Whether a fault is about the values that guards compare, and not only about the places.
    pub(super) fn is_about_values(&self) -> bool {
        self.faults.iter().any(|fault| match fault.code {
            Code::ValueOutside => true,
            Code::NeverFires => fault.message.contains("because "),
            Code::Tie => fault.message.contains("guards"),
            _ => false,
        })
    }

    pub(super) fn counts_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let closeness = self.closeness(transition);
        if closeness == 0 {
            return;
        }
        let Some(guard) = transition.attribute("when") else {
            return self.guard_count(transition, closeness, edits);
        };
        let at_fault = if self.is_about_values() { AT_FAULT } else { 0 };
        // Where a guard only lets a count begin, another one ends it.
        let begins = if guard.value.contains('>') { BEGINS } else { 0 };
        for counted in self.counted().filter(|counted| has_word(&guard.value, counted)) {
            let rank = SET + begins - CLOSE * closeness - at_fault;
            self.set_one_more(transition, counted, rank, edits);
        }
        let closeness = self.closeness_of_guard(transition);
        let close = CLOSE * closeness + at_fault;
        if self.counted().any(|counted| has_word(&guard.value, counted)) {
            if let Some(other) = with_stricter(&guard.value) {
                let rank = GUARD_AT_FAULT - CLOSE * closeness;
                edits.push(self.with_value(transition, guard, &other).ranked(rank));
            }
            for other in with_next_numbers(&guard.value) {
                edits.push(self.with_value(transition, guard, &other).ranked(NUMBER - close));
            }
        }
        for written in self.counted().chain(self.followed()) {
            for meant in self.counted().filter(|meant| *meant != written) {
                if has_word(&guard.value, written) {
                    let other = guard.value.replace(written, meant);
                    let edit = self.with_value(transition, guard, &other);
                    edits.push(edit.ranked(VARIABLE - close));
                }
            }
        }
    }

    /// A transition that counts without a guard ends at the largest value of its variable.
    fn guard_count(&self, transition: &Element, closeness: i32, edits: &mut Vec<FileEdit>) {
        if !self.has_fault(&[Code::ValueOutside]) {
            return;
        }
        for set in transition.elements().filter(|it| it.name == "set") {
            let Some(counted) = value(set, "variable") else { continue };
            let mut variables = self.element.elements().filter(|it| it.name == "variable");
            let Some(most) = variables
                .find(|it| value(it, "name") == Some(counted))
                .and_then(|it| value(it, "max"))
            else {
                continue;
            };
            if value(set, "value").is_some_and(|it| it == format!("{counted} + 1")) {
                let guard = format!("{counted} < {most}");
                let edit = self.with_attribute(transition, "when", &guard);
                let rank = GUARD_AT_FAULT - CLOSE * closeness;
                edits.extend(edit.map(|edit| edit.ranked(rank)));
            }
        }
    }

    /// The transition sets the variable to one more.
    fn set_one_more(
        &self,
        transition: &Element,
        counted: &str,
        rank: i32,
        edits: &mut Vec<FileEdit>,
    ) {
        let more = format!("{counted} + 1");
        let mut sets = transition.elements().filter(|it| it.name == "set");
        if let Some(set) = sets.find(|it| value(it, "variable") == Some(counted)) {
            let Some(written) = set.attribute("value").filter(|it| it.value != more) else {
                return;
            };
            let is_step = written
                .value
                .trim()
                .strip_prefix(counted)
                .is_some_and(|it| it.trim_start().starts_with(['+', '-']));
            let edit = self.with_value(transition, written, &more);
            edits.push(edit.ranked(rank - if is_step { OTHER_STEP } else { 0 }));
            return;
        }
        let set = format!("<set variable=\"{counted}\" value=\"{}\"/>", escape(&more));
        let (start, end) = (transition.tag_span.end(), transition.span.end());
        let is_empty = transition.tag_span == transition.span;
        // `/>` ends the element, `>` only its start tag.
        let (span, text) = match is_empty {
            true => (Span::new(end - 2, end), format!(">{set}</{}>", transition.name)),
            false => (Span::new(start, start), set.clone()),
        };
        let at = transition.attribute("name").map_or(transition.name_span, |it| it.value_span);
        let edit = FileEdit::new(vec![(span, text)], self.at(at), set, value(transition, "name"));
        edits.push(FileEdit { is_missing: true, ..edit.ranked(rank) });
    }

    /// The variables that transitions set.
    fn counted(&self) -> impl Iterator<Item = &str> {
        self.variables_where(|it| value(it, "source").is_none())
    }

    /// The variables that follow data.
    fn followed(&self) -> impl Iterator<Item = &str> {
        self.variables_where(|it| value(it, "source").is_some())
    }

    fn variables_where(&self, is_wanted: fn(&Element) -> bool) -> impl Iterator<Item = &str> {
        let variables = self.element.elements().filter(|it| it.name == "variable");
        variables.filter(move |it| is_wanted(it)).filter_map(|it| value(it, "name"))
    }
}

/// Whether a guard has the name as a word.
fn has_word(guard: &str, name: &str) -> bool {
    let is_of_name = |letter: char| letter.is_alphanumeric() || "_-.".contains(letter);
    guard.split(|letter| !is_of_name(letter)).any(|word| word == name)
}

/// The guard, a single comparison, with the operator that differs only where both sides are equal.
fn with_stricter(guard: &str) -> Option<String> {
    let (at, (old, new)) = STRICT.iter().find_map(|it| Some((guard.find(it.0)?, it)))?;
    is_single(guard).then(|| format!("{}{new}{}", &guard[..at], &guard[at + old.len()..]))
}

/// The guard, a single comparison with a whole number, with the numbers next to it.
fn with_next_numbers(guard: &str) -> Vec<String> {
    let Some((before, number)) = guard.trim_end().rsplit_once(' ') else { return Vec::new() };
    let Some(number) = number.parse::<i64>().ok().filter(|_| is_single(guard)) else {
        return Vec::new();
    };
    let next = [number.checked_sub(1), number.checked_add(1)];
    next.into_iter().flatten().map(|other| format!("{before} {other}")).collect()
}

/// Whether a guard is a single comparison.
pub(super) fn is_single(guard: &str) -> bool {
    ![" and ", " or ", "not ", "("].iter().any(|it| guard.contains(it))
}
