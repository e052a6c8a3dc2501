//! The parameters of a component as the fields of a struct, of which `#[derive(Parameters)]` writes
//! the table, the requests and the setter.

use std::path::PathBuf;

use armor_wire::text_format::{self, FixedFrame, TextFormatError};
use thiserror::Error;

use crate::armor::Armor;
use crate::call::Fault;
use crate::parameter::{Parameter, Value};

/// The parameters of a component, each a field; derived. The attributes are in the README of
/// `sdk/derive`.
///
/// ```
/// use armor_sdk::prelude::*;
///
/// #[derive(Parameters)]
/// struct BlinkerParameters {
///     /// time between two changes
///     #[parameter(unit = "s", default = "1s", range = 0.1..=60.0)]
///     period_s: f64,
///     /// which lamp
///     #[parameter(default = "red", choices("red" = 0, "green" = 1))]
///     lamp: usize,
/// }
///
/// struct Blinker {
///     parameters: BlinkerParameters,
/// }
///
/// impl Component for Blinker {
///     const KIND: &'static str = "blinker";
///     const SUMMARY: &'static str = "Blinks.";
///     const PARAMETERS: &'static [Parameter] = BlinkerParameters::DECLARED;
///
///     fn new(armor: Armor) -> Result<Self, Fault> {
///         let parameters = BlinkerParameters::request(&armor)?;
///         Ok(Self { parameters })
///     }
///
///     fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
///         Ok(self.parameters.set(name, value)?)
///     }
/// }
/// # armor_sdk::manifest_of::<Blinker>().unwrap();
/// ```
pub trait Parameters: Sized {
    /// The table for [`Component::PARAMETERS`](crate::Component::PARAMETERS), in the order of the
    /// fields.
    const DECLARED: &'static [Parameter];

    /// Returns every parameter at its declared default; one without a default at its type's.
    fn defaults() -> Self;

    /// Sets the parameter `name` to a received value.
    ///
    /// # Errors
    /// [`ParameterError`] if there is no such parameter, or the value does not fit its field.
    fn set(&mut self, name: &str, value: &Value) -> Result<(), ParameterError>;

    /// Asks for every parameter, waits for the answers, and returns the values. Each value goes to
    /// `parameter_received` too, before the first call of the component. For `--describe` all values
    /// are the defaults.
    ///
    /// # Errors
    /// As of [`Armor::synchronize`]. A value that does not fit its field is no error here: the field
    /// has its default, and `parameter_received` gets the value.
    fn request(armor: &Armor) -> Result<Self, Fault> {
        for parameter in Self::DECLARED {
            armor.get_parameter(parameter.name())?;
        }
        armor.synchronize()?;
        let mut parameters = Self::defaults();
        for name in Self::DECLARED.iter().map(Parameter::name) {
            if let Some(value) = armor.participant.parameters.find_arrived(name) {
                // Refused again, and reported, in `parameter_received`.
                let _ = parameters.set(name, &value);
            }
        }
        Ok(parameters)
    }
}

/// Why a parameter was not set.
#[derive(Debug, Error)]
pub enum ParameterError {
    /// The struct has no such parameter.
    #[error("there is no parameter `{0}`")]
    Unknown(String),
    /// The value does not fit the field.
    #[error("parameter `{name}`: {cause}")]
    Value {
        /// The parameter.
        name: String,
        /// Why it does not fit.
        cause: Fault,
    },
}

/// A type that a parameter's value can be read as.
pub trait FromValue: Sized {
    /// Reads the value.
    ///
    /// # Errors
    /// If the parameter is of another type, or the value is out of this type's range.
    fn from_value(value: &Value) -> Result<Self, Fault>;
}

impl FromValue for f64 {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        Ok(value.number()?)
    }
}

impl FromValue for f32 {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        Ok(value.number()? as Self)
    }
}

impl FromValue for bool {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        Ok(value.flag()?)
    }
}

impl FromValue for String {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        Ok(value.text()?.into())
    }
}

impl FromValue for PathBuf {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        Ok(value.path()?)
    }
}

/// A text with the format `points`; empty text has none.
impl FromValue for Vec<[f64; 2]> {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        read_list(value, text_format::parse_points)
    }
}

/// A text with the format `numbers`; empty text has none.
impl FromValue for Vec<f64> {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        read_list(value, text_format::parse_numbers)
    }
}

/// A text with the format `names`; empty text has none.
impl FromValue for Vec<String> {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        read_list(value, text_format::parse_names)
    }
}

/// A text with the format `frames`: the `<frame>`s of the file; empty text has none.
impl FromValue for Vec<FixedFrame> {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        read_list(value, text_format::parse_frames)
    }
}

fn read_list<T>(
    value: &Value,
    parse: fn(&str) -> Result<Vec<T>, TextFormatError>,
) -> Result<Vec<T>, Fault> {
    let text = value.text()?;
    // The declaration decides whether the empty text is a value.
    if text.is_empty() { Ok(Vec::new()) } else { Ok(parse(text)?) }
}

/// Empty text is `None`.
impl<T: FromValue> FromValue for Option<T> {
    fn from_value(value: &Value) -> Result<Self, Fault> {
        if value.text()?.is_empty() { Ok(None) } else { T::from_value(value).map(Some) }
    }
}

macro_rules! from_whole_number {
    ($($integer:ty),*) => {$(
        impl FromValue for $integer {
            fn from_value(value: &Value) -> Result<Self, Fault> {
                let number = value.integer()?;
                Self::try_from(number).map_err(|_| {
                    let (low, high) = (Self::MIN, Self::MAX);
                    let name = stringify!($integer);
                    format!("`{number}` is out of range for {name}, {low} to {high}").into()
                })
            }
        }
    )*};
}
from_whole_number!(i8, i16, i32, i64, isize, u8, u16, u32, u64, usize);

/// Assigns a value to a field, for derived code.
#[doc(hidden)]
pub fn assign_value<T: FromValue>(field: &mut T, value: &Value) -> Result<(), Fault> {
    *field = T::from_value(value)?;
    Ok(())
}

/// Assigns what a choice's text stands for, for derived code.
#[doc(hidden)]
pub fn assign_choice<T, const N: usize>(
    field: &mut T,
    value: &Value,
    choices: [(&str, T); N],
) -> Result<(), Fault> {
    let text = value.text()?;
    let found = choices.into_iter().find(|(choice, _)| *choice == text);
    *field = found.ok_or_else(|| format!("`{text}` is none of its choices"))?.1;
    Ok(())
}

/// Assigns what a function reads from a text, for derived code.
#[doc(hidden)]
pub fn assign_parsed<T, E: Into<Fault>>(
    field: &mut T,
    value: &Value,
    parse: impl FnOnce(&str) -> Result<T, E>,
) -> Result<(), Fault> {
    *field = parse(value.text()?).map_err(Into::into)?;
    Ok(())
}

/// Assigns each declared default, for derived code. A default that is malformed leaves its field as
/// it is: the manifest with that declaration is refused, with the reason.
#[doc(hidden)]
pub fn assign_defaults<P: Parameters>(parameters: &mut P) {
    for parameter in P::DECLARED {
        if let Some(Ok(value)) = parameter.default_value() {
            let _ = parameters.set(parameter.name(), &value);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use armor_sdk_derive::Parameters;
    use armor_wire::manifest::ParameterValue;

    use super::*;

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Side {
        Left,
        Right,
    }

    fn parse_pair(text: &str) -> Result<(u32, u32), Fault> {
        let (first, second) = text.split_once('-').ok_or("no `-`")?;
        Ok((first.parse()?, second.parse()?))
    }

    #[derive(Debug, PartialEq, Parameters)]
    struct Everything {
        /// how far
        #[parameter(unit = "cm", default = "20cm", range = 0.1..=5.0)]
        reach_m: f64,
        #[parameter(default = 0.5)]
        share: f32,
        #[parameter(default = 3, range = 1.0..=300.0, live)]
        count: u8,
        #[parameter(default = true)]
        is_on: bool,
        title: String,
        #[parameter(default = "")]
        file: Option<PathBuf>,
        #[parameter(default = "right", choices("left" = Side::Left, "right" = Side::Right))]
        side: Side,
        #[parameter(default = "1-2", parse = parse_pair)]
        pair: (u32, u32),
        #[parameter(default = "#ff0000", colour)]
        colour: String,
        #[parameter(default = "1,2", format = "points")]
        route: Vec<[f64; 2]>,
        #[parameter(default = "", format = "numbers")]
        gains: Vec<f64>,
        #[parameter(default = "", format = "names")]
        buttons: Vec<String>,
        #[parameter(default = "localhost:80", format = "address")]
        server: String,
    }

    fn value(value: ParameterValue) -> Value {
        Value::new(value, Path::new("/robots"))
    }

    #[test]
    fn the_defaults_are_those_of_the_table() {
        let expected = Everything {
            reach_m: 0.2,
            share: 0.5,
            count: 3,
            is_on: true,
            title: String::new(),
            file: None,
            side: Side::Right,
            pair: (1, 2),
            colour: "#ff0000".into(),
            route: vec![[1.0, 2.0]],
            gains: Vec::new(),
            buttons: Vec::new(),
            server: "localhost:80".into(),
        };
        assert_eq!(Everything::defaults(), expected);
        let manifest = Everything::DECLARED[0].manifest();
        assert_eq!((manifest.name.as_str(), manifest.unit.as_str()), ("reach", "cm"));
        assert_eq!((manifest.minimum, manifest.doc.as_str()), (Some(0.1), "how far"));
        assert!(Everything::DECLARED[2].manifest().live);
    }

    #[test]
    fn each_value_reaches_its_field() {
        let mut given = Everything::defaults();
        let text = |text: &str| value(ParameterValue::Text(text.into()));
        given.set("reach", &value(ParameterValue::Number(1.5))).unwrap();
        given.set("count", &value(ParameterValue::Integer(200))).unwrap();
        given.set("is_on", &value(ParameterValue::Flag(false))).unwrap();
        given.set("file", &text("map.yaml")).unwrap();
        given.set("side", &text("left")).unwrap();
        given.set("pair", &text("7-9")).unwrap();
        given.set("route", &text("3,4 -1,0")).unwrap();
        given.set("gains", &text("0.5 2")).unwrap();
        given.set("buttons", &text("go stop")).unwrap();
        assert_eq!(
            (given.route.as_slice(), given.gains.as_slice()),
            ([[3.0, 4.0], [-1.0, 0.0]].as_slice(), [0.5, 2.0].as_slice())
        );
        assert_eq!(given.buttons, ["go", "stop"]);
        let why = given.set("route", &text("3;4")).unwrap_err().to_string();
        assert!(why.contains("point 1, `3;4`"), "{why}");
        assert_eq!((given.reach_m, given.count, given.is_on), (1.5, 200, false));
        assert_eq!(given.file.as_deref(), Some(Path::new("/robots/map.yaml")));
        assert_eq!((given.side, given.pair), (Side::Left, (7, 9)));
    }

    #[test]
    fn an_error_names_the_parameter() {
        let mut given = Everything::defaults();
        for (name, wrong, why) in [
            ("reach", ParameterValue::Flag(true), "parameter `reach`: "),
            (
                "count",
                ParameterValue::Integer(256),
                "parameter `count`: `256` is out of range for u8, 0 to 255",
            ),
            ("side", ParameterValue::Text("up".into()), "`up` is none of its choices"),
            ("pair", ParameterValue::Text("7".into()), "parameter `pair`: no `-`"),
            ("volume", ParameterValue::Flag(true), "there is no parameter `volume`"),
        ] {
            let error = given.set(name, &value(wrong)).expect_err(name);
            assert!(error.to_string().contains(why), "{error}");
        }
        assert_eq!(given, Everything::defaults(), "nothing is set");
    }
}
