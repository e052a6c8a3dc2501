//! Reads one value of an encoded message without its Rust type: the field is located once by its
//! names, then read from every payload. The bytes before it are skipped, not decoded.

mod glimpse;
#[cfg(test)]
mod tests;

use thiserror::Error;

use super::layout::{Field, Schema};

pub use glimpse::{Glimpse, GlimpsedValue, ValuePath, glimpse_message};

/// The field that does not count when a message with a single other value is read without a field
/// name.
const STAMP: &str = "stamp";

/// A value that a field of a message can have.
#[derive(Clone, Debug, PartialEq)]
pub enum Scalar {
    /// Any number, in the field's unit.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// A text, or the name of an enum's variant.
    Text(String),
}

/// The location of a single value in the messages of one schema.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldPath<'a> {
    steps: Vec<usize>,
    /// Its layout: a number, `bool`, text or an enum; for an optional field the layout within the
    /// option.
    pub schema: &'a Schema,
    /// The unit of its number.
    pub unit: Option<&'a str>,
}

/// Why names do not lead to a single value.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FieldError {
    /// There is no such field.
    #[error("`{name}` is not a field there; there are: {}", known.join(", "))]
    Unknown {
        /// Which of the names, from 0.
        index: usize,
        /// The name.
        name: String,
        /// The fields that exist.
        known: Vec<String>,
    },
    /// The names so far lead to a value without fields.
    #[error("what comes before `{name}` has no fields")]
    NoFields {
        /// Which of the names, from 0.
        index: usize,
        /// The name.
        name: String,
    },
    /// The names lead to several values, or to none.
    #[error("it has not one value but {}", match known.as_slice() { [] => "none".into(), known => known.join(", ") })]
    NotOne {
        /// The fields that could be meant.
        known: Vec<String>,
    },
    /// The names lead to a list.
    #[error("it is a list, not a single value")]
    List,
}

/// Why a payload does not fit its schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{problem} at byte {at}")]
pub struct PayloadError {
    /// Offset into the payload.
    pub at: usize,
    /// What is wrong there.
    pub problem: &'static str,
}

impl<'a> FieldPath<'a> {
    /// Follows `names` from field to field. If they end at a struct that has exactly one number or
    /// `bool` besides `stamp`, that one is the value.
    ///
    /// # Errors
    /// [`FieldError`] if they lead to no single value.
    pub fn find(schema: &'a Schema, names: &[&str]) -> Result<Self, FieldError> {
        let mut path = Self { steps: Vec::new(), schema: without_options(schema), unit: None };
        for (index, name) in names.iter().enumerate() {
            let Schema::Struct { fields, .. } = path.schema else {
                return Err(FieldError::NoFields { index, name: (*name).into() });
            };
            let Some(step) = fields.iter().position(|field| field.name == *name) else {
                let known = fields.iter().map(|field| field.name.clone()).collect();
                return Err(FieldError::Unknown { index, name: (*name).into(), known });
            };
            path.add_step(step, &fields[step]);
        }
        match path.schema {
            Schema::List(_) | Schema::Fixed(..) => Err(FieldError::List),
            Schema::Struct { fields, .. } => {
                let single: Vec<_> = (0..fields.len()).filter(|i| is_value(&fields[*i])).collect();
                let [only] = single[..] else {
                    let known = single.iter().map(|i| fields[*i].name.clone()).collect();
                    return Err(FieldError::NotOne { known });
                };
                path.add_step(only, &fields[only]);
                Ok(path.with_unit_of_value())
            }
            _ => Ok(path.with_unit_of_value()),
        }
    }

    fn add_step(&mut self, step: usize, field: &'a Field) {
        self.steps.push(step);
        // A unit of a struct is that of the numbers in it.
        (self.schema, self.unit) =
            (without_options(&field.schema), field.unit.as_deref().or(self.unit));
    }

    /// Without the unit of a struct, if the value is no number.
    fn with_unit_of_value(mut self) -> Self {
        use Schema::{Bool, Enum, Text};
        self.unit = self.unit.filter(|_| !matches!(self.schema, Bool | Text | Enum { .. }));
        self
    }

    /// Reads the value from one payload of `schema`, in which it was found; `None` if it is, or
    /// lies within, an absent optional value.
    ///
    /// # Errors
    /// [`PayloadError`] if the payload up to the value is not one of the schema.
    pub fn read(&self, schema: &Schema, payload: &[u8]) -> Result<Option<Scalar>, PayloadError> {
        let mut cursor = Cursor { payload, at: 0 };
        let mut schema = schema;
        let mut steps = self.steps.iter();
        loop {
            while let Schema::Option(item) = schema {
                if !cursor.read_flag()? {
                    return Ok(None);
                }
                schema = item;
            }
            let Some(step) = steps.next() else { return cursor.read_scalar(schema).map(Some) };
            let Schema::Struct { fields, .. } = schema else {
                return Err(cursor.error_here("another schema"));
            };
            for field in fields.iter().take(*step) {
                cursor.skip_value(&field.schema)?;
            }
            let field = fields.get(*step).ok_or_else(|| cursor.error_here("another schema"))?;
            schema = &field.schema;
        }
    }
}

fn without_options(mut schema: &Schema) -> &Schema {
    while let Schema::Option(item) = schema {
        schema = item;
    }
    schema
}

/// Whether a field can be read without being named: a number or `bool` other than the stamp.
fn is_value(field: &Field) -> bool {
    use Schema::{Enum, Fixed, List, Struct, Text};
    let schema = without_options(&field.schema);
    let is_other = matches!(schema, Text | List(_) | Fixed(..) | Struct { .. } | Enum { .. });
    !is_other && field.name != STAMP
}

/// Returns the encoded length of a schema's values, if it is the same for all of them.
fn fixed_len(schema: &Schema) -> Option<usize> {
    match schema {
        Schema::Option(_) | Schema::List(_) | Schema::Text | Schema::Enum { .. } => None,
        Schema::Fixed(item, count) => fixed_len(item)?.checked_mul(*count),
        Schema::Struct { fields, .. } => {
            fields.iter().try_fold(0_usize, |sum, field| sum.checked_add(fixed_len(&field.schema)?))
        }
        plain => Some(plain.min_len()),
    }
}

struct Cursor<'a> {
    payload: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn error_here(&self, problem: &'static str) -> PayloadError {
        PayloadError { at: self.at, problem }
    }

    fn take_bytes(&mut self, len: usize) -> Result<&'a [u8], PayloadError> {
        let end = self.at.checked_add(len).filter(|end| *end <= self.payload.len());
        let end = end.ok_or_else(|| self.error_here("the payload ends too early"))?;
        let bytes = &self.payload[self.at..end];
        self.at = end;
        Ok(bytes)
    }

    fn take_array<const N: usize>(&mut self) -> Result<[u8; N], PayloadError> {
        let mut out = [0; N];
        out.copy_from_slice(self.take_bytes(N)?);
        Ok(out)
    }

    fn read_flag(&mut self) -> Result<bool, PayloadError> {
        match self.take_array::<1>()?[0] {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(self.error_here("a flag is neither 0 nor 1")),
        }
    }

    fn read_count(&mut self) -> Result<usize, PayloadError> {
        let count = u64::from_le_bytes(self.take_array()?);
        usize::try_from(count).map_err(|_| self.error_here("a count exceeds the payload"))
    }

    fn read_scalar(&mut self, schema: &Schema) -> Result<Scalar, PayloadError> {
        Ok(Scalar::Number(match schema {
            Schema::Bool => return Ok(Scalar::Flag(self.read_flag()?)),
            Schema::U8 => self.take_array::<1>()?[0].into(),
            Schema::I8 => i8::from_le_bytes(self.take_array()?).into(),
            Schema::U16 => u16::from_le_bytes(self.take_array()?).into(),
            Schema::I16 => i16::from_le_bytes(self.take_array()?).into(),
            Schema::U32 => u32::from_le_bytes(self.take_array()?).into(),
            Schema::I32 => i32::from_le_bytes(self.take_array()?).into(),
            // Above 2^53 to the nearest number that a double can be.
            Schema::U64 => u64::from_le_bytes(self.take_array()?) as f64,
            Schema::I64 => i64::from_le_bytes(self.take_array()?) as f64,
            // Through its shortest decimal form, so that 0.3f32 is 0.3 and not 0.30000001192.
            Schema::F32 => {
                let number = f32::from_le_bytes(self.take_array()?);
                number.to_string().parse().unwrap_or(f64::from(number))
            }
            Schema::F64 => f64::from_le_bytes(self.take_array()?),
            Schema::Text => {
                let len = self.read_count()?;
                let text = std::str::from_utf8(self.take_bytes(len)?);
                let text = text.map_err(|_| self.error_here("text is not UTF-8"))?;
                return Ok(Scalar::Text(text.to_owned()));
            }
            Schema::Enum { variants, .. } => {
                let index = u32::from_le_bytes(self.take_array()?) as usize;
                let variant =
                    variants.get(index).ok_or_else(|| self.error_here("an unknown variant"))?;
                return Ok(Scalar::Text(variant.name.clone()));
            }
            Schema::Option(_) | Schema::List(_) | Schema::Fixed(..) | Schema::Struct { .. } => {
                return Err(self.error_here("another schema"));
            }
        }))
    }

    /// Skips `count` values.
    fn skip_items(&mut self, item: &Schema, count: usize) -> Result<(), PayloadError> {
        match fixed_len(item) {
            Some(len) => {
                let len = len.checked_mul(count);
                let len = len.ok_or_else(|| self.error_here("a count exceeds the payload"))?;
                self.take_bytes(len).map(drop)
            }
            // Each takes a byte at least, so a wrong count ends with the payload.
            None => (0..count).try_for_each(|_| self.skip_value(item)),
        }
    }

    fn skip_value(&mut self, schema: &Schema) -> Result<(), PayloadError> {
        if let Some(len) = fixed_len(schema) {
            return self.take_bytes(len).map(drop);
        }
        match schema {
            Schema::Text => {
                let len = self.read_count()?;
                self.take_bytes(len)?;
            }
            Schema::Option(item) => {
                let is_there = self.read_flag()?;
                (0..usize::from(is_there)).try_for_each(|_| self.skip_value(item))?;
            }
            Schema::List(item) => {
                let count = self.read_count()?;
                self.skip_items(item, count)?;
            }
            Schema::Fixed(item, count) => (0..*count).try_for_each(|_| self.skip_value(item))?,
            Schema::Struct { fields, .. } => {
                fields.iter().try_for_each(|field| self.skip_value(&field.schema))?;
            }
            Schema::Enum { variants, .. } => {
                let index = u32::from_le_bytes(self.take_array()?) as usize;
                let variant =
                    variants.get(index).ok_or_else(|| self.error_here("an unknown variant"))?;
                variant.fields.iter().try_for_each(|field| self.skip_value(&field.schema))?;
            }
            _ => {}
        }
        Ok(())
    }
}
