//! What `<executable> --describe` prints: the ports, parameters and events of a kind of component.

mod parameter;
#[cfg(test)]
mod tests;
mod validate;

pub use parameter::{ParameterManifest, ParameterType, ParameterValue};
pub use validate::{ManifestFault, ManifestFaults, RESERVED_EVENTS};

use std::collections::BTreeSet;

use serde::{Deserialize, Deserializer, Serialize};

use crate::quantity;
use crate::schema::ANY_SCHEMA;

/// Version of the JSON form.
pub const MANIFEST_VERSION: u32 = 1;

/// The description of a kind of component, as the rest of the system uses it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this JSON form, [`MANIFEST_VERSION`].
    pub armor_manifest: u32,
    /// The kind, as the file names it.
    pub kind: String,
    /// What the component does, in one line.
    pub summary: String,
    /// What it takes.
    pub inputs: Vec<PortManifest>,
    /// What it publishes.
    pub outputs: Vec<PortManifest>,
    /// What can be set in the file.
    pub parameters: Vec<ParameterManifest>,
    /// The events that it reports, and no others. Left out by a component that does not list them: it
    /// may report any.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub events: Option<Vec<EventManifest>>,
    /// Whether it may report that it is done. Left out where it is true, as for most.
    #[serde(default = "true_by_default", skip_serializing_if = "Clone::clone")]
    pub reports_done: bool,
    /// Whether its task comes to an end by itself, so that a place in which it works and nothing waits for
    /// its `done` is probably a mistake. Left out where it is false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ends_by_itself: bool,
    /// Whether it works at its rate, so that it does nothing without one. Left out where it is false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub needs_rate: bool,
    /// Groups of inputs and parameters: of each, one must be fed or given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs_one_of: Vec<Vec<String>>,
    /// Values of its parameters that decide whether, and when, it does what it is for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub value_effects: Vec<ValueEffect>,
    /// The ports whose data are taken in a frame that the file places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<PortFrame>,
    /// Whether a mission may activate and freeze it. Left out where it is true, as almost always.
    #[serde(default = "true_by_default", skip_serializing_if = "Clone::clone")]
    pub controllable: bool,
    /// Whether it reads data of the system to which no link leads, as a recorder does. Left out where it
    /// is false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reads_all: bool,
    /// The version of the protocol that it speaks, [`VERSION`](crate::version::VERSION) of its build. Left
    /// out: unknown.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub protocol: Option<u16>,
}

/// The frame of a port: a file that links the port must place it on the robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PortFrame {
    /// The input or output.
    pub port: String,
    /// The parameter that names the frame, of the format `frame`.
    pub parameter: String,
}

fn true_by_default() -> bool {
    true
}

/// The effect of a parameter's value that its range allows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValueEffect {
    /// The parameter.
    pub parameter: String,
    /// What the value causes.
    pub effect: EffectKind,
    /// The value, written as in a file; empty where every value has the effect.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub value: String,
    /// The output that is concerned, if one is.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub output: String,
    /// Of a delay: the parameters by whose number, or number of entries, the time is multiplied.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub times: Vec<String>,
}

/// What a parameter's value causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectKind {
    /// With this value the component does nothing.
    Idle,
    /// With this value it is never done.
    NeverDone,
    /// It is done after this time at the earliest.
    DelaysDone,
    /// The output is sent after this time, each time.
    Paces,
    /// It gives up a part of its task after this time.
    GivesUp,
}

/// An input or an output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PortManifest {
    /// Local name of the port.
    pub id: String,
    /// Name of the message type.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Canonical text of the message type's schema.
    pub schema: String,
    /// Hash of the schema, as 16 hexadecimal digits.
    #[serde(with = "hex")]
    pub schema_hash: u64,
    /// What it carries, in one line; may be empty.
    #[serde(default)]
    pub doc: String,
    /// For an input: whether it must be fed.
    #[serde(default)]
    pub required: bool,
    /// For an input: whether any number of links may feed it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub many: bool,
    /// For an output: whether a late subscriber gets the last value immediately.
    #[serde(default)]
    pub latched: bool,
    /// For an input: the age from which on the component takes its data for missing, such as `0.5s`,
    /// or the name of the parameter that states it. Empty if their age does not matter.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub stale_after: String,
}

impl PortManifest {
    /// Whether it has no type of its own: an input takes messages of any type, and an output has the
    /// type of what feeds the input of this sort.
    pub fn is_any(&self) -> bool {
        self.schema == ANY_SCHEMA
    }
}

/// The type of an event's value. On the wire both are `f64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EventValue {
    /// A number, with a unit if the event has one.
    Number,
    /// A whole number.
    Integer,
}

/// An event that a mission may wait for as `component.event`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EventManifest {
    /// Its name.
    pub name: String,
    /// When it is reported, in one line; may be empty.
    #[serde(default)]
    pub doc: String,
    /// The type of its value; none if the value has no meaning.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub value: Option<EventValue>,
    /// The unit of a number, such as `m/s`; empty without.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// The text parameter whose words are the names of such events, for a component whose events the
    /// file names; empty for an event with a name of its own.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub named_by: String,
}

impl Manifest {
    /// Returns the age in seconds from which on the component takes data of the input for missing,
    /// where `value_of` returns the value that the file assigns to a parameter; none if age does not
    /// matter.
    pub fn stale_after_s<'a>(
        &'a self,
        input: &'a PortManifest,
        value_of: impl Fn(&str) -> Option<&'a str>,
    ) -> Option<f64> {
        let stated = input.stale_after.as_str();
        let parameter = self.parameters.iter().find(|parameter| parameter.name == stated);
        let age = match parameter {
            Some(parameter) => {
                let text = value_of(stated).or(parameter.default.as_deref())?;
                match parameter.parse(text).ok()? {
                    ParameterValue::Number(number) => number,
                    _ => return None,
                }
            }
            None => quantity::parse(stated).ok()?.si,
        };
        (age.is_finite() && age > 0.0).then_some(age)
    }

    /// Returns the reports that it may send in addition to its events.
    pub fn common_reports(&self) -> &'static [&'static str] {
        if self.reports_done { &RESERVED_EVENTS } else { &RESERVED_EVENTS[1..] }
    }

    /// The events that it lists; none if it does not list them.
    pub fn listed_events(&self) -> &[EventManifest] {
        self.events.as_deref().unwrap_or_default()
    }

    /// The names of its events, where `value_of` returns the value that the file assigns to a
    /// parameter. [`Self::common_reports`] are not among them.
    pub fn event_names<'a>(
        &'a self,
        value_of: impl Fn(&str) -> Option<&'a str>,
    ) -> BTreeSet<&'a str> {
        let default = |name: &str| {
            let parameter = self.parameters.iter().find(|parameter| parameter.name == name);
            parameter.and_then(|parameter| parameter.default.as_deref())
        };
        let mut names = BTreeSet::new();
        for event in self.listed_events() {
            if event.named_by.is_empty() {
                names.insert(event.name.as_str());
            } else {
                let words = value_of(&event.named_by).or_else(|| default(&event.named_by));
                names.extend(words.unwrap_or_default().split_whitespace());
            }
        }
        names
    }
}

/// Deserializes a member that may be absent but not `null`.
fn deserialize_given<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

mod hex {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(hash: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&format!("{hash:016x}"))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        let text = String::deserialize(deserializer)?;
        if text.len() != 16 || !text.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Err(D::Error::custom("a schema_hash has 16 hexadecimal digits"));
        }
        u64::from_str_radix(&text, 16).map_err(D::Error::custom)
    }
}
