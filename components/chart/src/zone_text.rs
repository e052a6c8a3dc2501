//! Zones as people write them:
//!
//! ```text
//! school no-go margin=2m 3,4 9,4 9,8; yard stay-in 0,0 20,0 20,20 0,20; crossing speed=0.3m/s circle 4,4 2m
//! ```

use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon, ShapeError};
use armor_quantity::{Dimension, QuantityError, parse_in};
use armor_zones::{MapZone, ZoneDuty, ZoneMap, ZoneMapError};
use thiserror::Error;

/// A text of zones that cannot be read, and where.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the zones, at character {column}: {fault}")]
pub struct ZoneTextError {
    /// The character at which the faulty part begins, counted from 1.
    pub column: usize,
    /// What is wrong there.
    pub fault: ZoneTextFault,
}

/// What is wrong with a text of zones.
#[derive(Clone, Debug, PartialEq, Error)]
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
    /// A shape or length that does not exist.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Zones that cannot be together.
    #[error(transparent)]
    Zones(#[from] ZoneMapError),
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
}

/// Reads zones, separated by `;`: name, kind, `margin=LENGTH` if there is one, and shape. The kind
/// is `no-go`, `stay-in`, `observe` or `speed=SPEED`; the shape is the corners `x,y` of a polygon in
/// metres, or `circle x,y RADIUS`. An empty text has no zones.
///
/// # Errors
/// The first fault, with its place.
pub fn parse_zones(text: &str) -> Result<ZoneMap, ZoneTextError> {
    let (mut zones, mut column) = (Vec::new(), 1);
    let mut starts = Vec::new();
    for part in text.split(';') {
        let words = split_words(part, column);
        column += part.chars().count() + 1;
        if let Some((first, rest)) = words.split_first() {
            zones.push(parse_zone(*first, rest)?);
            starts.push(*first);
        }
    }
    ZoneMap::new(zones).map_err(|fault| {
        // The second zone of a name, or the zone without a speed; of too many, the last.
        let named = match &fault {
            ZoneMapError::SameName(name) | ZoneMapError::NoSpeed { name, .. } => Some(name),
            _ => None,
        };
        let at = starts.iter().rev().find(|word| named.is_none_or(|name| word.text == name));
        ZoneTextError { column: at.map_or(1, |word| word.column), fault: fault.into() }
    })
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

fn parse_zone(name: Word<'_>, rest: &[Word<'_>]) -> Result<MapZone, ZoneTextError> {
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
    let area = parse_area(*kind, shape)?;
    let margin = margin.unwrap_or(Clearance::ZERO);
    Ok(MapZone { name: name.text.into(), duty, margin, area })
}

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'))
}

fn parse_duty(word: Word<'_>) -> Result<ZoneDuty, ZoneTextError> {
    match word.text {
        "no-go" => Ok(ZoneDuty::NoGo),
        "stay-in" => Ok(ZoneDuty::StayIn),
        "observe" => Ok(ZoneDuty::Observe),
        text => {
            let Some(speed) = text.strip_prefix("speed=") else {
                return Err(word.fault(ZoneTextFault::Kind(text.into())));
            };
            parse_in(speed, Dimension::Speed, "a speed such as 0.3m/s")
                .map(|limit_mps| ZoneDuty::Speed { limit_mps })
                .map_err(|fault| word.fault(fault))
        }
    }
}

fn parse_length(word: Word<'_>, text: &str) -> Result<Clearance, ZoneTextError> {
    let length_m = parse_in(text, Dimension::Length, "a length such as 2m");
    let length_m = length_m.map_err(|fault| word.fault(fault))?;
    Clearance::new(length_m).map_err(|fault| word.fault(fault))
}

/// `before` is where a missing shape is reported.
fn parse_area(before: Word<'_>, words: &[Word<'_>]) -> Result<MapArea, ZoneTextError> {
    match words {
        [] => Err(before.fault(ZoneTextFault::NoShape)),
        [circle, rest @ ..] if circle.text == "circle" => {
            let [centre, radius] = rest else { return Err(circle.fault(ZoneTextFault::Circle)) };
            let centre = parse_point(*centre)?;
            let length = parse_length(*radius, radius.text)?;
            let circle = MapCircle::new(centre, length).map_err(|fault| radius.fault(fault))?;
            Ok(circle.into())
        }
        [first, ..] => {
            let corners: Result<_, _> = words.iter().map(|word| parse_point(*word)).collect();
            Ok(MapPolygon::new(corners?).map_err(|fault| first.fault(fault))?.into())
        }
    }
}

fn parse_point(word: Word<'_>) -> Result<MapPoint, ZoneTextError> {
    let point =
        word.text.split_once(',').and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)));
    let (x_m, y_m) = point.ok_or_else(|| word.fault(ZoneTextFault::Point(word.text.into())))?;
    MapPoint::new(x_m, y_m).map_err(|fault| word.fault(fault))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "school no-go margin=2m 3,4 9,4 9,8; yard stay-in 0,0 20,0 20,20 0,20;\n\
                        crossing speed=0.3m/s circle 4,4 2m; pond observe margin=50cm circle -1,0 1m;";

    #[test]
    fn all_kinds_and_shapes_are_read() {
        let map = parse_zones(TEXT).expect("zones");
        let read: Vec<_> = map
            .zones()
            .iter()
            .map(|zone| (zone.name.as_str(), zone.duty, zone.margin.metres()))
            .collect();
        let expected = [
            ("school", ZoneDuty::NoGo, 2.0),
            ("yard", ZoneDuty::StayIn, 0.0),
            ("crossing", ZoneDuty::Speed { limit_mps: 0.3 }, 0.0),
            ("pond", ZoneDuty::Observe, 0.5),
        ];
        assert_eq!(read, expected);
        let MapArea::Polygon(yard) = &map.zones()[1].area else { panic!("the yard is a polygon") };
        assert_eq!(yard.corners()[2], MapPoint::new(20.0, 20.0).expect("a point"));
        for nothing in ["", " ;\n; "] {
            assert!(parse_zones(nothing).expect("no zones").is_empty());
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
        check("a no-go margin=-2m 1,1 2,2 3,1", 9, "length -2");
        check("a no-go margin=1m margin=2m 1,1 2,2 3,1", 19, "second margin");
        check("a speed=3 circle 1,1 2m", 3, "a speed such as 0.3m/s");
        check("a speed=0m/s circle 1,1 2m", 1, "speed above 0");
        check("a no-go 1,1 2;2", 13, "`2` is no point");
        check("a no-go 1,1 2,NaN 3,1", 13, "coordinate NaN");
        check("a no-go 1,1 2,2", 9, "at least 3");
        check("a no-go 0,0 2,2 2,0 0,2", 9, "cross");
        check("a no-go circle 1,1", 9, "centre and its radius");
        check("a no-go circle 1,1 0m", 20, "radius must be");
        check("a observe circle 1,1 1m; a observe circle 1,1 1m", 26, "two zones are named `a`");
    }

    #[test]
    fn any_change_of_a_text_is_read_or_refused_at_a_place_in_it() {
        let mut random = fastrand::Rng::with_seed(3);
        let (mut read, mut refused) = (0, 0);
        for _ in 0..10_000 {
            let mut text: Vec<char> = TEXT.chars().collect();
            for _ in 0..1 + random.usize(..3) {
                let at = random.usize(..text.len());
                match random.u8(..3) {
                    0 => drop(text.remove(at)),
                    1 => text.insert(
                        at,
                        random.choice([' ', ';', ',', '=', '-', 'é', '1', 'm']).unwrap_or(' '),
                    ),
                    _ => text.swap(at, 0),
                }
            }
            let length = text.len();
            match parse_zones(&text.into_iter().collect::<String>()) {
                Ok(_) => read += 1,
                Err(error) => {
                    assert!((1..=length + 1).contains(&error.column), "{error}");
                    refused += 1;
                }
            }
        }
        assert!(read > 100 && refused > 100, "{read} read, {refused} refused");
    }
}
