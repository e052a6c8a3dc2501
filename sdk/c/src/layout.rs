//! How a C struct lies in memory and on the wire: from its table a schema, and the steps by which it is
//! encoded and decoded.

use std::sync::Arc;

use armor_sdk::wire::quantity::{Unit, explain_unknown};
use armor_sdk::wire::schema::{Field, Schema, Variant};

use crate::declaration::{ArmorFieldForm, ArmorFieldKind, ArmorText};
use crate::failure::{ArmorError, Failure};

/// The deepest nesting of tables: one that contains itself is refused.
pub(crate) const MAX_DEPTH: usize = 16;
/// The memory of a list in a struct: a pointer and a length.
pub(crate) const LIST_LEN: usize = 2 * WORD;
pub(crate) const WORD: usize = size_of::<usize>();

/// A table, read from C's memory.
pub(crate) struct TypeTable {
    pub name: String,
    pub size: usize,
    pub alignment: usize,
    pub content: TypeContent,
}

pub(crate) enum TypeContent {
    Fields(Vec<FieldTable>),
    Variants(Vec<String>),
}

pub(crate) struct FieldTable {
    pub name: String,
    pub unit: String,
    pub kind: ArmorFieldKind,
    pub form: ArmorFieldForm,
    pub offset: usize,
    pub count: usize,
    pub of: Option<TypeTable>,
    pub presence: Option<usize>,
}

/// How values of a type are encoded and decoded.
#[derive(Debug)]
pub(crate) struct Layout {
    pub size: usize,
    pub schema: Schema,
    pub steps: Vec<Step>,
}

/// One part of a value: offsets are those in its struct.
#[derive(Debug)]
pub(crate) enum Step {
    /// These bytes as they are.
    Copy { offset: usize, len: usize },
    /// A flag.
    Bool { offset: usize },
    /// The number of a variant.
    Enum { offset: usize, variants: u32 },
    /// A text.
    Text { offset: usize },
    /// A list of numbers.
    Bulk { offset: usize, item_len: usize },
    /// A list of anything else.
    List { offset: usize, item: Arc<Layout> },
    /// As many values, next to each other.
    Fixed { offset: usize, count: usize, item: Arc<Layout> },
    /// A value that may be absent.
    Optional { presence: usize, steps: Vec<Step> },
}

impl Layout {
    pub fn of_table(table: &TypeTable) -> Result<Self, Failure> {
        let TypeTable { name, size, alignment, .. } = table;
        let wrong = |why: String| Failure::new(ArmorError::Table, format!("type {name}: {why}"));
        if !alignment.is_power_of_two() || *alignment > WORD {
            return Err(wrong(format!("its alignment is {alignment}; it may be 1, 2, 4 or 8")));
        }
        let (schema, steps) = match &table.content {
            TypeContent::Variants(_) if *size != size_of::<u32>() => {
                return Err(wrong(format!("an enum of {size} bytes; it must have 4")));
            }
            TypeContent::Variants(names) => {
                let plain = |name: &String| Variant { name: name.clone(), fields: Vec::new() };
                let variants = names.iter().map(plain).collect();
                let count = u32::try_from(names.len()).unwrap_or(u32::MAX);
                let schema = Schema::Enum { name: name.clone(), variants };
                (schema, vec![Step::Enum { offset: 0, variants: count }])
            }
            TypeContent::Fields(tables) => {
                let (mut fields, mut steps) = (Vec::new(), Vec::new());
                for field in tables {
                    let wrong = |why: String| wrong(format!("field {}: {why}", field.name));
                    let (value, field_steps) = lay_out_field(field, *size, &wrong)?;
                    fields.push(value);
                    field_steps.into_iter().for_each(|step| append(&mut steps, step));
                }
                (Schema::Struct { name: name.clone(), fields }, steps)
            }
        };
        if schema.min_len() == 0 {
            return Err(wrong("it has no fields".into()));
        }
        Ok(Self { size: *size, schema, steps })
    }

    /// The encoded message, if it lies in the memory of the struct as it is: numbers without gaps.
    pub fn find_encoded<'a>(&self, content: &'a [u8]) -> Option<&'a [u8]> {
        match self.steps.as_slice() {
            [Step::Copy { offset, len }] => content.get(*offset..*offset + *len),
            _ => None,
        }
    }
}

/// Adds a step; bytes that follow each other in both places are copied together.
fn append(steps: &mut Vec<Step>, step: Step) {
    if let (Some(Step::Copy { offset, len }), Step::Copy { offset: next, len: more }) =
        (steps.last_mut(), &step)
        && *offset + *len == *next
    {
        *len += more;
        return;
    }
    steps.push(step);
}

/// One value of a field, without its form and place.
enum Item {
    Number(Schema, usize),
    Other(Layout),
}

fn lay_out_field(
    field: &FieldTable,
    size: usize,
    wrong: &impl Fn(String) -> Failure,
) -> Result<(Field, Vec<Step>), Failure> {
    use ArmorFieldKind as Kind;
    let single = |schema, size, step| Item::Other(Layout { size, schema, steps: vec![step] });
    let item = match field.kind {
        Kind::U8 => Item::Number(Schema::U8, 1),
        Kind::I8 => Item::Number(Schema::I8, 1),
        Kind::U16 => Item::Number(Schema::U16, 2),
        Kind::I16 => Item::Number(Schema::I16, 2),
        Kind::U32 => Item::Number(Schema::U32, 4),
        Kind::I32 => Item::Number(Schema::I32, 4),
        Kind::F32 => Item::Number(Schema::F32, 4),
        Kind::U64 => Item::Number(Schema::U64, 8),
        Kind::I64 => Item::Number(Schema::I64, 8),
        Kind::F64 => Item::Number(Schema::F64, 8),
        Kind::Bool => single(Schema::Bool, 1, Step::Bool { offset: 0 }),
        Kind::Text => single(Schema::Text, size_of::<ArmorText>(), Step::Text { offset: 0 }),
        Kind::Nested => {
            let table = field.of.as_ref().ok_or_else(|| wrong("it has no table".into()))?;
            Item::Other(Layout::of_table(table)?)
        }
    };
    let (item_schema, item_size) = match &item {
        Item::Number(schema, len) => (schema.clone(), *len),
        Item::Other(layout) => (layout.schema.clone(), layout.size),
    };
    let offset = field.offset;
    let (schema, steps, len) = match (field.form, item) {
        (ArmorFieldForm::One, Item::Number(..)) => {
            (item_schema, vec![Step::Copy { offset, len: item_size }], item_size)
        }
        (ArmorFieldForm::One, Item::Other(layout)) => {
            let steps = layout.steps.into_iter().map(|step| step.shifted(offset)).collect();
            (item_schema, steps, item_size)
        }
        (ArmorFieldForm::Fixed, item) => {
            let count = field.count;
            if count == 0 {
                return Err(wrong("a fixed array of no values".into()));
            }
            let len = item_size.checked_mul(count).ok_or_else(|| wrong("it is too long".into()))?;
            let step = match item {
                Item::Number(..) => Step::Copy { offset, len },
                Item::Other(layout) => Step::Fixed { offset, count, item: Arc::new(layout) },
            };
            (Schema::Fixed(Box::new(item_schema), count), vec![step], len)
        }
        (ArmorFieldForm::List, item) => {
            let step = match item {
                Item::Number(_, item_len) => Step::Bulk { offset, item_len },
                Item::Other(layout) => Step::List { offset, item: Arc::new(layout) },
            };
            (Schema::List(Box::new(item_schema)), vec![step], LIST_LEN)
        }
    };
    if offset.checked_add(len).is_none_or(|end| end > size) {
        return Err(wrong(format!("it ends after the {size} bytes of its struct")));
    }
    let (schema, steps) = match field.presence {
        None => (schema, steps),
        Some(presence) if presence >= size => {
            return Err(wrong(format!("`is_present` is after the {size} bytes of its struct")));
        }
        Some(presence) => {
            (Schema::Option(Box::new(schema)), vec![Step::Optional { presence, steps }])
        }
    };
    let unit = match field.unit.as_str() {
        "" => None,
        name => {
            let unknown = || wrong(format!("there is no unit `{name}`; {}", explain_unknown(name)));
            Some(Unit::named(name).ok_or_else(unknown)?.ascii_name().to_owned())
        }
    };
    Ok((Field { name: field.name.clone(), schema, unit }, steps))
}

impl Step {
    /// The step for a struct that is at `by` in another one.
    fn shifted(self, by: usize) -> Self {
        match self {
            Self::Copy { offset, len } => Self::Copy { offset: offset + by, len },
            Self::Bool { offset } => Self::Bool { offset: offset + by },
            Self::Enum { offset, variants } => Self::Enum { offset: offset + by, variants },
            Self::Text { offset } => Self::Text { offset: offset + by },
            Self::Bulk { offset, item_len } => Self::Bulk { offset: offset + by, item_len },
            Self::List { offset, item } => Self::List { offset: offset + by, item },
            Self::Fixed { offset, count, item } => Self::Fixed { offset: offset + by, count, item },
            Self::Optional { presence, steps } => Self::Optional {
                presence: presence + by,
                steps: steps.into_iter().map(|step| step.shifted(by)).collect(),
            },
        }
    }
}
