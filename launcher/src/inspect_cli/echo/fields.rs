//! Fields of a message, named by their path: `pose.x`, `ranges.0`.

use anyhow::{Result, bail};
use armor_robotfile::advise_similar;
use serde_json::{Map, Value};

/// Returns an object of the named fields.
///
/// # Errors
/// If the message has no such field; the error lists those that it has.
pub fn select_fields(value: &Value, paths: &[String]) -> Result<Value> {
    let mut selected = Map::new();
    for path in paths {
        selected.insert(path.clone(), find_field(value, path)?.clone());
    }
    Ok(Value::Object(selected))
}

/// Returns the field at `path`; nothing is in an absent option and beyond the end of an array.
///
/// # Errors
/// If the message has no such field.
pub fn find_field<'a>(value: &'a Value, path: &str) -> Result<&'a Value> {
    let mut found = value;
    let mut walked: Vec<&str> = Vec::new();
    let names: Vec<&str> = path.split('.').collect();
    for (at, name) in names.iter().copied().enumerate() {
        found = match found {
            Value::Null => return Ok(&Value::Null),
            Value::Array(items) => match name.parse::<usize>() {
                Ok(index) => items.get(index).unwrap_or(&Value::Null),
                Err(_) => bail!(
                    "{} is an array of {}; write the index of an element, such as {}.0",
                    walked.join("."),
                    items.len(),
                    walked.join(".")
                ),
            },
            Value::Object(fields) => match fields.get(name) {
                Some(field) => field,
                None => bail!("{}", describe_unknown(fields, &walked, &names[at..])),
            },
            _ => bail!("{} has no fields: it is a single value", walked.join(".")),
        };
        walked.push(name);
    }
    Ok(found)
}

/// `walked` leads to `fields`, which have no field of the first of the names that are left.
fn describe_unknown(fields: &Map<String, Value>, walked: &[&str], left: &[&str]) -> String {
    let of = if walked.is_empty() { "the message".into() } else { walked.join(".") };
    let names: Vec<&str> = fields.keys().map(String::as_str).collect();
    let name = left.first().copied().unwrap_or_default();
    // `pose.position.x` as in ROS, where `pose.x` is a field here.
    let shorter = left.get(1).filter(|next| names.contains(next)).map(|_| {
        let path: Vec<&str> = walked.iter().chain(&left[1..]).copied().collect();
        format!("; did you mean {}?", path.join("."))
    });
    let advice = shorter.unwrap_or_else(|| advise_similar(name, names.iter().copied()));
    format!("{of} has no field called {name}{advice} (it has: {})", names.join(", "))
}

/// Returns the paths of all single values in `value`, outside arrays.
pub fn list_single_values(value: &Value, path: &str, paths: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (name, field) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                list_single_values(field, &path, paths);
            }
        }
        Value::Array(_) => {}
        _ => paths.push(path.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn scan() -> Value {
        json!({"pose": {"x": 1.5, "y": 2.0}, "ranges": [4.0, 5.0], "hint": null})
    }

    #[test]
    fn fields_are_found_by_their_path() {
        let selected = select_fields(&scan(), &["pose.x".into(), "ranges.1".into()]);
        assert_eq!(selected.expect("they exist"), json!({"pose.x": 1.5, "ranges.1": 5.0}));
        for nothing in ["ranges.7", "hint", "hint.deep"] {
            assert_eq!(find_field(&scan(), nothing).expect("it may exist"), &Value::Null);
        }
    }

    #[test]
    fn an_unknown_field_is_refused_with_those_that_exist() {
        let refused = |path| find_field(&scan(), path).expect_err("unknown").to_string();
        assert_eq!(
            refused("pos.x"),
            "the message has no field called pos; did you mean pose? (it has: hint, pose, ranges)"
        );
        assert_eq!(refused("pose.z"), "pose has no field called z (it has: x, y)");
        assert_eq!(
            refused("pose.position.x"),
            "pose has no field called position; did you mean pose.x? (it has: x, y)"
        );
        assert!(refused("pose.x.y").contains("single value"));
        assert!(refused("ranges.first").contains("ranges.0"));
    }
}
