//! The layout of a type: its parts, its hash, and the least length of its values.

/// The layout of a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Schema {
    /// One byte, 0 or 1.
    Bool,
    /// One byte.
    U8,
    /// One byte.
    I8,
    /// Two bytes.
    U16,
    /// Two bytes.
    I16,
    /// Four bytes.
    U32,
    /// Four bytes.
    I32,
    /// Eight bytes.
    U64,
    /// Eight bytes.
    I64,
    /// Four bytes, IEEE 754.
    F32,
    /// Eight bytes, IEEE 754.
    F64,
    /// A `u64` length in bytes, then UTF-8.
    Text,
    /// One byte, 0 or 1; then, if 1, the value.
    Option(Box<Schema>),
    /// A `u64` count, then the values.
    List(Box<Schema>),
    /// So many values, without a count.
    Fixed(Box<Schema>, usize),
    /// The fields in order.
    Struct {
        /// Name of the type.
        name: String,
        /// Its fields, in wire order.
        fields: Vec<Field>,
    },
    /// A `u32` index of the variant, then the variant's fields.
    Enum {
        /// Name of the type.
        name: String,
        /// Its variants, by index.
        variants: Vec<Variant>,
    },
}

/// One field of a struct or variant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name of the field.
    pub name: String,
    /// Layout of its value.
    pub schema: Schema,
    /// Unit of its number, such as `m` or `rad`; part of the type.
    pub unit: Option<String>,
}

/// One variant of an enum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name of the variant.
    pub name: String,
    /// Its fields; none for a plain variant.
    pub fields: Vec<Field>,
}

impl Field {
    /// A field without a unit.
    pub fn new(name: &str, schema: Schema) -> Self {
        Self { name: name.into(), schema, unit: None }
    }

    /// A field whose number has a unit.
    pub fn with_unit(name: &str, schema: Schema, unit: &str) -> Self {
        Self { name: name.into(), schema, unit: Some(unit.into()) }
    }
}

impl Schema {
    /// The hash that the two ends of a link compare: FNV-1a, 64 bits, over the canonical text.
    ///
    /// It guards against mistakes, not against an adversary. It is never 0, which means "any type".
    pub fn hash(&self) -> u64 {
        hash_text(&self.to_string())
    }

    /// The fewest bytes a value takes.
    pub fn min_len(&self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 | Self::Option(_) => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 | Self::Text | Self::List(_) => 8,
            Self::Fixed(item, count) => item.min_len().saturating_mul(*count),
            Self::Struct { fields, .. } => fields_min_len(fields),
            Self::Enum { variants, .. } => {
                let least = variants.iter().map(|v| fields_min_len(&v.fields)).min();
                least.unwrap_or(0).saturating_add(4)
            }
        }
    }

    /// The most bytes a value takes; none if its texts and lists may have any length.
    pub fn max_len(&self) -> Option<usize> {
        match self {
            Self::Text | Self::List(_) => None,
            Self::Option(item) => item.max_len()?.checked_add(1),
            Self::Fixed(item, count) => item.max_len()?.checked_mul(*count),
            Self::Struct { fields, .. } => fields_max_len(fields),
            Self::Enum { variants, .. } => {
                let lengths = variants.iter().map(|variant| fields_max_len(&variant.fields));
                let most = lengths.collect::<Option<Vec<_>>>()?.into_iter().max();
                most.unwrap_or(0).checked_add(4)
            }
            plain => Some(plain.min_len()),
        }
    }
}

fn fields_max_len(fields: &[Field]) -> Option<usize> {
    fields.iter().try_fold(0_usize, |sum, field| sum.checked_add(field.schema.max_len()?))
}

fn fields_min_len(fields: &[Field]) -> usize {
    fields.iter().fold(0, |sum: usize, field| sum.saturating_add(field.schema.min_len()))
}

/// The hash of a schema given as canonical text.
pub fn hash_text(text: &str) -> u64 {
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    });
    hash.max(1)
}
