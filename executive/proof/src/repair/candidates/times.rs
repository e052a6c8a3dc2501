//! Other times of a transition: in another unit, with a digit more or less, or written as a time that
//! waits where one was meant that ends the waiting.

use armor_robotfile::tree::{Attribute, Element};
use armor_robotfile::{Code, Span};

use super::places::CLOSE;
use super::{MissionElements, value};
use crate::repair::file_edit::FileEdit;

/// Ranks, next to those of places.
const UNIT: i32 = 20;
const DIGIT: i32 = 20;
const AS_TIMEOUT: i32 = 12;
/// The rank of a shorter time with which a mission that takes too long is short enough.
const SHORT_ENOUGH: i32 = 10;
/// A wrong unit or digit makes a mission longer by more than this; else the check may be too strict.
const FAR_TOO_LONG: f64 = 1.25;
/// How much less likely a time is that is over before anything has happened, in s.
const AT_ONCE: i32 = 8;
const AT_ONCE_S: f64 = 0.1;
/// How much likelier the time of a transition is wrong that always fires before another one, or the
/// earliest time of that one.
const ALWAYS_BEFORE: i32 = 4;
/// The units of times with their length in s, the shortest first.
const UNITS: [(&str, f64); 4] = [("ms", 0.001), ("s", 1.0), ("min", 60.0), ("h", 3600.0)];

/// A mission that takes longer than a check allows, in s.
struct TooLong {
    takes_s: f64,
    most_s: f64,
}

impl MissionElements<'_> {
    pub(super) fn times_of_transition(&self, transition: &Element, edits: &mut Vec<FileEdit>) {
        let close = CLOSE * self.closeness(transition);
        let name = value(transition, "name").unwrap_or("");
        let before = format!(": {name} always fires before");
        let is_before = self.faults.iter().any(|fault| fault.message.contains(&before));
        // Or its own earliest time is too long, because of which another one fires before it.
        let late = format!("{name} never fires in time: ");
        let is_late = self.faults.iter().any(|fault| fault.message.starts_with(&late));
        let timeouts = self.transitions.iter().filter_map(|it| seconds(value(it, "timeout")?));
        let longest_s = timeouts.fold(0.0, f64::max);
        let too_long = self.faults.iter().find_map(TooLong::of);
        for attribute in ["timeout", "after", "answer-within", "interval"] {
            let Some(time) = transition.attribute(attribute) else { continue };
            let Some((at, written)) = latest(&time.value) else { continue };
            let mut push = |other: String, rank: i32| {
                let new =
                    format!("{}{other}{}", &time.value[..at], &time.value[at + written.len()..]);
                let span = self.span_of(time, at, written);
                let mut edit = self.with_value(transition, time, &new).ranked(rank);
                if let Some(span) = span {
                    edit.replaced = vec![(span, other)];
                }
                edits.push(edit);
            };
            let is_interval = attribute == "interval";
            // Longer than any timeout of the mission.
            let is_too_long = is_late
                && attribute == "after"
                && seconds(written).is_some_and(|it| it > longest_s);
            let before = if is_before || is_too_long { ALWAYS_BEFORE } else { 0 };
            let other_digits: Vec<_> = other_digits(written).collect();
            if let Some(too_long) = &too_long {
                let next: Vec<_> =
                    other_units(written).chain(other_digits.iter().cloned()).collect();
                let further = shorter_units(written).filter(|other| !next.contains(other));
                let further = further.map(|other| (other, SHORT_ENOUGH + 1));
                let all = next.iter().map(|other| (other.clone(), SHORT_ENOUGH));
                let all: Vec<_> = all.chain(further).collect();
                let enough = all.into_iter().filter(|it| too_long.is_solved_by(written, &it.0));
                enough.for_each(|(other, rank)| push(other, rank));
            }
            if is_interval {
                continue;
            }
            let digits = other_digits.into_iter().filter(|_| close > 0);
            let other_times = other_units(written).map(|other| (other, UNIT));
            let other_times = other_times.chain(digits.map(|other| (other, DIGIT)));
            for (other, rank) in other_times {
                let at_once = seconds(&other).is_some_and(|it| it < AT_ONCE_S);
                let at_once = if at_once { AT_ONCE } else { 0 };
                push(other, rank + at_once - before - close);
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

    /// Where a piece of an attribute's value is written, if it is written as it is meant.
    fn span_of(&self, attribute: &Attribute, at: usize, piece: &str) -> Option<Span> {
        let start = attribute.value_span.start() + at;
        let span = Span::new(start, start + piece.len());
        (self.at(span).text() == piece).then_some(span)
    }
}

impl TooLong {
    /// From the fault of a check such as `duration(home) <= 20min`.
    fn of(fault: &armor_robotfile::Finding) -> Option<Self> {
        let check = fault.at.as_ref().filter(|_| fault.code == Code::CheckFails)?.text();
        let most = check.contains("duration(").then(|| check.rsplit(['=', ' ', ';']).next())??;
        let words = fault.message.split_once(" can take ")?.1.split([',', ';']).next()?;
        let words: Vec<_> = words.split_whitespace().collect();
        let takes_s = words.chunks(2).map(|it| seconds(&it.concat())).sum::<Option<f64>>()?;
        let most_s = seconds(most)?;
        (takes_s > most_s * FAR_TOO_LONG).then_some(Self { takes_s, most_s })
    }

    fn is_solved_by(&self, old: &str, new: &str) -> bool {
        let (Some(old), Some(new)) = (seconds(old), seconds(new)) else { return false };
        // In a round it may be waited for several times.
        let times = (self.takes_s / old).floor();
        new < old && new >= AT_ONCE_S && self.takes_s - times * (old - new) <= self.most_s
    }
}

/// The latest time of a value such as `5s` or `[5s,8s]`, and where it begins.
fn latest(value: &str) -> Option<(usize, &str)> {
    let Some(range) = value.trim().strip_suffix(']') else {
        return Some((value.len() - value.trim_start().len(), value.trim()));
    };
    let at = range.rfind(',')? + 1;
    let last = range[at..].trim();
    Some((at + range[at..].len() - range[at..].trim_start().len(), last))
}

/// A number and its unit.
fn parts(time: &str) -> Option<(&str, &str)> {
    let at = time.find(|letter: char| letter.is_ascii_alphabetic())?;
    let (number, unit) = time.split_at(at);
    let is_unit = UNITS.iter().any(|it| it.0 == unit);
    (number.parse::<f64>().is_ok() && is_unit).then_some((number, unit))
}

/// A time in s.
fn seconds(time: &str) -> Option<f64> {
    let (number, unit) = parts(time)?;
    let length = UNITS.iter().find(|it| it.0 == unit)?.1;
    Some(number.parse::<f64>().ok()? * length)
}

/// The same number in the units next to its own.
fn other_units(time: &str) -> impl Iterator<Item = String> {
    in_units(time, |own, at| own.abs_diff(at) == 1)
}

/// The same number in all shorter units, the longest first.
fn shorter_units(time: &str) -> impl Iterator<Item = String> {
    in_units(time, |own, at| at < own).collect::<Vec<_>>().into_iter().rev()
}

fn in_units(time: &str, is_wanted: fn(usize, usize) -> bool) -> impl Iterator<Item = String> {
    let parts = parts(time);
    let own = parts.and_then(|(_, unit)| UNITS.iter().position(|it| it.0 == unit));
    UNITS.iter().enumerate().filter_map(move |(at, (unit, _))| {
        own.filter(|own| is_wanted(*own, at))
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
