//! Which messages a file defines, and which standard ones it imports.

use armor_wire::schema::{Field, Schema};

use crate::definition::{Definition, name_of};
use crate::language::ExportError;

/// The messages of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Those that the file defines, each after those that it contains.
    pub defined: Vec<Definition>,
    /// The standard messages that these contain.
    pub imported: Vec<Definition>,
}

/// Selects the `requested` messages and all that they contain. A standard message is imported, except
/// if it is requested itself.
///
/// # Errors
/// If two different messages have the same name.
pub fn select_messages(
    requested: &[Schema],
    standard: &[Definition],
) -> Result<Selection, ExportError> {
    let mut selection = Selection::default();
    for schema in requested {
        add_parts(schema, requested, standard, &mut selection)?;
        add_message(schema, requested, standard, &mut selection)?;
    }
    Ok(selection)
}

/// Adds the messages within a schema.
fn add_parts(
    schema: &Schema,
    requested: &[Schema],
    standard: &[Definition],
    selection: &mut Selection,
) -> Result<(), ExportError> {
    let mut add_fields = |fields: &[Field]| {
        fields.iter().try_for_each(|field| {
            add_parts(&field.schema, requested, standard, selection)?;
            add_message(&field.schema, requested, standard, selection)
        })
    };
    match schema {
        Schema::Struct { fields, .. } => add_fields(fields),
        Schema::Enum { variants, .. } => {
            variants.iter().try_for_each(|variant| add_fields(&variant.fields))
        }
        Schema::Option(item) | Schema::List(item) | Schema::Fixed(item, _) => {
            add_parts(item, requested, standard, selection)?;
            add_message(item, requested, standard, selection)
        }
        _ => Ok(()),
    }
}

fn add_message(
    schema: &Schema,
    requested: &[Schema],
    standard: &[Definition],
    selection: &mut Selection,
) -> Result<(), ExportError> {
    let Some(name) = name_of(schema) else { return Ok(()) };
    let known = standard.iter().find(|it| it.schema == *schema);
    let definition = known.cloned().unwrap_or_else(|| Definition::of_schema(schema.clone()));
    let is_imported = known.is_some() && !requested.contains(schema);
    let mut others = selection.defined.iter().chain(&selection.imported);
    match others.find(|other| other.name() == name) {
        Some(other) if other.schema == *schema => {}
        Some(_) => return Err(ExportError::TwoMessages { name: name.into() }),
        None if is_imported => selection.imported.push(definition),
        None => selection.defined.push(definition),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use armor_wire::schema::parse;

    use super::*;
    use crate::definition::standard_messages;

    fn select(texts: &[&str]) -> Result<Selection, ExportError> {
        let requested: Vec<_> = texts.iter().map(|text| parse(text).expect("a schema")).collect();
        select_messages(&requested, &standard_messages())
    }

    fn names(definitions: &[Definition]) -> Vec<&str> {
        definitions.iter().map(Definition::name).collect()
    }

    #[test]
    fn what_a_message_contains_is_defined_before_it_and_a_standard_message_is_imported() {
        let vector = "Vector3{x:f64,y:f64,z:f64}";
        let own = format!("Hand{{joints:[Joint{{at:{vector}(m),grip:?Grip<Open,Shut>}}]}}");
        let selection = select(&[&own]).expect("it can be selected");
        assert_eq!(names(&selection.defined), ["Grip", "Joint", "Hand"]);
        assert_eq!(names(&selection.imported), ["Vector3"]);
        assert!(!selection.imported[0].doc.is_empty());

        let selection = select(&[&own, vector]).expect("it can be selected");
        assert_eq!(names(&selection.defined), ["Vector3", "Grip", "Joint", "Hand"]);
        assert!(selection.imported.is_empty());
    }

    #[test]
    fn two_messages_of_one_name_are_refused_by_their_name() {
        let error = select(&["A{x:Part{a:u8}}", "B{x:Part{b:u8}}"]).expect_err("two");
        assert!(error.to_string().contains("`Part`"), "{error}");
        assert!(select(&["A{x:Part{a:u8}}", "B{x:Part{a:u8}}"]).is_ok());
    }
}
