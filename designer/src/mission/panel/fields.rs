//! The fields of data that guards may speak of.

use armor_robotfile::{Configuration, TypedManifests};
use armor_wire::schema::{self, FieldPath, Schema};

use crate::kinds::Kinds;

/// Deepest nesting that is listed.
const MAX_DEPTH: usize = 4;

/// A field that a guard may name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DataField {
    /// As a guard writes it, `power.state.level`.
    pub name: String,
    /// What it is: `number in m/s`, `truth`, `one of 'Full', 'Low'`.
    pub is: String,
}

/// All fields with single values of all outputs of the system whose kinds are known.
pub fn data_fields(configuration: &Configuration, kinds: &Kinds) -> Vec<DataField> {
    let mut found = Vec::new();
    let Some(manifests) = kinds.manifests() else { return found };
    let typed = TypedManifests::of(&configuration.system, manifests);
    for component in &configuration.system.components {
        let Some(manifest) = typed.find(&component.name.value) else { continue };
        for output in manifest.outputs.iter().filter(|output| !output.is_any()) {
            let Ok(schema) = schema::parse(&output.schema) else { continue };
            let mut walk = Walk { whole: &schema, fields: Vec::new(), found: Vec::new() };
            walk.look_into(&schema);
            let data = format!("{}.{}", component.name.value, output.id);
            found.extend(walk.found.into_iter().map(|(fields, is)| DataField {
                name: std::iter::once(data.as_str()).chain(fields).collect::<Vec<_>>().join("."),
                is,
            }));
        }
    }
    found
}

struct Walk<'a> {
    whole: &'a Schema,
    fields: Vec<&'a str>,
    found: Vec<(Vec<&'a str>, String)>,
}

impl<'a> Walk<'a> {
    fn look_into(&mut self, schema: &'a Schema) {
        match schema {
            Schema::Struct { fields, .. } if self.fields.len() < MAX_DEPTH => {
                for field in fields {
                    self.fields.push(&field.name);
                    self.look_into(&field.schema);
                    self.fields.pop();
                }
            }
            Schema::Option(inner) => self.look_into(inner),
            Schema::Struct { .. } | Schema::List(_) | Schema::Fixed(..) => {}
            _ => {
                if let Ok(path) = FieldPath::find(self.whole, &self.fields) {
                    self.found.push((self.fields.clone(), words(&path)));
                }
            }
        }
    }
}

fn words(path: &FieldPath<'_>) -> String {
    match path.schema {
        Schema::Bool => "true or false".into(),
        Schema::Text => "a text".into(),
        Schema::Enum { variants, .. } => {
            let names = variants.iter().map(|variant| format!("'{}'", variant.name));
            format!("one of {}", names.collect::<Vec<_>>().join(", "))
        }
        _ => path.unit.map_or_else(|| "a number".into(), |unit| format!("a number in {unit}")),
    }
}
