//! What to write instead of a unit that does not exist: the unit that was probably meant, or those
//! of the quantity that is expected.

use crate::{Dimension, QuantityError, UNITS, Unit, parse};

/// Names of units in words and in other notations, in lower case, with the unit.
const OTHER_NAMES: &[(&[&str], &str)] = &[
    (&["sec", "secs", "second", "seconds"], "s"),
    (&["msec", "msecs", "millisecond", "milliseconds"], "ms"),
    (&["usec", "µs", "microsecond", "microseconds"], "us"),
    (&["mins", "minute", "minutes"], "min"),
    (&["hr", "hrs", "hour", "hours"], "h"),
    (&["hertz", "1/s"], "Hz"),
    (&["meter", "meters", "metre", "metres"], "m"),
    (&["millimeter", "millimeters", "millimetre", "millimetres"], "mm"),
    (&["centimeter", "centimeters", "centimetre", "centimetres"], "cm"),
    (&["kilometer", "kilometers", "kilometre", "kilometres"], "km"),
    (&["°", "degree", "degrees"], "deg"),
    (&["radian", "radians"], "rad"),
    (&["mps", "meter/s", "meters/s"], "m/s"),
    (&["kph", "kmh"], "km/h"),
    (&["°/s", "dps", "degree/s", "degrees/s"], "deg/s"),
    (&["m/s/s"], "m/s2"),
    (&["rad/s/s"], "rad/s2"),
    (&["kilogram", "kilograms"], "kg"),
    (&["gram", "grams"], "g"),
    (&["volt", "volts"], "V"),
    (&["amp", "amps", "ampere", "amperes"], "A"),
    (&["watt", "watts"], "W"),
    (&["°c", "celsius"], "degC"),
    (&["kelvin"], "K"),
    (&["newton", "newtons"], "N"),
    (&["nm", "n.m"], "N·m"),
    (&["pascal"], "Pa"),
    (&["liter", "liters", "litre", "litres"], "L"),
    (&["byte", "bytes"], "B"),
    (&["percent", "pct"], "%"),
];

/// Returns the unit that `written` probably stands for: in other letters, in words, or in another
/// notation, such as `S`, `seconds` and `m/s^2`. If `expected` is given, it is one of that quantity.
pub fn find_similar(written: &str, expected: Option<Dimension>) -> Option<&'static Unit> {
    let plain = written.trim().to_lowercase().replace('²', "2").replace('³', "3");
    let plain = plain.replace('^', "").replace("/second", "/s").replace("/sec", "/s");
    let of_word = OTHER_NAMES.iter().find(|(words, _)| words.contains(&plain.as_str()));
    let is_expected = |unit: &&Unit| expected.is_none_or(|wanted| wanted == unit.dimension);
    let is_meant = |unit: &&Unit| {
        unit.name.to_lowercase() == plain || of_word.is_some_and(|(_, name)| *name == unit.name)
    };
    UNITS.iter().filter(is_expected).find(is_meant)
}

/// Explains that `name` is no unit: the similar units, or all of them.
pub fn explain_unknown(name: &str) -> String {
    let is_similar = |unit: &&Unit| {
        (unit.name.len() > 1 && name.starts_with(unit.name))
            || (name.len() > 1 && unit.name.starts_with(name))
    };
    let similar: Vec<_> = match find_similar(name, None) {
        Some(unit) => vec![unit.name],
        None => UNITS.iter().filter(is_similar).map(|unit| unit.name).collect(),
    };
    if similar.is_empty() {
        format!("the units are {}", list_units())
    } else {
        format!("did you mean {}? `docs/units.md` lists all units", similar.join(" or "))
    }
}

/// Returns what to write instead of `text`, in which `unit` follows the number and is no unit.
pub fn advise_unit(text: &str, unit: &str, expected: Option<Dimension>) -> String {
    let number = text.strip_suffix(unit).unwrap_or(text).trim_end();
    if let Some(advice) = advise_milli(number, unit, expected) {
        return advice;
    }
    if let Some(meant) = find_similar(unit, expected) {
        return format!("did you mean {number}{}?", meant.name);
    }
    let with_point = text.replacen(',', ".", 1);
    if unit.starts_with(',') && parse(&with_point).is_ok() {
        return format!("did you mean {with_point}?");
    }
    let is_next_number = |name: &str| {
        unit.strip_prefix(name)
            .is_some_and(|rest| rest.trim_start().starts_with(|first: char| first.is_ascii_digit()))
    };
    if UNITS.iter().any(|unit| is_next_number(unit.name)) {
        return "write one number with one unit: 90s instead of 1min30s".into();
    }
    match expected {
        Some(dimension) => {
            let units = UNITS.iter().filter(|unit| unit.dimension == dimension);
            let names: Vec<_> = units.map(|unit| unit.name).collect();
            format!("write {}", join_alternatives(&names))
        }
        None => format!("known are {}", list_units()),
    }
}

/// Of a unit with the prefix milli that is not known, such as `mHz`, what each prefix would mean.
fn advise_milli(number: &str, unit: &str, expected: Option<Dimension>) -> Option<String> {
    let base = unit.strip_prefix('m').filter(|base| Unit::named(base).is_some())?;
    let mega = find_similar(unit, expected).filter(|mega| mega.name.starts_with('M'))?;
    let milli = number.trim().parse::<f64>().ok()? / 1000.0;
    let mega = mega.name;
    Some(format!("did you mean {number}{base}, {milli}{base} (m is milli) or {number}{mega}?"))
}

impl QuantityError {
    /// Returns what is wrong, with the units of the quantity that is expected.
    pub fn explain_for(&self, expected: Option<Dimension>) -> String {
        match self {
            Self::UnknownUnit { text, unit } => {
                let advice = advise_unit(text, unit, expected);
                format!("`{unit}` in `{text}` is not a unit; {advice}")
            }
            other => other.to_string(),
        }
    }
}

fn join_alternatives(names: &[&str]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        names => names.join(""),
    }
}

fn list_units() -> String {
    UNITS.iter().map(|unit| unit.name).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_prefix_milli_is_not_taken_for_mega_alone() {
        let advice = advise_unit("5mHz", "mHz", Some(Dimension::Frequency));
        assert_eq!(advice, "did you mean 5Hz, 0.005Hz (m is milli) or 5MHz?");
    }

    #[test]
    fn an_unknown_unit_is_explained() {
        assert!(explain_unknown("hz").starts_with("did you mean Hz?"));
        assert!(explain_unknown("meter").starts_with("did you mean m?"));
        assert!(explain_unknown("furlong").starts_with("the units are s ms"));
    }

    #[test]
    fn the_unit_that_was_meant_is_of_the_expected_quantity() {
        let check = |written: &str, expected: Option<Dimension>, found: Option<&str>| {
            let unit = find_similar(written, expected).map(|unit| unit.name);
            assert_eq!(unit, found, "{written}");
        };
        check("S", Some(Dimension::Time), Some("s"));
        check("Minutes", Some(Dimension::Time), Some("min"));
        check("KHz", Some(Dimension::Frequency), Some("kHz"));
        check("rad/s^2", None, Some("rad/s2"));
        check("m/sec", None, Some("m/s"));
        check("m/s²", None, Some("m/s2"));
        check("volts", None, Some("V"));
        check("volts", Some(Dimension::Time), None);
        check("parsec", None, None);
    }

    #[test]
    fn the_whole_value_is_suggested() {
        let time = |text: &str| parse(text).expect_err(text).explain_for(Some(Dimension::Time));
        assert_eq!(time("60S"), "`S` in `60S` is not a unit; did you mean 60s?");
        assert!(time("1,5min").ends_with("did you mean 1.5min?"));
        assert!(time("1 Min").ends_with("did you mean 1min?"));
        assert!(time("2min30s").ends_with("one number with one unit: 90s instead of 1min30s"));
        assert!(time("5 parsec").ends_with("is not a unit; write s, ms, us, ns, min or h"));
        let of_any = parse("5 parsec").expect_err("no unit").to_string();
        assert!(of_any.contains("known are s ms us"), "{of_any}");
    }
}
