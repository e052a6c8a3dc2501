//! Schemas as text: the canonical form that is hashed, and its reader.
//!
//! `Pose2D{x:f64(m),y:f64(m),theta:f64(rad)}`, `[f32]`, `[f64;36]`, `?string`,
//! `Level<Low,High{margin:f64}>`. No spaces.

use std::fmt;

use std::collections::BTreeSet;

use thiserror::Error;

use super::layout::{Field, Schema, Variant};
use crate::limits::{MAX_DATA_LEN, MAX_FIXED_COUNT};

/// Deepest nesting of a schema that is read.
pub const MAX_DEPTH: usize = 16;
/// Longest schema text that is read, in bytes.
pub const MAX_TEXT_LEN: usize = 16 << 10;
/// Longest name of a type, field or variant in a schema, in bytes.
pub const MAX_LABEL_LEN: usize = 128;
/// Longest unit in a schema, in bytes.
pub const MAX_UNIT_LEN: usize = 32;

impl fmt::Display for Schema {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Option(item) => write!(f, "?{item}"),
            Self::List(item) => write!(f, "[{item}]"),
            Self::Fixed(item, count) => write!(f, "[{item};{count}]"),
            Self::Struct { name, fields } => write!(f, "{name}{}", FieldList(fields)),
            Self::Enum { name, variants } => {
                write!(f, "{name}<")?;
                for (index, variant) in variants.iter().enumerate() {
                    let comma = if index > 0 { "," } else { "" };
                    write!(f, "{comma}{}", variant.name)?;
                    if !variant.fields.is_empty() {
                        write!(f, "{}", FieldList(&variant.fields))?;
                    }
                }
                write!(f, ">")
            }
            primitive => f.write_str(primitive_name(primitive)),
        }
    }
}

struct FieldList<'a>(&'a [Field]);

impl fmt::Display for FieldList<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{")?;
        for (index, field) in self.0.iter().enumerate() {
            let comma = if index > 0 { "," } else { "" };
            write!(f, "{comma}{}:{}", field.name, field.schema)?;
            if let Some(unit) = &field.unit {
                write!(f, "({unit})")?;
            }
        }
        f.write_str("}")
    }
}

const PRIMITIVES: [(&str, Schema); 12] = [
    ("bool", Schema::Bool),
    ("u8", Schema::U8),
    ("i8", Schema::I8),
    ("u16", Schema::U16),
    ("i16", Schema::I16),
    ("u32", Schema::U32),
    ("i32", Schema::I32),
    ("u64", Schema::U64),
    ("i64", Schema::I64),
    ("f32", Schema::F32),
    ("f64", Schema::F64),
    ("string", Schema::Text),
];

fn primitive_name(schema: &Schema) -> &'static str {
    PRIMITIVES.iter().find(|(_, primitive)| primitive == schema).map_or("", |(name, _)| name)
}

/// Why a text is not a schema.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("schema text, byte {at}: {problem}")]
pub struct ParseError {
    /// Offset of the offending byte.
    pub at: usize,
    /// What is wrong there.
    pub problem: &'static str,
}

/// Reads a schema from its canonical text.
///
/// # Errors
/// [`ParseError`] if the text is not canonical, deeper than [`MAX_DEPTH`], longer than
/// [`MAX_TEXT_LEN`], or of a value that does not fit into [`MAX_DATA_LEN`] bytes.
pub fn parse(text: &str) -> Result<Schema, ParseError> {
    if text.len() > MAX_TEXT_LEN {
        return Err(ParseError { at: MAX_TEXT_LEN, problem: "the text is too long" });
    }
    let mut parser = SchemaParser { text, at: 0 };
    let schema = parser.parse_schema(0)?;
    if parser.at < text.len() {
        return Err(parser.error_here("text after the end of the schema"));
    }
    if schema.min_len() > MAX_DATA_LEN {
        return Err(parser.error_here("no payload can hold a value of this type"));
    }
    Ok(schema)
}

struct SchemaParser<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> SchemaParser<'a> {
    fn error_here(&self, problem: &'static str) -> ParseError {
        ParseError { at: self.at, problem }
    }

    fn take_byte(&mut self, byte: u8) -> bool {
        let found = self.text.as_bytes().get(self.at) == Some(&byte);
        self.at += usize::from(found);
        found
    }

    fn expect_byte(&mut self, byte: u8, problem: &'static str) -> Result<(), ParseError> {
        if self.take_byte(byte) { Ok(()) } else { Err(self.error_here(problem)) }
    }

    /// The longest run of allowed bytes, 1 to `most` of them. All that is allowed is ASCII.
    fn take_word(
        &mut self,
        allowed: impl Fn(u8) -> bool,
        most: usize,
        problem: &'static str,
    ) -> Result<&'a str, ParseError> {
        let rest = &self.text[self.at..];
        let len = rest.bytes().take_while(|byte| allowed(*byte)).count();
        if len == 0 || len > most {
            return Err(self.error_here(problem));
        }
        self.at += len;
        Ok(&rest[..len])
    }

    fn parse_name(&mut self) -> Result<&'a str, ParseError> {
        let at = self.at;
        let problem = "a name is expected: a letter or _, then letters, digits, _ - /; 128 at most";
        let name = self.take_word(is_name_byte, MAX_LABEL_LEN, problem)?;
        if name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            Ok(name)
        } else {
            Err(ParseError { at, problem })
        }
    }

    /// Parses the name of a field or variant that is not in `taken` yet.
    fn parse_label(&mut self, taken: &mut BTreeSet<&'a str>) -> Result<String, ParseError> {
        let at = self.at;
        let name = self.parse_name()?;
        if taken.insert(name) {
            Ok(name.into())
        } else {
            Err(ParseError { at, problem: "the name occurs twice" })
        }
    }

    fn parse_schema(&mut self, depth: usize) -> Result<Schema, ParseError> {
        if depth > MAX_DEPTH {
            return Err(self.error_here("nested too deep"));
        }
        if self.take_byte(b'?') {
            return Ok(Schema::Option(Box::new(self.parse_schema(depth + 1)?)));
        }
        if self.take_byte(b'[') {
            return self.parse_array(depth);
        }
        let name = self.parse_name()?;
        if let Some((_, primitive)) = PRIMITIVES.iter().find(|(known, _)| *known == name) {
            return Ok(primitive.clone());
        }
        let name = name.into();
        if self.take_byte(b'{') {
            return Ok(Schema::Struct { name, fields: self.parse_fields(depth)? });
        }
        self.expect_byte(b'<', "an unknown type; a struct has {fields}, an enum <variants>")?;
        Ok(Schema::Enum { name, variants: self.parse_variants(depth)? })
    }

    fn parse_array(&mut self, depth: usize) -> Result<Schema, ParseError> {
        let item = self.parse_schema(depth + 1)?;
        if item.min_len() == 0 {
            return Err(self.error_here("the items of a list take no bytes"));
        }
        if !self.take_byte(b';') {
            self.expect_byte(b']', "a list ends with ]")?;
            return Ok(Schema::List(Box::new(item)));
        }
        let problem = "the count is not in 1..=65536, without leading zeros";
        let at = self.at;
        let digits = self.take_word(|b| b.is_ascii_digit(), 5, problem)?;
        let count = digits.parse().ok().filter(|count| (1..=MAX_FIXED_COUNT).contains(count));
        let count = count.filter(|_| !digits.starts_with('0')).ok_or(ParseError { at, problem })?;
        self.expect_byte(b']', "an array ends with ]")?;
        Ok(Schema::Fixed(Box::new(item), count))
    }

    fn parse_fields(&mut self, depth: usize) -> Result<Vec<Field>, ParseError> {
        let mut fields = Vec::new();
        if self.take_byte(b'}') {
            return Ok(fields);
        }
        let mut taken = BTreeSet::new();
        loop {
            let name = self.parse_label(&mut taken)?;
            self.expect_byte(b':', "a field is name:type")?;
            let schema = self.parse_schema(depth + 1)?;
            let unit = if self.take_byte(b'(') {
                let unit =
                    self.take_word(is_unit_byte, MAX_UNIT_LEN, "a unit of 1 to 32 characters")?;
                self.expect_byte(b')', "a unit ends with )")?;
                Some(unit.into())
            } else {
                None
            };
            fields.push(Field { name, schema, unit });
            if !self.take_byte(b',') {
                self.expect_byte(b'}', "fields end with }")?;
                return Ok(fields);
            }
        }
    }

    fn parse_variants(&mut self, depth: usize) -> Result<Vec<Variant>, ParseError> {
        let (mut variants, mut taken) = (Vec::new(), BTreeSet::new());
        loop {
            let name = self.parse_label(&mut taken)?;
            let fields = if self.take_byte(b'{') { self.parse_fields(depth)? } else { Vec::new() };
            if fields.is_empty() && self.text[..self.at].ends_with('}') {
                return Err(self.error_here("a variant without fields has no braces"));
            }
            variants.push(Variant { name, fields });
            if !self.take_byte(b',') {
                self.expect_byte(b'>', "variants end with >")?;
                return Ok(variants);
            }
        }
    }
}

fn is_name_byte(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'/')
}

fn is_unit_byte(byte: u8) -> bool {
    byte.is_ascii_graphic() && byte != b')'
}
