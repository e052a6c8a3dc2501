//! Messages as structs of C++ with the macros that describe them.

use std::fmt::Write;

use armor_wire::schema::{Field, Schema, Variant};
use serde_json::Value;

use crate::c::{KEPT_HEAD, plain_type, write_doc, write_field_doc};
use crate::definition::{Definition, name_of};
use crate::language::{ExportError, Language};

const KEYWORDS: [&str; 62] = [
    "alignas",
    "alignof",
    "and",
    "asm",
    "auto",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "class",
    "const",
    "constexpr",
    "continue",
    "decltype",
    "default",
    "delete",
    "do",
    "double",
    "else",
    "enum",
    "explicit",
    "export",
    "extern",
    "false",
    "float",
    "for",
    "friend",
    "goto",
    "if",
    "inline",
    "int",
    "long",
    "mutable",
    "namespace",
    "new",
    "noexcept",
    "not",
    "nullptr",
    "operator",
    "or",
    "private",
    "protected",
    "public",
    "register",
    "return",
    "short",
    "signed",
    "sizeof",
    "static",
    "struct",
    "switch",
    "template",
    "this",
    "throw",
    "true",
    "try",
    "union",
    "unsigned",
    "using",
    "virtual",
    "while",
];

/// Most fields that the macro of a message takes.
const MAX_FIELDS: usize = 32;

/// Writes the header of the standard messages.
///
/// # Errors
/// If a message has a field that C++'s package cannot express.
pub fn write_cpp_header(messages: &[Definition]) -> Result<String, ExportError> {
    let mut out = format!(
        "{KEPT_HEAD}\n#ifndef ARMOR_MESSAGES_HPP\n#define ARMOR_MESSAGES_HPP\n\n#include <cmath>\n\n\
         #include \"armor.hpp\"\n\nnamespace armor::messages {{\n"
    );
    messages.iter().try_for_each(|message| write_definition(&mut out, message))?;
    Ok(out + "\n}  // namespace armor::messages\n\n#endif  // ARMOR_MESSAGES_HPP\n")
}

/// Writes a header that defines the messages.
///
/// # Errors
/// If a message has a field that C++'s package cannot express.
pub fn export(defined: &[Definition], imported: &[Definition]) -> Result<String, ExportError> {
    let mut out = String::from(
        "// Messages, as `armor message export --lang cpp` writes them.\n\n#pragma once\n\n\
         #include <armor_messages.hpp>\n",
    );
    if !imported.is_empty() {
        out.push('\n');
    }
    for message in imported {
        let _ = writeln!(out, "using armor::messages::{};", message.name());
    }
    defined.iter().try_for_each(|message| write_definition(&mut out, message))?;
    Ok(out)
}

fn write_definition(out: &mut String, definition: &Definition) -> Result<(), ExportError> {
    out.push('\n');
    match &definition.schema {
        Schema::Enum { variants, .. } => write_enum(out, definition, variants),
        Schema::Struct { fields, .. } => {
            write_struct(out, definition, fields, false)?;
            let is_bulk = |field: &Field| matches!(&field.schema, Schema::List(item) if plain_type(item).is_some());
            if fields.iter().any(is_bulk) {
                out.push('\n');
                write_struct(out, definition, fields, true)?;
            }
            Ok(())
        }
        _ => Ok(()),
    }
}

/// The type of a field; a view borrows texts and lists.
fn type_name(schema: &Schema, is_view: bool) -> String {
    match schema {
        Schema::Text if is_view => "std::string_view".into(),
        Schema::Text => "std::string".into(),
        Schema::Option(item) => format!("std::optional<{}>", type_name(item, false)),
        Schema::Fixed(item, count) => format!("std::array<{}, {count}>", type_name(item, false)),
        Schema::List(item) if is_view && plain_type(item).is_some() => {
            format!("armor::span<const {}>", type_name(item, false))
        }
        Schema::List(item) => format!("std::vector<{}>", type_name(item, false)),
        other => match plain_type(other) {
            Some((ctype, _)) => ctype.into(),
            None => name_of(other).unwrap_or_default().into(),
        },
    }
}

/// The initializer of a field whose default is not zero.
fn initializer(field: &Field, default: Option<&Value>) -> String {
    let is_zero = |number: f64| number == 0.0;
    match (&field.schema, default) {
        // JSON has no number for it.
        (Schema::F32 | Schema::F64, Some(Value::String(_))) => {
            let function = if field.schema == Schema::F32 { "nanf" } else { "nan" };
            format!(" = std::{function}(\"\")")
        }
        (Schema::F32 | Schema::F64, Some(Value::Number(number)))
            if !number.as_f64().is_none_or(is_zero) =>
        {
            format!(" = {:?}", number.as_f64().unwrap_or_default())
        }
        (Schema::Bool, Some(Value::Bool(true))) => " = true".into(),
        _ => "{}".into(),
    }
}

fn write_struct(
    out: &mut String,
    definition: &Definition,
    fields: &[Field],
    is_view: bool,
) -> Result<(), ExportError> {
    let name = definition.name();
    if let Some(field) = fields.get(MAX_FIELDS) {
        let form = format!("its field number {}", MAX_FIELDS + 1);
        return Err(ExportError::unsupported(definition, &field.name, form, Language::Cpp));
    }
    let struct_name = if is_view { format!("{name}View") } else { name.to_owned() };
    if is_view {
        let _ = writeln!(
            out,
            "// As `{name}`, with texts and lists that are borrowed: from the message that has arrived, or\n\
             // from the sender's memory."
        );
    } else {
        write_doc(out, &definition.doc, "");
    }
    let _ = writeln!(out, "struct {struct_name} {{");
    let mut entries = Vec::new();
    for field in fields {
        if KEYWORDS.contains(&field.name.as_str()) {
            return Err(ExportError::reserved(definition, &field.name, Language::Cpp));
        }
        write_field_doc(out, definition, field);
        let default = initializer(field, definition.default.get(&field.name));
        let _ = writeln!(out, "  {} {}{default};", type_name(&field.schema, is_view), field.name);
        entries.push(match &field.unit {
            Some(unit) => format!("({}, \"{unit}\")", field.name),
            None => field.name.clone(),
        });
    }
    let entries = entries.join(", ");
    let _ = writeln!(out, "}};\nARMOR_MESSAGE_NAMED(\"{name}\", {struct_name}, {entries})");
    Ok(())
}

fn write_enum(
    out: &mut String,
    definition: &Definition,
    variants: &[Variant],
) -> Result<(), ExportError> {
    let name = definition.name();
    write_doc(out, &definition.doc, "");
    let _ = writeln!(out, "enum class {name} : uint32_t {{");
    for variant in variants {
        if !variant.fields.is_empty() {
            let form = "a variant with fields";
            return Err(ExportError::unsupported(definition, &variant.name, form, Language::Cpp));
        }
        write_doc(out, definition.member_docs.get(&variant.name).into_iter().flatten(), "  ");
        let _ = writeln!(out, "  {},", variant.name);
    }
    let names: Vec<_> = variants.iter().map(|one| one.name.as_str()).collect();
    let _ = writeln!(out, "}};\nARMOR_MESSAGE_ENUM({name}, {})", names.join(", "));
    Ok(())
}
