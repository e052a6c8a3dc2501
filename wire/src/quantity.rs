//! Numbers with units as people write them: `10Hz`, `0.2s`, `30deg`, `1.5m`, `10min`.

use thiserror::Error;

/// A physical dimension; two units convert into each other if theirs are equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Seconds.
    Time,
    /// Hertz.
    Frequency,
    /// Metres.
    Length,
    /// Radians.
    Angle,
    /// Metres per second.
    Speed,
    /// Radians per second.
    AngularSpeed,
    /// Metres per second squared.
    Acceleration,
    /// Radians per second squared.
    AngularAcceleration,
    /// Kilograms.
    Mass,
    /// Volts.
    Voltage,
    /// Amperes.
    Current,
    /// Ampere seconds.
    Charge,
    /// Joules.
    Energy,
    /// Watts.
    Power,
    /// Degrees Celsius.
    Temperature,
    /// Bytes.
    Information,
    /// A fraction of one.
    Ratio,
}

/// A unit that may follow a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// How it is written.
    pub name: &'static str,
    /// What it measures.
    pub dimension: Dimension,
    /// Its size in the SI unit of its dimension.
    pub to_si: f64,
}

const DEG: f64 = std::f64::consts::PI / 180.0;

macro_rules! units {
    ($($name:literal $dimension:ident $to_si:expr;)*) => {
        /// All units, with their size in SI.
        pub const UNITS: &[Unit] = &[
            $(Unit { name: $name, dimension: Dimension::$dimension, to_si: $to_si }),*
        ];
    };
}

units! {
    "s" Time 1.0; "ms" Time 1e-3; "us" Time 1e-6; "ns" Time 1e-9; "min" Time 60.0; "h" Time 3600.0;
    "Hz" Frequency 1.0; "kHz" Frequency 1e3; "MHz" Frequency 1e6;
    "m" Length 1.0; "mm" Length 1e-3; "cm" Length 1e-2; "km" Length 1e3;
    "rad" Angle 1.0; "deg" Angle DEG;
    "m/s" Speed 1.0; "mm/s" Speed 1e-3; "cm/s" Speed 1e-2; "km/h" Speed 1.0 / 3.6;
    "rad/s" AngularSpeed 1.0; "deg/s" AngularSpeed DEG;
    "m/s2" Acceleration 1.0;
    "rad/s2" AngularAcceleration 1.0; "deg/s2" AngularAcceleration DEG;
    "kg" Mass 1.0; "g" Mass 1e-3;
    "V" Voltage 1.0; "mV" Voltage 1e-3;
    "A" Current 1.0; "mA" Current 1e-3;
    "As" Charge 1.0; "Ah" Charge 3600.0; "mAh" Charge 3.6;
    "J" Energy 1.0; "Wh" Energy 3600.0;
    "W" Power 1.0;
    "degC" Temperature 1.0;
    "B" Information 1.0; "KiB" Information 1024.0; "MiB" Information 1_048_576.0;
    "%" Ratio 0.01;
}

impl Unit {
    /// The unit written `name`.
    pub fn named(name: &str) -> Option<&'static Self> {
        UNITS.iter().find(|unit| unit.name == name)
    }
}

/// A number as read: its value in SI, and the unit it was given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The value in SI; as written if there is no unit.
    pub si: f64,
    /// The unit written after the number.
    pub unit: Option<&'static Unit>,
}

/// Why a text is not a quantity.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum QuantityError {
    /// It does not start with a finite number.
    #[error("`{0}` does not start with a number")]
    NotANumber(String),
    /// What follows the number is no unit.
    #[error("`{unit}` in `{text}` is not a unit; known are {}", known())]
    UnknownUnit {
        /// The text as given.
        text: String,
        /// Its part after the number.
        unit: String,
    },
    /// The unit measures something else.
    #[error("`{text}` is not {wanted}")]
    WrongDimension {
        /// The text as given.
        text: String,
        /// What was wanted, with an example.
        wanted: &'static str,
    },
}

fn known() -> String {
    UNITS.iter().map(|unit| unit.name).collect::<Vec<_>>().join(" ")
}

/// Reads a number with or without a unit.
///
/// # Errors
/// [`QuantityError`] if it is neither.
pub fn parse(text: &str) -> Result<Quantity, QuantityError> {
    let digits = text
        .char_indices()
        .find(|(at, c)| {
            !(c.is_ascii_digit() || matches!(c, '.' | '+' | '-') || is_exponent(text, *at))
        })
        .map_or(text.len(), |(at, _)| at);
    let (number, unit) = text.split_at(digits);
    let number: f64 = number
        .parse()
        .ok()
        .filter(|number: &f64| number.is_finite())
        .ok_or_else(|| QuantityError::NotANumber(text.into()))?;
    let unit = unit.trim_start_matches(' ');
    if unit.is_empty() {
        return Ok(Quantity { si: number, unit: None });
    }
    let found = Unit::named(unit)
        .ok_or_else(|| QuantityError::UnknownUnit { text: text.into(), unit: unit.into() })?;
    Ok(Quantity { si: number * found.to_si, unit: Some(found) })
}

fn is_exponent(text: &str, at: usize) -> bool {
    let bytes = text.as_bytes();
    matches!(bytes[at], b'e' | b'E')
        && at > 0
        && bytes[at - 1].is_ascii_digit()
        && bytes.get(at + 1).is_some_and(|b| b.is_ascii_digit() || matches!(b, b'-' | b'+'))
}

fn of(text: &str, dimension: Dimension, wanted: &'static str) -> Result<f64, QuantityError> {
    let quantity = parse(text)?;
    match quantity.unit {
        Some(unit) if unit.dimension == dimension => Ok(quantity.si),
        _ => Err(QuantityError::WrongDimension { text: text.into(), wanted }),
    }
}

/// Reads a duration, such as `0.2s` or `10min`, in seconds; not negative.
///
/// # Errors
/// [`QuantityError`] if it is not one.
pub fn seconds(text: &str) -> Result<f64, QuantityError> {
    let wanted = "a duration such as 0.2s or 10min";
    of(text, Dimension::Time, wanted).and_then(|s| {
        if s >= 0.0 {
            Ok(s)
        } else {
            Err(QuantityError::WrongDimension { text: text.into(), wanted })
        }
    })
}

/// Reads a rate, such as `10Hz`, in hertz; above zero.
///
/// # Errors
/// [`QuantityError`] if it is not one.
pub fn hertz(text: &str) -> Result<f64, QuantityError> {
    let wanted = "a rate such as 10Hz";
    of(text, Dimension::Frequency, wanted).and_then(|hz| {
        if hz > 0.0 {
            Ok(hz)
        } else {
            Err(QuantityError::WrongDimension { text: text.into(), wanted })
        }
    })
}
