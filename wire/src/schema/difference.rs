//! Says in words how two schemas differ, field by field.

use super::{Field, Schema};

/// The first few differences between two schemas given as text, one per line, for people.
///
/// `ours` and `theirs` name the two sides. Empty if the texts are equal.
pub fn difference(ours: (&str, &str), theirs: (&str, &str)) -> String {
    if ours.1 == theirs.1 {
        return String::new();
    }
    let mut lines = Vec::new();
    match (super::parse(ours.1), super::parse(theirs.1)) {
        (Ok(a), Ok(b)) => compare("", &a, &b, (ours.0, theirs.0), &mut lines),
        _ => lines.push(format!("{}: {}; {}: {}", ours.0, ours.1, theirs.0, theirs.1)),
    }
    lines.truncate(MAX_LINES);
    lines.join("\n")
}

/// More lines than this help nobody.
const MAX_LINES: usize = 8;

fn compare(path: &str, a: &Schema, b: &Schema, who: (&str, &str), lines: &mut Vec<String>) {
    match (a, b) {
        (Schema::Struct { name: n, fields: f }, Schema::Struct { name: m, fields: g })
            if n == m =>
        {
            compare_fields(path, f, g, who, lines);
        }
        (Schema::List(x), Schema::List(y)) | (Schema::Option(x), Schema::Option(y)) => {
            compare(&format!("{path}[]"), x, y, who, lines);
        }
        _ if a == b => {}
        _ => {
            let place = if path.is_empty() { "the type" } else { path };
            lines.push(format!("{place}: {} has {a}, {} has {b}", who.0, who.1));
        }
    }
}

fn compare_fields(
    path: &str,
    a: &[Field],
    b: &[Field],
    who: (&str, &str),
    lines: &mut Vec<String>,
) {
    let before = lines.len();
    let place =
        |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    for field in a {
        match b.iter().find(|other| other.name == field.name) {
            None => lines.push(format!("{}: only {} has it", place(&field.name), who.0)),
            Some(other) if other.unit != field.unit => {
                let unit = |f: &Field| f.unit.clone().unwrap_or_else(|| "no unit".into());
                let (x, y) = (unit(field), unit(other));
                lines.push(format!("{}: {} has {x}, {} has {y}", place(&field.name), who.0, who.1));
            }
            Some(other) => compare(&place(&field.name), &field.schema, &other.schema, who, lines),
        }
    }
    for field in b.iter().filter(|field| a.iter().all(|other| other.name != field.name)) {
        lines.push(format!("{}: only {} has it", place(&field.name), who.1));
    }
    if lines.len() == before && a != b {
        let order =
            |fields: &[Field]| fields.iter().map(|f| f.name.clone()).collect::<Vec<_>>().join(", ");
        lines.push(format!(
            "{}: {} orders {}; {} orders {}",
            place("fields"),
            who.0,
            order(a),
            who.1,
            order(b)
        ));
    }
}
