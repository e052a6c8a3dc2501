//! How likely it is that a place was meant at a transition: authors name a transition after its
//! place, and write the transitions of one place one after another.

use armor_robotfile::{Code, Finding, Location};

/// Letters that two names have in common at their beginning, if one is named after the other.
const SAME_LETTERS: usize = 4;

/// The closeness of an element that a fault is at.
pub(super) const MOST_CLOSE: i32 = 2;

/// Whether one name was probably made from the other: `tour-late` and `touring`.
pub(super) fn are_related(one: &str, other: &str) -> bool {
    let same = one.bytes().zip(other.bytes()).take_while(|(one, other)| one == other).count();
    same >= SAME_LETTERS
}

/// How close the faults are to a transition or place: [`MOST_CLOSE`] if one is at it, 1 if one is
/// related to it or shown by its firing, else 0.
pub(super) fn closeness(faults: &[Finding], element: &Location, name: &str) -> i32 {
    let is_in = |at: &Location| {
        at.source.path() == element.source.path()
            && element.span.start() <= at.span.start()
            && at.span.end() <= element.span.end()
    };
    let is_named = |full: &String| {
        full == name || full.strip_suffix(name).is_some_and(|before| before.ends_with('.'))
    };
    // Two that fire at the same moment do not tell which of them is wrong.
    let mut own = faults.iter().filter(|fault| fault.code != Code::Tie);
    if own.any(|fault| fault.at.as_ref().is_some_and(is_in)) {
        return MOST_CLOSE;
    }
    let is_at = faults.iter().any(|fault| fault.at.as_ref().is_some_and(is_in));
    let is_related = faults.iter().any(|fault| fault.related.iter().any(|it| is_in(&it.0)));
    let fired = |fault: &Finding| {
        let trace = fault.trace.iter();
        trace.flat_map(|it| it.firings.iter().chain(&it.circle)).any(is_named)
    };
    i32::from(is_at || is_related || faults.iter().any(fired))
}
