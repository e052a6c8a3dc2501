//! Schemas as text: the canonical form that is hashed, and its reader.
//!
//! `Pose2D{x:f64(m),y:f64(m),theta:f64(rad)}`, `[f32]`, `[f64;36]`, `?string`,
//! `Level<Low,High{margin:f64}>`. No spaces.

use std::fmt;

use thiserror::Error;

use super::{Field, Schema, Variant};

/// Deepest nesting of a schema that is read.
pub const MAX_DEPTH: usize = 16;
/// Longest schema text that is read, in bytes.
pub const MAX_TEXT_LEN: usize = 16 << 10;
/// Most elements of a fixed-length array.
const MAX_FIXED: usize = 1 << 16;

impl fmt::Display for Schema {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Option(item) => write!(f, "?{item}"),
            Self::List(item) => write!(f, "[{item}]"),
            Self::Fixed(item, count) => write!(f, "[{item};{count}]"),
            Self::Struct { name, fields } => write!(f, "{name}{}", Fields(fields)),
            Self::Enum { name, variants } => {
                write!(f, "{name}<")?;
                for (index, variant) in variants.iter().enumerate() {
                    let comma = if index > 0 { "," } else { "" };
                    write!(f, "{comma}{}", variant.name)?;
                    if !variant.fields.is_empty() {
                        write!(f, "{}", Fields(&variant.fields))?;
                    }
                }
                write!(f, ">")
            }
            primitive => f.write_str(primitive_name(primitive)),
        }
    }
}

struct Fields<'a>(&'a [Field]);

impl fmt::Display for Fields<'_> {
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
/// [`ParseError`] if the text is not canonical, deeper than [`MAX_DEPTH`], or longer than
/// [`MAX_TEXT_LEN`].
pub fn parse(text: &str) -> Result<Schema, ParseError> {
    if text.len() > MAX_TEXT_LEN {
        return Err(ParseError { at: MAX_TEXT_LEN, problem: "the text is too long" });
    }
    let mut parser = Parser { text, at: 0 };
    let schema = parser.schema(0)?;
    if parser.at < text.len() {
        return Err(parser.error("text after the end of the schema"));
    }
    Ok(schema)
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
}

impl Parser<'_> {
    fn error(&self, problem: &'static str) -> ParseError {
        ParseError { at: self.at, problem }
    }

    fn take(&mut self, byte: u8) -> bool {
        let found = self.text.as_bytes().get(self.at) == Some(&byte);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, byte: u8, problem: &'static str) -> Result<(), ParseError> {
        if self.take(byte) { Ok(()) } else { Err(self.error(problem)) }
    }

    fn word(
        &mut self,
        allowed: impl Fn(u8) -> bool,
        problem: &'static str,
    ) -> Result<String, ParseError> {
        let rest = &self.text.as_bytes()[self.at..];
        let len = rest.iter().take_while(|byte| allowed(**byte)).count();
        if len == 0 {
            return Err(self.error(problem));
        }
        let word = String::from_utf8_lossy(&rest[..len]).into_owned();
        self.at += len;
        Ok(word)
    }

    fn name(&mut self) -> Result<String, ParseError> {
        self.word(
            |b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'/'),
            "a name is expected",
        )
    }

    fn schema(&mut self, depth: usize) -> Result<Schema, ParseError> {
        if depth > MAX_DEPTH {
            return Err(self.error("nested too deep"));
        }
        if self.take(b'?') {
            return Ok(Schema::Option(Box::new(self.schema(depth + 1)?)));
        }
        if self.take(b'[') {
            return self.array(depth);
        }
        let name = self.name()?;
        if let Some((_, primitive)) = PRIMITIVES.iter().find(|(known, _)| *known == name) {
            return Ok(primitive.clone());
        }
        if self.take(b'{') {
            return Ok(Schema::Struct { name, fields: self.fields(depth)? });
        }
        self.expect(b'<', "an unknown type; a struct has {fields}, an enum <variants>")?;
        Ok(Schema::Enum { name, variants: self.variants(depth)? })
    }

    fn array(&mut self, depth: usize) -> Result<Schema, ParseError> {
        let item = self.schema(depth + 1)?;
        if item.min_len() == 0 {
            return Err(self.error("the items of a list take no bytes"));
        }
        if !self.take(b';') {
            self.expect(b']', "a list ends with ]")?;
            return Ok(Schema::List(Box::new(item)));
        }
        let digits = self.word(|b| b.is_ascii_digit(), "a count is expected")?;
        let count = digits.parse().ok().filter(|count| (1..=MAX_FIXED).contains(count));
        let count = count.ok_or_else(|| self.error("the count is not in 1..=65536"))?;
        self.expect(b']', "an array ends with ]")?;
        Ok(Schema::Fixed(Box::new(item), count))
    }

    fn fields(&mut self, depth: usize) -> Result<Vec<Field>, ParseError> {
        let mut fields = Vec::new();
        if self.take(b'}') {
            return Ok(fields);
        }
        loop {
            let name = self.name()?;
            self.expect(b':', "a field is name:type")?;
            let schema = self.schema(depth + 1)?;
            let unit = if self.take(b'(') {
                let unit =
                    self.word(|b| b.is_ascii_graphic() && b != b')', "a unit is expected")?;
                self.expect(b')', "a unit ends with )")?;
                Some(unit)
            } else {
                None
            };
            fields.push(Field { name, schema, unit });
            if !self.take(b',') {
                self.expect(b'}', "fields end with }")?;
                return Ok(fields);
            }
        }
    }

    fn variants(&mut self, depth: usize) -> Result<Vec<Variant>, ParseError> {
        let mut variants = Vec::new();
        loop {
            let name = self.name()?;
            let fields = if self.take(b'{') { self.fields(depth)? } else { Vec::new() };
            variants.push(Variant { name, fields });
            if !self.take(b',') {
                self.expect(b'>', "variants end with >")?;
                return Ok(variants);
            }
        }
    }
}
