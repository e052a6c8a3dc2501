//! A message that a person writes, by the names of its fields: `linear.x=0.3`, or a JSON object. It is
//! checked against the schema of its type, and every fault is found.

mod encoding;

use std::fmt;

use armor_wire::schema::{Field, Schema};
use serde_json::{Map, Value};

use encoding::Encoder;

/// The field that has the time of a message; it is filled in if it is not given.
const STAMP: &str = "stamp";
/// Most fields that an error lists.
const MAX_KNOWN: usize = 20;

/// A message of some type, to be encoded.
#[derive(Clone, Debug)]
pub struct MessageDraft {
    schema: Schema,
    value: Value,
    /// It has a stamp that is to be filled in.
    lacks_stamp: bool,
}

/// What is wrong with one field of a draft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldFault {
    /// The field, such as `pose.x`; empty for the message itself.
    pub path: String,
    /// What is wrong there, what was given, and what is expected.
    pub problem: String,
}

impl fmt::Display for FieldFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.path.as_str() {
            "" => f.write_str(&self.problem),
            path => write!(f, "{path}: {}", self.problem),
        }
    }
}

impl MessageDraft {
    /// Reads a draft from arguments: JSON objects, and `PATH=VALUE`, of which later ones replace
    /// earlier ones. Fields that are not given are 0, empty or absent, and a `stamp` is the time of
    /// the encoding.
    ///
    /// # Errors
    /// All faults, if a field does not exist, or a value is not of its type.
    pub fn parse(schema: &Schema, arguments: &[String]) -> Result<Self, Vec<FieldFault>> {
        let mut faults = Vec::new();
        let mut value = Value::Object(Map::new());
        for argument in arguments {
            if let Err(fault) = add_argument(schema, argument, &mut value) {
                faults.push(fault);
            }
        }
        let lacks_stamp = has_stamp(schema) && value.get(STAMP).is_none();
        let draft = Self { schema: schema.clone(), value, lacks_stamp };
        if let Err(others) = draft.encode(0.0) {
            faults.extend(others);
        }
        if faults.is_empty() { Ok(draft) } else { Err(faults) }
    }

    /// Returns the message with the stamp `now_s`, unless it has one of its own.
    ///
    /// # Errors
    /// All faults; none if the draft was parsed.
    pub fn encode(&self, now_s: f64) -> Result<Vec<u8>, Vec<FieldFault>> {
        let mut encoder = Encoder::default();
        match &self.value {
            Value::Object(fields) if self.lacks_stamp => {
                let mut fields = fields.clone();
                fields.insert(STAMP.into(), now_s.into());
                encoder.write_value(&self.schema, &Value::Object(fields));
            }
            value => encoder.write_value(&self.schema, value),
        }
        encoder.finish()
    }
}

fn has_stamp(schema: &Schema) -> bool {
    let is_stamp = |field: &Field| field.name == STAMP && field.schema == Schema::F64;
    matches!(schema, Schema::Struct { fields, .. } if fields.iter().any(is_stamp))
}

fn fault(path: &str, problem: impl Into<String>) -> FieldFault {
    FieldFault { path: path.into(), problem: problem.into() }
}

/// Adds a JSON object, or the value of one field.
fn add_argument(schema: &Schema, argument: &str, value: &mut Value) -> Result<(), FieldFault> {
    if argument.trim_start().starts_with('{') {
        let object: Map<String, Value> = serde_json::from_str(argument)
            .map_err(|error| fault("", format!("{argument} is no JSON object: {error}")))?;
        if let Value::Object(fields) = value {
            fields.extend(object);
        }
        return Ok(());
    }
    let Some((path, text)) = argument.split_once('=') else {
        let problem = format!(
            "`{argument}` is no field: write PATH=VALUE, such as linear.x=0.3, or a JSON object"
        );
        return Err(fault("", problem));
    };
    let (place, schema) = find_place(schema, path, value)?;
    *place = parse_text(schema, text).map_err(|problem| fault(path, problem))?;
    Ok(())
}

/// Returns the place of the field at `path`, and its layout. Structs and arrays on the way to it are
/// made; an array is an object with the indices as names until it is encoded.
fn find_place<'v, 's>(
    mut schema: &'s Schema,
    path: &str,
    mut value: &'v mut Value,
) -> Result<(&'v mut Value, &'s Schema), FieldFault> {
    let mut walked = String::new();
    for name in path.split('.') {
        while let Schema::Option(item) = schema {
            schema = item;
        }
        schema = match schema {
            Schema::Struct { fields, .. } => {
                let field = fields.iter().find(|field| field.name == name);
                let known = || describe_unknown(name, fields);
                &field.ok_or_else(|| fault(path, known()))?.schema
            }
            Schema::List(item) | Schema::Fixed(item, _) => match name.parse::<usize>() {
                Ok(_) => item,
                Err(_) => {
                    let problem =
                        format!("{walked} is an array: `{name}` is not the index of an element");
                    return Err(fault(path, problem));
                }
            },
            Schema::Enum { .. } => {
                let problem =
                    format!("{walked} is one of several: write {walked}={{\"VARIANT\":…}}");
                return Err(fault(path, problem));
            }
            _ => return Err(fault(path, format!("{walked} has no fields: it is a single value"))),
        };
        if !value.is_object() {
            *value = open_array(value);
        }
        let Value::Object(fields) = value else {
            return Err(fault(path, format!("{walked} was given as a single value before")));
        };
        value = fields.entry(name).or_insert(Value::Null);
        walked = if walked.is_empty() { name.into() } else { format!("{walked}.{name}") };
    }
    Ok((value, schema))
}

/// Returns the elements of an array under their indices, and nothing of anything else.
fn open_array(value: &Value) -> Value {
    let items = value.as_array().map(Vec::as_slice).unwrap_or_default();
    let indexed = items.iter().enumerate().map(|(index, item)| (index.to_string(), item.clone()));
    Value::Object(indexed.collect())
}

/// Reads the value of one field as a person writes it: a text without quotes.
fn parse_text(schema: &Schema, text: &str) -> Result<Value, String> {
    match schema {
        Schema::Text => Ok(text.into()),
        Schema::Option(_) if text == "null" => Ok(Value::Null),
        Schema::Option(item) => parse_text(item, text),
        Schema::List(item) if **item == Schema::U8 && !text.starts_with('[') => Ok(text.into()),
        // A plain variant, or JSON.
        Schema::Enum { .. } if !text.starts_with(['{', '"']) => Ok(text.into()),
        Schema::F32 | Schema::F64 => match text.trim().parse::<f64>() {
            // Not through a number of JSON, which is never infinite.
            Ok(number) if !number.is_finite() => Ok(encoding::name_of(number).into()),
            Ok(number) => Ok(number.into()),
            Err(_) => Err(format!("`{text}` is not a number")),
        },
        Schema::Struct { .. } | Schema::List(_) | Schema::Fixed(..) => serde_json::from_str(text)
            .map_err(|_| format!("`{text}` is no JSON, which is written for {}", noun(schema))),
        _ => serde_json::from_str(text).map_err(|_| format!("`{text}` is not {}", noun(schema))),
    }
}

/// What a value of this layout is called, with its article.
fn noun(schema: &Schema) -> &'static str {
    match schema {
        Schema::Bool => "true or false",
        Schema::F32 | Schema::F64 => "a number",
        Schema::Text => "a text",
        Schema::Option(item) => noun(item),
        Schema::List(item) if **item == Schema::U8 => "bytes in base64",
        Schema::List(_) | Schema::Fixed(..) => "an array",
        Schema::Struct { .. } => "an object",
        Schema::Enum { .. } => "a variant",
        _ => "a whole number",
    }
}

fn describe_unknown(name: &str, fields: &[Field]) -> String {
    let known: Vec<_> = fields.iter().take(MAX_KNOWN).map(|field| field.name.as_str()).collect();
    let more = if fields.len() > MAX_KNOWN { ", …" } else { "" };
    format!("`{name}` is not a field there; there are: {}{more}", known.join(", "))
}

#[cfg(test)]
mod tests {
    use armor_wire::schema::{parse, to_json};
    use serde_json::json;

    use super::*;

    const POSE: &str = "Goal{stamp:f64(s),pose:Pose{x:f64(m),y:f32(m)},name:string,level:?u8,\
                        mode:Mode<Slow,Fast{limit:f64}>,path:[P{x:f64}],cov:[i16;3],raw:[u8],ok:bool}";

    fn draft(arguments: &[&str]) -> Result<Value, Vec<String>> {
        let schema = parse(POSE).expect("a schema");
        let arguments: Vec<_> = arguments.iter().map(|it| (*it).to_owned()).collect();
        let draft = MessageDraft::parse(&schema, &arguments)
            .map_err(|faults| faults.iter().map(ToString::to_string).collect::<Vec<_>>())?;
        let bytes = draft.encode(7.5).expect("it was parsed");
        Ok(to_json(&schema, &bytes).expect("it fits its schema"))
    }

    #[test]
    fn what_is_not_given_is_nothing_and_the_stamp_is_the_time() {
        let expected = json!({"stamp": 7.5, "pose": {"x": 0.0, "y": 0.0}, "name": "", "level": null,
            "mode": "Slow", "path": [], "cov": [0, 0, 0], "raw": "", "ok": false});
        assert_eq!(draft(&[]), Ok(expected));
        assert_eq!(draft(&["stamp=3"]).expect("a stamp")["stamp"], json!(3.0));
    }

    #[test]
    fn fields_are_given_by_their_path_or_as_json() {
        let value = draft(&[
            r#"{"pose": {"y": 2.5}, "path": [{"x": 1}, {"x": 2}], "raw": "AQID"}"#,
            "pose.x=-0.3",
            "name=the first, of two",
            "level=3",
            "mode={\"Fast\":{\"limit\":\"Infinity\"}}",
            "path.1.x=NaN",
            "cov.2=-7",
            "ok=true",
        ]);
        let expected = json!({"stamp": 7.5, "pose": {"x": -0.3, "y": 2.5},
            "name": "the first, of two", "level": 3, "mode": {"Fast": {"limit": "Infinity"}},
            "path": [{"x": 1.0}, {"x": "NaN"}], "cov": [0, 0, -7], "raw": "AQID", "ok": true});
        assert_eq!(value, Ok(expected));
        assert_eq!(draft(&["name=5"]).expect("a text")["name"], json!("5"));
        assert_eq!(draft(&["mode=Slow"]).expect("a variant")["mode"], json!("Slow"));
        assert_eq!(draft(&["raw=AQID"]).expect("bytes")["raw"], json!("AQID"));
        assert_eq!(draft(&["raw=[1,2,3]"]).expect("bytes")["raw"], json!("AQID"));
        assert_eq!(draft(&["level=3", "level=null"]).expect("nothing")["level"], Value::Null);
    }

    #[test]
    fn every_fault_is_found_with_its_path_and_what_is_there() {
        let faults = draft(&[
            "pos.x=1",
            "pose.x=fast",
            "nonsense",
            r#"{"cov": [1, 2], "level": 256, "mode": "Quick", "ok": 1, "path": [{"x": 1, "z": 2}],
                "raw": "?", "name": 5, "pose": 3}"#,
        ]);
        let expected = [
            "pos.x: `pos` is not a field there; there are: stamp, pose, name, level, mode, path, cov, raw, ok",
            "pose.x: `fast` is not a number",
            "`nonsense` is no field: write PATH=VALUE, such as linear.x=0.3, or a JSON object",
            "pose: 3 is not an object",
            "name: 5 is not a text",
            "level: 256 is not a whole number from 0 to 255",
            "mode: `Quick` is not one of Slow, Fast",
            "path.0: `z` is not a field there; there are: x",
            "cov: 2 elements are given; it has 3",
            "raw: \"?\" is not bytes in base64",
            "ok: 1 is not true or false",
        ];
        assert_eq!(draft_error(faults), expected);
        assert_eq!(
            draft_error(draft(&["cov.3=1"])),
            ["cov: the element 3 is given; it has 3, from 0"]
        );
        assert_eq!(
            draft_error(draft(&["path.1.x=1"])),
            ["path: the element 0 is not given, but one after it is"]
        );
        assert_eq!(
            draft_error(draft(&["pose.x.deep=1"])),
            ["pose.x.deep: pose.x has no fields: it is a single value"]
        );
        assert_eq!(
            draft_error(draft(&["mode=Fast"])),
            ["mode: Fast has fields: write {\"Fast\":{…}}"]
        );
    }

    fn draft_error(draft: Result<Value, Vec<String>>) -> Vec<String> {
        draft.expect_err("it has faults")
    }

    #[test]
    fn a_message_that_is_too_large_is_refused_before_it_is_filled() {
        let schema = parse("Big{all:[[[f64;60000];100]]}").expect("a schema");
        let faults = MessageDraft::parse(&schema, &["all=[null,null]".into()]);
        let faults = faults.expect_err("it is too large");
        assert_eq!(faults[0].path, "all.1");
        assert!(faults[0].problem.contains("bytes"), "{faults:?}");
    }
}
