//! Messages as structs and enums of Rust that derive `Message`.

use std::fmt::Write;

use armor_wire::schema::{Field, Schema};

use crate::definition::{Definition, name_of};
use crate::language::{ExportError, Language};

/// Names that are keywords even as `r#name`.
const NO_IDENTIFIERS: [&str; 4] = ["self", "Self", "super", "crate"];
const KEYWORDS: [&str; 48] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let",
    "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return",
    "static", "struct", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use",
    "virtual", "where", "while", "yield",
];
/// The longest array that `Default` is implemented for.
const MAX_DEFAULT_COUNT: usize = 32;

/// Writes a module that defines the messages.
///
/// # Errors
/// If a name cannot be one in Rust.
pub fn export(defined: &[Definition], imported: &[Definition]) -> Result<String, ExportError> {
    let mut body = String::new();
    for definition in defined {
        body.push('\n');
        write_definition(&mut body, definition)?;
    }
    let mut out =
        String::from("//! Messages, as `armor message export --lang rust` writes them.\n\n");
    let array = if body.contains(" Array<") { "Array, " } else { "" };
    match array {
        "" => out += "use armor_sdk::Message;\n",
        _ => out += "use armor_sdk::{Array, Message};\n",
    }
    let names: Vec<_> = imported.iter().map(Definition::name).collect();
    let used = names.iter().filter(|name| mentions(&body, name));
    match used.copied().collect::<Vec<_>>().as_slice() {
        [] => {}
        [one] => writeln!(out, "use armor_sdk::messages::{one};").unwrap_or_default(),
        several => writeln!(out, "use armor_sdk::messages::{{{}}};", several.join(", "))
            .unwrap_or_default(),
    }
    Ok(out + &body)
}

/// Whether a type is named; what another message imports by itself is not.
fn mentions(body: &str, name: &str) -> bool {
    body.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == name)
}

fn write_definition(out: &mut String, definition: &Definition) -> Result<(), ExportError> {
    let name = definition.name();
    write_doc(out, &definition.doc, "");
    let has_default = has_default(&definition.schema);
    let default = if has_default { "Default, " } else { "" };
    let mut push = |line: String| {
        out.push_str(&line);
        out.push('\n');
    };
    push(format!("#[derive(Clone, Debug, {default}PartialEq, Message)]"));
    match &definition.schema {
        Schema::Struct { fields, .. } => {
            push(format!("pub struct {name} {{"));
            for field in fields {
                let doc = definition.member_docs.get(&field.name).cloned().unwrap_or_default();
                doc.iter().for_each(|line| push(format!("    /// {line}")));
                write_field(&mut push, definition, field, ("    ", "pub "))?;
            }
        }
        Schema::Enum { variants, .. } => {
            push(format!("pub enum {name} {{"));
            for (index, variant) in variants.iter().enumerate() {
                let doc = definition.member_docs.get(&variant.name).cloned().unwrap_or_default();
                doc.iter().for_each(|line| push(format!("    /// {line}")));
                if index == 0 && has_default {
                    push("    #[default]".into());
                }
                let label = identifier(definition, &variant.name)?;
                if variant.fields.is_empty() {
                    push(format!("    {label},"));
                    continue;
                }
                push(format!("    {label} {{"));
                for field in &variant.fields {
                    write_field(&mut push, definition, field, ("        ", ""))?;
                }
                push("    },".into());
            }
        }
        _ => {}
    }
    push("}".into());
    Ok(())
}

fn write_doc(out: &mut String, lines: &[String], indent: &str) {
    for line in lines {
        writeln!(out, "{indent}/// {line}").unwrap_or_default();
    }
}

fn write_field(
    push: &mut impl FnMut(String),
    of: &Definition,
    field: &Field,
    (indent, visibility): (&str, &str),
) -> Result<(), ExportError> {
    if let Some(unit) = &field.unit {
        push(format!("{indent}#[message(unit = \"{unit}\")]"));
    }
    let name = identifier(of, &field.name)?;
    push(format!("{indent}{visibility}{name}: {},", type_name(&field.schema)));
    Ok(())
}

fn identifier(of: &Definition, name: &str) -> Result<String, ExportError> {
    if NO_IDENTIFIERS.contains(&name) {
        return Err(ExportError::reserved(of, name, Language::Rust));
    }
    Ok(if KEYWORDS.contains(&name) { format!("r#{name}") } else { name.into() })
}

fn is_number(schema: &Schema) -> bool {
    use Schema::{F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
    matches!(schema, U8 | I8 | U16 | I16 | U32 | I32 | U64 | I64 | F32 | F64)
}

fn type_name(schema: &Schema) -> String {
    match schema {
        Schema::Text => "String".into(),
        Schema::Option(item) => format!("Option<{}>", type_name(item)),
        Schema::List(item) if is_number(item) => format!("Array<{item}>"),
        Schema::List(item) => format!("Vec<{}>", type_name(item)),
        Schema::Fixed(item, count) => format!("[{}; {count}]", type_name(item)),
        other => name_of(other).map_or_else(|| other.to_string(), str::to_owned),
    }
}

fn has_default(schema: &Schema) -> bool {
    match schema {
        Schema::Fixed(item, count) => *count <= MAX_DEFAULT_COUNT && has_default(item),
        Schema::Struct { fields, .. } => fields.iter().all(|field| has_default(&field.schema)),
        Schema::Enum { variants, .. } => variants.first().is_some_and(|it| it.fields.is_empty()),
        _ => true,
    }
}
