//! Checks what the JSON form of a manifest cannot express. The program that wrote it may
//! have written it by hand.

use std::collections::BTreeSet;

use super::{MANIFEST_VERSION, Manifest, ParameterManifest, ParameterType, PortManifest};
use crate::name::is_name;
use crate::quantity::Unit;
use crate::schema;

impl Manifest {
    /// Whether names are names and each there once, schemas are schemas with their hashes, and
    /// every parameter has a unit that exists, a range that is not empty, and a default within it.
    ///
    /// # Errors
    /// The first thing that is wrong, in words that name it.
    pub fn validate(&self) -> Result<(), String> {
        if self.armor_manifest != MANIFEST_VERSION {
            let version = self.armor_manifest;
            return Err(format!("it is of version {version}, not {MANIFEST_VERSION}"));
        }
        if !is_name(&self.kind) {
            return Err(format!("the kind `{}` is not a name", self.kind));
        }
        one_line("the summary", &self.summary)?;
        let ports = self.inputs.iter().chain(&self.outputs);
        unique("port", ports.clone().map(|port| port.id.as_str()))?;
        unique("parameter", self.parameters.iter().map(|parameter| parameter.name.as_str()))?;
        for port in ports {
            validate_port(port).map_err(|why| format!("the port {}: {why}", port.id))?;
        }
        for parameter in &self.parameters {
            validate_parameter(parameter)
                .map_err(|why| format!("the parameter {}: {why}", parameter.name))?;
        }
        Ok(())
    }
}

/// Inputs and outputs share their names: a file names both as `component.port`.
fn unique<'a>(noun: &str, names: impl Iterator<Item = &'a str>) -> Result<(), String> {
    let mut seen = BTreeSet::new();
    for name in names {
        if !is_name(name) {
            return Err(format!("`{name}` is not a name for a {noun}"));
        }
        if !seen.insert(name) {
            return Err(format!("the {noun} {name} occurs twice"));
        }
    }
    Ok(())
}

fn one_line(what: &str, text: &str) -> Result<(), String> {
    match text.chars().find(|c| c.is_control()) {
        None => Ok(()),
        Some(c) => Err(format!("{what} is not one line: U+{:04X} is in it", u32::from(c))),
    }
}

fn validate_port(port: &PortManifest) -> Result<(), String> {
    one_line("its text", &port.doc)?;
    let schema = schema::parse(&port.schema).map_err(|why| format!("its schema: {why}"))?;
    if let schema::Schema::Struct { name, .. } | schema::Schema::Enum { name, .. } = &schema
        && *name != port.type_name
    {
        return Err(format!("its type is {}, but its schema is that of {name}", port.type_name));
    }
    let hash = schema::hash_text(&port.schema);
    if hash != port.schema_hash {
        let given = port.schema_hash;
        return Err(format!("its schema_hash is {given:016x}, but {hash:016x} is its schema's"));
    }
    Ok(())
}

fn validate_parameter(parameter: &ParameterManifest) -> Result<(), String> {
    one_line("its text", &parameter.doc)?;
    let numeric = matches!(parameter.kind, ParameterType::Number | ParameterType::Integer);
    let unit = parameter.unit.as_str();
    if !unit.is_empty() && parameter.kind != ParameterType::Number {
        return Err(format!("it has the unit {unit}, but is no number"));
    }
    if !unit.is_empty() && Unit::named(unit).is_none() {
        return Err(format!("there is no unit called `{unit}`"));
    }
    let (minimum, maximum) = (parameter.minimum, parameter.maximum);
    if !numeric && (minimum.is_some() || maximum.is_some()) {
        return Err("it has a range, but is no number".into());
    }
    if let (Some(minimum), Some(maximum)) = (minimum, maximum)
        && minimum > maximum
    {
        return Err(format!("its range is empty: {minimum} to {maximum}"));
    }
    let choice = parameter.kind == ParameterType::Choice;
    if choice == parameter.choices.is_empty() {
        return Err(if choice { "it has no choices" } else { "it has choices, but is none" }.into());
    }
    match &parameter.default {
        Some(default) => {
            parameter.parse(default).map(|_| ()).map_err(|why| format!("its default: {why}"))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Fault = fn(&mut Manifest);

    fn manifest() -> Manifest {
        let schema = "Scan{ranges:[f32](m)}";
        let port = |id: &str| PortManifest {
            id: id.into(),
            type_name: "Scan".into(),
            schema: schema.into(),
            schema_hash: schema::hash_text(schema),
            doc: String::new(),
            required: false,
            latched: false,
        };
        let speed = ParameterManifest {
            name: "speed".into(),
            kind: ParameterType::Number,
            unit: "m/s".into(),
            default: Some("0.5".into()),
            minimum: Some(0.0),
            maximum: Some(1.0),
            choices: vec![],
            doc: "how fast".into(),
            live: true,
        };
        Manifest {
            armor_manifest: MANIFEST_VERSION,
            kind: "mapper".into(),
            summary: "Draws.".into(),
            inputs: vec![port("scan")],
            outputs: vec![port("map")],
            parameters: vec![speed],
        }
    }

    #[test]
    fn each_fault_is_named() {
        assert_eq!(manifest().validate(), Ok(()));
        let faults: [(&str, Fault); 16] = [
            ("version 2", |m| m.armor_manifest = 2),
            ("`9x` is not a name", |m| m.kind = "9x".into()),
            ("summary is not one line", |m| m.summary = "a\u{1b}[2J".into()),
            ("port map occurs twice", |m| m.inputs[0].id = "map".into()),
            ("`a b` is not a name", |m| m.inputs[0].id = "a b".into()),
            ("its schema", |m| m.inputs[0].schema = "Scan{".into()),
            ("that of Scan", |m| m.outputs[0].type_name = "Map".into()),
            ("schema_hash", |m| m.outputs[0].schema_hash = 1),
            ("no unit called `knots`", |m| m.parameters[0].unit = "knots".into()),
            ("no number", |m| m.parameters[0].kind = ParameterType::Text),
            ("range is empty", |m| m.parameters[0].minimum = Some(2.0)),
            ("its default: `0.5` is out of range", |m| m.parameters[0].maximum = Some(0.1)),
            ("its default: `fast`", |m| m.parameters[0].default = Some("fast".into())),
            ("choices, but is none", |m| m.parameters[0].choices = vec!["a".into()]),
            ("no choices", |m| {
                let parameter = &mut m.parameters[0];
                (parameter.kind, parameter.unit) = (ParameterType::Choice, String::new());
                (parameter.minimum, parameter.maximum) = (None, None);
            }),
            ("occurs twice", |m| m.parameters.push(m.parameters[0].clone())),
        ];
        for (expected, fault) in faults {
            let mut manifest = manifest();
            fault(&mut manifest);
            let why = manifest.validate().expect_err(expected);
            assert!(why.contains(expected), "{why} instead of {expected}");
        }
    }
}
