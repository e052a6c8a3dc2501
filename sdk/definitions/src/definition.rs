//! A message as it is written: its schema, its default and its documentation.

use std::collections::BTreeMap;

use armor_sdk::messages::{DEFINITION_SOURCES, standard_definitions};
use armor_wire::schema::Schema;
use serde_json::Value;

/// A message, or an enum of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Its layout.
    pub schema: Schema,
    /// Its default as JSON; `null` if it has none, as a message of a component.
    pub default: Value,
    /// Lines of documentation of the message; none for a message of a component.
    pub doc: Vec<String>,
    /// Lines of documentation of its fields or variants, by name.
    pub member_docs: BTreeMap<String, Vec<String>>,
}

impl Definition {
    /// A definition of which only the schema is known.
    pub fn of_schema(schema: Schema) -> Self {
        let (default, doc, member_docs) = Default::default();
        Self { schema, default, doc, member_docs }
    }

    /// Its name; empty for what is neither a struct nor an enum.
    pub fn name(&self) -> &str {
        name_of(&self.schema).unwrap_or_default()
    }

    /// The documentation of a field or variant in one line.
    pub fn member_doc(&self, member: &str) -> String {
        self.member_docs.get(member).map(|lines| lines.join(" ")).unwrap_or_default()
    }
}

/// Returns the standard messages, each after those that it contains.
pub fn standard_messages() -> Vec<Definition> {
    let mut docs = BTreeMap::new();
    DEFINITION_SOURCES.iter().for_each(|text| read_docs(text, &mut docs));
    let definitions = standard_definitions().into_iter().map(|standard| {
        let plain = Definition::of_schema(standard.schema);
        let SourceDocs { doc, members } = docs.remove(plain.name()).unwrap_or_default();
        Definition { default: standard.default, doc, member_docs: members, ..plain }
    });
    definitions.collect()
}

/// Returns the name of a struct or an enum.
pub fn name_of(schema: &Schema) -> Option<&str> {
    match schema {
        Schema::Struct { name, .. } | Schema::Enum { name, .. } => Some(name),
        _ => None,
    }
}

/// The documentation of a type in the sources.
#[derive(Default)]
struct SourceDocs {
    doc: Vec<String>,
    members: BTreeMap<String, Vec<String>>,
}

/// Reads the documentation of the types of one source, and of their fields and variants.
fn read_docs(source: &str, docs: &mut BTreeMap<String, SourceDocs>) {
    let (mut lines, mut owner) = (Vec::new(), None::<String>);
    for line in source.lines() {
        let trimmed = line.trim();
        if let Some(doc) = trimmed.strip_prefix("///") {
            lines.push(doc.trim().to_owned());
            continue;
        }
        if trimmed.starts_with("#[") {
            continue;
        }
        let declared = ["pub struct ", "pub enum "].iter().find_map(|it| line.strip_prefix(it));
        let doc = std::mem::take(&mut lines);
        if let Some(rest) = declared {
            let name = first_word(rest);
            docs.insert(name.clone(), SourceDocs { doc, ..SourceDocs::default() });
            owner = Some(name);
        } else if line == "}" {
            owner = None;
        } else if let (Some(owner), false) = (&owner, doc.is_empty()) {
            let member = first_word(trimmed.strip_prefix("pub ").unwrap_or(trimmed));
            if let Some(of) = docs.get_mut(owner) {
                of.members.insert(member, doc);
            }
        }
    }
}

fn first_word(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_standard_message_and_every_part_of_it_has_its_documentation() {
        let messages = standard_messages();
        assert!(messages.len() > 30, "{}", messages.len());
        for message in messages {
            assert!(!message.doc.is_empty(), "{}", message.name());
            let members: Vec<_> = match &message.schema {
                Schema::Struct { fields, .. } => fields.iter().map(|it| &it.name).collect(),
                Schema::Enum { variants, .. } => variants.iter().map(|it| &it.name).collect(),
                other => panic!("{other} is no message"),
            };
            for member in members {
                assert!(!message.member_doc(member).is_empty(), "{}.{member}", message.name());
            }
        }
    }
}
