//! A parameter of a kind of component, and its values: texts of the file, read by the declared type.

#[cfg(test)]
pub(super) mod tests;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::quantity::{self, Dimension, Unit};
use crate::text_format::TextFormat;

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
        deserialize_with = "super::deserialize_given"
    )]
    pub default: Option<String>,
    /// Smallest value, in SI; of a ratio in its unit.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "super::deserialize_given"
    )]
    pub minimum: Option<f64>,
    /// Largest value, in SI; of a ratio in its unit.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "super::deserialize_given"
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
        deserialize_with = "super::deserialize_given"
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
