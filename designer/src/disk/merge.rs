//! Merges two changed versions of one text by lines, if at least one unchanged line lies between
//! the changes of the one and those of the other. Decides what to do about a file that changed on
//! the disk.

mod lines;

use std::ops::Range;
use std::path::Path;

use armor_robotfile::Document;

use lines::changes;

/// What to do about a file that has changed on the disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The disk has the text of the window, or still the one that was read last.
    Same,
    /// Nothing was changed in the window: it takes the version of the disk, also an invalid one.
    Take,
    /// Both were changed, in different places: this text contains both changes.
    Merged(String),
    /// Both were changed in the same place, or the result is no XML: the user decides.
    Ask,
}

/// Returns what to do about the file at `path`, which was read as `base`, is `ours` in the window
/// and `theirs` on the disk.
pub fn answer(path: &Path, base: &str, ours: &str, theirs: &[u8]) -> Answer {
    // A write that changes nothing, or one that was reported before and has been decided.
    if theirs == ours.as_bytes() || theirs == base.as_bytes() {
        return Answer::Same;
    }
    let Ok(theirs) = std::str::from_utf8(theirs) else { return Answer::Ask };
    if ours == base {
        return Answer::Take;
    }
    // Changes that stay apart as lines can still break the XML together: one side removes an
    // element whose end the other moves.
    match merge(base, ours, theirs) {
        Some(both) if Document::open(path, both.as_bytes()).is_ok() => Answer::Merged(both),
        _ => Answer::Ask,
    }
}

/// Returns `base` with the changes of both, or none if changes touch each other. A change that both
/// made is applied once.
pub fn merge(base: &str, ours: &str, theirs: &str) -> Option<String> {
    let split = |text| -> Vec<&str> { str::split_inclusive(text, '\n').collect() };
    let (base, ours, theirs) = (split(base), split(ours), split(theirs));
    let (mine, other) = (changes(&base, &ours), changes(&base, &theirs));
    let mut out = String::new();
    let (mut at, mut mine, mut other) = (0, mine.iter().peekable(), other.iter().peekable());
    loop {
        let (change, from) = match (mine.peek(), other.peek()) {
            (None, None) => break,
            (Some(a), Some(b))
                if a.old == b.old && ours[a.new.clone()] == theirs[b.new.clone()] =>
            {
                other.next();
                (mine.next(), &ours)
            }
            (Some(a), Some(b)) if touch(&a.old, &b.old) => return None,
            (Some(a), Some(b)) if b.old.start < a.old.start => (other.next(), &theirs),
            (Some(_), _) => (mine.next(), &ours),
            (None, Some(_)) => (other.next(), &theirs),
        };
        let Some(change) = change else { break };
        out.extend(base[at..change.old.start].iter().copied());
        out.extend(from[change.new.clone()].iter().copied());
        at = change.old.end;
    }
    out.extend(base[at..].iter().copied());
    Some(out)
}

/// Whether no unchanged line lies between the two.
fn touch(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.start <= b.end && b.start <= a.end
}

#[cfg(test)]
mod tests;
