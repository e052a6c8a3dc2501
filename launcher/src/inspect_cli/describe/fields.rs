//! The fields of a message as people read them: one line per field, with its type and unit.

use armor_wire::schema::{Field, Schema, parse};

/// Returns one line per field of the message with this schema: the path of the
/// field, as a guard or `armor echo --field` writes it, and its type with its unit.
pub fn list_fields(schema: &str) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    match parse(schema) {
        Ok(schema) => push_parts("", None, &schema, &mut lines),
        Err(error) => lines.push((String::new(), format!("the schema cannot be read: {error}"))),
    }
    lines
}

/// `unit`: that of the struct, which its numbers without a unit have.
fn push_parts(path: &str, unit: Option<&str>, schema: &Schema, lines: &mut Vec<(String, String)>) {
    match schema {
        Schema::Struct { fields, .. } => {
            fields.iter().for_each(|field| push_field(path, unit, field, lines));
        }
        Schema::Enum { variants, .. } => {
            for variant in variants {
                let path = join(path, &variant.name);
                variant.fields.iter().for_each(|field| push_field(&path, unit, field, lines));
            }
        }
        Schema::Option(item) | Schema::List(item) | Schema::Fixed(item, _) => {
            push_parts(path, unit, item, lines);
        }
        _ => {}
    }
}

fn push_field(path: &str, outer: Option<&str>, field: &Field, lines: &mut Vec<(String, String)>) {
    let path = join(path, &field.name);
    let unit = field.unit.as_deref().or(outer);
    let has_unit = field.unit.is_some() || is_number(&field.schema);
    let in_unit = unit.filter(|_| has_unit).map_or(String::new(), |unit| format!(" in {unit}"));
    // A struct is named by its fields below.
    if !matches!(field.schema, Schema::Struct { .. }) {
        lines.push((path.clone(), format!("{}{in_unit}", describe_type(&field.schema))));
    }
    let is_array = matches!(field.schema, Schema::List(_) | Schema::Fixed(..));
    let inside = if is_array { format!("{path}.N") } else { path };
    push_parts(&inside, unit, &field.schema, lines);
}

fn is_number(schema: &Schema) -> bool {
    use Schema::{Bool, Enum, Fixed, List, Option, Struct, Text};
    match schema {
        Option(item) | List(item) | Fixed(item, _) => is_number(item),
        Bool | Text | Enum { .. } | Struct { .. } => false,
        _ => true,
    }
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

/// Returns the type of a value as people read it.
pub fn describe_type(schema: &Schema) -> String {
    match schema {
        Schema::Text => "text".into(),
        Schema::Option(item) => format!("{} or nothing", describe_type(item)),
        Schema::List(item) if **item == Schema::U8 => "bytes".into(),
        Schema::List(item) => format!("list of {}", describe_type(item)),
        Schema::Fixed(item, count) => format!("{count} {}", describe_type(item)),
        Schema::Struct { name, .. } => name.clone(),
        Schema::Enum { variants, .. } => {
            variants.iter().map(|it| it.name.as_str()).collect::<Vec<_>>().join(" | ")
        }
        primitive => primitive.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_a_struct_is_that_of_its_numbers() {
        let schema = "Twist{linear:Vector3{x:f64,ok:bool,at:f64(s)}(m/s),mode:Mode<A,B>}";
        let lines = list_fields(schema);
        let lines: Vec<_> = lines.iter().map(|(path, kind)| format!("{path}: {kind}")).collect();
        let expected = ["linear.x: f64 in m/s", "linear.ok: bool", "linear.at: f64 in s"];
        assert_eq!(lines[..3], expected);
    }

    #[test]
    fn every_field_has_a_line_with_its_type_and_unit() {
        let schema = "Scan{stamp:f64(s),pose:Pose{x:f64(m),yaw:f64(rad)},ranges:[f32](m),\
                      level:?Level<Low,High{margin:f64}>,points:[P{x:f64(m)}],raw:[u8],cov:[f64;9]}";
        let lines = list_fields(schema);
        let lines: Vec<_> = lines.iter().map(|(path, kind)| format!("{path}: {kind}")).collect();
        assert_eq!(
            lines,
            [
                "stamp: f64 in s",
                "pose.x: f64 in m",
                "pose.yaw: f64 in rad",
                "ranges: list of f32 in m",
                "level: Low | High or nothing",
                "level.High.margin: f64",
                "points: list of P",
                "points.N.x: f64 in m",
                "raw: bytes",
                "cov: 9 f64",
            ]
        );
    }
}
