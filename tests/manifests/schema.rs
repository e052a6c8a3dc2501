//! The subset of JSON Schema 2020-12 that the schema of manifests uses. Any other keyword panics,
//! so that no part of the schema is ignored silently.

use std::collections::BTreeSet;

use serde_json::{Map, Value};

/// A schema.
pub struct Schema(Value);

impl Schema {
    /// Reads one.
    pub fn new(text: &str) -> Self {
        Self(serde_json::from_str(text).expect("a schema in JSON"))
    }

    /// Checks that `value` conforms to the schema; if not, returns the position and the reason.
    pub fn check(&self, value: &Value) -> Result<(), String> {
        self.check_at(&self.0, value, "")
    }

    /// Returns the names of all members that the schema describes, each with its definition's name.
    pub fn members(&self) -> BTreeSet<String> {
        let definitions = self.0["$defs"].as_object().into_iter().flatten();
        let definitions = definitions.map(|(name, schema)| (name.as_str(), schema));
        let all = [("", &self.0)].into_iter().chain(definitions);
        let members = |(of, schema): (&str, &Value)| -> Vec<String> {
            let members = schema["properties"].as_object().into_iter().flatten();
            members.map(|(name, _)| format!("{of}.{name}")).collect()
        };
        all.flat_map(members).collect()
    }

    /// As [`Self::members`], those that a manifest has.
    pub fn members_used(&self, manifest: &Value) -> BTreeSet<String> {
        let names = |of: &str, value: &Value| -> Vec<String> {
            let members = value.as_object().into_iter().flatten();
            members.map(|(name, _)| format!("{of}.{name}")).collect()
        };
        let mut used: BTreeSet<String> = names("", manifest).into_iter().collect();
        for (list, of) in [
            ("inputs", "port"),
            ("outputs", "port"),
            ("parameters", "parameter"),
            ("events", "event"),
            ("value_effects", "value_effect"),
            ("frames", "port_frame"),
        ] {
            let items = manifest[list].as_array().into_iter().flatten();
            used.extend(items.flat_map(|item| names(of, item)));
        }
        used
    }

    fn check_at(&self, schema: &Value, value: &Value, at: &str) -> Result<(), String> {
        let words = schema.as_object().expect("a schema is an object");
        for (word, wanted) in words {
            let holds = match word.as_str() {
                "$schema" | "$defs" | "title" | "description" => true,
                "$ref" => {
                    let path = wanted.as_str().and_then(|path| path.strip_prefix('#'));
                    let other = self.0.pointer(path.expect("a path in this schema"));
                    self.check_at(other.expect("the reference leads somewhere"), value, at)?;
                    true
                }
                "type" => is_of_type(value, wanted.as_str().expect("one type")),
                "const" => value == wanted,
                "enum" => wanted.as_array().expect("a list").contains(value),
                "minLength" => length(value).is_none_or(|length| Some(length) >= wanted.as_u64()),
                "maxLength" => length(value).is_none_or(|length| Some(length) <= wanted.as_u64()),
                "pattern" => {
                    value.as_str().is_none_or(|text| matches(wanted.as_str().expect("text"), text))
                }
                "items" => {
                    for (n, item) in value.as_array().into_iter().flatten().enumerate() {
                        self.check_at(wanted, item, &format!("{at}/{n}"))?;
                    }
                    true
                }
                "required" => value.as_object().is_none_or(|members| has_all(members, wanted)),
                "properties" => {
                    for (name, member) in value.as_object().into_iter().flatten() {
                        if let Some(schema) = wanted.get(name) {
                            self.check_at(schema, member, &format!("{at}/{name}"))?;
                        }
                    }
                    true
                }
                "additionalProperties" => {
                    assert_eq!(*wanted, Value::Bool(false));
                    let known = schema["properties"].as_object().expect("properties");
                    value.as_object().is_none_or(|all| all.keys().all(|n| known.contains_key(n)))
                }
                other => panic!("{other:?} is not understood here"),
            };
            if !holds {
                return Err(format!("{at}: {word} {wanted} does not hold for {value}"));
            }
        }
        Ok(())
    }
}

fn is_of_type(value: &Value, name: &str) -> bool {
    match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "boolean" => value.is_boolean(),
        other => panic!("the type {other:?} is not understood here"),
    }
}

/// In characters.
fn length(value: &Value) -> Option<u64> {
    Some(value.as_str()?.chars().count() as u64)
}

fn has_all(members: &Map<String, Value>, names: &Value) -> bool {
    let mut names = names.as_array().expect("a list").iter();
    names.all(|name| members.contains_key(name.as_str().expect("a name")))
}

/// The three patterns of the schema.
fn matches(pattern: &str, text: &str) -> bool {
    match pattern {
        "^[A-Za-z][A-Za-z0-9_-]*$" => {
            let word = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
            text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(word)
        }
        "^[0-9A-Fa-f]{16}$" => text.len() == 16 && text.chars().all(|c| c.is_ascii_hexdigit()),
        "^[^\\u0000-\\u001f\\u007f-\\u009f]*$" => !text.contains(char::is_control),
        other => panic!("the pattern {other:?} is not understood here"),
    }
}
