//! JSON to the bytes of a message, by its schema: the inverse of `armor_wire::schema::to_json`. Continues
//! after a fault, so that all are found.

use armor_wire::codec::MAX_DATA_LEN;
use armor_wire::schema::{Field, Schema, Variant};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Map, Value};

use super::{FieldFault, describe_unknown, noun};

/// Most characters of a value that an error repeats.
const MAX_SHOWN: usize = 40;

/// The bytes so far, and what is wrong.
#[derive(Default)]
pub struct Encoder {
    bytes: Vec<u8>,
    path: Vec<String>,
    faults: Vec<FieldFault>,
}

/// Returns the name that JSON has for a number that is not finite.
pub fn name_of(number: f64) -> &'static str {
    match number {
        n if n.is_nan() => "NaN",
        n if n > 0.0 => "Infinity",
        _ => "-Infinity",
    }
}

impl Encoder {
    /// Returns the bytes.
    ///
    /// # Errors
    /// All faults.
    pub fn finish(mut self) -> Result<Vec<u8>, Vec<FieldFault>> {
        if self.bytes.len() > MAX_DATA_LEN {
            let len = self.bytes.len();
            self.add_fault(format!("it takes {len} bytes; a message has at most {MAX_DATA_LEN}"));
        }
        if self.faults.is_empty() { Ok(self.bytes) } else { Err(self.faults) }
    }

    /// Writes a value; nothing (`null`) is 0, empty or absent.
    pub fn write_value(&mut self, schema: &Schema, value: &Value) {
        if self.bytes.len().saturating_add(schema.min_len()) > MAX_DATA_LEN {
            let len = schema.min_len();
            let problem = format!("it takes at least {len} bytes; a message has {MAX_DATA_LEN}");
            return self.add_fault(problem);
        }
        match schema {
            Schema::Bool => match value {
                Value::Null => self.bytes.push(0),
                Value::Bool(is_set) => self.bytes.push(u8::from(*is_set)),
                other => self.refuse(schema, other),
            },
            Schema::U8 => self.write_whole(value, u8::MIN.into(), u8::MAX.into(), 1),
            Schema::I8 => self.write_whole(value, i8::MIN.into(), i8::MAX.into(), 1),
            Schema::U16 => self.write_whole(value, u16::MIN.into(), u16::MAX.into(), 2),
            Schema::I16 => self.write_whole(value, i16::MIN.into(), i16::MAX.into(), 2),
            Schema::U32 => self.write_whole(value, u32::MIN.into(), u32::MAX.into(), 4),
            Schema::I32 => self.write_whole(value, i32::MIN.into(), i32::MAX.into(), 4),
            Schema::U64 => self.write_whole(value, u64::MIN.into(), u64::MAX.into(), 8),
            Schema::I64 => self.write_whole(value, i64::MIN.into(), i64::MAX.into(), 8),
            Schema::F32 => match read_number(value) {
                Some(number) => self.bytes.extend((number as f32).to_le_bytes()),
                None => self.refuse(schema, value),
            },
            Schema::F64 => match read_number(value) {
                Some(number) => self.bytes.extend(number.to_le_bytes()),
                None => self.refuse(schema, value),
            },
            Schema::Text => match value {
                Value::Null => self.write_count(0),
                Value::String(text) => self.write_bytes(text.as_bytes()),
                other => self.refuse(schema, other),
            },
            Schema::Option(item) => {
                self.bytes.push(u8::from(!value.is_null()));
                if !value.is_null() {
                    self.write_value(item, value);
                }
            }
            Schema::List(item) if **item == Schema::U8 && value.is_string() => {
                match STANDARD.decode(value.as_str().unwrap_or_default()) {
                    Ok(bytes) => self.write_bytes(&bytes),
                    Err(_) => self.refuse(schema, value),
                }
            }
            Schema::List(item) => self.write_list(schema, item, value),
            Schema::Fixed(item, count) => self.write_fixed(schema, (item, *count), value),
            Schema::Struct { fields, .. } => match value {
                Value::Null => self.write_fields(fields, &Map::new()),
                Value::Object(object) => self.write_fields(fields, object),
                other => self.refuse(schema, other),
            },
            Schema::Enum { variants, .. } => self.write_variant(schema, variants, value),
        }
    }

    fn write_whole(&mut self, value: &Value, least: i128, most: i128, len: usize) {
        let number = match value {
            Value::Null => Some(0),
            Value::Number(number) => {
                let whole = number.as_i64().map(i128::from);
                whole.or_else(|| number.as_u64().map(i128::from))
            }
            _ => None,
        };
        match number.filter(|number| (least..=most).contains(number)) {
            Some(number) => self.bytes.extend(&number.to_le_bytes()[..len]),
            None => {
                let problem =
                    format!("{} is not a whole number from {least} to {most}", show(value));
                self.add_fault(problem);
            }
        }
    }

    fn write_count(&mut self, count: usize) {
        self.bytes.extend((count as u64).to_le_bytes());
    }

    fn write_bytes(&mut self, bytes: &[u8]) {
        self.write_count(bytes.len());
        self.bytes.extend(bytes);
    }

    fn write_list(&mut self, schema: &Schema, item: &Schema, value: &Value) {
        match value {
            Value::Null => self.write_count(0),
            Value::Array(items) => {
                self.write_count(items.len());
                self.write_items(item, items.iter());
            }
            // Elements that were given by their indices.
            Value::Object(fields) => {
                let is_given = |index: &usize| fields.contains_key(&index.to_string());
                if let Some(missing) = (0..fields.len()).find(|index| !is_given(index)) {
                    let problem =
                        format!("the element {missing} is not given, but one after it is");
                    return self.add_fault(problem);
                }
                self.write_count(fields.len());
                let items = (0..fields.len()).filter_map(|index| fields.get(&index.to_string()));
                self.write_items(item, items);
            }
            other => self.refuse(schema, other),
        }
    }

    fn write_fixed(&mut self, schema: &Schema, (item, count): (&Schema, usize), value: &Value) {
        match value {
            Value::Null => (0..count).for_each(|_| self.write_value(item, &Value::Null)),
            Value::Array(items) if items.len() == count => self.write_items(item, items.iter()),
            Value::Array(items) => {
                let problem = format!("{} elements are given; it has {count}", items.len());
                self.add_fault(problem);
            }
            Value::Object(fields) => {
                let index_of = |name: &String| name.parse::<usize>().ok();
                let beyond = fields.keys().find(|name| index_of(name).is_none_or(|it| it >= count));
                if let Some(index) = beyond {
                    let problem = format!("the element {index} is given; it has {count}, from 0");
                    return self.add_fault(problem);
                }
                let nothing = Value::Null;
                let items =
                    (0..count).map(|index| fields.get(&index.to_string()).unwrap_or(&nothing));
                self.write_items(item, items);
            }
            other => self.refuse(schema, other),
        }
    }

    fn write_items<'v>(&mut self, item: &Schema, items: impl Iterator<Item = &'v Value>) {
        for (index, value) in items.enumerate() {
            self.path.push(index.to_string());
            self.write_value(item, value);
            self.path.pop();
        }
    }

    fn write_fields(&mut self, fields: &[Field], object: &Map<String, Value>) {
        let is_unknown = |name: &&String| fields.iter().all(|field| field.name != **name);
        if let Some(name) = object.keys().find(is_unknown) {
            self.add_fault(describe_unknown(name, fields));
        }
        for field in fields {
            self.path.push(field.name.clone());
            self.write_value(&field.schema, object.get(&field.name).unwrap_or(&Value::Null));
            self.path.pop();
        }
    }

    /// Writes a variant, which is its name, or an object of its name with its fields.
    fn write_variant(&mut self, schema: &Schema, variants: &[Variant], value: &Value) {
        let (name, fields) = match value {
            // The first one stands for nothing, as 0 does for a number.
            Value::Null => (variants.first().map(|it| it.name.as_str()), None),
            Value::String(name) => (Some(name.as_str()), None),
            Value::Object(object) if object.len() == 1 => {
                let only = object.iter().next();
                (only.map(|(name, _)| name.as_str()), only.map(|(_, fields)| fields))
            }
            _ => (None, None),
        };
        let Some(name) = name else { return self.refuse(schema, value) };
        let Some(index) = variants.iter().position(|variant| variant.name == name) else {
            let known: Vec<_> = variants.iter().map(|it| it.name.as_str()).collect();
            return self.add_fault(format!("`{name}` is not one of {}", known.join(", ")));
        };
        let variant = &variants[index];
        self.bytes.extend((index as u32).to_le_bytes());
        match fields {
            None if variant.fields.is_empty() || value.is_null() => {
                self.write_fields(&variant.fields, &Map::new());
            }
            None => self.add_fault(format!("{name} has fields: write {{\"{name}\":{{…}}}}")),
            Some(Value::Object(object)) => {
                self.path.push(name.into());
                self.write_fields(&variant.fields, object);
                self.path.pop();
            }
            Some(other) => {
                self.add_fault(format!("{} is not an object of the fields of {name}", show(other)));
            }
        }
    }

    fn refuse(&mut self, schema: &Schema, value: &Value) {
        self.add_fault(format!("{} is not {}", show(value), noun(schema)));
    }

    fn add_fault(&mut self, problem: String) {
        self.faults.push(FieldFault { path: self.path.join("."), problem });
    }
}

fn read_number(value: &Value) -> Option<f64> {
    match value {
        Value::Null => Some(0.0),
        Value::Number(number) => number.as_f64(),
        Value::String(name) => {
            let numbers = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
            numbers.into_iter().find(|number| name_of(*number) == name)
        }
        _ => None,
    }
}

/// Returns a value as JSON, shortened.
fn show(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
