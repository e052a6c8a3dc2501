//! Positions and shapes of the map: metres of its frame, or latitude and longitude.

use armor_geo::{
    Clearance, GeoPosition, MapArea, MapCircle, MapPoint, MapPolygon, MapPolyline, ShapeError,
};
use armor_wire::quantity::{self, Dimension};

use crate::code::Code;
use crate::fields::ElementFields;
use crate::finding::Finding;
use crate::read::limits::{MAX_MAP_CORNERS, MAX_SHAPE_CORNERS};
use crate::read::site_map::MapScale;
use crate::site_map::DrawnPosition;
use crate::source::Spanned;

const POSITION: &str = "a position is expected: metres x and y, such as 12.5 4, or latitude and \
                        longitude, such as 48.8583N 2.2945E";
const SHAPE: &str = "points are expected, such as 3,4 9,4 9,8; or 48.8583N,2.2945E …; or a circle, \
                     such as circle 5,6 3m";

/// Why a position cannot be used.
enum PositionFault {
    /// It is malformed, or does not exist.
    Bad(String),
    /// It is a latitude and longitude, and the map has no origin.
    NoOrigin,
}

/// A required position, `12.5 4.0` or `48.8583N 2.2945E`.
pub(super) fn read_position(
    fields: &mut ElementFields<'_, '_>,
    name: &'static str,
    scale: &MapScale,
) -> Option<Spanned<DrawnPosition>> {
    let written = fields.required(name)?;
    let mut words = written.value.split_ascii_whitespace();
    let pair = (words.next(), words.next(), words.next());
    let read = match pair {
        (Some(first), Some(second), None) => parse_pair(first, second, scale),
        _ => Err(PositionFault::Bad(POSITION.into())),
    };
    match read {
        Ok(position) => Some(written.with(position)),
        Err(fault) => {
            report_fault(fields, name, &written, fault);
            None
        }
    }
}

fn report_fault(
    fields: &mut ElementFields<'_, '_>,
    name: &str,
    written: &Spanned<String>,
    fault: PositionFault,
) {
    match fault {
        PositionFault::Bad(expected) => fields.bad_value(name, written, expected),
        PositionFault::NoOrigin => {
            let message = "where this latitude and longitude is on the map is unknown";
            let finding = Finding::new(Code::NoOrigin, &written.at, message);
            fields.report(finding.remedy(
                "write origin=\"48.8583 2.2945 35m\", the position of the map's origin, at <map>",
            ));
        }
    }
}

fn parse_pair(first: &str, second: &str, scale: &MapScale) -> Result<DrawnPosition, PositionFault> {
    let bad = |error: String| PositionFault::Bad(error);
    if let (Some(x), Some(y)) = (parse_decimal(first), parse_decimal(second)) {
        let point = MapPoint::new(x, y).map_err(|error| bad(error.to_string()))?;
        return Ok(DrawnPosition { point, geo: None });
    }
    let is_degrees = |word: &str, ends: [char; 2]| word.ends_with(ends);
    if !is_degrees(first, ['N', 'S']) || !is_degrees(second, ['E', 'W']) {
        return Err(bad(POSITION.into()));
    }
    let degrees = parse_degrees(first, ['N', 'S']).zip(parse_degrees(second, ['E', 'W']));
    let (latitude, longitude) = degrees.ok_or_else(|| bad(POSITION.into()))?;
    let placement = scale.placement.as_ref();
    let height_m = placement.map_or(0.0, |placement| placement.origin().height_m());
    let geo = GeoPosition::new(latitude, longitude, height_m).map_err(|e| bad(e.to_string()))?;
    let placement = placement.ok_or(PositionFault::NoOrigin)?;
    let point = placement.map_from_geo(geo).map_err(|error| bad(error.to_string()))?;
    Ok(DrawnPosition { point, geo: Some(geo) })
}

/// `48.8583`, `48.8583N`, `2.5W`: degrees, negative to the south and west.
pub(super) fn parse_degrees(word: &str, ends: [char; 2]) -> Option<f64> {
    let [positive, negative] = ends;
    if let Some(number) = word.strip_suffix(positive) {
        return parse_decimal(number).filter(|degrees| *degrees >= 0.0);
    }
    if let Some(number) = word.strip_suffix(negative) {
        return parse_decimal(number).filter(|degrees| *degrees >= 0.0).map(|degrees| -degrees);
    }
    parse_decimal(word)
}

/// A number as the schema has it: no `inf`, `nan` or unit.
fn parse_decimal(word: &str) -> Option<f64> {
    let allowed =
        |byte: u8| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.' | b'e' | b'E');
    let is_plain = word.bytes().all(allowed) && word.bytes().any(|byte| byte.is_ascii_digit());
    word.parse::<f64>().ok().filter(|number| is_plain && number.is_finite())
}

/// A shape as it is written.
pub(super) enum WrittenShape {
    /// Points of a polygon or a line.
    Points(Vec<MapPoint>),
    /// A circle.
    Circle(MapCircle),
}

/// Reads a shape; none, with a finding, if it is malformed or the map has too many points.
pub(super) fn read_shape(
    fields: &mut ElementFields<'_, '_>,
    written: &Spanned<String>,
    scale: &mut MapScale,
) -> Option<WrittenShape> {
    let words: Vec<_> =
        written.value.split_ascii_whitespace().take(MAX_SHAPE_CORNERS + 2).collect();
    if words.len() > MAX_SHAPE_CORNERS || words.len() > scale.corners_left {
        let message = format!(
            "a shape has more than {MAX_SHAPE_CORNERS} points, or the map more than \
             {MAX_MAP_CORNERS}"
        );
        let finding = Finding::new(Code::TooMany, &written.at, message);
        fields.report(finding.remedy("draw it with fewer points: this is the format's limit"));
        return None;
    }
    scale.corners_left -= words.len();
    let read = match words.as_slice() {
        ["circle", centre, radius] => parse_circle(centre, radius, scale),
        points => points
            .iter()
            .map(|word| parse_corner(word, scale))
            .collect::<Result<_, _>>()
            .map(WrittenShape::Points),
    };
    read.map_err(|fault| report_fault(fields, "shape", written, fault)).ok()
}

fn parse_circle(
    centre: &str,
    radius: &str,
    scale: &MapScale,
) -> Result<WrittenShape, PositionFault> {
    let centre = parse_corner(centre, scale)?;
    let radius_m = quantity::parse_in(radius, Dimension::Length, "a radius such as 3m");
    let radius_m = radius_m.map_err(|_| {
        PositionFault::Bad("a radius with its unit is expected, such as circle 5,6 3m".into())
    })?;
    let bad = |error: ShapeError| PositionFault::Bad(error.to_string());
    let radius = Clearance::new(radius_m).map_err(bad)?;
    Ok(WrittenShape::Circle(MapCircle::new(centre, radius).map_err(bad)?))
}

fn parse_corner(word: &str, scale: &MapScale) -> Result<MapPoint, PositionFault> {
    let pair = word.split_once(',').ok_or_else(|| PositionFault::Bad(SHAPE.into()))?;
    let position = parse_pair(pair.0, pair.1, scale).map_err(|fault| match fault {
        PositionFault::Bad(expected) if expected == POSITION => PositionFault::Bad(SHAPE.into()),
        fault => fault,
    })?;
    Ok(position.point)
}

impl WrittenShape {
    /// An area; none, with a finding, if the points are not those of a simple polygon.
    pub(super) fn into_area(
        self,
        fields: &mut ElementFields<'_, '_>,
        written: Spanned<String>,
    ) -> Option<Spanned<MapArea>> {
        let area = match self {
            Self::Circle(circle) => Ok(circle.into()),
            Self::Points(points) => MapPolygon::new(points).map(MapArea::from),
        };
        checked(area, fields, &written)
    }

    /// A line; none, with a finding, if it is a circle or too short.
    pub(super) fn into_line(
        self,
        fields: &mut ElementFields<'_, '_>,
        written: Spanned<String>,
    ) -> Option<Spanned<MapPolyline>> {
        match self {
            Self::Points(points) => checked(MapPolyline::new(points), fields, &written),
            Self::Circle(_) => {
                let expected = "a line has points, such as 0,20 60,22; a <zone> may be a circle";
                fields.bad_value("shape", &written, expected.into());
                None
            }
        }
    }
}

fn checked<T>(
    shape: Result<T, ShapeError>,
    fields: &mut ElementFields<'_, '_>,
    written: &Spanned<String>,
) -> Option<Spanned<T>> {
    match shape {
        Ok(shape) => Some(written.with(shape)),
        Err(error) => {
            fields.bad_value("shape", written, error.to_string());
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_have_a_sign_or_a_letter() {
        assert_eq!(parse_degrees("48.5N", ['N', 'S']), Some(48.5));
        assert_eq!(parse_degrees("48.5S", ['N', 'S']), Some(-48.5));
        assert_eq!(parse_degrees("-48.5", ['N', 'S']), Some(-48.5));
        assert_eq!(parse_degrees("-48.5S", ['N', 'S']), None);
        for odd in ["inf", "NaN", "", "1m", "N", "e", "1e999"] {
            assert_eq!(parse_degrees(odd, ['N', 'S']), None, "{odd}");
        }
    }
}
