//! What a schema is in ROS, worked out once for each type.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::schema::{Field, Schema, Variant};

use super::standard::{find_small_number, find_standard, is_plain_number};

/// The package of the types that ROS does not have.
const OWN_PACKAGE: &str = "armor_msgs";
/// What ROS puts into a type without fields.
pub(super) const NO_FIELD: &str = "structure_needs_at_least_one_member";

/// A value in both forms.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// A number or a flag: so many bytes, the same in both.
    Plain {
        len: usize,
        name: &'static str,
    },
    Text,
    Option(Box<Shape>),
    List(Box<Shape>),
    Fixed(Box<Shape>, usize),
    Struct(StructShape),
    /// An enum whose variants have no fields: its index, as a number.
    Index {
        variants: Vec<String>,
    },
    /// The same in one byte.
    SmallIndex {
        variants: usize,
        first: i8,
        name: &'static str,
    },
    /// A variant with fields: the index, then for each variant a list that has one value or none.
    Enum {
        name: String,
        variants: Vec<(String, StructShape)>,
    },
}

/// A struct: its values in Armor's order, and the fields of ROS.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StructShape {
    /// `PACKAGE/TYPE`.
    pub name: String,
    pub parts: Vec<Shape>,
    pub fields: Vec<RosField>,
    /// The fields are the parts in order, so nothing has to be sought.
    pub is_sequential: bool,
    /// The part that is the stamp of the messages in it, without a field of its own.
    pub inner_stamp: Option<usize>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct RosField {
    pub name: String,
    pub content: FieldContent,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum FieldContent {
    Part(usize),
    /// `std_msgs/Header` of a stamp and a frame.
    Header {
        stamp: usize,
        frame: usize,
    },
    /// The same with the stamp of the message around.
    InnerHeader {
        frame: usize,
    },
    /// `builtin_interfaces/Time`.
    Time(usize),
    /// Of no part: zeros of this type.
    Constant(ConstantType),
    /// A type of ROS around fields.
    Group {
        name: String,
        fields: Vec<RosField>,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ConstantType {
    Byte,
    /// A list of numbers of four bytes.
    Floats,
    Text,
}

impl ConstantType {
    fn parse(text: &str) -> Option<Self> {
        match text {
            "uint8" => Some(Self::Byte),
            "float32[]" => Some(Self::Floats),
            "string" => Some(Self::Text),
            _ => None,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Byte => "uint8",
            Self::Floats => "float32[]",
            Self::Text => "string",
        }
    }
}

impl Shape {
    /// The fewest bytes of a value in Armor's form.
    pub fn min_len(&self) -> usize {
        match self {
            Self::Plain { len, .. } => *len,
            Self::Text | Self::List(_) => 8,
            Self::Option(_) => 1,
            Self::Fixed(item, count) => item.min_len().saturating_mul(*count),
            Self::Struct(shape) => shape.min_len(),
            Self::Index { .. } | Self::SmallIndex { .. } | Self::Enum { .. } => 4,
        }
    }
}

impl StructShape {
    fn min_len(&self) -> usize {
        self.parts.iter().fold(0_usize, |sum, part| sum.saturating_add(part.min_len()))
    }
}

/// Gives each type its name.
#[derive(Default)]
pub(super) struct ShapeBuilder {
    /// The names in use, each with the schema that has it.
    names: BTreeMap<String, String>,
}

impl ShapeBuilder {
    /// The shape of a whole message: a struct, which is made around every other type.
    pub fn build_message(&mut self, schema: &Schema) -> Shape {
        match self.build(schema) {
            Shape::Struct(shape) => Shape::Struct(shape),
            other => {
                let name = format!("{OWN_PACKAGE}/Value");
                let field = RosField { name: "data".into(), content: FieldContent::Part(0) };
                Shape::Struct(StructShape::new(name, vec![other], vec![field]))
            }
        }
    }

    fn build(&mut self, schema: &Schema) -> Shape {
        let plain = |len, name| Shape::Plain { len, name };
        match schema {
            Schema::Bool => plain(1, "bool"),
            Schema::U8 => plain(1, "uint8"),
            Schema::I8 => plain(1, "int8"),
            Schema::U16 => plain(2, "uint16"),
            Schema::I16 => plain(2, "int16"),
            Schema::U32 => plain(4, "uint32"),
            Schema::I32 => plain(4, "int32"),
            Schema::U64 => plain(8, "uint64"),
            Schema::I64 => plain(8, "int64"),
            Schema::F32 => plain(4, "float32"),
            Schema::F64 => plain(8, "float64"),
            Schema::Text => Shape::Text,
            Schema::Option(item) => Shape::Option(Box::new(self.build_item(item))),
            Schema::List(item) => Shape::List(Box::new(self.build_item(item))),
            Schema::Fixed(item, count) => Shape::Fixed(Box::new(self.build_item(item)), *count),
            Schema::Struct { name, fields } => self.build_struct(schema, name, fields),
            Schema::Enum { name, variants } => self.build_enum(schema, name, variants),
        }
    }

    /// An item of a list: ROS has no lists of lists, so a struct is made around one.
    fn build_item(&mut self, schema: &Schema) -> Shape {
        match self.build(schema) {
            inner @ (Shape::Option(_) | Shape::List(_) | Shape::Fixed(..)) => {
                let name = self.choose_name("Items", &format!("items of {schema}"));
                let field = RosField { name: "items".into(), content: FieldContent::Part(0) };
                Shape::Struct(StructShape::new(name, vec![inner], vec![field]))
            }
            other => other,
        }
    }

    fn build_struct(&mut self, schema: &Schema, name: &str, fields: &[Field]) -> Shape {
        if let ([field], true) = (fields, is_plain_number(name)) {
            return self.build(&field.schema);
        }
        let parts: Vec<_> = fields.iter().map(|field| self.build(&field.schema)).collect();
        if let Some(standard) = find_standard(schema) {
            let find = |name: &str| fields.iter().position(|field| field.name == name);
            let ros = standard.fields.split(' ').map(|field| read_field(field, &find)).collect();
            return Shape::Struct(StructShape::new(standard.name.into(), parts, ros));
        }
        let name = self.choose_name(name, &schema.to_string());
        Shape::Struct(own_struct(name, fields, parts))
    }

    fn build_enum(&mut self, schema: &Schema, name: &str, variants: &[Variant]) -> Shape {
        if variants.iter().all(|variant| variant.fields.is_empty()) {
            if let Some(small) = find_small_number(name, variants.len()) {
                let (first, name) = (small.first, small.type_name);
                return Shape::SmallIndex { variants: variants.len(), first, name };
            }
            let variants = variants.iter().map(|variant| variant.name.clone()).collect();
            return Shape::Index { variants };
        }
        let shapes = variants.iter().map(|variant| {
            let parts = variant.fields.iter().map(|field| self.build(&field.schema)).collect();
            let text = format!("{} of {schema}", variant.name);
            let type_name = self.choose_name(&format!("{name}{}", variant.name), &text);
            (variant.name.clone(), own_struct(type_name, &variant.fields, parts))
        });
        let variants = shapes.collect();
        Shape::Enum { name: self.choose_name(name, &schema.to_string()), variants }
    }

    /// Returns `PACKAGE/TYPE`; another number for each type of one name.
    fn choose_name(&mut self, name: &str, what: &str) -> String {
        let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
        let mut plain: String = words.map(capitalize).collect();
        if !plain.starts_with(|first: char| first.is_ascii_uppercase()) {
            plain.insert(0, 'T');
        }
        let mut chosen = format!("{OWN_PACKAGE}/{plain}");
        for number in 2.. {
            match self.names.get(&chosen) {
                Some(other) if other != what => chosen = format!("{OWN_PACKAGE}/{plain}{number}"),
                _ => break,
            }
        }
        self.names.insert(chosen.clone(), what.into());
        chosen
    }
}

impl StructShape {
    fn new(name: String, parts: Vec<Shape>, fields: Vec<RosField>) -> Self {
        let mut order = Vec::new();
        fields.iter().for_each(|field| field.content.list_parts(&mut order));
        let inner_stamp = (0..parts.len()).find(|part| !order.contains(part));
        let is_sequential = order.iter().copied().eq(0..parts.len());
        Self { name, parts, fields, is_sequential, inner_stamp }
    }
}

impl FieldContent {
    fn list_parts(&self, order: &mut Vec<usize>) {
        match self {
            Self::Part(part) | Self::Time(part) | Self::InnerHeader { frame: part } => {
                order.push(*part);
            }
            Self::Header { stamp, frame } => order.extend([*stamp, *frame]),
            Self::Constant(_) => {}
            Self::Group { fields, .. } => {
                fields.iter().for_each(|field| field.content.list_parts(order));
            }
        }
    }
}

/// A type of Armor's own: its fields, and a header if it begins with a stamp and a frame.
fn own_struct(name: String, fields: &[Field], parts: Vec<Shape>) -> StructShape {
    let mut used = BTreeSet::new();
    let mut ros = Vec::new();
    let begins_with_header = matches!(fields, [stamp, frame, ..]
        if stamp.name == "stamp" && stamp.schema == Schema::F64
            && frame.name == "frame" && frame.schema == Schema::Text);
    if begins_with_header {
        let content = FieldContent::Header { stamp: 0, frame: 1 };
        ros.push(RosField { name: choose_field_name("header", &mut used), content });
    }
    let first = if begins_with_header { 2 } else { 0 };
    for (part, field) in fields.iter().enumerate().skip(first) {
        let name = choose_field_name(&field.name, &mut used);
        ros.push(RosField { name, content: FieldContent::Part(part) });
    }
    if ros.is_empty() {
        let content = FieldContent::Constant(ConstantType::Byte);
        ros.push(RosField { name: NO_FIELD.into(), content });
    }
    StructShape::new(name, parts, ros)
}

/// Reads a field of the table of standard messages.
fn read_field(text: &str, find: &impl Fn(&str) -> Option<usize>) -> RosField {
    // The table is right, which a test shows for every line of it.
    let part = |name: &str| find(name).unwrap_or_default();
    let (name, content) = if text == "header" {
        ("header", FieldContent::Header { stamp: part("stamp"), frame: part("frame") })
    } else if let Some((name, frame)) = text.split_once('<') {
        (name, FieldContent::InnerHeader { frame: part(frame) })
    } else if let Some((name, field)) = text.split_once('=') {
        (name, FieldContent::Part(part(field)))
    } else if let Some((name, kind)) = text.split_once(':') {
        let content = if kind == "time" {
            FieldContent::Time(part(name))
        } else if let Some(constant) = ConstantType::parse(kind) {
            FieldContent::Constant(constant)
        } else {
            let (group, inner) = kind.trim_end_matches('}').split_once('{').unwrap_or((kind, ""));
            let fields = inner.split(',').map(|field| read_field(field, find)).collect();
            FieldContent::Group { name: group.into(), fields }
        };
        (name, content)
    } else {
        (text, FieldContent::Part(part(text)))
    };
    RosField { name: name.into(), content }
}

fn capitalize(word: &str) -> String {
    let mut letters = word.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + letters.as_str())
}

/// A name as ROS allows it: small letters, digits and single underscores, with a letter first.
pub(super) fn choose_field_name(name: &str, used: &mut BTreeSet<String>) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words: Vec<_> =
        words.filter(|word| !word.is_empty()).map(str::to_ascii_lowercase).collect();
    let mut plain = words.join("_");
    if !plain.starts_with(|first: char| first.is_ascii_lowercase()) {
        plain.insert_str(0, "f_");
    }
    let plain = plain.trim_end_matches('_').to_owned();
    let mut chosen = plain.clone();
    for number in 2.. {
        if used.insert(chosen.clone()) {
            break;
        }
        chosen = format!("{plain}_{number}");
    }
    chosen
}
