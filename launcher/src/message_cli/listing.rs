//! Messages in tables for people, and as JSON Lines.

use anyhow::Result;
use armor_definitions::{Definition, select_messages};
use armor_wire::schema::{Field, Schema};
use serde_json::{Value, json};

use super::known_messages::{KnownMessage, KnownMessages, MessagePort};
use crate::arguments::OutputFormat;
use crate::inspect_cli::describe::fields::describe_type;
use crate::print::{Table, print_line, terminal_width, wrap_text};

/// Prints a line for each message.
///
/// # Errors
/// If stdout cannot be written.
pub fn list_messages(known: &KnownMessages, format: OutputFormat) -> Result<()> {
    if format == OutputFormat::Json {
        return known.0.iter().try_for_each(|message| print_line(describe_message(message)));
    }
    let rows = known.0.iter().map(|message| {
        let origin = if message.is_standard { "standard" } else { "component" };
        let mut kinds: Vec<_> = message.ports.iter().map(|it| it.kind.as_str()).collect();
        kinds.dedup();
        let (name, doc) = (message.definition.name(), message.definition.doc.first());
        vec![name.into(), origin.into(), kinds.join(", "), doc.cloned().unwrap_or_default()]
    });
    let table = Table::new(&["MESSAGE", "OF", "USED BY", "MEANING"], rows.collect());
    print_line(table.dispensable(&["USED BY"]).format(terminal_width()).trim_end())
}

/// Prints the messages that have one name.
///
/// # Errors
/// If stdout cannot be written.
pub fn show_messages(messages: &[&KnownMessage], format: OutputFormat) -> Result<()> {
    if format == OutputFormat::Json {
        return messages.iter().try_for_each(|message| print_line(describe_message(message)));
    }
    let texts: Vec<_> = messages.iter().map(|message| in_words(message)).collect();
    print_line(texts.join("\n").trim_end())
}

fn in_words(message: &KnownMessage) -> String {
    let width = terminal_width();
    let definition = &message.definition;
    let origin = if message.is_standard { "standard" } else { "of components" };
    let mut out = format!("{} ({origin})\n", definition.name());
    out += &describe_meaning(definition, width);
    // The messages within it follow, each once.
    let parts = select_messages(
        std::slice::from_ref(&definition.schema),
        &armor_definitions::standard_messages(),
    );
    let parts = parts.map(|it| [it.imported, it.defined].concat()).unwrap_or_default();
    out += "\n";
    out += &describe_parts(definition, width);
    for part in parts.iter().filter(|part| part.schema != definition.schema) {
        out += &format!("\n{}\n", part.name());
        out += &describe_meaning(part, width);
        out += &describe_parts(part, width);
    }
    if !message.ports.is_empty() {
        let rows = message.ports.iter().map(describe_port).collect();
        out += "\n";
        out += &Table::new(&["PORT", "", ""], rows).format(width);
    }
    let schema = &definition.schema;
    out + &format!("\nschema {schema}\nhash   {:016x}\n", schema.hash())
}

fn describe_meaning(definition: &Definition, width: Option<usize>) -> String {
    let text = definition.doc.join(" ");
    let lines = wrap_text(&text, width.unwrap_or(usize::MAX));
    if text.is_empty() { text } else { lines.join("\n") + "\n" }
}

fn describe_port(port: &MessagePort) -> Vec<String> {
    let direction = if port.is_input { "input" } else { "output" };
    let frame = match port.frame.as_str() {
        "" => String::new(),
        parameter => format!("in the frame that the parameter {parameter} names"),
    };
    vec![format!("{}.{}", port.kind, port.port), direction.into(), frame]
}

/// The fields of a struct, or the variants of an enum, as a table.
fn describe_parts(definition: &Definition, width: Option<usize>) -> String {
    let rows: Vec<Vec<String>> = match &definition.schema {
        Schema::Struct { fields, .. } => {
            fields.iter().map(|it| field_row("", it, definition.member_doc(&it.name))).collect()
        }
        Schema::Enum { variants, .. } => {
            let rows = variants.iter().flat_map(|variant| {
                let doc = definition.member_doc(&variant.name);
                let own = vec![variant.name.clone(), String::new(), String::new(), doc];
                let path = format!("{}.", variant.name);
                let fields = variant.fields.iter();
                let fields = fields.map(move |it| field_row(&path, it, String::new()));
                std::iter::once(own).chain(fields).collect::<Vec<_>>()
            });
            rows.collect()
        }
        _ => Vec::new(),
    };
    let heading = match &definition.schema {
        Schema::Enum { .. } => "VALUE",
        _ => "FIELD",
    };
    let headings = [heading, "TYPE", "UNIT", "MEANING"];
    // A message of a component has no documentation, and an enum mostly no types.
    let has_news = |column: &usize| *column == 0 || rows.iter().any(|row| !row[*column].is_empty());
    let columns: Vec<_> = (0..headings.len()).filter(has_news).collect();
    let headings: Vec<_> = columns.iter().map(|column| headings[*column]).collect();
    let select = |row: &Vec<String>| -> Vec<String> {
        columns.iter().map(|column| row[*column].clone()).collect()
    };
    Table::new(&headings, rows.iter().map(select).collect()).format(width)
}

fn field_row(path: &str, field: &Field, doc: String) -> Vec<String> {
    // The values of an enum follow in a table of their own.
    let type_name = match &field.schema {
        Schema::Enum { name, .. } => name.clone(),
        other => describe_type(other),
    };
    vec![format!("{path}{}", field.name), type_name, field.unit.clone().unwrap_or_default(), doc]
}

fn describe_message(message: &KnownMessage) -> Value {
    let definition = &message.definition;
    let ports = message.ports.iter().map(|it| {
        let direction = if it.is_input { "input" } else { "output" };
        json!({ "kind": it.kind, "port": it.port, "direction": direction, "frame": it.frame })
    });
    let mut value = json!({
        "name": definition.name(),
        "standard": message.is_standard,
        "doc": definition.doc.join(" "),
        "schema": definition.schema.to_string(),
        "hash": format!("{:016x}", definition.schema.hash()),
        "ports": ports.collect::<Vec<_>>(),
    });
    match &definition.schema {
        Schema::Struct { fields, .. } => {
            let fields = fields.iter().map(|field| {
                let doc = definition.member_doc(&field.name);
                let type_name = describe_type(&field.schema);
                json!({ "name": field.name, "type": type_name, "unit": field.unit, "doc": doc })
            });
            value["fields"] = fields.collect();
        }
        Schema::Enum { variants, .. } => {
            let variants = variants.iter().map(|variant| {
                json!({ "name": variant.name, "doc": definition.member_doc(&variant.name) })
            });
            value["variants"] = variants.collect();
        }
        _ => {}
    }
    value
}
