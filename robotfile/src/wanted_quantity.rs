//! Reads the durations, rates, lengths and angles of attributes; where a text is none, the error states
//! what to write instead.

use std::time::Duration;

use armor_wire::quantity::{self, Dimension, QuantityError};

use crate::finding::short;
use crate::guard::dimension_noun;

/// A quantity that an attribute expects.
struct WantedQuantity {
    /// What is expected, with an example.
    wanted: &'static str,
    /// The quantity of its units.
    dimension: Dimension,
    /// A unit that a number without one probably has.
    unit: &'static str,
    /// A unit that is often mistaken for one of this quantity, and the one that was meant.
    mistaken: Option<(&'static str, &'static str)>,
}

const DURATION: WantedQuantity = WantedQuantity {
    wanted: "a duration such as 0.2s or 10min is expected",
    dimension: Dimension::Time,
    unit: "s",
    mistaken: Some(("m", "min")),
};
const RATE: WantedQuantity = WantedQuantity {
    wanted: "a rate such as 10Hz is expected",
    dimension: Dimension::Frequency,
    unit: "Hz",
    mistaken: None,
};

const LENGTH: WantedQuantity = WantedQuantity {
    wanted: "a length such as 0.3m is expected",
    dimension: Dimension::Length,
    unit: "m",
    mistaken: None,
};
const ANGLE: WantedQuantity = WantedQuantity {
    wanted: "an angle such as 90deg is expected",
    dimension: Dimension::Angle,
    unit: "deg",
    mistaken: None,
};

/// Reads a duration such as `0.2s` or `10min`.
pub(crate) fn read_duration(text: &str) -> Result<Duration, String> {
    let seconds =
        quantity::seconds(text).map_err(|error| explain_expected(text, error, &DURATION))?;
    Duration::try_from_secs_f64(seconds).map_err(|_| format!("`{}` is too long", short(text)))
}

/// Reads a rate such as `10Hz`, in hertz.
pub(crate) fn read_rate_hz(text: &str) -> Result<f64, String> {
    quantity::hertz(text).map_err(|error| explain_expected(text, error, &RATE))
}

/// Reads a number with or without a unit, in SI.
pub(crate) fn read_number(text: &str) -> Result<f64, String> {
    quantity::parse(text).map(|read| read.si).map_err(|error| explain_number(text, &error))
}

/// Reads a number with a unit of this quantity, a length or an angle, in SI.
pub(crate) fn read_number_in(text: &str, dimension: Dimension) -> Result<f64, String> {
    let wanted = if dimension == Dimension::Angle { &ANGLE } else { &LENGTH };
    let parsed = quantity::parse_in(text, wanted.dimension, wanted.wanted);
    let number = parsed.map_err(|error| explain_expected(text, error, wanted))?;
    let turns = number.abs() / std::f64::consts::TAU;
    match dimension == Dimension::Angle && turns > 1.0 + 1e-9 {
        true => Err(format!("it is {turns:.1} full turns: write one at most, such as 90deg")),
        false => Ok(number),
    }
}

/// Returns what is expected instead of a wrong quantity; a number may be too large.
fn explain_number(text: &str, error: &QuantityError) -> String {
    let digits = text.trim_start_matches(['+', '-']);
    match error {
        QuantityError::NotANumber(_) if digits.starts_with(|c: char| c.is_ascii_digit()) => {
            "a number below 1e308 with or without a unit is expected, such as 0.5m/s".into()
        }
        error => error.to_string(),
    }
}

/// Returns what was read, and what to write instead.
fn explain_expected(text: &str, error: QuantityError, quantity: &WantedQuantity) -> String {
    let WantedQuantity { wanted, dimension, unit, mistaken } = quantity;
    match error {
        QuantityError::UnknownUnit { .. } | QuantityError::OutOfRange { .. } => {
            return error.explain_for(Some(*dimension));
        }
        QuantityError::NotANumber(_) => return (*wanted).to_owned(),
        QuantityError::WrongDimension { .. } => {}
    }
    match quantity::parse(text).ok().and_then(|read| read.unit) {
        None => format!("it has no unit: write {}{unit}", short(text.trim_end())),
        Some(read) => {
            let noun = dimension_noun(read.dimension);
            let meant = mistaken.filter(|(mistaken, _)| *mistaken == read.name);
            let number = short(text.strip_suffix(read.name).unwrap_or(text).trim_end());
            match meant {
                Some((_, meant)) => {
                    format!("it is {noun}: write {number}{meant} if {meant} was meant; {wanted}")
                }
                None => format!("it is {noun}; {wanted}"),
            }
        }
    }
}
