//! The type of Armor that a definition of ROS 2 (`.msg` text with the types that it needs) means, for
//! messages that no table knows. Its values have the same bytes in ROS as those of the definition.

use std::collections::{BTreeSet, HashMap};

use armor_wire::schema::{Field, Schema};
use thiserror::Error;

use super::shape::NO_FIELD;
use super::standard::{find_by_ros_name, find_standard};

/// Most fields of a type, with those of the types in it: more are no message, but an attack.
const MAX_FIELDS: usize = 4096;
/// Deepest nesting of types.
const MAX_DEPTH: usize = 16;
/// Types that definitions may leave out.
const TIMES: [(&str, &str); 2] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"),
];
const HEADER: &str = "std_msgs/Header";
const HEADER_FIELDS: &str = "builtin_interfaces/Time stamp\nstring frame_id";

/// Why a definition means no type of Armor.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DefinitionError {
    /// A type that Armor has no counterpart for.
    #[error("its field {field} is a {type_name}, which Armor does not have")]
    Type {
        /// The field.
        field: String,
        /// Its type in ROS.
        type_name: String,
    },
    /// A type that is neither in the definition nor a standard one.
    #[error("its definition lacks the type {0}")]
    Missing(String),
    /// A line that is no field.
    #[error("its definition has the line `{0}`, which is no field")]
    Line(String),
    /// A type within itself, or too many fields.
    #[error("its definition has more than {MAX_FIELDS} fields or {MAX_DEPTH} levels")]
    Large,
}

/// Reads the definition of the message `PACKAGE/msg/TYPE`.
///
/// # Errors
/// If it is damaged, or has a type that Armor does not have.
pub fn read_definition(ros_name: &str, text: &str) -> Result<Schema, DefinitionError> {
    let name = ros_name.replace("/msg/", "/");
    let mut sections = split_sections(text);
    let first = sections.remove("").unwrap_or_default();
    DefinitionReader { sections, fields: 0 }.read_struct(&name, &first, 0)
}

/// The lines of each type by its name, those of the message itself under an empty one.
fn split_sections(text: &str) -> HashMap<String, Vec<&str>> {
    let mut sections: HashMap<String, Vec<&str>> = HashMap::new();
    let mut name = String::new();
    for line in text.lines() {
        if let Some(next) = line.strip_prefix("MSG:") {
            name = next.trim().replace("/msg/", "/");
        } else if !line.starts_with("====") {
            sections.entry(name.clone()).or_default().push(line);
        }
    }
    sections
}

struct DefinitionReader<'a> {
    sections: HashMap<String, Vec<&'a str>>,
    fields: usize,
}

impl DefinitionReader<'_> {
    fn read_struct(
        &mut self,
        name: &str,
        lines: &[&str],
        depth: usize,
    ) -> Result<Schema, DefinitionError> {
        if depth > MAX_DEPTH {
            return Err(DefinitionError::Large);
        }
        let (package, type_name) = name.split_once('/').unwrap_or(("", name));
        let mut fields: Vec<Field> = Vec::new();
        let mut used = BTreeSet::new();
        for line in lines {
            let Some((ros_type, field)) = read_line(line)? else { continue };
            self.fields += 1;
            if self.fields > MAX_FIELDS {
                return Err(DefinitionError::Large);
            }
            if field == NO_FIELD {
                continue;
            }
            let is_header =
                matches!(ros_type, "std_msgs/Header" | "std_msgs/msg/Header" | "Header");
            if is_header && fields.is_empty() {
                // In Armor a message has stamp and frame as its first fields.
                for (name, schema) in [("stamp", Schema::F64), ("frame", Schema::Text)] {
                    used.insert(name.to_owned());
                    fields.push(Field::new(name, schema));
                }
                continue;
            }
            let schema = self.read_type(package, ros_type, field, depth)?;
            fields.push(Field::new(&choose_name(field, &fields, &schema, &mut used), schema));
        }
        let schema = |name: String| Schema::Struct { name, fields: fields.clone() };
        let own = schema(type_name.to_owned());
        // One that only looks like another standard message has the fields of its own definition.
        Ok(if find_standard(&own).is_some() { schema(format!("{type_name}Message")) } else { own })
    }

    fn read_type(
        &mut self,
        package: &str,
        ros_type: &str,
        field: &str,
        depth: usize,
    ) -> Result<Schema, DefinitionError> {
        let unknown = || DefinitionError::Type { field: field.into(), type_name: ros_type.into() };
        let (item, count) = match ros_type.strip_suffix(']').and_then(|it| it.split_once('[')) {
            Some((item, count)) => (item, Some(count)),
            None => (ros_type, None),
        };
        // A length that is at most N changes nothing of the bytes.
        let item = item.split_once("<=").map_or(item, |(item, _)| item);
        let schema = match item {
            "bool" => Schema::Bool,
            "uint8" | "byte" | "char" => Schema::U8,
            "int8" => Schema::I8,
            "uint16" => Schema::U16,
            "int16" => Schema::I16,
            "uint32" => Schema::U32,
            "int32" => Schema::I32,
            "uint64" => Schema::U64,
            "int64" => Schema::I64,
            "float32" => Schema::F32,
            "float64" => Schema::F64,
            "string" => Schema::Text,
            "wstring" | "" => return Err(unknown()),
            name => self.read_named(package, &name.replace("/msg/", "/"), depth)?,
        };
        Ok(match count {
            None => schema,
            Some(count) if count.is_empty() || count.starts_with("<=") => {
                Schema::List(Box::new(schema))
            }
            Some(count) => Schema::Fixed(Box::new(schema), count.parse().map_err(|_| unknown())?),
        })
    }

    fn read_named(
        &mut self,
        package: &str,
        name: &str,
        depth: usize,
    ) -> Result<Schema, DefinitionError> {
        let name = if name == "Header" { HEADER } else { name };
        let name = if name.contains('/') { name.into() } else { format!("{package}/{name}") };
        if let Some(standard) = find_by_ros_name(&name) {
            return Ok(standard.clone());
        }
        let known = self.sections.get(&name).cloned().or_else(|| {
            let built_in = TIMES.iter().chain(&[(HEADER, HEADER_FIELDS)]);
            built_in.into_iter().find(|(known, _)| *known == name).map(|it| it.1.lines().collect())
        });
        let Some(lines) = known else { return Err(DefinitionError::Missing(name)) };
        self.read_struct(&name, &lines, depth + 1)
    }
}

/// The type and the name of a field; none of a comment or a constant.
fn read_line(line: &str) -> Result<Option<(&str, &str)>, DefinitionError> {
    let text = line.split('#').next().unwrap_or_default().trim();
    if text.is_empty() {
        return Ok(None);
    }
    let fail = || DefinitionError::Line(line.trim().chars().take(80).collect());
    let (ros_type, rest) = text.split_once(char::is_whitespace).ok_or_else(fail)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    if after.trim_start().starts_with('=') {
        return Ok(None);
    }
    // What follows a name is its default.
    let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    let is_whole = after.is_empty() || after.starts_with(char::is_whitespace);
    if is_name && is_whole { Ok(Some((ros_type, name))) } else { Err(fail()) }
}

/// A name that no other field has, and with which the first two fields are not taken for a header.
fn choose_name(
    name: &str,
    before: &[Field],
    schema: &Schema,
    used: &mut BTreeSet<String>,
) -> String {
    let looks_like_header = before.is_empty() && name == "stamp" && *schema == Schema::F64;
    let plain = if looks_like_header { "stamp_s" } else { name };
    let mut chosen = plain.to_owned();
    for number in 2.. {
        if used.insert(chosen.clone()) {
            break;
        }
        chosen = format!("{plain}_{number}");
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::super::RosMessage;
    use super::*;

    fn read(name: &str, text: &str) -> String {
        read_definition(name, text).map_or_else(|error| error.to_string(), |it| it.to_string())
    }

    #[test]
    fn a_definition_becomes_a_type_with_its_fields() {
        let text = "# A comment\n\
                    std_msgs/Header header\n\
                    uint8 STATE_ON=1   # a constant\n\
                    string NAME = \"a b\"\n\
                    uint8 state 3\n\
                    string<=10[<=4] names\n\
                    float64[3] axes\n\
                    Wheel[] wheels\n\
                    geometry_msgs/Point at\n\
                    builtin_interfaces/Time due\n\
                    string frame\n\
                    ================================================================\n\
                    MSG: robot_msgs/msg/Wheel\n\
                    int32 turns\n\
                    builtin_interfaces/Duration within\n";
        assert_eq!(
            read("robot_msgs/msg/State", text),
            "State{stamp:f64,frame:string,state:u8,names:[string],axes:[f64;3],\
             wheels:[Wheel{turns:i32,within:Duration{sec:i32,nanosec:u32}}],\
             at:Point{x:f64(m),y:f64(m),z:f64(m)},due:Time{sec:i32,nanosec:u32},frame_2:string}"
        );
        assert_eq!(read("std_msgs/msg/Empty", ""), "Empty{}");
    }

    #[test]
    fn what_armor_has_no_type_for_is_named() {
        for (text, expected) in [
            ("wstring title", "its field title is a wstring, which Armor does not have"),
            ("Wheel wheel", "its definition lacks the type a/Wheel"),
            ("uint8", "its definition has the line `uint8`, which is no field"),
            ("uint8[x] data", "its field data is a uint8[x], which Armor does not have"),
            ("A again\n====\nMSG: a/A\nA again", "its definition has more than 4096 fields or 16"),
        ] {
            let found = read("a/msg/A", text);
            assert!(found.starts_with(expected), "{text}: {found}");
        }
    }

    #[test]
    fn a_type_of_a_definition_has_the_bytes_of_its_definition() {
        // The first is a header only by its names, the second has the name of another standard message.
        for (name, text) in [
            ("a/msg/A", "float64 stamp\nstring frame\nint32 x\n"),
            ("a/msg/Flag", "bool data\n"),
            ("a/msg/B", "int8 a\nstd_msgs/Header inner\nint64 b\n"),
        ] {
            let message = RosMessage::new(&read_definition(name, text).expect("a definition"));
            let plain = |text: &str| -> Vec<String> {
                let lines = text.lines().filter_map(|line| read_line(line).ok().flatten());
                lines.map(|(ros_type, _)| ros_type.replace("armor_msgs/", "std_msgs/")).collect()
            };
            let own = message.definition().split("====").next().unwrap_or_default();
            assert_eq!(plain(own), plain(text), "{name}");
            assert!(message.name().starts_with("armor_msgs/"), "{}", message.name());
        }
    }
}
