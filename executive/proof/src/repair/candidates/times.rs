//! Other times of a transition: in another unit, with a digit more or less, or written as a time that
//! waits where one was meant that ends the waiting.

use armor_robotfile::tree::Element;

use super::places::CLOSE;
use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

/// Ranks, next to those of places.
const UNIT: i32 = 20;
const DIGIT: i32 = 21;
const AS_TIMEOUT: i32 = 12;
/// The units of times, the shortest first.
const UNITS: [&str; 4] = ["ms", "s", "min", "h"];

impl MissionElements<'_> {
    pub(super) fn times_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(transition);
        for attribute in ["timeout", "after", "answer-within"] {
            let Some(time) = transition.attribute(attribute) else { continue };
            let digits = other_digits(&time.value).filter(|_| close > 0);
            let other_times = other_units(&time.value).map(|other| (other, UNIT));
            let other_times = other_times.chain(digits.map(|other| (other, DIGIT)));
            for (other, rank) in other_times {
                edits.push(self.with_value(transition, time, &other).ranked(rank - close));
            }
        }
        if let (Some(after), None) = (transition.attribute("after"), value(transition, "timeout")) {
            let edit = FileEdit::new(
                vec![(after.name_span, "timeout".to_owned())],
                self.at(after.span()),
                format!("timeout=\"{}\"", after.value),
                value(transition, "name"),
            );
            edits.push(edit.ranked(AS_TIMEOUT - close));
        }
    }
}

/// A number and its unit.
fn parts(time: &str) -> Option<(&str, &str)> {
    let at = time.find(|letter: char| letter.is_ascii_alphabetic())?;
    let (number, unit) = time.split_at(at);
    (number.parse::<f64>().is_ok() && UNITS.contains(&unit)).then_some((number, unit))
}

/// The same number in the units next to its own.
fn other_units(time: &str) -> impl Iterator<Item = String> {
    let parts = parts(time);
    let own = parts.and_then(|(_, unit)| UNITS.iter().position(|it| *it == unit));
    UNITS.iter().enumerate().filter_map(move |(at, unit)| {
        own.filter(|own| own.abs_diff(at) == 1)
            .map(|_| format!("{}{unit}", parts.unwrap_or(("", "")).0))
    })
}

/// A digit less or more, of a whole number.
fn other_digits(time: &str) -> impl Iterator<Item = String> {
    let whole = parts(time).filter(|(number, _)| number.bytes().all(|it| it.is_ascii_digit()));
    let less = whole.and_then(|(number, unit)| Some((number.strip_suffix('0')?, unit)));
    let less = less.filter(|(number, _)| !number.is_empty() && *number != "0");
    let less = less.map(|(number, unit)| format!("{number}{unit}"));
    less.into_iter().chain(whole.map(|(number, unit)| format!("{number}0{unit}")))
}
