//! Where a name stands in a value: alone, in a list, before a dot, in an expression.

use std::ops::Range;

use crate::claim::Sort;

/// How a value names things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// The value is the name.
    Whole,
    /// Names separated by spaces.
    List,
    /// The name, a dot, and more.
    Dotted,
    /// An expression in which the name stands before a dot.
    DottedWords,
    /// An expression in which the name stands by itself.
    BareWords,
    /// An expression in which the name stands before a dot or by itself.
    AllWords,
    /// A check in which the name stands where one of a thing of this sort does.
    Claimed(Sort),
}

/// Words of expressions that name nothing.
const KEYWORDS: &[&str] =
    &["always", "never", "eventually", "and", "or", "not", "true", "false", "inf"];

/// Where `name` stands in `value`.
pub(crate) fn occurrences(form: Form, value: &str, name: &str) -> Vec<Range<usize>> {
    match form {
        Form::Whole => (value == name).then_some(0..value.len()).into_iter().collect(),
        Form::List => list(value).filter(|word| value[word.clone()] == *name).collect(),
        Form::Dotted => {
            let starts = value.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
            starts.then_some(0..name.len()).into_iter().collect()
        }
        Form::DottedWords | Form::BareWords | Form::AllWords => {
            let is_named = |word: &Range<usize>| {
                let other = if value[word.end..].starts_with('.') {
                    Form::BareWords
                } else {
                    Form::DottedWords
                };
                value[word.clone()] == *name && form != other
            };
            names(value).into_iter().filter(is_named).collect()
        }
        Form::Claimed(sort) => {
            let is_named = |word: &Range<usize>| {
                value[word.clone()] == *name
                    && !value[word.end..].starts_with('.')
                    && sort_at(value, word.start) == sort
            };
            names(value).into_iter().filter(is_named).collect()
        }
    }
}

/// Of what sort the thing is whose name begins there in a check: what it is called with says it.
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
    // Where the second word of `leads to` stands, which is no name.
    let mut to = None;
    while at < bytes.len() {
        let start = at;
        let part: fn(u8) -> bool = match bytes[at] {
            b'0'..=b'9' => |b| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'%' | b'/'),
            b if b.is_ascii_alphabetic() => {
                |b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-')
            }
            // What is not ASCII is in no name, but may stand before one.
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

    fn check(form: Form, value: &str, expected: &str) {
        let places = occurrences(form, value, "home");
        assert_eq!(replaced(value, &places, "H"), expected);
    }

    #[test]
    fn a_name_is_found_where_it_means_the_thing() {
        check(Form::Whole, "home", "H");
        check(Form::Whole, "home ", "home ");
        check(Form::List, " home  homes home-a home ", " H  homes home-a H ");
        check(Form::Dotted, "home.home", "H.home");
        check(Form::Dotted, "homes.x", "homes.x");
        check(Form::DottedWords, "home < 3 and home.x > -home.home", "home < 3 and H.x > -H.home");
        check(Form::BareWords, "home < 3 and home.x", "H < 3 and home.x");
        check(Form::AllWords, "always home(home) <= 20home", "always home(H) <= 20home");
        check(Form::AllWords, "5-home+home-1*ähome x.home home.y", "5-H+home-1*ähome x.home H.y");
        check(Form::AllWords, "(home)and not home", "(H)and not H");
        assert!(occurrences(Form::AllWords, "always x", "always").is_empty());
    }

    #[test]
    fn in_a_check_what_a_name_stands_in_says_whose_it_is() {
        let place = |value, expected| check(Form::Claimed(Sort::Place), value, expected);
        place("always reachable(home)", "always reachable(H)");
        place("home leads to ( home )", "H leads to ( H )");
        place("never home + x.home > 1 and home.x", "never H + x.home > 1 and home.x");
        place("fires(home)", "fires(home)");
        place("home leads to active( home )", "H leads to active( home )");
        check(Form::Claimed(Sort::Transition), "dead ( home )", "dead ( H )");
        check(
            Form::Claimed(Sort::Component),
            "never active(home) and home",
            "never active(H) and home",
        );
        let at = |value, name| occurrences(Form::Claimed(Sort::Place), value, name);
        assert_eq!(at("leads leads to to", "leads"), vec![Range { start: 0, end: 5 }]);
        assert_eq!(at("leads leads to to", "to"), vec![Range { start: 15, end: 17 }]);
        assert_eq!(at("a leads to top", "to"), []);
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
            assert_eq!(without(value, &occurrences(Form::List, value, "a")), expected);
        }
    }
}
