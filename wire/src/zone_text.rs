//! Zones as people write them, the format `zones` of a text:
//!
//! ```text
//! school no-go margin=2m 3,4 9,4 9,8; yard stay-in 0,0 20,0 20,20 0,20; crossing speed=0.3m/s circle 4,4 2m
//! ```
//!
//! Whether the corners are those of a polygon is not decided here: that is geometry.

use std::fmt;

use armor_quantity::{Dimension, QuantityError, parse_in};
use thiserror::Error;

use crate::name::is_name;

/// A zone as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenZone {
    /// Its name.
    pub name: InText<String>,
    /// What it requires of a robot.
    pub duty: WrittenDuty,
    /// The distance to keep from it, in metres; 0 m if none is written, and then where the name is.
    pub margin_m: InText<f64>,
    /// Where it is.
    pub shape: WrittenShape,
}

/// What a written zone requires of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WrittenDuty {
    /// It must not enter.
    NoGo,
    /// It must not leave.
    StayIn,
    /// It must not be faster, in metres per second.
    Speed(f64),
    /// Nothing.
    Observe,
}

/// The shape of a written zone.
#[derive(Clone, Debug, PartialEq)]
pub enum WrittenShape {
    /// The corners of a polygon, x and y in metres.
    Polygon(Vec<InText<[f64; 2]>>),
    /// A circle.
    Circle {
        /// Its centre, x and y in metres.
        centre: InText<[f64; 2]>,
        /// Its radius, in metres.
        radius_m: InText<f64>,
    },
}

/// A value with the character of the text at which it begins, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InText<T> {
    /// The value.
    pub value: T,
    /// The character.
    pub column: usize,
}

impl<T> InText<T> {
    /// A value that comes from no text.
    pub fn nowhere(value: T) -> Self {
        Self { value, column: 1 }
    }
}

/// Writes it as [`parse_zones`] reads it; numbers are read back as they were.
impl fmt::Display for WrittenZone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ", self.name.value)?;
        match self.duty {
            WrittenDuty::NoGo => f.write_str("no-go")?,
            WrittenDuty::StayIn => f.write_str("stay-in")?,
            WrittenDuty::Speed(limit_mps) => write!(f, "speed={limit_mps}m/s")?,
            WrittenDuty::Observe => f.write_str("observe")?,
        }
        if self.margin_m.value != 0.0 {
            write!(f, " margin={}m", self.margin_m.value)?;
        }
        match &self.shape {
            WrittenShape::Polygon(corners) => corners.iter().try_for_each(|corner| {
                let [x, y] = corner.value;
                write!(f, " {x},{y}")
            }),
            WrittenShape::Circle { centre, radius_m } => {
                let [x, y] = centre.value;
                write!(f, " circle {x},{y} {}m", radius_m.value)
            }
        }
    }
}

/// A text of zones that cannot be read, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the zones, at character {column}: {fault}")]
pub struct ZoneTextError {
    /// The character at which the faulty part begins, counted from 1.
    pub column: usize,
    /// What is wrong there.
    pub fault: ZoneTextFault,
}

/// What is wrong with a text of zones.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ZoneTextFault {
    /// A name that is none.
    #[error("`{0}` is no name of a zone; a name is letters, digits, _ and -, a letter first")]
    Name(String),
    /// No kind after the name.
    #[error("after the name comes the kind: no-go, stay-in, observe, or speed=0.3m/s; not `{0}`")]
    Kind(String),
    /// No kind at all.
    #[error("the zone has no kind; after its name comes no-go, stay-in, observe, or speed=0.3m/s")]
    NoKind,
    /// No shape.
    #[error("the zone has no shape; write corners such as 3,4 9,4 9,8, or circle 4,4 2m")]
    NoShape,
    /// A circle without centre or radius, or with more.
    #[error("a circle is its centre and its radius, such as circle 4,4 2m")]
    Circle,
    /// A point that is none.
    #[error("`{0}` is no point; write x,y in metres, such as 3,4")]
    Point(String),
    /// A second margin.
    #[error("the zone has a second margin; keep one")]
    SecondMargin,
    /// A length or speed that is none.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
}

/// A word of the text, and the character at which it begins, counted from 1.
#[derive(Clone, Copy)]
struct Word<'a> {
    column: usize,
    text: &'a str,
}

impl Word<'_> {
    fn fault(self, fault: impl Into<ZoneTextFault>) -> ZoneTextError {
        ZoneTextError { column: self.column, fault: fault.into() }
    }

    fn at<T>(self, value: T) -> InText<T> {
        InText { value, column: self.column }
    }
}

/// Reads zones, separated by `;`: name, kind, `margin=LENGTH` if there is one, and shape. The kind
/// is `no-go`, `stay-in`, `observe` or `speed=SPEED`; the shape is the corners `x,y` of a polygon in
/// metres, or `circle x,y RADIUS`. An empty text has no zones.
///
/// # Errors
/// The first fault, with its place.
pub fn parse_zones(text: &str) -> Result<Vec<WrittenZone>, ZoneTextError> {
    let (mut zones, mut column) = (Vec::new(), 1);
    for part in text.split(';') {
        let words = split_words(part, column);
        column += part.chars().count() + 1;
        if let Some((first, rest)) = words.split_first() {
            zones.push(parse_zone(*first, rest)?);
        }
    }
    Ok(zones)
}

fn split_words(part: &str, first_column: usize) -> Vec<Word<'_>> {
    let mut words: Vec<Word<'_>> = Vec::new();
    let mut begun: Option<(usize, usize)> = None;
    let ends = part.char_indices().map(|(at, c)| (at, c.is_whitespace()));
    for (index, (at, is_space)) in ends.chain([(part.len(), true)]).enumerate() {
        match begun {
            None if !is_space => begun = Some((at, first_column + index)),
            Some((start, column)) if is_space => {
                words.push(Word { column, text: &part[start..at] });
                begun = None;
            }
            _ => {}
        }
    }
    words
}

fn parse_zone(name: Word<'_>, rest: &[Word<'_>]) -> Result<WrittenZone, ZoneTextError> {
    if !is_name(name.text) {
        return Err(name.fault(ZoneTextFault::Name(name.text.into())));
    }
    let Some((kind, mut shape)) = rest.split_first() else {
        return Err(name.fault(ZoneTextFault::NoKind));
    };
    let duty = parse_duty(*kind)?;
    let mut margin = None;
    while let Some((word, after)) = shape.split_first()
        && let Some(length) = word.text.strip_prefix("margin=")
    {
        if margin.replace(parse_length(*word, length)?).is_some() {
            return Err(word.fault(ZoneTextFault::SecondMargin));
        }
        shape = after;
    }
    let shape = parse_shape(*kind, shape)?;
    let margin_m = margin.unwrap_or(name.at(0.0));
    Ok(WrittenZone { name: name.at(name.text.to_owned()), duty, margin_m, shape })
}

fn parse_duty(word: Word<'_>) -> Result<WrittenDuty, ZoneTextError> {
    match word.text {
        "no-go" => Ok(WrittenDuty::NoGo),
        "stay-in" => Ok(WrittenDuty::StayIn),
        "observe" => Ok(WrittenDuty::Observe),
        text => {
            let Some(speed) = text.strip_prefix("speed=") else {
                return Err(word.fault(ZoneTextFault::Kind(text.into())));
            };
            parse_in(speed, Dimension::Speed, "a speed such as 0.3m/s")
                .map(WrittenDuty::Speed)
                .map_err(|fault| word.fault(fault))
        }
    }
}

fn parse_length(word: Word<'_>, text: &str) -> Result<InText<f64>, ZoneTextError> {
    let length_m = parse_in(text, Dimension::Length, "a length such as 2m");
    length_m.map(|length_m| word.at(length_m)).map_err(|fault| word.fault(fault))
}

/// `before` is where a missing shape is reported.
fn parse_shape(before: Word<'_>, words: &[Word<'_>]) -> Result<WrittenShape, ZoneTextError> {
    match words {
        [] => Err(before.fault(ZoneTextFault::NoShape)),
        [circle, rest @ ..] if circle.text == "circle" => {
            let [centre, radius] = rest else { return Err(circle.fault(ZoneTextFault::Circle)) };
            let centre = parse_point(*centre)?;
            Ok(WrittenShape::Circle { centre, radius_m: parse_length(*radius, radius.text)? })
        }
        words => {
            let corners: Result<_, _> = words.iter().map(|word| parse_point(*word)).collect();
            Ok(WrittenShape::Polygon(corners?))
        }
    }
}

fn parse_point(word: Word<'_>) -> Result<InText<[f64; 2]>, ZoneTextError> {
    let point =
        word.text.split_once(',').and_then(|(x, y)| Some([x.parse().ok()?, y.parse().ok()?]));
    point
        .map(|point| word.at(point))
        .ok_or_else(|| word.fault(ZoneTextFault::Point(word.text.into())))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TEXT: &str = "school no-go margin=2m 3,4 9,4 9,8; yard stay-in 0,0 20,0 20,20 0,20;\n\
                        crossing speed=0.3m/s circle 4,4 2m; pond observe margin=50cm circle -1,0 1m;";

    #[test]
    fn all_kinds_and_shapes_are_read() {
        let zones = parse_zones(TEXT).expect("zones");
        let read: Vec<_> = zones
            .iter()
            .map(|zone| (zone.name.value.as_str(), zone.duty, zone.margin_m.value))
            .collect();
        let expected = [
            ("school", WrittenDuty::NoGo, 2.0),
            ("yard", WrittenDuty::StayIn, 0.0),
            ("crossing", WrittenDuty::Speed(0.3), 0.0),
            ("pond", WrittenDuty::Observe, 0.5),
        ];
        assert_eq!(read, expected);
        let WrittenShape::Polygon(yard) = &zones[1].shape else { panic!("it is a polygon") };
        assert_eq!((yard[2].value, yard[2].column), ([20.0, 20.0], 59));
        for nothing in ["", " ;\n; "] {
            assert_eq!(parse_zones(nothing), Ok(Vec::new()));
        }
    }

    #[track_caller]
    fn check(text: &str, column: usize, expected: &str) {
        let error = parse_zones(text).expect_err("it is refused");
        assert_eq!(error.column, column, "{text}: {error}");
        assert!(error.to_string().contains(expected), "{text}: {error}");
    }

    #[test]
    fn a_fault_is_reported_with_its_place() {
        check("3rd no-go 1,1 2,2 3,1", 1, "`3rd` is no name");
        check("a forbidden 1,1 2,2 3,1", 3, "not `forbidden`");
        check("é; a", 1, "`é` is no name");
        check("a", 1, "no kind");
        check("a no-go 1,1 2,2 3,1;  b stay-in", 25, "no shape");
        check("a no-go margin=2 1,1 2,2 3,1", 9, "a length such as 2m");
        check("a no-go margin=1m margin=2m 1,1 2,2 3,1", 19, "second margin");
        check("a speed=3 circle 1,1 2m", 3, "a speed such as 0.3m/s");
        check("a no-go 1,1 2;2", 13, "`2` is no point");
        check("a no-go circle 1,1", 9, "centre and its radius");
    }

    fn any_zone() -> impl Strategy<Value = WrittenZone> {
        let point = || [-1e5..1e5, -1e5..1e5].prop_map(InText::nowhere);
        let shape = prop_oneof![
            prop::collection::vec(point(), 1..9).prop_map(WrittenShape::Polygon),
            (point(), 1e-3..1e3).prop_map(|(centre, radius_m)| {
                WrittenShape::Circle { centre, radius_m: InText::nowhere(radius_m) }
            }),
        ];
        let duty = prop_oneof![
            Just(WrittenDuty::NoGo),
            Just(WrittenDuty::StayIn),
            Just(WrittenDuty::Observe),
            (1e-3..1e2).prop_map(WrittenDuty::Speed),
        ];
        ("[a-z][a-z0-9_-]{0,8}", duty, 1e-3..1e2, shape).prop_map(
            |(name, duty, margin_m, shape)| {
                let (name, margin_m) = (InText::nowhere(name), InText::nowhere(margin_m));
                WrittenZone { name, duty, margin_m, shape }
            },
        )
    }

    proptest! {
        #[test]
        fn written_zones_are_read_back(zones in prop::collection::vec(any_zone(), 0..6)) {
            let write = |zones: &[WrittenZone]| {
                zones.iter().map(WrittenZone::to_string).collect::<Vec<_>>().join("; ")
            };
            let text = write(&zones);
            prop_assert_eq!(write(&parse_zones(&text).unwrap()), text);
        }

        #[test]
        fn any_text_is_read_or_refused_at_a_place_in_it(text in "[a-z0-9,;=. é-]{0,60}") {
            if let Err(error) = parse_zones(&text) {
                prop_assert!((1..=text.chars().count()).contains(&error.column), "{}", error);
            }
        }
    }
}
