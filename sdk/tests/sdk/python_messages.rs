//! The standard messages of the Python package are written from those of Rust: names, schemas, defaults
//! and documentation. `ARMOR_BLESS=1` writes the file.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use armor_sdk::messages;
use armor_sdk::wire::codec;
use armor_sdk::wire::message::WireType;
use armor_sdk::wire::schema::{Field, Schema, Variant, to_json};
use serde_json::Value;

/// Lists the messages with their schemas, and their defaults as JSON.
macro_rules! definitions_of {
    ($($name:ident)*) => {
        vec![$({
            let schema = messages::$name::schema();
            let bytes = codec::encode(&messages::$name::default()).expect("it fits");
            let default = to_json(&schema, &bytes).expect("it is its schema");
            (schema, default)
        },)*]
    };
}

/// Every standard message, each after those that it contains; the test of the schemas has them all.
fn definitions() -> Vec<(Schema, Value)> {
    definitions_of![
        Point Vector3 Quaternion Pose Pose2D PoseStamped PoseArray PoseWithCovariance
        PoseWithCovarianceStamped Twist TwistWithCovariance FrameTransform FrameTransforms
        MapMetaData OccupancyGrid OccupancyGridUpdate Path SlamDiagnostics ZoneRule Zone Zones
        Odometry
        LaserScan Image CompressedImage Imu NavSatStatus NavSatService NavSatFix
        PowerSupplyStatus BatteryState
        Flag Number Text Count Log Progress
    ]
}

/// The documentation of types and of their fields and variants, as `Type` and `Type.field`.
fn read_docs(text: &str, docs: &mut BTreeMap<String, String>) {
    let (mut doc, mut owner) = (Vec::new(), None);
    for line in text.lines() {
        let trimmed = line.trim();
        if let Some(text) = trimmed.strip_prefix("///") {
            doc.push(text.trim().to_owned());
            continue;
        }
        if trimmed.starts_with("#[") {
            continue;
        }
        let declares = ["pub struct ", "pub enum "];
        let declared = declares.iter().find_map(|word| line.strip_prefix(word));
        let name = |rest: &str| {
            rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().map(str::to_owned)
        };
        if let Some(rest) = declared {
            owner = name(rest);
            docs.insert(owner.clone().expect("a name"), std::mem::take(&mut doc).join(" "));
        } else if line == "}" {
            owner = None;
        } else if let (Some(owner), false) = (&owner, doc.is_empty()) {
            let member = name(trimmed.strip_prefix("pub ").unwrap_or(trimmed)).expect("a name");
            docs.insert(format!("{owner}.{member}"), std::mem::take(&mut doc).join(" "));
        }
        doc.clear();
    }
}

const HEAD: &str = r#""""The standard messages, with the names and fields of ROS. Angles are in radians, lengths in metres;
axes by REP-103. An array is a numpy array; a received one is read-only, and lies where it arrived.

Written from the definitions in Rust by `cargo test -p armor-sdk python_messages`; not to be edited.
"""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Union

from armor._message import Message

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def _array(values: Any, dtype: str) -> Any:
    """An array of `values`; those that are an array already as they are."""
    if hasattr(values, "__array_interface__"):
        return values
    import numpy

    if isinstance(values, (bytes, bytearray, memoryview)):
        return numpy.frombuffer(values, dtype)
    return numpy.array(() if values is None else values, dtype)
"#;

/// Methods of a message by hand, as in Rust.
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

/// What a field is in Python.
struct FieldText {
    /// The type of the attribute, and of the argument of the constructor.
    attribute: String,
    argument: String,
    /// The default of the argument, and what is assigned.
    default: String,
    assigned: String,
    /// Its description for the native part.
    described: String,
}

fn numpy_name(schema: &Schema) -> Option<(&'static str, &'static str)> {
    Some(match schema {
        Schema::U8 => ("uint8", "<u1"),
        Schema::I8 => ("int8", "<i1"),
        Schema::F32 => ("float32", "<f4"),
        Schema::F64 => ("float64", "<f8"),
        _ => return None,
    })
}

fn plain(python: &str, default: String, field: &Field) -> FieldText {
    FieldText {
        attribute: python.into(),
        argument: python.into(),
        default,
        assigned: field.name.clone(),
        described: format!("\"{}\"", field.schema),
    }
}

fn optional(python: &str, field: &Field, otherwise: &str, described: String) -> FieldText {
    let name = &field.name;
    FieldText {
        attribute: python.into(),
        argument: format!("Optional[{python}]"),
        default: "None".into(),
        assigned: format!("{otherwise} if {name} is None else {name}"),
        described,
    }
}

fn describe_field(field: &Field, default: &Value) -> FieldText {
    match &field.schema {
        Schema::Bool => plain(
            "bool",
            if default == &Value::Bool(true) { "True" } else { "False" }.into(),
            field,
        ),
        Schema::F32 | Schema::F64 => {
            let number = default.as_f64().map_or("math.nan".into(), |it| format!("{it:?}"));
            plain("float", number, field)
        }
        Schema::Text => plain("str", default.to_string(), field),
        Schema::List(item) if numpy_name(item).is_some() => {
            let (numpy, dtype) = numpy_name(item).expect("a number");
            let given = if **item == Schema::U8 { "bytes, " } else { "" };
            let number = if numpy.starts_with("float") { "float" } else { "int" };
            FieldText {
                attribute: format!("NDArray[np.{numpy}]"),
                argument: format!("Union[NDArray[np.{numpy}], {given}Sequence[{number}], None]"),
                default: "None".into(),
                assigned: format!("_array({}, \"{dtype}\")", field.name),
                described: format!("(\"array\", \"{item}\")"),
            }
        }
        Schema::List(item) => {
            let Schema::Struct { name, .. } = &**item else { panic!("a list of {item}") };
            optional(&format!("List[{name}]"), field, "[]", format!("(\"list\", {name})"))
        }
        Schema::Fixed(item, count) => {
            let described = format!("(\"fixed\", \"{item}\", {count})");
            optional("List[float]", field, &format!("[0.0] * {count}"), described)
        }
        Schema::Struct { name, .. } => optional(name, field, &format!("{name}()"), name.clone()),
        Schema::Enum { name, .. } => {
            let member = default.as_str().expect("a variant without fields");
            FieldText { described: name.clone(), ..plain(name, format!("{name}.{member}"), field) }
        }
        Schema::Option(_) => panic!("no standard message has an optional field yet"),
        _ => plain("int", default.to_string(), field),
    }
}

fn write_struct(
    out: &mut String,
    (name, fields): (&str, &[Field]),
    default: &Value,
    docs: &BTreeMap<String, String>,
) {
    let texts: Vec<_> =
        fields.iter().map(|field| (field, describe_field(field, &default[&field.name]))).collect();
    let names: Vec<_> = fields.iter().map(|field| format!("\"{}\",", field.name)).collect();
    writeln!(out, "\n\nclass {name}(Message):\n    \"\"\"{}\"\"\"\n", docs[name]).unwrap();
    writeln!(out, "    __slots__ = ({})\n    _fields = (", names.join(" ")).unwrap();
    for (field, text) in &texts {
        let unit = field.unit.as_ref().map_or("None".into(), |unit| format!("\"{unit}\""));
        let name = &field.name;
        writeln!(out, "        (\"{name}\", \"{name}\", {unit}, {}),", text.described).unwrap();
    }
    writeln!(out, "    )\n").unwrap();
    for (field, text) in &texts {
        let doc = &docs[&format!("{name}.{}", field.name)];
        let unit = field.unit.as_ref().map_or(String::new(), |unit| format!(" Unit: {unit}."));
        writeln!(out, "    {}: {}\n    \"\"\"{doc}{unit}\"\"\"", field.name, text.attribute)
            .unwrap();
    }
    writeln!(out, "\n    def __init__(\n        self,").unwrap();
    for (field, text) in &texts {
        writeln!(out, "        {}: {} = {},", field.name, text.argument, text.default).unwrap();
    }
    writeln!(out, "    ) -> None:").unwrap();
    for (field, text) in &texts {
        writeln!(out, "        self.{} = {}", field.name, text.assigned).unwrap();
    }
    if name == "Quaternion" {
        out.push_str(YAW);
    }
}

fn write_enum(out: &mut String, name: &str, variants: &[Variant], docs: &BTreeMap<String, String>) {
    writeln!(out, "\n\nclass {name}(enum.Enum):\n    \"\"\"{}\"\"\"\n", docs[name]).unwrap();
    for (index, variant) in variants.iter().enumerate() {
        assert!(variant.fields.is_empty(), "{name}.{} has fields", variant.name);
        let doc = &docs[&format!("{name}.{}", variant.name)];
        writeln!(out, "    {} = {index}\n    \"\"\"{doc}\"\"\"", variant.name).unwrap();
    }
}

#[test]
fn the_messages_of_python_are_those_of_rust() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut docs = BTreeMap::new();
    for entry in std::fs::read_dir(root.join("src/messages")).expect("a folder") {
        let text = std::fs::read_to_string(entry.expect("an entry").path()).expect("a file");
        read_docs(&text, &mut docs);
    }
    let mut definitions = definitions();
    // A class is used in those after it.
    let is_contained = |schema: &Schema, other: &Schema| {
        schema != other && other.to_string().contains(&schema.to_string())
    };
    let mut sorted: Vec<(Schema, Value)> = Vec::new();
    while !definitions.is_empty() {
        let free = definitions.iter().position(|(schema, _)| {
            definitions.iter().all(|(other, _)| !is_contained(other, schema))
        });
        sorted.push(definitions.remove(free.expect("no message contains itself")));
    }
    let mut text = HEAD.to_owned();
    for (schema, default) in &sorted {
        match schema {
            Schema::Struct { name, fields } => {
                write_struct(&mut text, (name, fields), default, &docs);
            }
            Schema::Enum { name, variants } => write_enum(&mut text, name, variants, &docs),
            other => panic!("{other} is no message"),
        }
    }
    let path = root.join("python/python/armor/messages.py");
    if std::env::var_os("ARMOR_BLESS").is_some() {
        std::fs::write(&path, &text).expect("it is written");
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == text,
        "{} is not what the messages of Rust are; ARMOR_BLESS=1 writes it",
        path.display()
    );
}
