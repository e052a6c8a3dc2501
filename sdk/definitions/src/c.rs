//! Messages as structs of C with the tables that describe them.

use std::fmt::Write;

use armor_wire::schema::{Field, Schema, Variant};

use crate::definition::{Definition, name_of};
use crate::language::{ExportError, Language};

/// The first lines of the kept headers.
pub const KEPT_HEAD: &str = "\
// The standard messages, with the names and fields of armor-sdk; units and axes by REP-103.
// Generated from sdk/src/messages; do not edit: ARMOR_BLESS=1 cargo test -p armor-definitions
";
/// The header of the functions, whose names no message may have.
const HEADER: &str = include_str!("../../c/include/armor.h");
const KEYWORDS: [&str; 37] = [
    "auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double",
    "else", "enum", "extern", "false", "float", "for", "goto", "if", "inline", "int", "long",
    "register", "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch",
    "true", "typedef", "union", "unsigned", "void", "volatile", "while",
];

/// Writes the header of the standard messages.
///
/// # Errors
/// If a message has a field that C's package cannot express.
pub fn write_c_header(messages: &[Definition]) -> Result<String, ExportError> {
    let mut out = format!(
        "{KEPT_HEAD}\n#ifndef ARMOR_MESSAGES_H\n#define ARMOR_MESSAGES_H\n\n#include \"armor.h\"\n\n\
         #ifdef __cplusplus\n#error \"C++ includes armor_messages.hpp\"\n#endif\n"
    );
    messages.iter().try_for_each(|message| write_definition(&mut out, message))?;
    Ok(out + "\n#endif  // ARMOR_MESSAGES_H\n")
}

/// Writes a header that defines the messages.
///
/// # Errors
/// If a message has a field that C's package cannot express.
pub fn export(defined: &[Definition]) -> Result<String, ExportError> {
    let mut out = String::from(
        "// Messages, as `armor message export --lang c` writes them.\n\n#pragma once\n\n\
         #include <armor_messages.h>\n",
    );
    defined.iter().try_for_each(|message| write_definition(&mut out, message))?;
    Ok(out)
}

/// Writes a documentation as comments.
pub fn write_doc<'a>(out: &mut String, lines: impl IntoIterator<Item = &'a String>, indent: &str) {
    for line in lines {
        // Links of Rust lead nowhere here.
        let line = line.replace("[`", "`").replace("`]", "`");
        let _ = writeln!(out, "{indent}// {line}");
    }
}

/// Writes the documentation of a field, and its unit.
pub fn write_field_doc(out: &mut String, definition: &Definition, field: &Field) {
    write_doc(out, definition.member_docs.get(&field.name).into_iter().flatten(), "  ");
    if let Some(unit) = &field.unit {
        let _ = writeln!(out, "  // Unit: {unit}.");
    }
}

/// `LaserScan` is `armor_laser_scan`, `NoFix` in it `ARMOR_…_NO_FIX`.
fn snake_case(name: &str) -> String {
    let mut result = String::new();
    for (index, c) in name.char_indices() {
        let follows_small = index > 0 && name[..index].ends_with(|c: char| c.is_ascii_lowercase());
        if c.is_ascii_uppercase() && follows_small {
            result.push('_');
        }
        result.push(c.to_ascii_lowercase());
    }
    result
}

/// The C type of a message. The suffix keeps it apart from a type of `armor.h`: a message `State` is
/// `armor_state_message`, because `armor_state` is the state of a component.
fn type_name(name: &str) -> String {
    let plain = format!("armor_{}", snake_case(name));
    let is_word = |text: &str| !text.contains(|c: char| c.is_ascii_alphanumeric() || c == '_');
    let is_taken = HEADER.match_indices(&plain).any(|(at, _)| {
        let before = HEADER[..at].chars().next_back().map(String::from).unwrap_or_default();
        let after = HEADER[at + plain.len()..].chars().next().map(String::from).unwrap_or_default();
        is_word(&before) && is_word(&after)
    });
    if is_taken { plain + "_message" } else { plain }
}

/// The C type, and its short name in those of lists, of a number or a flag.
pub fn plain_type(schema: &Schema) -> Option<(&'static str, &'static str)> {
    Some(match schema {
        Schema::Bool => ("bool", "bool"),
        Schema::U8 => ("uint8_t", "u8"),
        Schema::I8 => ("int8_t", "i8"),
        Schema::U16 => ("uint16_t", "u16"),
        Schema::I16 => ("int16_t", "i16"),
        Schema::U32 => ("uint32_t", "u32"),
        Schema::I32 => ("int32_t", "i32"),
        Schema::U64 => ("uint64_t", "u64"),
        Schema::I64 => ("int64_t", "i64"),
        Schema::F32 => ("float", "f32"),
        Schema::F64 => ("double", "f64"),
        _ => return None,
    })
}

/// What a value without a form of its own is: a type of C, or a message with a table.
enum Item {
    Plain(&'static str),
    Nested(String),
}

fn item_of(schema: &Schema) -> Option<Item> {
    if let Schema::Text = schema {
        return Some(Item::Plain("armor_string"));
    }
    let plain = plain_type(schema).map(|(name, _)| Item::Plain(name));
    plain.or_else(|| name_of(schema).map(|name| Item::Nested(type_name(name))))
}

/// A field: its declaration, and its entry in the table.
fn describe_field(
    definition: &Definition,
    of: &str,
    field: &Field,
) -> Result<(String, String), ExportError> {
    let Field { name, schema, unit } = field;
    let unsupported = |form: &str| ExportError::unsupported(definition, name, form, Language::C);
    if KEYWORDS.contains(&name.as_str()) {
        return Err(ExportError::reserved(definition, name, Language::C));
    }
    let inner = |item: &Schema, form: &str| {
        item_of(item).ok_or_else(|| unsupported(&format!("{form} of `{item}`")))
    };
    let text = unit.as_deref().unwrap_or_default();
    let entry = |macro_name: &str| format!("{macro_name}({of}, {name}, \"{text}\")");
    // The tables have no unit for several messages.
    let nested_entry = |macro_name: &str, nested: &str| match unit {
        Some(_) => Err(unsupported("several messages with a unit")),
        None => Ok(format!("{macro_name}({of}, {name}, {nested})")),
    };
    Ok(match schema {
        Schema::Option(item) => match inner(item, "an optional value")? {
            Item::Plain(ctype) => (
                format!("struct {{\n    bool is_present;\n    {ctype} value;\n  }} {name}"),
                entry("ARMOR_OPTIONAL_FIELD"),
            ),
            Item::Nested(nested) => (
                format!("struct {{\n    bool is_present;\n    {nested} value;\n  }} {name}"),
                nested_entry("ARMOR_OPTIONAL_NESTED", &nested)?,
            ),
        },
        Schema::Fixed(item, count) => match inner(item, "an array")? {
            Item::Plain(ctype) => (format!("{ctype} {name}[{count}]"), entry("ARMOR_ARRAY")),
            Item::Nested(nested) => {
                (format!("{nested} {name}[{count}]"), nested_entry("ARMOR_NESTED_ARRAY", &nested)?)
            }
        },
        Schema::List(item) => match inner(item, "a list")? {
            Item::Plain(_) => {
                let short = plain_type(item).map_or("string", |(_, short)| short);
                let ctype = match short {
                    "bool" => "ARMOR_LIST_OF(bool)".into(),
                    short => format!("armor_{short}_list"),
                };
                (format!("{ctype} {name}"), entry("ARMOR_LIST"))
            }
            Item::Nested(nested) => (
                format!("ARMOR_LIST_OF({nested}) {name}"),
                nested_entry("ARMOR_NESTED_LIST", &nested)?,
            ),
        },
        other => match inner(other, "a value")? {
            Item::Plain(ctype) => (format!("{ctype} {name}"), entry("ARMOR_FIELD")),
            Item::Nested(nested) => {
                let entry = format!("ARMOR_NESTED({of}, {name}, {nested}, \"{text}\")");
                (format!("{nested} {name}"), entry)
            }
        },
    })
}

fn write_definition(out: &mut String, definition: &Definition) -> Result<(), ExportError> {
    out.push('\n');
    write_doc(out, &definition.doc, "");
    match &definition.schema {
        Schema::Enum { variants, .. } => write_enum(out, definition, variants),
        Schema::Struct { fields, .. } => write_struct(out, definition, fields),
        _ => Ok(()),
    }
}

fn write_enum(
    out: &mut String,
    definition: &Definition,
    variants: &[Variant],
) -> Result<(), ExportError> {
    let name = definition.name();
    let ctype = type_name(name);
    let _ = writeln!(out, "typedef enum {ctype} {{");
    for variant in variants {
        if !variant.fields.is_empty() {
            let form = "a variant with fields";
            return Err(ExportError::unsupported(definition, &variant.name, form, Language::C));
        }
        write_doc(out, definition.member_docs.get(&variant.name).into_iter().flatten(), "  ");
        let constant = format!("{ctype}_{}", snake_case(&variant.name)).to_uppercase();
        let _ = writeln!(out, "  {constant},");
    }
    let names: Vec<_> = variants.iter().map(|one| format!("\"{}\"", one.name)).collect();
    let names = names.join(", ");
    let _ = writeln!(out, "}} {ctype};\nARMOR_ENUM({ctype}, \"{name}\", {names});");
    Ok(())
}

fn write_struct(
    out: &mut String,
    definition: &Definition,
    fields: &[Field],
) -> Result<(), ExportError> {
    let name = definition.name();
    let ctype = type_name(name);
    let _ = writeln!(out, "typedef struct {ctype} {{");
    let mut entries = Vec::new();
    for field in fields {
        write_field_doc(out, definition, field);
        let (declaration, entry) = describe_field(definition, &ctype, field)?;
        let _ = writeln!(out, "  {declaration};");
        entries.push(format!("  {entry}"));
    }
    let entries = entries.join(",\n");
    let _ = writeln!(out, "}} {ctype};\nARMOR_STRUCT({ctype}, \"{name}\",\n{entries});");
    Ok(())
}
