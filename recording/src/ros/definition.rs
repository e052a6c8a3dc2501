//! The text that ROS 2 has for a type in `.msg` files, with the types that it needs.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::shape::{FieldContent, RosField, Shape, StructShape, choose_field_name};

const SEPARATOR_LEN: usize = 80;
const HEADER: &str = "std_msgs/Header";
const TIME: &str = "builtin_interfaces/Time";

/// Returns the name (`PACKAGE/msg/TYPE`) and the definition of a message.
pub(super) fn write_definition(message: &Shape) -> (String, String) {
    let mut writer = DefinitionWriter::default();
    let Shape::Struct(message) = message else { return (String::new(), String::new()) };
    let mut text = writer.write_fields(&message.fields, message);
    let mut known = BTreeSet::from([message.name.clone()]);
    while let Some((name, definition)) = writer.needed.pop() {
        if known.insert(name.clone()) {
            let rule = "=".repeat(SEPARATOR_LEN);
            let body = match definition {
                Definition::Text(text) => text.to_owned(),
                Definition::Struct(shape) => writer.write_fields(&shape.fields, &shape),
                Definition::Group(fields, shape) => writer.write_fields(&fields, &shape),
                Definition::Enum(variants) => writer.write_variants(&variants),
            };
            let _ = write!(text, "{rule}\nMSG: {name}\n{body}");
        }
    }
    (message.name.replacen('/', "/msg/", 1), text)
}

enum Definition {
    Text(&'static str),
    Struct(StructShape),
    /// Fields of a type around parts of a struct.
    Group(Vec<RosField>, StructShape),
    Enum(Vec<(String, StructShape)>),
}

#[derive(Default)]
struct DefinitionWriter {
    needed: Vec<(String, Definition)>,
}

impl DefinitionWriter {
    fn write_fields(&mut self, fields: &[RosField], shape: &StructShape) -> String {
        let mut text = String::new();
        for field in fields {
            let name = &field.name;
            match &field.content {
                FieldContent::Part(part) => {
                    if let Shape::Index { variants } = &shape.parts[*part] {
                        let known: Vec<_> =
                            variants.iter().enumerate().map(|(i, v)| format!("{i} {v}")).collect();
                        let _ = writeln!(text, "# {name}: {}", known.join(", "));
                    }
                    let type_name = self.name_type(&shape.parts[*part]);
                    let _ = writeln!(text, "{type_name} {name}");
                }
                FieldContent::Header { .. } | FieldContent::InnerHeader { .. } => {
                    let _ = writeln!(text, "{HEADER} {name}");
                    self.need_time();
                    let header =
                        Definition::Text("builtin_interfaces/Time stamp\nstring frame_id\n");
                    self.needed.push((HEADER.into(), header));
                }
                FieldContent::Time(_) => {
                    let _ = writeln!(text, "{TIME} {name}");
                    self.need_time();
                }
                FieldContent::Constant(constant) => {
                    let _ = writeln!(text, "{} {name}", constant.name());
                }
                FieldContent::Group { name: group, fields } => {
                    let _ = writeln!(text, "{group} {name}");
                    let definition = Definition::Group(fields.clone(), shape.clone());
                    self.needed.push((group.clone(), definition));
                }
            }
        }
        text
    }

    fn need_time(&mut self) {
        let time = Definition::Text("int32 sec\nuint32 nanosec\n");
        self.needed.push((TIME.into(), time));
    }

    fn write_variants(&mut self, variants: &[(String, StructShape)]) -> String {
        let mut used = BTreeSet::new();
        let mut text = format!("uint32 {}\n", choose_field_name("variant", &mut used));
        for (name, shape) in variants {
            let _ = writeln!(text, "{}[] {}", shape.name, choose_field_name(name, &mut used));
            self.needed.push((shape.name.clone(), Definition::Struct(shape.clone())));
        }
        text
    }

    fn name_type(&mut self, shape: &Shape) -> String {
        match shape {
            Shape::Plain { name, .. } | Shape::SmallIndex { name, .. } => (*name).into(),
            Shape::Text => "string".into(),
            Shape::Option(item) | Shape::List(item) => format!("{}[]", self.name_type(item)),
            Shape::Fixed(item, count) => format!("{}[{count}]", self.name_type(item)),
            Shape::Struct(shape) => {
                self.needed.push((shape.name.clone(), Definition::Struct(shape.clone())));
                shape.name.clone()
            }
            Shape::Index { .. } => "uint32".into(),
            Shape::Enum { name, variants } => {
                self.needed.push((name.clone(), Definition::Enum(variants.clone())));
                name.clone()
            }
        }
    }
}
