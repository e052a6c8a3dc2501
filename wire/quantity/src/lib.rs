//! Numbers with units as people write them: `10Hz`, `0.2s`, `30deg`, `1.5m`, `10min`; and the table
//! of units (`docs/units.md`).

mod advice;

use thiserror::Error;

pub use advice::{advise_unit, explain_unknown, find_similar};

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
    /// Kelvin. Not convertible into degrees Celsius: a difference of temperatures is in kelvin, too.
    AbsoluteTemperature,
    /// Newtons.
    Force,
    /// Newton metres.
    Torque,
    /// Pascals.
    Pressure,
    /// Teslas.
    MagneticFluxDensity,
    /// Lux.
    Illuminance,
    /// Cubic metres.
    Volume,
    /// Bytes.
    Information,
    /// A fraction of one.
    Ratio,
}

impl Dimension {
    /// Returns how its SI unit is written; none if it has no name, as a ratio.
    pub fn si_unit(self) -> Option<&'static str> {
        let is_si =
            |unit: &&Unit| unit.dimension == self && (unit.to_si - 1.0).abs() < f64::EPSILON;
        UNITS.iter().find(is_si).map(|unit| unit.name)
    }

    /// What it is called, such as `angular speed`.
    pub fn label(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Frequency => "frequency",
            Self::Length => "length",
            Self::Angle => "angle",
            Self::Speed => "speed",
            Self::AngularSpeed => "angular speed",
            Self::Acceleration => "acceleration",
            Self::AngularAcceleration => "angular acceleration",
            Self::Mass => "mass",
            Self::Voltage => "voltage",
            Self::Current => "current",
            Self::Charge => "charge",
            Self::Energy => "energy",
            Self::Power => "power",
            Self::Temperature => "temperature in degrees Celsius",
            Self::AbsoluteTemperature => "temperature in kelvin",
            Self::Force => "force",
            Self::Torque => "torque",
            Self::Pressure => "pressure",
            Self::MagneticFluxDensity => "magnetic flux density",
            Self::Illuminance => "illuminance",
            Self::Volume => "volume",
            Self::Information => "amount of data",
            Self::Ratio => "ratio",
        }
    }
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
    "rad/s" AngularSpeed 1.0; "deg/s" AngularSpeed DEG; "rpm" AngularSpeed std::f64::consts::TAU / 60.0;
    "m/s2" Acceleration 1.0;
    "rad/s2" AngularAcceleration 1.0; "deg/s2" AngularAcceleration DEG;
    "kg" Mass 1.0; "g" Mass 1e-3;
    "V" Voltage 1.0; "mV" Voltage 1e-3;
    "A" Current 1.0; "mA" Current 1e-3;
    "As" Charge 1.0; "Ah" Charge 3600.0; "mAh" Charge 3.6;
    "J" Energy 1.0; "Wh" Energy 3600.0;
    "W" Power 1.0;
    "degC" Temperature 1.0;
    "K" AbsoluteTemperature 1.0;
    "N" Force 1.0;
    "N·m" Torque 1.0;
    "Pa" Pressure 1.0; "hPa" Pressure 100.0; "kPa" Pressure 1e3; "bar" Pressure 1e5;
    "T" MagneticFluxDensity 1.0; "uT" MagneticFluxDensity 1e-6;
    "lx" Illuminance 1.0;
    "m3" Volume 1.0; "L" Volume 1e-3;
    "B" Information 1.0; "KiB" Information 1024.0; "MiB" Information 1_048_576.0;
    "%" Ratio 0.01; "ppm" Ratio 1e-6;
}

/// Other ways to write a unit: those that a keyboard and the schema of a message have.
const SPELLINGS: &[(&str, &str)] = &[("N*m", "N·m")];

impl Unit {
    /// The unit written `name`.
    pub fn named(name: &str) -> Option<&'static Self> {
        let name = SPELLINGS.iter().find(|(other, _)| *other == name).map_or(name, |(_, own)| *own);
        UNITS.iter().find(|unit| unit.name == name)
    }

    /// Its size in the unit in which a component receives its parameters: SI, but a ratio stays in
    /// percent or parts per million, as a field of a message with this unit is.
    pub fn received_size(&self) -> f64 {
        if self.dimension == Dimension::Ratio { 1.0 } else { self.to_si }
    }

    /// As it is written in ASCII, such as in the schema of a message.
    pub fn ascii_name(&self) -> &'static str {
        let spelling = SPELLINGS.iter().find(|(_, own)| *own == self.name);
        spelling.map_or(self.name, |(other, _)| *other)
    }
}

/// A number as read: its value in SI, and the unit it was given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The value in SI; as written if there is no unit.
    pub si: f64,
    /// The number as written.
    pub number: f64,
    /// The unit written after the number.
    pub unit: Option<&'static Unit>,
}

/// Why a text is not a quantity.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum QuantityError {
    /// It does not start with a number, or with one too large for its unit.
    #[error("`{0}` does not start with a number")]
    NotANumber(String),
    /// It is outside of what makes sense here.
    #[error("`{text}` is not between {least} and {most}")]
    OutOfRange {
        /// The text as given.
        text: String,
        /// The least that is allowed, with its unit.
        least: &'static str,
        /// The most that is allowed, with its unit.
        most: &'static str,
    },
    /// What follows the number is no unit.
    #[error("`{unit}` in `{text}` is not a unit; {}", advise_unit(text, unit, None))]
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
        return Ok(Quantity { si: number, number, unit: None });
    }
    let found = Unit::named(unit)
        .ok_or_else(|| QuantityError::UnknownUnit { text: text.into(), unit: unit.into() })?;
    let si = number * found.to_si;
    if !si.is_finite() {
        return Err(QuantityError::NotANumber(text.into()));
    }
    Ok(Quantity { si, number, unit: Some(found) })
}

fn is_exponent(text: &str, at: usize) -> bool {
    let bytes = text.as_bytes();
    matches!(bytes[at], b'e' | b'E')
        && at > 0
        && bytes[at - 1].is_ascii_digit()
        && bytes.get(at + 1).is_some_and(|b| b.is_ascii_digit() || matches!(b, b'-' | b'+'))
}

/// Reads a number with a unit of this quantity, in SI; `wanted` describes it with an example.
///
/// # Errors
/// [`QuantityError`] if it is not one.
pub fn parse_in(
    text: &str,
    dimension: Dimension,
    wanted: &'static str,
) -> Result<f64, QuantityError> {
    let quantity = parse(text)?;
    match quantity.unit {
        Some(unit) if unit.dimension == dimension => Ok(quantity.si),
        _ => Err(QuantityError::WrongDimension { text: text.into(), wanted }),
    }
}

/// Reads a duration, such as `0.2s` or `10min`, in seconds: from 0 to 1e9 s, which is 31 years and
/// no overflow in any arithmetic.
///
/// # Errors
/// [`QuantityError`] if it is not one.
pub fn seconds(text: &str) -> Result<f64, QuantityError> {
    let s = parse_in(text, Dimension::Time, "a duration such as 0.2s or 10min")?;
    if (0.0..=1e9).contains(&s) {
        Ok(s)
    } else {
        Err(QuantityError::OutOfRange { text: text.into(), least: "0s", most: "1e9s" })
    }
}

/// Reads a rate, such as `10Hz`, in hertz: from 1e-6 Hz to 1 MHz.
///
/// # Errors
/// [`QuantityError`] if it is not one.
pub fn hertz(text: &str) -> Result<f64, QuantityError> {
    let hz = parse_in(text, Dimension::Frequency, "a rate such as 10Hz")?;
    if (1e-6..=1e6).contains(&hz) {
        Ok(hz)
    } else {
        Err(QuantityError::OutOfRange { text: text.into(), least: "1e-6Hz", most: "1MHz" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Result<(f64, Option<&str>), &str>) {
        let found = parse(text).map(|q| (q.si, q.unit.map(|unit| unit.name)));
        match (found, expected) {
            (Ok((si, unit)), Ok((wanted, wanted_unit))) => {
                assert!((si - wanted).abs() <= wanted.abs() * 1e-15, "{text}: {si}");
                assert_eq!(unit, wanted_unit, "{text}");
            }
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{text}: {error}"),
            (found, _) => panic!("{text}: {found:?} instead of {expected:?}"),
        }
    }

    #[test]
    fn numbers_with_and_without_units() {
        check("10Hz", Ok((10.0, Some("Hz"))));
        check("0.2s", Ok((0.2, Some("s"))));
        check("10min", Ok((600.0, Some("min"))));
        check("180deg", Ok((std::f64::consts::PI, Some("deg"))));
        check("-1.5 m", Ok((-1.5, Some("m"))));
        check("36km/h", Ok((10.0, Some("km/h"))));
        check("2e3mm", Ok((2.0, Some("mm"))));
        check("+7", Ok((7.0, None)));
        check("1E-2", Ok((0.01, None)));
        check("50%", Ok((0.5, Some("%"))));
        check("2.5N·m", Ok((2.5, Some("N·m"))));
        check("2.5 N*m", Ok((2.5, Some("N·m"))));
        check("60rpm", Ok((std::f64::consts::TAU, Some("rpm"))));
        check("1.5bar", Ok((150_000.0, Some("bar"))));
        check("300K", Ok((300.0, Some("K"))));
        check("1e3lx", Ok((1000.0, Some("lx"))));
        check("2L", Ok((0.002, Some("L"))));
        check("400ppm", Ok((0.0004, Some("ppm"))));
    }

    #[test]
    fn what_is_not_a_quantity_is_named() {
        for text in ["", "m", "inf", "NaN", "1.2.3m", "--1", "1e999", "1e308km", "½m", "e5"] {
            check(text, Err("does not start with a number"));
        }
        for (text, unit) in [("1e", "`e`"), ("5 parsec", "`parsec`"), ("5m m", "`m m`")] {
            check(text, Err(unit));
        }
    }

    #[test]
    fn durations_and_rates_are_such_that_no_timer_overflows() {
        assert_eq!(seconds("250ms"), Ok(0.25));
        assert_eq!(seconds("0s"), Ok(0.0));
        assert_eq!(hertz("0.5kHz"), Ok(500.0));
        for text in ["-1s", "1e300s", "5", "5m", "s"] {
            assert!(seconds(text).is_err(), "{text}");
        }
        for text in ["0Hz", "-1Hz", "1e9Hz", "1e-300Hz", "10", "10s"] {
            assert!(hertz(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_unit_is_found_by_its_name() {
        for unit in UNITS {
            assert_eq!(Unit::named(unit.name), Some(unit));
            assert!(unit.ascii_name().is_ascii());
            assert_eq!(Unit::named(unit.ascii_name()), Some(unit));
        }
    }

    #[test]
    fn the_si_unit_is_the_one_of_size_one() {
        let units =
            [Dimension::Angle, Dimension::Voltage, Dimension::Ratio].map(Dimension::si_unit);
        assert_eq!(units, [Some("rad"), Some("V"), None]);
    }

    /// The rows of `docs/units.md`: one for each dimension.
    fn table() -> String {
        let mut dimensions: Vec<Dimension> = Vec::new();
        for unit in UNITS {
            if !dimensions.contains(&unit.dimension) {
                dimensions.push(unit.dimension);
            }
        }
        let mut rows =
            String::from("| quantity | units, with their size in the first one |\n| --- | --- |\n");
        for dimension in dimensions {
            let units = UNITS.iter().filter(|unit| unit.dimension == dimension);
            let cells: Vec<_> = units.map(cell).collect();
            rows += &format!("| {} | {} |\n", dimension.label(), cells.join(", "));
        }
        rows
    }

    fn cell(unit: &Unit) -> String {
        let spelled = match unit.ascii_name() {
            other if other == unit.name => format!("`{other}`"),
            other => format!("`{}` or `{other}`", unit.name),
        };
        let is_one = (unit.to_si - 1.0).abs() < f64::EPSILON;
        if is_one { spelled } else { format!("{spelled} ({})", unit.to_si) }
    }

    #[test]
    fn the_page_of_units_is_the_table() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/units.md");
        let page = std::fs::read_to_string(&path).unwrap();
        let (start, end) = (page.find("| quantity |").unwrap(), page.rfind("|\n").unwrap() + 2);
        if std::env::var_os("ARMOR_BLESS").is_some() {
            let page = format!("{}{}{}", &page[..start], table(), &page[end..]);
            std::fs::write(&path, page).unwrap();
            return;
        }
        assert_eq!(&page[start..end], table(), "run with ARMOR_BLESS=1");
    }
}
