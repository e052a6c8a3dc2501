//! Checks what the JSON form of a manifest cannot express: for the SDK, which prints manifests, and
//! for the launcher, which reads those of others. The derives check parameters by the same function.

mod frames;

use std::collections::BTreeSet;
use std::fmt;

use super::{
    EffectKind, EventManifest, EventValue, MANIFEST_VERSION, Manifest, ParameterManifest,
    ParameterType, PortManifest,
};
use crate::name::is_name;
use crate::quantity::{self, QuantityError, Unit};
use crate::schema::{self, ANY_NAME, Schema};
use crate::version::VERSION;

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
        if let Some(protocol) = self.protocol
            && protocol != VERSION
        {
            let problem = format!("it speaks version {protocol} of the protocol, not {VERSION}");
            of_kind.add("protocol", problem, "build it with the SDK of this release");
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
        self.check_any(&mut found);
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
    /// An output of any type has the type of the input of any type, so there must be one.
    fn check_any(&self, found: &mut Vec<ManifestFault>) {
        let inputs = self.inputs.iter().filter(|input| input.is_any()).count();
        for output in self.outputs.iter().filter(|output| output.is_any() && inputs != 1) {
            let subject = format!("the port {}", output.id);
            let problem = format!(
                "it has the type of the input of type {ANY_NAME}, and the kind has {inputs} of them"
            );
            let remedy = format!("declare exactly one input of type {ANY_NAME}");
            Faults { subject, found: &mut *found }.add("schema", problem, remedy);
        }
    }

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
mod tests;
