//! Any message as JSON, from its schema alone.
//!
//! Numbers that JSON lacks are the strings `"NaN"`, `"Infinity"`, `"-Infinity"`, and bytes are
//! base64, as in the JSON mapping of Protocol Buffers 3.

use serde_json::{Map, Value};
use thiserror::Error;

use super::layout::{Field, Schema};

/// Most memory that a message may take as JSON, in bytes, estimated: a `bool` of the payload
/// becomes a value of 32 bytes, a struct a map of names.
pub const MAX_JSON_LEN: usize = 1 << 30;

const VALUE_LEN: usize = size_of::<Value>();
/// An object's first node, which it has however few its fields.
const OBJECT_LEN: usize = 640;

/// Why a payload does not fit its schema.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("{path}: {problem} at byte {at}")]
pub struct JsonError {
    /// The field being read, such as `pose.position.x`.
    pub path: String,
    /// Offset into the payload.
    pub at: usize,
    /// What is wrong there.
    pub problem: &'static str,
}

/// Decodes `payload` by `schema`. The memory it takes depends on the payload's length, not on the
/// counts in it.
///
/// # Errors
/// [`JsonError`] if the payload is not exactly one value of the schema, or its JSON would be larger
/// than [`MAX_JSON_LEN`].
pub fn to_json(schema: &Schema, payload: &[u8]) -> Result<Value, JsonError> {
    to_json_within(schema, payload, MAX_JSON_LEN)
}

pub(super) fn to_json_within(
    schema: &Schema,
    payload: &[u8],
    room: usize,
) -> Result<Value, JsonError> {
    let mut reader = JsonReader { payload, at: 0, path: Vec::new(), room };
    let value = reader.read_value(schema)?;
    if reader.at < payload.len() {
        return Err(reader.error_here("bytes are left over"));
    }
    Ok(value)
}

struct JsonReader<'a> {
    payload: &'a [u8],
    at: usize,
    path: Vec<&'a str>,
    /// How much memory the rest may take.
    room: usize,
}

impl<'a> JsonReader<'a> {
    fn error_here(&self, problem: &'static str) -> JsonError {
        let path = if self.path.is_empty() { "value".into() } else { self.path.join(".") };
        JsonError { path, at: self.at, problem }
    }

    fn take_bytes(&mut self, len: usize) -> Result<&'a [u8], JsonError> {
        let end = self.at.checked_add(len).filter(|end| *end <= self.payload.len());
        let end = end.ok_or_else(|| self.error_here("the payload ends too early"))?;
        let bytes = &self.payload[self.at..end];
        self.at = end;
        Ok(bytes)
    }

    fn take_array<const N: usize>(&mut self) -> Result<[u8; N], JsonError> {
        let mut out = [0; N];
        out.copy_from_slice(self.take_bytes(N)?);
        Ok(out)
    }

    fn read_flag(&mut self) -> Result<bool, JsonError> {
        match self.take_array::<1>()?[0] {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(self.error_here("a flag is neither 0 nor 1")),
        }
    }

    /// A count of things that take at least a byte each.
    fn read_count(&mut self) -> Result<usize, JsonError> {
        let count = u64::from_le_bytes(self.take_array()?);
        let left = self.payload.len() - self.at;
        usize::try_from(count)
            .ok()
            .filter(|count| *count <= left)
            .ok_or_else(|| self.error_here("a count exceeds the payload"))
    }

    fn take_room(&mut self, len: usize) -> Result<(), JsonError> {
        let room = self.room.checked_sub(len);
        self.room = room.ok_or_else(|| self.error_here("the value is too large for JSON"))?;
        Ok(())
    }

    fn read_value(&mut self, schema: &'a Schema) -> Result<Value, JsonError> {
        Ok(match schema {
            Schema::Bool => Value::Bool(self.read_flag()?),
            Schema::U8 => self.take_array::<1>()?[0].into(),
            Schema::I8 => i8::from_le_bytes(self.take_array()?).into(),
            Schema::U16 => u16::from_le_bytes(self.take_array()?).into(),
            Schema::I16 => i16::from_le_bytes(self.take_array()?).into(),
            Schema::U32 => u32::from_le_bytes(self.take_array()?).into(),
            Schema::I32 => i32::from_le_bytes(self.take_array()?).into(),
            Schema::U64 => u64::from_le_bytes(self.take_array()?).into(),
            Schema::I64 => i64::from_le_bytes(self.take_array()?).into(),
            // Through its shortest decimal form, so that 0.1f32 is 0.1 and not 0.10000000149.
            Schema::F32 => {
                let number = f32::from_le_bytes(self.take_array()?);
                float_value(number.to_string().parse().unwrap_or(f64::from(number)))
            }
            Schema::F64 => float_value(f64::from_le_bytes(self.take_array()?)),
            Schema::Text => Value::String(self.read_text()?),
            Schema::Option(item) => {
                if self.read_flag()? {
                    self.read_value(item)?
                } else {
                    Value::Null
                }
            }
            Schema::List(item) if **item == Schema::U8 => {
                let len = self.read_count()?;
                self.take_room(len / 3 * 4)?;
                Value::String(encode_base64(self.take_bytes(len)?))
            }
            Schema::List(item) => {
                let count = self.read_count()?;
                self.read_items(item, count)?
            }
            Schema::Fixed(item, count) => self.read_items(item, *count)?,
            Schema::Struct { fields, .. } => Value::Object(self.read_fields(fields)?),
            Schema::Enum { variants, .. } => {
                let index = u32::from_le_bytes(self.take_array()?) as usize;
                let variant =
                    variants.get(index).ok_or_else(|| self.error_here("an unknown variant"))?;
                if variant.fields.is_empty() {
                    Value::String(variant.name.clone())
                } else {
                    let fields = self.read_fields(&variant.fields)?;
                    self.take_room(OBJECT_LEN)?;
                    Value::Object(Map::from_iter([(variant.name.clone(), Value::Object(fields))]))
                }
            }
        })
    }

    fn read_items(&mut self, item: &'a Schema, count: usize) -> Result<Value, JsonError> {
        // Grows with the values that are read: a peer can send any count.
        let mut items = Vec::new();
        for _ in 0..count {
            self.take_room(VALUE_LEN)?;
            items.push(self.read_value(item)?);
        }
        Ok(Value::Array(items))
    }

    fn read_fields(&mut self, fields: &'a [Field]) -> Result<Map<String, Value>, JsonError> {
        self.take_room(OBJECT_LEN)?;
        let mut object = Map::new();
        for field in fields {
            self.take_room(field.name.len() + VALUE_LEN + size_of::<String>())?;
            self.path.push(&field.name);
            let value = self.read_value(&field.schema)?;
            self.path.pop();
            object.insert(field.name.clone(), value);
        }
        Ok(object)
    }

    fn read_text(&mut self) -> Result<String, JsonError> {
        let len = self.read_count()?;
        self.take_room(len)?;
        let bytes = self.take_bytes(len)?;
        std::str::from_utf8(bytes)
            .map(str::to_owned)
            .map_err(|_| self.error_here("text is not UTF-8"))
    }
}

fn float_value(number: f64) -> Value {
    serde_json::Number::from_f64(number).map_or_else(
        || {
            let name = if number.is_nan() {
                "NaN"
            } else if number > 0.0 {
                "Infinity"
            } else {
                "-Infinity"
            };
            name.into()
        },
        Value::Number,
    )
}

fn encode_base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}
