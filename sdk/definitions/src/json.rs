//! Messages as one JSON document.

use armor_wire::schema::{Field, Schema};
use serde_json::{Value, json};

use crate::definition::{Definition, name_of};

/// Writes the document; imported messages are in it, too.
pub fn export(defined: &[Definition], imported: &[Definition]) -> String {
    let messages: Vec<_> = imported.iter().chain(defined).map(describe_message).collect();
    format!("{:#}\n", json!({ "messages": messages }))
}

fn describe_message(definition: &Definition) -> Value {
    let field_docs = |field: &Field| definition.member_doc(&field.name);
    let mut value = json!({
        "name": definition.name(),
        "doc": definition.doc.join(" "),
        "schema": definition.schema.to_string(),
        "hash": format!("{:016x}", definition.schema.hash()),
    });
    match &definition.schema {
        Schema::Struct { fields, .. } => {
            let fields = fields.iter().map(|field| describe_field(field, field_docs(field)));
            value["fields"] = fields.collect();
            value["default"] = definition.default.clone();
        }
        Schema::Enum { variants, .. } => {
            let variants = variants.iter().map(|variant| {
                let fields = variant.fields.iter();
                let fields: Value = fields.map(|it| describe_field(it, String::new())).collect();
                let doc = definition.member_doc(&variant.name);
                json!({ "name": variant.name, "doc": doc, "fields": fields })
            });
            value["variants"] = variants.collect();
        }
        _ => {}
    }
    value
}

fn describe_field(field: &Field, doc: String) -> Value {
    json!({
        "name": field.name,
        "type": type_text(&field.schema),
        "unit": field.unit,
        "doc": doc,
    })
}

/// The form of a schema's text, with the names of other messages in place of their parts.
fn type_text(schema: &Schema) -> String {
    match schema {
        Schema::Option(item) => format!("?{}", type_text(item)),
        Schema::List(item) => format!("[{}]", type_text(item)),
        Schema::Fixed(item, count) => format!("[{};{count}]", type_text(item)),
        other => name_of(other).map_or_else(|| other.to_string(), str::to_owned),
    }
}
