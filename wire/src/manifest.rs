//! What `<executable> --describe` prints: the ports, parameters and events of a kind of component.

#[cfg(test)]
mod tests;
mod validate;

pub use validate::{ManifestFault, ManifestFaults, RESERVED_EVENTS};

use std::collections::BTreeSet;
use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::quantity::{self, Dimension, Unit};
use crate::schema::ANY_SCHEMA;
use crate::text_format::TextFormat;

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

/// The type of a parameter's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ParameterType {
    /// A number, with a unit if the parameter has one.
    Number,
    /// A whole number.
    Integer,
    /// Any text.
    Text,
    /// One of the listed choices.
    Choice,
    /// A file or folder; relative to the file that assigns it.
    Path,
    /// `true` or `false`.
    Flag,
    /// `#rrggbb`.
    Colour,
}

impl ParameterType {
    /// All types.
    pub const ALL: [Self; 7] = [
        Self::Number,
        Self::Integer,
        Self::Text,
        Self::Choice,
        Self::Path,
        Self::Flag,
        Self::Colour,
    ];
}

impl fmt::Display for ParameterType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Number => "number",
            Self::Integer => "integer",
            Self::Text => "text",
            Self::Choice => "choice",
            Self::Path => "path",
            Self::Flag => "flag",
            Self::Colour => "colour",
        })
    }
}

/// A parameter of a kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterManifest {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub kind: ParameterType,
    /// The unit its number is given to the component in, such as `m/s`; empty without.
    #[serde(default)]
    pub unit: String,
    /// What it is when the file does not assign it; without one it must be assigned.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub default: Option<String>,
    /// Smallest value, in SI; of a ratio in its unit.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub minimum: Option<f64>,
    /// Largest value, in SI; of a ratio in its unit.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub maximum: Option<f64>,
    /// The choices of a [`ParameterType::Choice`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<String>,
    /// The form of a [`ParameterType::Text`], or to what a [`ParameterType::Path`] leads; any if there
    /// is none.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_given"
    )]
    pub format: Option<TextFormat>,
    /// What it does, in one line; may be empty.
    #[serde(default)]
    pub doc: String,
    /// Whether a change reaches the running component.
    #[serde(default)]
    pub live: bool,
    /// Of a path: whether the component writes there. A relative one is then in the run's folder,
    /// and only the file or `--set` may name a place outside it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub written: bool,
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

/// A parameter's value, of its declared type.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// In SI; of a ratio in its unit.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// Text, a choice, a colour, or a path as written.
    Text(String),
    /// Yes or no.
    Flag(bool),
}

impl ParameterManifest {
    /// Reads `text` as a value of this parameter.
    ///
    /// # Errors
    /// What is wrong with the text and what would be right, in words.
    pub fn parse(&self, text: &str) -> Result<ParameterValue, String> {
        match self.kind {
            ParameterType::Number => self.parse_number(text).map(ParameterValue::Number),
            ParameterType::Integer => self.parse_integer(text).map(ParameterValue::Integer),
            ParameterType::Flag => match text {
                "true" => Ok(ParameterValue::Flag(true)),
                "false" => Ok(ParameterValue::Flag(false)),
                _ => Err(format!("`{text}` is neither true nor false")),
            },
            ParameterType::Choice if !self.choices.iter().any(|choice| choice == text) => {
                Err(format!("`{text}` is none of {}", self.choices.join(", ")))
            }
            ParameterType::Colour if !is_colour(text) => {
                Err(format!("`{text}` is not a colour; write it as #rrggbb"))
            }
            ParameterType::Path if text.is_empty() && self.default.as_deref() != Some("") => {
                Err("a path is expected".into())
            }
            ParameterType::Text if !text.is_empty() || self.default.as_deref() != Some("") => {
                let checked = self.format.map_or(Ok(()), |format| format.check_text(text));
                checked.map(|()| ParameterValue::Text(text.into())).map_err(|why| why.to_string())
            }
            _ => Ok(ParameterValue::Text(text.into())),
        }
    }

    /// The form of its text for tables, such as `points, such as 4,1 9.5,-3`; empty without one.
    pub fn form(&self) -> String {
        self.format.map(|form| format!("{form}, such as {}", form.example())).unwrap_or_default()
    }

    /// The range in the parameter's own unit, such as `0.1 to 500`; empty if there is none.
    pub fn range(&self) -> String {
        self.range_in("", self.minimum, self.maximum)
    }

    /// The same for tables, without the ends of an integer type of 32 bits, which no author chose.
    pub fn intended_range(&self) -> String {
        let (minimum, maximum) = self.intended_ends();
        self.range_in("", minimum, maximum)
    }

    /// The intended range as a file's author writes such values: `0.1m to 500m`; empty if there is
    /// none.
    pub fn range_with_unit(&self) -> String {
        let (minimum, maximum) = self.intended_ends();
        self.range_in(&self.unit, minimum, maximum)
    }

    fn intended_ends(&self) -> (Option<f64>, Option<f64>) {
        let is_intended = |end: &f64| {
            let ends = [f64::from(u32::MAX), f64::from(i32::MIN), f64::from(i32::MAX)];
            self.kind != ParameterType::Integer || !ends.contains(end)
        };
        (self.minimum.filter(is_intended), self.maximum.filter(is_intended))
    }

    /// Returns the default with its unit, as a file's author writes it: `30deg`, also where the
    /// component declares `30`.
    pub fn default_with_unit(&self) -> Option<String> {
        self.default.as_ref().map(|text| match quantity::parse(text) {
            Ok(quantity) if quantity.unit.is_none() => format!("{text}{}", self.unit),
            _ => text.clone(),
        })
    }

    fn range_in(&self, unit: &str, minimum: Option<f64>, maximum: Option<f64>) -> String {
        let size = Unit::named(&self.unit).map_or(1.0, Unit::received_size);
        let own = |received: f64| {
            let number = format!("{:.4}", received / size);
            format!("{}{unit}", number.trim_end_matches('0').trim_end_matches('.'))
        };
        match (minimum.map(own), maximum.map(own)) {
            (Some(low), Some(high)) => format!("{low} to {high}"),
            (Some(low), None) => format!("{low} or more"),
            (None, Some(high)) => format!("{high} or less"),
            (None, None) => String::new(),
        }
    }

    fn parse_number(&self, text: &str) -> Result<f64, String> {
        let own = Unit::named(&self.unit);
        let quantity = quantity::parse(text)
            .map_err(|error| error.explain_for(own.map(|unit| unit.dimension)))?;
        if let Some(given) = quantity.unit {
            let wanted = own.ok_or_else(|| {
                let remedy = match given.dimension {
                    Dimension::Ratio => format!("; write {}", quantity.si),
                    _ => String::new(),
                };
                format!("`{text}` has a unit, but this parameter has none{remedy}")
            })?;
            if given.dimension != wanted.dimension {
                let meant = match (given.name, wanted.dimension) {
                    ("m", Dimension::Time) => {
                        let times =
                            ["min", "s", "ms"].map(|unit| format!("{}{unit}", quantity.number));
                        let is_possible = |time: &String| self.parse_number(time).is_ok();
                        let times: Vec<_> = times.into_iter().filter(is_possible).collect();
                        match times.is_empty() {
                            true => ": m is metres".to_owned(),
                            false => {
                                format!(": m is metres; did you mean {}?", times.join(" or "))
                            }
                        }
                    }
                    _ => String::new(),
                };
                return Err(format!("`{text}` is not in {} or a multiple of it{meant}", self.unit));
            }
        }
        let received = match (own, quantity.unit) {
            (None, _) => quantity.si,
            // A bare number is in the parameter's own unit.
            (Some(own), None) => quantity.number * own.received_size(),
            (Some(own), Some(given)) if own == given => quantity.number * own.received_size(),
            (Some(own), Some(_)) => quantity.si / (own.to_si / own.received_size()),
        };
        self.in_range(received, text)
    }

    fn parse_integer(&self, text: &str) -> Result<i64, String> {
        let number: i64 = text.parse().map_err(|_| format!("`{text}` is not a whole number"))?;
        self.in_range(number as f64, text)?;
        Ok(number)
    }

    fn in_range(&self, received: f64, text: &str) -> Result<f64, String> {
        let (low, high) =
            (self.minimum.unwrap_or(f64::NEG_INFINITY), self.maximum.unwrap_or(f64::INFINITY));
        if received.is_finite() && (low..=high).contains(&received) {
            Ok(received)
        } else {
            Err(format!("`{text}` is out of range, {} {}", self.range(), self.unit)
                .trim_end()
                .into())
        }
    }
}

fn is_colour(text: &str) -> bool {
    text.len() == 7 && text.starts_with('#') && text[1..].bytes().all(|b| b.is_ascii_hexdigit())
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
