//! Parameters as a component declares them, and their values as it receives them.

use std::path::{Path, PathBuf};

use armor_wire::manifest::{ParameterManifest, ParameterType, ParameterValue};
use armor_wire::text_format::TextFormat;
use thiserror::Error;

/// A parameter of a component: a `const` with its type, unit, default, range and meaning.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    name: &'static str,
    kind: ParameterType,
    unit: &'static str,
    default: Option<&'static str>,
    range: Option<(f64, f64)>,
    choices: &'static [&'static str],
    format: Option<TextFormat>,
    doc: &'static str,
    live: bool,
    written: bool,
}

impl Parameter {
    const fn new(name: &'static str, kind: ParameterType) -> Self {
        Self {
            name,
            kind,
            unit: "",
            default: None,
            range: None,
            choices: &[],
            format: None,
            doc: "",
            live: false,
            written: false,
        }
    }

    /// A number; the file may give it in any unit of the same dimension, the component gets SI.
    pub const fn number(name: &'static str, unit: &'static str) -> Self {
        let mut parameter = Self::new(name, ParameterType::Number);
        parameter.unit = unit;
        parameter
    }

    /// A whole number.
    pub const fn integer(name: &'static str) -> Self {
        Self::new(name, ParameterType::Integer)
    }

    /// Any text.
    pub const fn text(name: &'static str) -> Self {
        Self::new(name, ParameterType::Text)
    }

    /// One of the given texts.
    pub const fn choice(name: &'static str, choices: &'static [&'static str]) -> Self {
        let mut parameter = Self::new(name, ParameterType::Choice);
        parameter.choices = choices;
        parameter
    }

    /// A file or folder; a relative one is relative to the file that assigns it.
    pub const fn path(name: &'static str) -> Self {
        Self::new(name, ParameterType::Path)
    }

    /// `true` or `false`.
    pub const fn flag(name: &'static str) -> Self {
        Self::new(name, ParameterType::Flag)
    }

    /// A colour, `#rrggbb`.
    pub const fn colour(name: &'static str) -> Self {
        Self::new(name, ParameterType::Colour)
    }

    /// Its value if the file does not assign one, written as in the file.
    #[must_use]
    pub const fn default(mut self, text: &'static str) -> Self {
        self.default = Some(text);
        self
    }

    /// Its smallest and largest value, in SI; of a ratio in its unit.
    #[must_use]
    pub const fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// The form of a text, which the check of a file knows too. The functions of
    /// [`armor_wire::text_format`] read it.
    #[must_use]
    pub const fn format(mut self, format: TextFormat) -> Self {
        self.format = Some(format);
        self
    }

    /// What it does, in one line.
    #[must_use]
    pub const fn doc(mut self, doc: &'static str) -> Self {
        self.doc = doc;
        self
    }

    /// A change in the file reaches the running component through `parameter_received`.
    #[must_use]
    pub const fn live(mut self) -> Self {
        self.live = true;
        self
    }

    /// Of a path: the component writes there. A relative one is in the run's folder (`ARMOR_OUT`),
    /// and `armor param set` cannot lead it out of that folder.
    #[must_use]
    pub const fn written(mut self) -> Self {
        self.written = true;
        self
    }

    /// Returns its name.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// Returns the default as a value, or why its text is none; `None` if there is no default.
    pub(crate) fn default_value(&self) -> Option<Result<Value, String>> {
        let parsed = self.manifest().parse(self.default?);
        Some(parsed.map(|value| Value::new(value, Path::new(""))))
    }

    /// Its entry in the manifest.
    pub fn manifest(&self) -> ParameterManifest {
        ParameterManifest {
            name: self.name.into(),
            kind: self.kind,
            unit: self.unit.into(),
            default: self.default.map(Into::into),
            minimum: self.range.map(|(low, _)| low),
            maximum: self.range.map(|(_, high)| high),
            choices: self.choices.iter().map(|choice| (*choice).into()).collect(),
            format: self.format,
            doc: self.doc.into(),
            live: self.live,
            written: self.written,
        }
    }
}

/// A parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    value: ParameterValue,
    base: PathBuf,
}

/// The value is of another type than asked for.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the value {value:?} is not {wanted}; is the parameter declared with that type?")]
pub struct ValueError {
    value: ParameterValue,
    wanted: &'static str,
}

impl Value {
    /// A value; a relative path in it is relative to `base`.
    pub fn new(value: ParameterValue, base: &Path) -> Self {
        Self { value, base: base.into() }
    }

    fn type_error(&self, wanted: &'static str) -> ValueError {
        ValueError { value: self.value.clone(), wanted }
    }

    /// A number in SI; of a ratio in its unit.
    ///
    /// # Errors
    /// If the parameter is not a number.
    pub fn number(&self) -> Result<f64, ValueError> {
        match self.value {
            ParameterValue::Number(number) => Ok(number),
            ParameterValue::Integer(number) => Ok(number as f64),
            _ => Err(self.type_error("a number")),
        }
    }

    /// A whole number.
    ///
    /// # Errors
    /// If the parameter is not an integer.
    pub fn integer(&self) -> Result<i64, ValueError> {
        match self.value {
            ParameterValue::Integer(number) => Ok(number),
            _ => Err(self.type_error("a whole number")),
        }
    }

    /// Yes or no.
    ///
    /// # Errors
    /// If the parameter is not a flag.
    pub fn flag(&self) -> Result<bool, ValueError> {
        match self.value {
            ParameterValue::Flag(flag) => Ok(flag),
            _ => Err(self.type_error("a flag")),
        }
    }

    /// Text, a choice or a colour, as written in the file.
    ///
    /// # Errors
    /// If the parameter is a number or a flag.
    pub fn text(&self) -> Result<&str, ValueError> {
        match &self.value {
            ParameterValue::Text(text) => Ok(text),
            _ => Err(self.type_error("text")),
        }
    }

    /// A path, resolved against the folder of the file that assigned it, or against the run's
    /// folder if the component writes there ([`Parameter::written`]).
    ///
    /// # Errors
    /// If the parameter is a number or a flag.
    pub fn path(&self) -> Result<PathBuf, ValueError> {
        self.text().map(|text| self.base.join(text))
    }
}
