//! Messages as classes of the Python package `armor`.

use std::fmt::Write;

use armor_wire::schema::{Field, Schema, Variant};
use serde_json::Value;

use crate::definition::Definition;
use crate::language::{ExportError, Language};

const HEAD: &str = r#""""The standard messages, with the names and fields of ROS. Angles are in radians, lengths in metres;
axes by REP-103. An array is a numpy array; a received one is read-only, and lies where it arrived.

Written from the definitions in Rust by `ARMOR_BLESS=1 cargo test -p armor-definitions`; not to be edited.
"""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, List, Optional, Sequence, Union

from armor._message import Message, _array

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
"#;

/// Methods of a message that are written by hand, as in Rust.
const YAW: &str = r#"
    @classmethod
    def from_yaw(cls, yaw_rad: float) -> Quaternion:
        """A rotation about the up axis, counter-clockwise, in radians."""
        return cls(z=math.sin(yaw_rad / 2.0), w=math.cos(yaw_rad / 2.0))

    def yaw_rad(self) -> float:
        """The rotation about the up axis, in radians, in -pi..pi."""
        w, x, y, z = self.w, self.x, self.y, self.z
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
"#;

/// Words that are no names of attributes; these end with an underscore, which the schema has not.
const KEYWORDS: [&str; 35] = [
    "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue",
    "def", "del", "elif", "else", "except", "finally", "for", "from", "global", "if", "import",
    "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while",
    "with", "yield",
];

/// Writes the module of the standard messages.
///
/// # Errors
/// If a message has a field that Python's package cannot express.
pub fn write_python_module(messages: &[Definition]) -> Result<String, ExportError> {
    let mut out = HEAD.to_owned();
    messages.iter().try_for_each(|message| write_definition(&mut out, message))?;
    Ok(out)
}

/// Writes a module that defines the messages.
///
/// # Errors
/// If a message has a field that Python's package cannot express.
pub fn export(defined: &[Definition], imported: &[Definition]) -> Result<String, ExportError> {
    let mut body = String::new();
    defined.iter().try_for_each(|message| write_definition(&mut body, message))?;
    Ok(export_head(&body, imported) + &body)
}

/// The imports that `body` needs.
fn export_head(body: &str, imported: &[Definition]) -> String {
    let mut out = String::from(
        "\"\"\"Messages, as `armor message export --lang python` writes them.\"\"\"\n\n\
         from __future__ import annotations\n\n",
    );
    let modules = ["enum", "math"].iter().filter(|it| body.contains(&format!("{it}.")));
    modules.for_each(|module| out += &format!("import {module}\n"));
    let needs_numpy = body.contains("NDArray[");
    let typed = ["List[", "Optional[", "Sequence[", "Union["];
    let typed = typed.iter().filter(|it| body.contains(*it)).map(|it| it.trim_end_matches('['));
    let typing: Vec<_> = needs_numpy.then_some("TYPE_CHECKING").into_iter().chain(typed).collect();
    if !typing.is_empty() {
        out += &format!("from typing import {}\n", typing.join(", "));
    }
    if !out.ends_with("\n\n") {
        out.push('\n');
    }
    if body.contains("(Message):") {
        let array = if body.contains("_array(") { ", _array" } else { "" };
        out += &format!("from armor._message import Message{array}\n");
    }
    let names = imported.iter().map(Definition::name);
    let names: Vec<_> = names.filter(|name| body.contains(*name)).collect();
    if !names.is_empty() {
        out += &format!("from armor.messages import {}\n", names.join(", "));
    }
    if needs_numpy {
        out +=
            "\nif TYPE_CHECKING:\n    import numpy as np\n    from numpy.typing import NDArray\n";
    }
    out
}

fn write_definition(out: &mut String, definition: &Definition) -> Result<(), ExportError> {
    match &definition.schema {
        Schema::Struct { fields, .. } => write_struct(out, definition, fields),
        Schema::Enum { variants, .. } => write_enum(out, definition, variants),
        _ => Ok(()),
    }
}

/// The name of an attribute or a member.
fn attribute_name(name: &str) -> String {
    if KEYWORDS.contains(&name) { format!("{name}_") } else { name.into() }
}

/// A field in Python.
struct FieldText {
    /// The type of the argument of the constructor.
    argument: String,
    /// The default of the argument, and what is assigned.
    default: String,
    assigned: String,
}

fn numpy_name(schema: &Schema) -> Option<(&'static str, &'static str)> {
    Some(match schema {
        Schema::U8 => ("uint8", "<u1"),
        Schema::I8 => ("int8", "<i1"),
        Schema::U16 => ("uint16", "<u2"),
        Schema::I16 => ("int16", "<i2"),
        Schema::U32 => ("uint32", "<u4"),
        Schema::I32 => ("int32", "<i4"),
        Schema::U64 => ("uint64", "<u8"),
        Schema::I64 => ("int64", "<i8"),
        Schema::F32 => ("float32", "<f4"),
        Schema::F64 => ("float64", "<f8"),
        _ => return None,
    })
}

/// The annotation of a value.
fn annotation(schema: &Schema) -> String {
    match schema {
        Schema::Bool => "bool".into(),
        Schema::F32 | Schema::F64 => "float".into(),
        Schema::Text => "str".into(),
        Schema::Option(item) => format!("Optional[{}]", annotation(item)),
        Schema::List(item) => match numpy_name(item) {
            Some((numpy, _)) => format!("NDArray[np.{numpy}]"),
            None => format!("List[{}]", annotation(item)),
        },
        Schema::Fixed(item, _) => format!("List[{}]", annotation(item)),
        Schema::Struct { name, .. } | Schema::Enum { name, .. } => name.clone(),
        _ => "int".into(),
    }
}

/// How a value is described for the native part.
fn description(schema: &Schema) -> String {
    match schema {
        Schema::Option(item) => format!("(\"optional\", {})", description(item)),
        Schema::List(item) => {
            let word = if numpy_name(item).is_some() { "array" } else { "list" };
            format!("(\"{word}\", {})", description(item))
        }
        Schema::Fixed(item, count) => format!("(\"fixed\", {}, {count})", description(item)),
        Schema::Struct { name, .. } | Schema::Enum { name, .. } => name.clone(),
        plain => format!("\"{plain}\""),
    }
}

/// The value that a part has if nothing is given.
fn zero(schema: &Schema) -> String {
    match schema {
        Schema::Bool => "False".into(),
        Schema::F32 | Schema::F64 => "0.0".into(),
        Schema::Text => "\"\"".into(),
        Schema::Option(_) => "None".into(),
        Schema::List(item) => match numpy_name(item) {
            Some((_, dtype)) => format!("_array(None, \"{dtype}\")"),
            None => "[]".into(),
        },
        Schema::Fixed(item, count) => match &**item {
            Schema::List(_) | Schema::Fixed(..) | Schema::Struct { .. } => {
                format!("[{} for _ in range({count})]", zero(item))
            }
            item => format!("[{}] * {count}", zero(item)),
        },
        Schema::Struct { name, .. } => format!("{name}()"),
        Schema::Enum { name, variants } => {
            let first = variants.first().map(|it| attribute_name(&it.name)).unwrap_or_default();
            format!("{name}.{first}")
        }
        _ => "0".into(),
    }
}

fn describe_field(of: &str, field: &Field, default: Option<&Value>) -> FieldText {
    let name = attribute_name(&field.name);
    let plain = |default: String| {
        let (argument, assigned) = (annotation(&field.schema), name.clone());
        FieldText { argument, default, assigned }
    };
    match &field.schema {
        Schema::List(item) if numpy_name(item).is_some() => {
            let (numpy, dtype) = numpy_name(item).unwrap_or_default();
            let given = if **item == Schema::U8 { "bytes, " } else { "" };
            let number = annotation(item);
            FieldText {
                argument: format!("Union[NDArray[np.{numpy}], {given}Sequence[{number}], None]"),
                default: "None".into(),
                assigned: format!("_array({name}, \"{dtype}\", \"{of}.{name}\")"),
            }
        }
        Schema::List(_) | Schema::Fixed(..) | Schema::Struct { .. } => FieldText {
            argument: format!("Optional[{}]", annotation(&field.schema)),
            default: "None".into(),
            assigned: format!("{} if {name} is None else {name}", zero(&field.schema)),
        },
        Schema::Enum { name, .. } => match default.and_then(Value::as_str) {
            Some(member) => plain(format!("{name}.{}", attribute_name(member))),
            None => plain(zero(&field.schema)),
        },
        Schema::F32 | Schema::F64 => match default {
            Some(default) => {
                plain(default.as_f64().map_or("math.nan".into(), |it| format!("{it:?}")))
            }
            None => plain(zero(&field.schema)),
        },
        Schema::Bool => match default {
            Some(Value::Bool(true)) => plain("True".into()),
            _ => plain(zero(&field.schema)),
        },
        schema => plain(default.map_or_else(|| zero(schema), Value::to_string)),
    }
}

/// The documentation string of a class.
fn doc_string(definition: &Definition) -> String {
    match definition.doc.as_slice() {
        [] => format!("The message {}.", definition.name()),
        lines => lines.join(" "),
    }
}

fn write_struct(
    out: &mut String,
    definition: &Definition,
    fields: &[Field],
) -> Result<(), ExportError> {
    let name = definition.name();
    let default = |field: &Field| definition.default.get(&field.name);
    let texts: Vec<_> =
        fields.iter().map(|field| (field, describe_field(name, field, default(field)))).collect();
    let mut push = |line: String| {
        out.push_str(&line);
        out.push('\n');
    };
    let names: Vec<_> =
        fields.iter().map(|field| format!("\"{}\",", attribute_name(&field.name))).collect();
    push(format!("\n\nclass {name}(Message):\n    \"\"\"{}\"\"\"\n", doc_string(definition)));
    push(format!("    __slots__ = ({})\n    _fields = (", names.join(" ")));
    for field in fields {
        if field.name == "self" {
            return Err(ExportError::reserved(definition, "self", Language::Python));
        }
        let unit = field.unit.as_ref().map_or("None".into(), |unit| format!("\"{unit}\""));
        let (attribute, schema_name) = (attribute_name(&field.name), &field.name);
        let described = description(&field.schema);
        push(format!("        (\"{attribute}\", \"{schema_name}\", {unit}, {described}),"));
    }
    push("    )\n".into());
    for field in fields {
        let doc = definition.member_doc(&field.name);
        let unit = field.unit.as_ref().map_or(String::new(), |unit| format!("Unit: {unit}."));
        push(format!("    {}: {}", attribute_name(&field.name), annotation(&field.schema)));
        let parts = [doc, unit];
        let parts: Vec<_> =
            parts.iter().filter(|part| !part.is_empty()).map(String::as_str).collect();
        if !parts.is_empty() {
            push(format!("    \"\"\"{}\"\"\"", parts.join(" ")));
        }
    }
    push("\n    def __init__(\n        self,".into());
    for (field, text) in &texts {
        let attribute = attribute_name(&field.name);
        push(format!("        {attribute}: {} = {},", text.argument, text.default));
    }
    push("    ) -> None:".into());
    for (field, text) in &texts {
        push(format!("        self.{} = {}", attribute_name(&field.name), text.assigned));
    }
    if fields.is_empty() {
        push("        pass".into());
    }
    if name == "Quaternion" && !definition.doc.is_empty() {
        out.push_str(YAW);
    }
    Ok(())
}

fn write_enum(
    out: &mut String,
    definition: &Definition,
    variants: &[Variant],
) -> Result<(), ExportError> {
    let name = definition.name();
    let _ =
        writeln!(out, "\n\nclass {name}(enum.Enum):\n    \"\"\"{}\"\"\"\n", doc_string(definition));
    for (index, variant) in variants.iter().enumerate() {
        if !variant.fields.is_empty() {
            let form = "a variant with fields";
            return Err(ExportError::unsupported(
                definition,
                &variant.name,
                form,
                Language::Python,
            ));
        }
        let _ = writeln!(out, "    {} = {index}", attribute_name(&variant.name));
        let doc = definition.member_doc(&variant.name);
        if !doc.is_empty() {
            let _ = writeln!(out, "    \"\"\"{doc}\"\"\"");
        }
    }
    Ok(())
}
