//! Describes for people how two schemas differ, field by field.

use std::collections::BTreeMap;

use super::layout::{Field, Schema, Variant};
use super::text::parse;

/// Most lines of a description; further ones do not help a reader.
const MAX_LINES: usize = 8;
/// Longest type in a line, in bytes; the rest is cut.
const MAX_TYPE_LEN: usize = 160;

/// Describes the first differences between two schemas given as text, one per line.
///
/// `ours` and `theirs` name the two sides. Empty if the texts are equal.
pub fn difference(ours: (&str, &str), theirs: (&str, &str)) -> String {
    if ours.1 == theirs.1 {
        return String::new();
    }
    let mut found = SchemaComparison { ours: ours.0, theirs: theirs.0, lines: Vec::new() };
    match (parse(ours.1), parse(theirs.1)) {
        (Ok(a), Ok(b)) => found.compare_types("", &a, &b),
        (a, b) => {
            for (who, result) in [(ours.0, a), (theirs.0, b)] {
                if let Err(error) = result {
                    found.lines.push(format!("the schema of {who} cannot be read: {error}"));
                }
            }
        }
    }
    found.lines.truncate(MAX_LINES);
    found.lines.join("\n")
}

struct SchemaComparison<'a> {
    ours: &'a str,
    theirs: &'a str,
    lines: Vec<String>,
}

impl SchemaComparison<'_> {
    fn push_line(&mut self, place: &str, our: &str, their: &str) {
        let (ours, theirs) = (self.ours, self.theirs);
        let place = if place.is_empty() { "the type" } else { place };
        self.lines.push(format!("{place}: {ours} has {our}, {theirs} has {their}"));
    }

    fn compare_types(&mut self, place: &str, a: &Schema, b: &Schema) {
        match (a, b) {
            _ if a == b || self.lines.len() >= MAX_LINES => {}
            (Schema::Struct { name: n, fields: f }, Schema::Struct { name: m, fields: g })
                if n == m =>
            {
                self.compare_fields(place, f, g);
            }
            (Schema::Enum { name: n, variants: v }, Schema::Enum { name: m, variants: w })
                if n == m =>
            {
                self.compare_variants(place, v, w);
            }
            (Schema::List(x), Schema::List(y)) => self.compare_types(&format!("{place}[]"), x, y),
            (Schema::Fixed(x, n), Schema::Fixed(y, m)) if n == m => {
                self.compare_types(&format!("{place}[]"), x, y);
            }
            (Schema::Option(x), Schema::Option(y)) => {
                self.compare_types(&format!("{place}?"), x, y);
            }
            _ => self.push_line(place, &shorten_type(a), &shorten_type(b)),
        }
    }

    fn compare_fields(&mut self, place: &str, a: &[Field], b: &[Field]) {
        let before = self.lines.len();
        let ours: BTreeMap<_, _> = a.iter().map(|field| (&field.name, field)).collect();
        let theirs: BTreeMap<_, _> = b.iter().map(|field| (&field.name, field)).collect();
        for field in a {
            let inner = join_path(place, &field.name);
            match theirs.get(&field.name) {
                None => self.lines.push(format!("{inner}: only {} has it", self.ours)),
                Some(other) if other.unit != field.unit => {
                    self.push_line(&inner, unit_of(field), unit_of(other));
                }
                Some(other) => self.compare_types(&inner, &field.schema, &other.schema),
            }
        }
        for field in b.iter().filter(|field| !ours.contains_key(&field.name)) {
            self.lines.push(format!(
                "{}: only {} has it",
                join_path(place, &field.name),
                self.theirs
            ));
        }
        if self.lines.len() == before {
            let place = join_path(place, "(order of fields)");
            self.first_difference(&place, a.iter().map(|f| &f.name), b.iter().map(|f| &f.name));
        }
    }

    fn compare_variants(&mut self, place: &str, a: &[Variant], b: &[Variant]) {
        if a.iter().map(|v| &v.name).eq(b.iter().map(|v| &v.name)) {
            for (variant, other) in a.iter().zip(b).filter(|(v, w)| v != w) {
                self.compare_fields(
                    &join_path(place, &variant.name),
                    &variant.fields,
                    &other.fields,
                );
            }
        } else {
            let place = join_path(place, "(variants)");
            self.first_difference(&place, a.iter().map(|v| &v.name), b.iter().map(|v| &v.name));
        }
    }

    /// Describes the first position at which two lists of names differ.
    fn first_difference<'n>(
        &mut self,
        place: &str,
        mut a: impl Iterator<Item = &'n String>,
        mut b: impl Iterator<Item = &'n String>,
    ) {
        for index in 0.. {
            match (a.next(), b.next()) {
                (None, None) => return,
                (x, y) if x == y => {}
                (x, y) => {
                    let name = |name: Option<&'n String>| name.map_or("none", String::as_str);
                    return self.push_line(&format!("{place} #{index}"), name(x), name(y));
                }
            }
        }
    }
}

fn join_path(place: &str, name: &str) -> String {
    if place.is_empty() { name.into() } else { format!("{place}.{name}") }
}

fn unit_of(field: &Field) -> &str {
    field.unit.as_deref().unwrap_or("no unit")
}

fn shorten_type(schema: &Schema) -> String {
    let mut text = schema.to_string();
    // Names and units are ASCII, so any place is a boundary.
    if text.len() > MAX_TYPE_LEN {
        text.truncate(MAX_TYPE_LEN);
        text.push('…');
    }
    text
}
