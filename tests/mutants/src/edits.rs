//! The kinds of mutations, each as the edit of a random piece of an example. `None` if the example
//! has no such piece.

use std::ops::Range;

use armor_robotfile::Span;
use fastrand::Rng;

use crate::example::{Example, KnownAttribute, KnownElement, ValueSort};
use crate::mutation::Edit;

/// The units that replace a unit: those of its own dimension, and one of another.
const UNITS: [&[&str]; 6] = [
    &["ms", "s", "min", "h"],
    &["mm", "cm", "m", "km"],
    &["deg", "rad"],
    &["mm/s", "m/s", "km/h"],
    &["Hz", "kHz"],
    &["deg/s", "rad/s"],
];

pub fn delete_element(example: &Example, random: &mut Rng) -> Option<Edit> {
    let element = pick_element(example, random)?;
    let what = format!("deleted {}", example.tag_line(element));
    Some(Edit::described(what).replacing(with_indent(example, element), ""))
}

pub fn delete_attribute(example: &Example, random: &mut Rng) -> Option<Edit> {
    let (element, attribute) = pick_attribute(example, random, |_| true)?;
    let what = format!("deleted {} of {}", attribute.name, example.tag_line(element));
    // The space before it goes too.
    let span = Span::new(attribute.span.start() - 1, attribute.span.end());
    Some(Edit::described(what).replacing(span, ""))
}

pub fn duplicate_element(example: &Example, random: &mut Rng) -> Option<Edit> {
    let element = pick_element(example, random)?;
    let what = format!("duplicated {}", example.tag_line(element));
    let copy = example.piece(with_indent(example, element)).to_owned();
    Some(Edit::described(what).replacing(end_of(&example.elements[element]), copy))
}

pub fn move_element(example: &Example, random: &mut Rng) -> Option<Edit> {
    let element = pick_element(example, random)?;
    let moved = &example.elements[element];
    let siblings_only = random.bool();
    let outside = |other: &&KnownElement| {
        let is_inside =
            other.span.start() >= moved.span.start() && other.span.end() <= moved.span.end();
        let is_sibling = other.parent == moved.parent;
        !is_inside && other.parent.is_some() && (!siblings_only || is_sibling)
    };
    let others: Vec<_> = example.elements.iter().filter(outside).collect();
    let after = random.choice(others)?;
    let behind = example.piece(after.tag_span).split_whitespace().collect::<Vec<_>>().join(" ");
    let what = format!("moved {} behind {behind}", example.tag_line(element));
    let span = with_indent(example, element);
    let text = example.piece(span).to_owned();
    Some(Edit::described(what).replacing(span, "").replacing(end_of(after), text))
}

pub fn rename_once(example: &Example, random: &mut Rng) -> Option<Edit> {
    let (element, attribute) = pick_attribute(example, random, |it| it.sort != ValueSort::Other)?;
    let words = words_in(&attribute.value);
    let word = random.choice(words)?;
    let name = &attribute.value[word.clone()];
    let misspelt = match random.usize(..3) {
        0 => format!("{name}s"),
        1 => name[..name.len() - 1].to_owned(),
        _ => format!("{}{}", name[..1].to_uppercase(), &name[1..]),
    };
    let what = format!("{name} misspelt {misspelt} in {}", example.tag_line(element));
    Some(Edit::described(what).replacing(within(attribute.value_span, &word), misspelt))
}

pub fn swap_values(example: &Example, random: &mut Rng) -> Option<Edit> {
    let (element, first) = pick_attribute(example, random, |_| true)?;
    let all = example.elements.iter().flat_map(|other| {
        other.attributes.iter().map(move |attribute| (other.name.as_str(), attribute))
    });
    let name = example.elements[element].name.as_str();
    let others: Vec<_> = all
        .filter(|(of, second)| {
            let is_alike = if first.sort == ValueSort::Other {
                *of == name && second.name == first.name
            } else {
                second.sort == first.sort && (first.sort != ValueSort::OwnName || *of == name)
            };
            is_alike && second.value != first.value
        })
        .map(|(_, attribute)| attribute)
        .collect();
    let second = random.choice(others)?;
    let (one, other) = (example.piece(first.value_span), example.piece(second.value_span));
    let what = format!("swapped {one} of {} with {other}", example.tag_line(element));
    Some(Edit::described(what).replacing(first.value_span, other).replacing(second.value_span, one))
}

pub fn replace_reference(example: &Example, random: &mut Rng) -> Option<Edit> {
    let is_reference =
        |it: &KnownAttribute| !matches!(it.sort, ValueSort::Other | ValueSort::OwnName);
    let (element, attribute) = pick_attribute(example, random, is_reference)?;
    let word = random.choice(words_in(&attribute.value))?;
    let name = &attribute.value[word.clone()];
    let other = random.choice(names_of(example, attribute.sort, name))?;
    let what = format!("{name} replaced by {other} in {}", example.tag_line(element));
    Some(Edit::described(what).replacing(within(attribute.value_span, &word), other))
}

pub fn change_list(example: &Example, random: &mut Rng) -> Option<Edit> {
    let is_list = |it: &KnownAttribute| {
        it.name == "components" || (it.sort == ValueSort::Place && words_in(&it.value).len() > 1)
    };
    let (element, attribute) = pick_attribute(example, random, is_list)?;
    let words = words_in(&attribute.value);
    let names: Vec<&str> = words.iter().map(|word| &attribute.value[word.clone()]).collect();
    let (what, names) = if random.bool() {
        let name = random.choice(names_of(example, attribute.sort, ""))?;
        (format!("{name} added"), [names, vec![name.as_str()]].concat().join(" "))
    } else {
        let gone = random.usize(..names.len());
        let mut left = names.clone();
        left.remove(gone);
        (format!("{} removed", names[gone]), left.join(" "))
    };
    let what = format!("{what} in {}", example.tag_line(element));
    Some(Edit::described(what).replacing(attribute.value_span, names))
}

pub fn change_number(example: &Example, random: &mut Rng) -> Option<Edit> {
    let (element, span) = pick_text_with_numbers(example, random)?;
    let text = example.piece(span);
    let number = random.choice(numbers_in(text))?;
    let old: f64 = text[number.clone()].parse().ok()?;
    let new = match random.usize(..6) {
        0 => old * 10.0,
        1 => old / 10.0,
        2 => old * 1000.0,
        3 => 0.0,
        4 => -old,
        _ => old + 1.0,
    };
    // Nine digits are enough; 0.7 / 10 has a rest otherwise.
    let new = (new * 1e9).round() / 1e9;
    let what =
        format!("{} changed to {new} in {}", &text[number.clone()], example.tag_line(element));
    Some(Edit::described(what).replacing(within(span, &number), new.to_string()))
}

pub fn change_unit(example: &Example, random: &mut Rng) -> Option<Edit> {
    let (element, span) = pick_text_with_numbers(example, random)?;
    let text = example.piece(span);
    let units: Vec<_> =
        numbers_in(text).into_iter().filter_map(|it| unit_after(text, &it)).collect();
    let unit = random.choice(units)?;
    let old = &text[unit.clone()];
    let own = UNITS.iter().find(|family| family.contains(&old));
    let new = match (random.usize(..4), own) {
        (0, _) => "",
        (1, _) | (_, None) => random.choice(UNITS.concat())?,
        (_, Some(own)) => random.choice(own.iter().copied())?,
    };
    let what = format!("{old} changed to {new:?} in {}", example.tag_line(element));
    Some(Edit::described(what).replacing(within(span, &unit), new))
}

pub fn copy_attribute(example: &Example, random: &mut Rng) -> Option<Edit> {
    let (from, attribute) = pick_attribute(example, random, |_| true)?;
    let name = &example.elements[from].name;
    let lacks = |other: &&KnownElement| {
        other.name == *name && other.attributes.iter().all(|it| it.name != attribute.name)
    };
    let to = random.choice(example.elements.iter().filter(lacks).collect::<Vec<_>>())?;
    let text = example.piece(attribute.span);
    let tag = example.piece(to.tag_span).split_whitespace().collect::<Vec<_>>().join(" ");
    let name_end = to.tag_span.start() + 1 + name.len();
    let what = format!("added {text} to {tag}");
    Some(Edit::described(what).replacing(Span::new(name_end, name_end), format!(" {text}")))
}

pub fn turn_guard(example: &Example, random: &mut Rng) -> Option<Edit> {
    let guards = example.elements.iter().enumerate().flat_map(|(number, element)| {
        let guards = element.attributes.iter().filter(|it| it.name == "when");
        let check = element.text_span.filter(|_| element.name == "check");
        guards.map(|it| it.value_span).chain(check).map(move |span| (number, span))
    });
    let (element, span) = random.choice(guards.collect::<Vec<_>>())?;
    let text = example.piece(span);
    let turns = [
        ("&lt;=", "&gt;"),
        ("&lt;", "&gt;"),
        ("==", "!="),
        ("!=", "=="),
        (" or ", " and "),
        (" and ", " or "),
        ("always ", "never "),
        ("never ", "always "),
        ("eventually ", "never "),
    ];
    let turns: Vec<_> = turns.into_iter().filter(|(old, _)| text.contains(old)).collect();
    let turned = match random.choice(turns).filter(|_| random.bool()) {
        Some((old, new)) => text.replacen(old, new, 1),
        None => format!("not ({text})"),
    };
    let what = format!("turned into {turned}: {text} of {}", example.tag_line(element));
    Some(Edit::described(what).replacing(span, turned))
}

/// Any element but the outermost one.
fn pick_element(example: &Example, random: &mut Rng) -> Option<usize> {
    (example.elements.len() > 1).then(|| random.usize(1..example.elements.len()))
}

fn pick_attribute<'a>(
    example: &'a Example,
    random: &mut Rng,
    wanted: impl Fn(&KnownAttribute) -> bool,
) -> Option<(usize, &'a KnownAttribute)> {
    let all = example.elements.iter().enumerate().flat_map(|(number, element)| {
        element.attributes.iter().map(move |attribute| (number, attribute))
    });
    random.choice(all.filter(|(_, attribute)| wanted(attribute)).collect::<Vec<_>>())
}

/// The value of an attribute, or the text of an element, that holds numbers.
fn pick_text_with_numbers(example: &Example, random: &mut Rng) -> Option<(usize, Span)> {
    let all = example.elements.iter().enumerate().flat_map(|(number, element)| {
        let values = element.attributes.iter().map(|attribute| attribute.value_span);
        values.chain(element.text_span).map(move |span| (number, span))
    });
    let has_numbers = |(_, span): &(usize, Span)| !numbers_in(example.piece(*span)).is_empty();
    random.choice(all.filter(has_numbers).collect::<Vec<_>>())
}

/// The names of a sort in the file, each once, without `except`.
fn names_of(example: &Example, sort: ValueSort, except: &str) -> Vec<String> {
    let attributes = example.elements.iter().flat_map(|element| &element.attributes);
    let used = attributes.filter(|it| it.sort == sort).flat_map(|it| it.value.split_whitespace());
    let given = example.elements.iter().filter(|element| match sort {
        ValueSort::Component => element.name == "component",
        ValueSort::Place => element.name == "place",
        ValueSort::Variable => element.name == "variable",
        _ => false,
    });
    let given = given.flat_map(|element| &element.attributes);
    let given = given.filter(|it| it.name == "name").map(|it| it.value.as_str());
    let mut names: Vec<String> =
        used.chain(given).filter(|name| *name != except).map(str::to_owned).collect();
    names.sort();
    names.dedup();
    names
}

fn words_in(text: &str) -> Vec<Range<usize>> {
    let start_of = |word: &str| word.as_ptr().addr() - text.as_ptr().addr();
    text.split_whitespace().map(|word| start_of(word)..start_of(word) + word.len()).collect()
}

/// The numbers in a text that do not belong to a name.
fn numbers_in(text: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let is_part = |byte: u8| byte.is_ascii_digit() || byte == b'.';
        let in_name = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
        if !bytes[at].is_ascii_digit() || in_name {
            at += 1;
            continue;
        }
        let end =
            bytes[at..].iter().position(|byte| !is_part(*byte)).map_or(bytes.len(), |it| at + it);
        found.push(at..end);
        at = end;
    }
    found
}

fn unit_after(text: &str, number: &Range<usize>) -> Option<Range<usize>> {
    let rest = &text[number.end..];
    let is_unit = |c: char| c.is_ascii_alphanumeric() || c == '/';
    let length = rest.find(|c| !is_unit(c)).unwrap_or(rest.len());
    let is_there = rest.starts_with(|c: char| c.is_ascii_alphabetic());
    is_there.then_some(number.end..number.end + length)
}

fn within(span: Span, part: &Range<usize>) -> Span {
    Span::new(span.start() + part.start, span.start() + part.end)
}

fn end_of(element: &KnownElement) -> Span {
    Span::new(element.span.end(), element.span.end())
}

/// The element with the white space before it.
fn with_indent(example: &Example, element: usize) -> Span {
    let span = example.elements[element].span;
    let before = example.text[..span.start()].trim_end().len();
    Span::new(before, span.end())
}
