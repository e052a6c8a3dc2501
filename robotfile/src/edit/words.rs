//! The occurrences of a name in a value: alone, in a list, before a dot, in an expression.

use std::ops::Range;

use crate::claim::Sort;

/// The form in which a value names things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ListForm {
    /// The value is the name.
    Whole,
    /// Names separated by spaces.
    List,
    /// The name, a dot, and more.
    Dotted,
    /// An expression with the name before a dot.
    DottedWords,
    /// An expression with the name without a dot.
    BareWords,
    /// An expression with the name before a dot or without one.
    AllWords,
    /// A check with the name at a position for this kind of thing.
    Claimed(Sort),
    /// An expression with the name of a route or step, or of what is derived from it:
    /// `red.l1`, `red.l1.late`.
    Derived,
}

/// Words of expressions that are not names.
const KEYWORDS: &[&str] =
    &["always", "never", "eventually", "and", "or", "not", "true", "false", "inf"];

/// Returns the occurrences of `name` in `value`.
pub(crate) fn occurrences(form: ListForm, value: &str, name: &str) -> Vec<Range<usize>> {
    match form {
        ListForm::Whole => (value == name).then_some(0..value.len()).into_iter().collect(),
        ListForm::List => list(value).filter(|word| value[word.clone()] == *name).collect(),
        ListForm::Dotted => {
            let starts = value.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
            starts.then_some(0..name.len()).into_iter().collect()
        }
        ListForm::DottedWords | ListForm::BareWords | ListForm::AllWords => {
            let is_named = |word: &Range<usize>| {
                let other = if value[word.end..].starts_with('.') {
                    ListForm::BareWords
                } else {
                    ListForm::DottedWords
                };
                value[word.clone()] == *name && form != other
            };
            names(value).into_iter().filter(is_named).collect()
        }
        ListForm::Claimed(sort) => {
            let qualified = names(value).into_iter().map(|word| qualified_name(value, word));
            let is_named = |word: &Range<usize>| {
                value[word.clone()] == *name && sort_at(value, word.start) == sort
            };
            qualified.filter(is_named).collect()
        }
        ListForm::Derived => {
            let whole = names(value).into_iter().map(|word| qualified_name(value, word));
            let is_derived = |word: &Range<usize>| {
                let rest = value[word.clone()].strip_prefix(name);
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            let derived = whole.filter(is_derived);
            derived.map(|word| word.start..word.start + name.len()).collect()
        }
    }
}

/// Returns the whole name that begins with this word: `dock.creep` is one of a sub-mission.
fn qualified_name(value: &str, word: Range<usize>) -> Range<usize> {
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    let mut end = word.end;
    while let Some(rest) = value[end..].strip_prefix('.') {
        end = value.len() - rest.trim_start_matches(is_of_name).len();
    }
    word.start..end
}

/// Returns the kind of the thing whose name begins there in a check: the word before the
/// parenthesis decides.
fn sort_at(value: &str, start: usize) -> Sort {
    let before = value[..start].trim_ascii_end();
    let Some(called) = before.strip_suffix('(').map(str::trim_ascii_end) else {
        return Sort::Place;
    };
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    match &called[called.trim_end_matches(is_of_name).len()..] {
        "fires" | "dead" => Sort::Transition,
        "active" => Sort::Component,
        _ => Sort::Place,
    }
}

/// The words of a list.
pub(crate) fn list(value: &str) -> impl Iterator<Item = Range<usize>> {
    value.split_ascii_whitespace().map(|word| {
        // Both slices are of one string, so the difference is the word's offset.
        let start = word.as_ptr() as usize - value.as_ptr() as usize;
        start..start + word.len()
    })
}

/// The list without the words at these places, in the same order and, where it can be, with the
/// same spaces.
pub(crate) fn without(value: &str, gone: &[Range<usize>]) -> String {
    let words: Vec<_> = list(value).collect();
    let mut kept = words.iter().filter(|word| !gone.contains(word));
    let Some(first) = kept.next() else { return String::new() };
    let mut out = value[..words[0].start].to_owned() + &value[first.clone()];
    let mut last = first;
    for word in kept {
        let space = words.iter().rev().find(|before| before.end < word.start);
        let space = space.map_or(" ", |before| &value[before.end..word.start]);
        out += space;
        out += &value[word.clone()];
        last = word;
    }
    let end = words.last().unwrap_or(last).end;
    out + &value[end..]
}

/// The value with `new` in the places.
pub(crate) fn replaced(value: &str, places: &[Range<usize>], new: &str) -> String {
    let mut out = String::with_capacity(value.len() + new.len());
    let mut at = 0;
    for place in places {
        out += &value[at..place.start];
        out += new;
        at = place.end;
    }
    out + &value[at..]
}

/// The names of an expression: not what follows a dot or is called, no numbers with their units.
fn names(text: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let mut names = Vec::new();
    let mut at = 0;
    // The position of the second word of `leads to`, which is not a name.
    let mut to = None;
    while at < bytes.len() {
        let start = at;
        let part: fn(u8) -> bool = match bytes[at] {
            b'0'..=b'9' => |b| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'%' | b'/'),
            b if b.is_ascii_alphabetic() => {
                |b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-')
            }
            // A character that is not ASCII is not part of a name, but may precede one.
            b'_' | 128.. => |b| b >= 128 || b.is_ascii_alphanumeric() || b == b'_',
            _ => |_| false,
        };
        at += 1;
        while at < bytes.len() && part(bytes[at]) {
            at += 1;
        }
        let follows_dot = start > 0 && bytes[start - 1] == b'.';
        let is_called = text[at..].trim_ascii_start().starts_with('(');
        let word = &text[start..at];
        if word == "leads" && Some(start) != to {
            let rest = text[at..].trim_ascii_start();
            let ends = |after: &str| {
                !after.starts_with(|c: char| c.is_alphanumeric() || "_-.".contains(c))
            };
            if rest.len() < text.len() - at && rest.strip_prefix("to").is_some_and(ends) {
                to = Some(text.len() - rest.len());
                continue;
            }
        }
        if Some(start) == to {
            continue;
        }
        if bytes[start].is_ascii_alphabetic()
            && !follows_dot
            && !is_called
            && !KEYWORDS.contains(&word)
        {
            names.push(start..at);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(form: ListForm, value: &str, expected: &str) {
        let places = occurrences(form, value, "home");
        assert_eq!(replaced(value, &places, "H"), expected);
    }

    #[test]
    fn a_name_is_found_where_it_means_the_thing() {
        check(ListForm::Whole, "home", "H");
        check(ListForm::Whole, "home ", "home ");
        check(ListForm::List, " home  homes home-a home ", " H  homes home-a H ");
        check(ListForm::Dotted, "home.home", "H.home");
        check(ListForm::Dotted, "homes.x", "homes.x");
        check(
            ListForm::DottedWords,
            "home < 3 and home.x > -home.home",
            "home < 3 and H.x > -H.home",
        );
        check(ListForm::BareWords, "home < 3 and home.x", "H < 3 and home.x");
        check(ListForm::AllWords, "always home(home) <= 20home", "always home(H) <= 20home");
        check(
            ListForm::AllWords,
            "5-home+home-1*ähome x.home home.y",
            "5-H+home-1*ähome x.home H.y",
        );
        check(ListForm::AllWords, "(home)and not home", "(H)and not H");
        assert!(occurrences(ListForm::AllWords, "always x", "always").is_empty());
    }

    #[test]
    fn in_a_check_the_word_before_a_name_decides_its_kind() {
        let place = |value, expected| check(ListForm::Claimed(Sort::Place), value, expected);
        place("always reachable(home)", "always reachable(H)");
        place("home leads to ( home )", "H leads to ( H )");
        place("never home + x.home > 1 and home.x", "never H + x.home > 1 and home.x");
        place("fires(home)", "fires(home)");
        place("home leads to active( home )", "H leads to active( home )");
        check(ListForm::Claimed(Sort::Transition), "dead ( home )", "dead ( H )");
        check(
            ListForm::Claimed(Sort::Component),
            "never active(home) and home",
            "never active(H) and home",
        );
        let at = |value, name| occurrences(ListForm::Claimed(Sort::Place), value, name);
        assert_eq!(
            at("never d.creep and d.creep.x or d-2.creep", "d.creep"),
            vec![Range { start: 6, end: 13 }]
        );
        assert_eq!(at("fires(d.creep) and creep and x.d.creep", "d.creep"), []);
        assert_eq!(at("leads leads to to", "leads"), vec![Range { start: 0, end: 5 }]);
        assert_eq!(at("leads leads to to", "to"), vec![Range { start: 15, end: 17 }]);
        assert_eq!(at("a leads to top", "to"), []);
    }

    #[test]
    fn what_is_derived_from_a_step_has_its_name_in_front() {
        let check = |value: &str, expected: &str| {
            let places = occurrences(ListForm::Derived, value, "red.l1");
            assert_eq!(replaced(value, &places, "red.first"), expected);
        };
        check("never red.l1 and blue.l1", "never red.first and blue.l1");
        check("fires(red.l1.late) or red.l11", "fires(red.first.late) or red.l11");
        check("x.red.l1 > 0 and red", "x.red.l1 > 0 and red");
    }

    #[test]
    fn a_list_loses_words_and_keeps_its_spaces() {
        for (value, expected) in [
            ("a", ""),
            ("a b", "b"),
            ("b  a", "b"),
            ("b  a c", "b c"),
            (" b   c a ", " b   c "),
            ("a a b a", "b"),
        ] {
            assert_eq!(without(value, &occurrences(ListForm::List, value, "a")), expected);
        }
    }
}
