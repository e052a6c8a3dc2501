//! Checks what the JSON form of a manifest cannot express: for the SDK, which prints manifests, and
//! for the launcher, which reads those of others. The derives check parameters by the same function.

use std::collections::BTreeSet;
use std::fmt;

use super::{
    EffectKind, EventManifest, EventValue, MANIFEST_VERSION, Manifest, ParameterManifest,
    ParameterType, PortManifest,
};
use crate::name::is_name;
use crate::quantity::{self, QuantityError, Unit};
use crate::schema::{self, Schema};
use crate::text_format::TextFormat;

/// Names that reports have: no event may have them.
pub const RESERVED_EVENTS: [&str; 2] = ["done", "failed"];

/// One thing that is wrong with a manifest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManifestFault {
    /// What it is about, such as `the parameter speed`.
    pub subject: String,
    /// The member that is wrong, such as `unit`.
    pub member: &'static str,
    /// What is wrong with it.
    pub problem: String,
    /// What to do; empty if the problem makes it obvious.
    pub remedy: String,
}

impl fmt::Display for ManifestFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.problem)?;
        if self.remedy.is_empty() { Ok(()) } else { write!(f, "; {}", self.remedy) }
    }
}

/// Everything that is wrong with a manifest; never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManifestFaults(pub Vec<ManifestFault>);

impl fmt::Display for ManifestFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, fault) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { ". " };
            write!(f, "{separator}{fault}")?;
        }
        Ok(())
    }
}

impl std::error::Error for ManifestFaults {}

/// The faults of one subject.
struct Faults<'a> {
    subject: String,
    found: &'a mut Vec<ManifestFault>,
}

impl Faults<'_> {
    fn add(&mut self, member: &'static str, problem: impl Into<String>, remedy: impl Into<String>) {
        let subject = self.subject.clone();
        let (problem, remedy) = (problem.into(), remedy.into());
        self.found.push(ManifestFault { subject, member, problem, remedy });
    }

    fn check_line(&mut self, member: &'static str, text: &str) {
        if let Some(c) = text.chars().find(|c| c.is_control()) {
            let problem = format!("its {member} is not one line: U+{:04X} is in it", u32::from(c));
            self.add(member, problem, "write it as one line of text");
        }
    }
}

impl Manifest {
    /// Whether names are names and each there once, schemas are schemas with their hashes and known
    /// units, every parameter has a unit that exists, a range that is not empty and a default within
    /// it, and every event can be waited for.
    ///
    /// # Errors
    /// Everything that is wrong, each with its remedy.
    pub fn validate(&self) -> Result<(), ManifestFaults> {
        let mut found = Vec::new();
        let mut of_kind = Faults { subject: format!("the kind {}", self.kind), found: &mut found };
        if self.armor_manifest != MANIFEST_VERSION {
            let version = self.armor_manifest;
            let problem = format!("its manifest is of version {version}, not {MANIFEST_VERSION}");
            of_kind.add("armor_manifest", problem, "build it with this version's SDK");
        }
        if !is_name(&self.kind) {
            of_kind.add("kind", format!("`{}` is not a name", self.kind), NAMES);
        }
        of_kind.check_line("summary", &self.summary);
        let ports = self.inputs.iter().chain(&self.outputs);
        // Inputs and outputs share their names: a file names both as `component.port`.
        check_names("port", ports.clone().map(|port| port.id.as_str()), &mut found);
        let parameters = self.parameters.iter().map(|parameter| parameter.name.as_str());
        check_names("parameter", parameters, &mut found);
        check_names(
            "event",
            self.listed_events().iter().map(|event| event.name.as_str()),
            &mut found,
        );
        for port in ports {
            check_port(port, &mut found);
        }
        self.check_ages(&mut found);
        self.check_groups(&mut found);
        self.check_effects(&mut found);
        self.check_frames(&mut found);
        found.extend(self.parameters.iter().flat_map(ParameterManifest::list_faults));
        found.extend(self.listed_events().iter().flat_map(EventManifest::list_faults));
        self.check_named_by(&mut found);
        if found.is_empty() { Ok(()) } else { Err(ManifestFaults(found)) }
    }
}

impl Manifest {
    fn check_ages(&self, found: &mut Vec<ManifestFault>) {
        let stated = |port: &&PortManifest| !port.stale_after.is_empty();
        for output in self.outputs.iter().filter(stated) {
            let subject = format!("the port {}", output.id);
            let mut faults = Faults { subject, found: &mut *found };
            let problem = "it is an output, and has an age from which on its data are missing";
            faults.add("stale_after", problem, "state that at the inputs");
        }
        for input in self.inputs.iter().filter(stated) {
            let subject = format!("the port {}", input.id);
            let mut faults = Faults { subject, found: &mut *found };
            let text = input.stale_after.as_str();
            let is_time = |unit: &str| {
                Unit::named(unit).is_some_and(|unit| unit.dimension == quantity::Dimension::Time)
            };
            let parameter = self.parameters.iter().find(|parameter| parameter.name == text);
            let is_age = match parameter {
                Some(parameter) => is_time(&parameter.unit),
                None => quantity::parse(text).is_ok_and(|age| {
                    age.si.is_finite()
                        && age.si > 0.0
                        && age.unit.is_some_and(|unit| unit.dimension == quantity::Dimension::Time)
                }),
            };
            if !is_age {
                let problem = format!("`{text}` is neither an age nor a parameter that is a time");
                faults.add("stale_after", problem, "write a time, such as 0.5s, or name one");
            }
        }
    }

    fn check_groups(&self, found: &mut Vec<ManifestFault>) {
        let is_known = |id: &String| {
            self.inputs.iter().any(|input| input.id == *id)
                || self.parameters.iter().any(|parameter| parameter.name == *id)
        };
        for id in self.needs_one_of.iter().flatten().filter(|id| !is_known(id)) {
            let subject = format!("the kind {}", self.kind);
            let problem = format!("it needs one of several, and `{id}` is no input or parameter");
            Faults { subject, found: &mut *found }.add("needs_one_of", problem, "name one");
        }
    }

    /// Of a value with an effect: a parameter of which it is a value, or that is a time, and an output.
    fn check_effects(&self, found: &mut Vec<ManifestFault>) {
        for effect in &self.value_effects {
            let subject = format!("the parameter {}", effect.parameter);
            let mut faults = Faults { subject, found: &mut *found };
            let named = self.parameters.iter().find(|it| it.name == effect.parameter);
            let Some(parameter) = named else {
                let problem = "its value has an effect, and there is no such parameter";
                faults.add("value_effects", problem, "name a parameter");
                continue;
            };
            let is_of_value = matches!(effect.effect, EffectKind::Idle | EffectKind::NeverDone);
            let is_time = Unit::named(&parameter.unit)
                .is_some_and(|unit| unit.dimension == quantity::Dimension::Time);
            let is_output = self.outputs.iter().any(|output| output.id == effect.output);
            if is_of_value && parameter.parse(&effect.value).is_err() {
                let problem = format!("`{}` has an effect, and is no value of it", effect.value);
                faults.add("value_effects", problem, "write a value that it may have");
            } else if !is_of_value && (!is_time || !effect.value.is_empty()) {
                let problem = "its value has an effect as a time, and it is none";
                faults.add(
                    "value_effects",
                    problem,
                    "name a parameter with a unit of time, and no value",
                );
            } else if (effect.effect == EffectKind::Paces) != is_output {
                let problem = format!("`{}` is not the output that it paces", effect.output);
                faults.add("value_effects", problem, "name an output with the effect paces alone");
            }
            let is_known = |name: &&String| self.parameters.iter().any(|it| it.name == **name);
            let is_delay = effect.effect == EffectKind::DelaysDone;
            if let Some(name) = effect.times.iter().find(|name| !is_delay || !is_known(name)) {
                let problem = format!("`{name}` is no parameter that multiplies its time");
                faults.add(
                    "value_effects",
                    problem,
                    "name parameters with the effect delays_done alone",
                );
            }
        }
    }

    /// Of a port with a frame: the port, and a parameter that names the frame.
    fn check_frames(&self, found: &mut Vec<ManifestFault>) {
        let is_port = |id: &str| self.inputs.iter().chain(&self.outputs).any(|it| it.id == id);
        for frame in &self.frames {
            let mut faults =
                Faults { subject: format!("the port {}", frame.port), found: &mut *found };
            if !is_port(&frame.port) {
                faults.add("frames", "it has a frame, and there is no such port", "name a port");
            }
            let named = self.parameters.iter().find(|it| it.name == frame.parameter);
            if named.is_none_or(|it| it.format != Some(TextFormat::Frame)) {
                let problem =
                    format!("`{}` does not name its frame: it is no such text", frame.parameter);
                faults.add("frames", problem, "name a parameter of the format frame");
            }
        }
    }

    fn check_named_by(&self, found: &mut Vec<ManifestFault>) {
        for event in self.listed_events().iter().filter(|event| !event.named_by.is_empty()) {
            let subject = format!("the event {}", event.name);
            let mut faults = Faults { subject, found: &mut *found };
            let name = event.named_by.as_str();
            let names_it = |parameter: &ParameterManifest| {
                parameter.name == name && parameter.kind == ParameterType::Text
            };
            if !self.parameters.iter().any(names_it) {
                let problem = format!("it is named by `{name}`, which is no text parameter");
                faults.add("named_by", problem, "declare that parameter, or name the event");
            }
        }
    }
}

const NAMES: &str = "a name has letters, digits, _ and -, and begins with a letter";

fn check_names<'a>(
    noun: &str,
    names: impl Iterator<Item = &'a str>,
    found: &mut Vec<ManifestFault>,
) {
    let mut seen = BTreeSet::new();
    let mut repeated = BTreeSet::new();
    for name in names {
        let mut faults = Faults { subject: format!("the {noun} {name}"), found: &mut *found };
        if !is_name(name) {
            faults.add("name", format!("`{name}` is not a name for a {noun}"), NAMES);
        }
        if !seen.insert(name) && repeated.insert(name) {
            faults.add("name", format!("the {noun} {name} occurs twice"), "rename one of them");
        }
    }
}

fn check_port(port: &PortManifest, found: &mut Vec<ManifestFault>) {
    let mut faults = Faults { subject: format!("the port {}", port.id), found };
    faults.check_line("doc", &port.doc);
    let schema = match schema::parse(&port.schema) {
        Ok(schema) => schema,
        Err(why) => {
            return faults.add("schema", format!("its schema: {why}"), "see docs/protocol.md");
        }
    };
    if let Schema::Struct { name, .. } | Schema::Enum { name, .. } = &schema
        && *name != port.type_name
    {
        let problem = format!("its type is {}, but its schema is that of {name}", port.type_name);
        faults.add("type", problem, format!("write {name} as its type"));
    }
    let hash = schema::hash_text(&port.schema);
    if hash != port.schema_hash {
        let given = port.schema_hash;
        let problem = format!("its schema_hash is {given:016x}, but {hash:016x} is its schema's");
        faults.add("schema_hash", problem, format!("write {hash:016x}"));
    }
    let mut units = BTreeSet::new();
    list_units(&schema, &mut units);
    for unit in units.into_iter().filter(|unit| Unit::named(unit).is_none()) {
        let problem = format!("a field of {} has the unknown unit `{unit}`", port.type_name);
        faults.add("schema", problem, quantity::explain_unknown(unit));
    }
}

/// The units of all fields of a type.
fn list_units<'a>(schema: &'a Schema, units: &mut BTreeSet<&'a str>) {
    let fields = match schema {
        Schema::Struct { fields, .. } => fields.iter().collect::<Vec<_>>(),
        Schema::Enum { variants, .. } => {
            variants.iter().flat_map(|variant| &variant.fields).collect()
        }
        Schema::List(item) | Schema::Option(item) | Schema::Fixed(item, _) => {
            return list_units(item, units);
        }
        _ => return,
    };
    for field in fields {
        units.extend(field.unit.as_deref());
        list_units(&field.schema, units);
    }
}

impl ParameterManifest {
    /// Everything that is wrong with it, apart from its name.
    pub fn list_faults(&self) -> Vec<ManifestFault> {
        let mut found = Vec::new();
        let subject = format!("the parameter {}", self.name);
        let mut faults = Faults { subject, found: &mut found };
        faults.check_line("doc", &self.doc);
        let is_number = self.kind == ParameterType::Number;
        let unit = self.unit.as_str();
        if !unit.is_empty() && !is_number {
            let problem = format!("it has the unit {unit}, but is no number");
            faults.add("unit", problem, "remove the unit, or declare it as a number");
        } else if !unit.is_empty() && Unit::named(unit).is_none() {
            let problem = format!("there is no unit called `{unit}`");
            faults.add("unit", problem, quantity::explain_unknown(unit));
        }
        if self.written && self.kind != ParameterType::Path {
            faults.add("written", "it is written to, but is no path", "declare it as a path");
        }
        if let Some(format) = self.format {
            let wanted =
                if format.is_of_path() { ParameterType::Path } else { ParameterType::Text };
            if self.kind != wanted {
                let problem = format!("it has the format {format}, but is no {wanted}");
                let remedy = format!("remove the format, or declare it as a {wanted}");
                faults.add("format", problem, remedy);
            }
        }
        let (minimum, maximum) = (self.minimum, self.maximum);
        let is_numeric = is_number || self.kind == ParameterType::Integer;
        if !is_numeric && (minimum.is_some() || maximum.is_some()) {
            faults.add("range", "it has a range, but is no number", "remove the range");
        }
        if let (Some(minimum), Some(maximum)) = (minimum, maximum)
            && minimum > maximum
        {
            let problem = format!("its range is empty: {minimum} to {maximum}");
            faults.add("range", problem, "write the smaller value first");
        }
        let is_choice = self.kind == ParameterType::Choice;
        if is_choice == self.choices.is_empty() {
            let problem =
                if is_choice { "it has no choices" } else { "it has choices, but is none" };
            faults.add("choices", problem, "give a choice its texts, and nothing else");
        }
        let choices = &self.choices;
        let twice = choices.iter().enumerate().find(|(n, one)| choices[..*n].contains(one));
        if let Some((_, choice)) = twice {
            faults.add("choices", format!("the choice `{choice}` occurs twice"), "remove one");
        }
        if let Some(why) = self.explain_default(faults.found) {
            let remedy = match self.range_with_unit() {
                range if range.is_empty() => "write it as a file would".into(),
                range => format!("write it as a file would, {range}"),
            };
            faults.add("default", format!("its default: {why}"), remedy);
        }
        found
    }
}

impl ParameterManifest {
    /// Why its default is wrong, as far as that does not follow from the other faults.
    fn explain_default(&self, others: &[ManifestFault]) -> Option<String> {
        let text = self.default.as_deref()?;
        let are_of = |members: &[&str]| others.iter().all(|it| members.contains(&it.member));
        if are_of(&["doc"]) {
            return self.parse(text).err();
        }
        // Without its unit the number is nevertheless one.
        if self.kind == ParameterType::Number && are_of(&["doc", "unit"]) {
            let error = quantity::parse(text).err();
            return error
                .filter(|e| matches!(e, QuantityError::NotANumber(_)))
                .map(|e| e.to_string());
        }
        None
    }
}

impl EventManifest {
    /// Everything that is wrong with it, apart from being a name.
    pub fn list_faults(&self) -> Vec<ManifestFault> {
        let mut found = Vec::new();
        let mut faults = Faults { subject: format!("the event {}", self.name), found: &mut found };
        faults.check_line("doc", &self.doc);
        if RESERVED_EVENTS.contains(&self.name.as_str()) {
            let problem = "`done` and `failed` are reports of their own";
            faults.add("name", problem, "return Outcome::Done or Outcome::Failed, or rename it");
        }
        let unit = self.unit.as_str();
        if !unit.is_empty() && Unit::named(unit).is_none() {
            let problem = format!("there is no unit called `{unit}`");
            faults.add("unit", problem, quantity::explain_unknown(unit));
        } else if !unit.is_empty() && self.value != Some(EventValue::Number) {
            let problem = format!("it has the unit {unit}, but its value is no number");
            faults.add("unit", problem, "remove the unit, or give it a number as its value");
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::{PortFrame, ValueEffect};

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
            many: false,
            latched: false,
            stale_after: String::new(),
        };
        let speed = ParameterManifest {
            name: "speed".into(),
            kind: ParameterType::Number,
            unit: "m/s".into(),
            default: Some("0.5".into()),
            minimum: Some(0.0),
            maximum: Some(1.0),
            choices: vec![],
            format: None,
            doc: "how fast".into(),
            live: true,
            written: false,
        };
        let lap = EventManifest {
            name: "lap".into(),
            doc: "a lap is over".into(),
            value: Some(EventValue::Number),
            unit: "s".into(),
            named_by: String::new(),
        };
        Manifest {
            armor_manifest: MANIFEST_VERSION,
            kind: "mapper".into(),
            summary: "Draws.".into(),
            controllable: true,
            reports_done: true,
            ends_by_itself: false,
            needs_rate: false,
            needs_one_of: Vec::new(),
            value_effects: Vec::new(),
            frames: Vec::new(),
            inputs: vec![port("scan")],
            outputs: vec![port("map")],
            parameters: vec![speed],
            events: Some(vec![lap]),
        }
    }

    fn effect(parameter: &str, effect: EffectKind, value: &str, output: &str) -> ValueEffect {
        let (parameter, value, output) = (parameter.into(), value.into(), output.into());
        ValueEffect { parameter, effect, value, output, times: Vec::new() }
    }

    /// Its only event.
    fn lap(manifest: &mut Manifest) -> &mut EventManifest {
        &mut manifest.events.as_mut().expect("events")[0]
    }

    fn set_schema(port: &mut PortManifest, schema: &str) {
        (port.schema, port.schema_hash) = (schema.into(), schema::hash_text(schema));
    }

    #[test]
    fn each_fault_is_named() {
        assert_eq!(manifest().validate(), Ok(()));
        let faults: [(&str, Fault); 37] = [
            ("version 2", |m| m.armor_manifest = 2),
            ("`9x` is not a name", |m| m.kind = "9x".into()),
            ("summary is not one line", |m| m.summary = "a\u{1b}[2J".into()),
            ("port map occurs twice", |m| m.inputs[0].id = "map".into()),
            ("`a b` is not a name", |m| m.inputs[0].id = "a b".into()),
            ("its schema", |m| m.inputs[0].schema = "Scan{".into()),
            ("that of Scan", |m| m.outputs[0].type_name = "Map".into()),
            ("schema_hash", |m| m.outputs[0].schema_hash = 1),
            ("the port map: a field of Scan has the unknown unit `furlong`", |m| {
                set_schema(&mut m.outputs[0], "Scan{hits:[Hit{at:f32(furlong)}]}");
            }),
            ("no unit called `knots`", |m| m.parameters[0].unit = "knots".into()),
            ("no number", |m| {
                m.parameters[0].kind = ParameterType::Text;
                (m.parameters[0].minimum, m.parameters[0].maximum) = (None, None);
            }),
            ("range is empty", |m| m.parameters[0].minimum = Some(2.0)),
            ("its default: `0.5` is out of range", |m| m.parameters[0].maximum = Some(0.1)),
            ("its default: `fast`", |m| m.parameters[0].default = Some("fast".into())),
            ("its default: `1.5s` is not in m/s", |m| {
                m.parameters[0].default = Some("1.5s".into());
            }),
            ("its default: `0.5` is not a whole number", |m| {
                let parameter = &mut m.parameters[0];
                (parameter.kind, parameter.unit) = (ParameterType::Integer, String::new());
            }),
            ("choices, but is none", |m| m.parameters[0].choices = vec!["a".into()]),
            ("no choices", |m| {
                let parameter = &mut m.parameters[0];
                (parameter.kind, parameter.unit) = (ParameterType::Choice, String::new());
                (parameter.minimum, parameter.maximum) = (None, None);
            }),
            ("`a` occurs twice", |m| {
                let parameter = &mut m.parameters[0];
                (parameter.kind, parameter.unit) = (ParameterType::Choice, String::new());
                (parameter.minimum, parameter.maximum) = (None, None);
                parameter.choices = vec!["a".into(), "a".into()];
            }),
            ("the port scan: `soon` is neither an age", |m| {
                m.inputs[0].stale_after = "soon".into();
            }),
            ("the port scan: `speed` is neither an age", |m| {
                m.inputs[0].stale_after = "speed".into();
            }),
            ("`sound` is no input or parameter", |m| {
                m.needs_one_of = vec![vec!["scan".into(), "sound".into()]];
            }),
            ("`1kg` has an effect, and is no value of it", |m| {
                m.value_effects = vec![effect("speed", EffectKind::Idle, "1kg", "")];
            }),
            ("its value has an effect, and there is no such parameter", |m| {
                m.value_effects = vec![effect("sped", EffectKind::Idle, "0m/s", "")];
            }),
            ("its value has an effect as a time, and it is none", |m| {
                m.value_effects = vec![effect("speed", EffectKind::DelaysDone, "", "")];
            }),
            ("`rounds` is no parameter that multiplies its time", |m| {
                let mut idle = effect("speed", EffectKind::Idle, "0m/s", "");
                idle.times = vec!["rounds".into()];
                m.value_effects = vec![idle];
            }),
            ("the port map: it is an output", |m| m.outputs[0].stale_after = "1s".into()),
            ("it has a frame, and there is no such port", |m| {
                let (name, default) = ("mount".into(), Some("laser".into()));
                let (kind, format) = (ParameterType::Text, Some(TextFormat::Frame));
                let (unit, minimum, maximum) = (String::new(), None, None);
                let speed = m.parameters[0].clone();
                m.parameters.push(ParameterManifest {
                    name,
                    default,
                    kind,
                    format,
                    unit,
                    minimum,
                    maximum,
                    ..speed
                });
                m.frames = vec![PortFrame { port: "sound".into(), parameter: "mount".into() }];
            }),
            ("`speed` does not name its frame", |m| {
                m.frames = vec![PortFrame { port: "scan".into(), parameter: "speed".into() }];
            }),
            ("it has the format points, but is no text", |m| {
                m.parameters[0].format = Some(TextFormat::Points);
            }),
            ("its default: point 1, `0.5`, is not x,y", |m| {
                let parameter = &mut m.parameters[0];
                (parameter.kind, parameter.unit) = (ParameterType::Text, String::new());
                (parameter.minimum, parameter.maximum) = (None, None);
                parameter.format = Some(TextFormat::Points);
            }),
            ("occurs twice", |m| m.parameters.push(m.parameters[0].clone())),
            ("the event lap occurs twice", |m| {
                let lap = lap(m).clone();
                m.events.get_or_insert_default().push(lap);
            }),
            ("the event done: `done` and `failed`", |m| lap(m).name = "done".into()),
            ("the event lap: there is no unit called `knots`", |m| {
                lap(m).unit = "knots".into();
            }),
            ("named by `speed`, which is no text", |m| lap(m).named_by = "speed".into()),
            ("the event lap: it has the unit s", |m| lap(m).value = None),
        ];
        for (expected, fault) in faults {
            let mut manifest = manifest();
            fault(&mut manifest);
            let why = manifest.validate().expect_err(expected);
            assert!(why.to_string().contains(expected), "{why} instead of {expected}");
            assert_eq!(why.0.len(), 1, "{why}");
            assert!(!why.0[0].remedy.is_empty(), "{why}");
        }
    }

    #[test]
    fn all_faults_are_found_together() {
        let mut manifest = manifest();
        manifest.kind = "9x".into();
        manifest.inputs[0].schema_hash = 1;
        manifest.parameters[0].unit = "knots".into();
        lap(&mut manifest).name = "failed".into();
        let faults = manifest.validate().expect_err("four faults");
        let members: Vec<_> = faults.0.iter().map(|fault| fault.member).collect();
        assert_eq!(members, ["kind", "schema_hash", "unit", "name"]);
    }
}
