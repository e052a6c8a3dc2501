//! A text of zones into the zones of algorithms.

use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon, ShapeError};
use armor_sdk::wire::zone_text::{
    InText, WrittenDuty, WrittenShape, WrittenZone, ZoneTextError, parse_zones,
};
use armor_zones::{MapZone, ZoneDuty, ZoneMap, ZoneMapError};
use thiserror::Error;

/// Why a text holds no usable zones.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ZoneParsingError {
    /// It cannot be read.
    #[error(transparent)]
    Text(#[from] ZoneTextError),
    /// A shape or length that does not exist.
    #[error("the zones, at character {column}: {fault}")]
    Shape {
        /// The character at which it begins, counted from 1.
        column: usize,
        /// What is wrong with it.
        fault: ShapeError,
    },
    /// Zones that cannot be together.
    #[error("the zones, at character {column}: {fault}")]
    Map {
        /// The character at which the zone begins, counted from 1.
        column: usize,
        /// What is wrong.
        fault: ZoneMapError,
    },
}

/// Reads zones as people write them, such as `school no-go margin=2m 3,4 9,4 9,8`; the grammar is that of
/// [`parse_zones`].
///
/// # Errors
/// The first fault, with its place.
pub fn parse_zone_map(text: &str) -> Result<ZoneMap, ZoneParsingError> {
    let written = parse_zones(text)?;
    let zones: Result<Vec<_>, _> = written.iter().map(build_map_zone).collect();
    ZoneMap::new(zones?).map_err(|fault| {
        // The second zone of a name, or the zone without a speed; of too many, the last.
        let named = match &fault {
            ZoneMapError::SameName(name) | ZoneMapError::NoSpeed { name, .. } => Some(name),
            _ => None,
        };
        let is_meant = |zone: &&WrittenZone| named.is_none_or(|name| zone.name.value == *name);
        let column = written.iter().rev().find(is_meant).map_or(1, |zone| zone.name.column);
        ZoneParsingError::Map { column, fault }
    })
}

fn build_map_zone(zone: &WrittenZone) -> Result<MapZone, ZoneParsingError> {
    let duty = match zone.duty {
        WrittenDuty::NoGo => ZoneDuty::NoGo,
        WrittenDuty::StayIn => ZoneDuty::StayIn,
        WrittenDuty::Speed(limit_mps) => ZoneDuty::Speed { limit_mps },
        WrittenDuty::Observe => ZoneDuty::Observe,
    };
    let margin = build_length(zone.margin_m)?;
    let area = match &zone.shape {
        WrittenShape::Polygon(corners) => {
            let column = corners.first().map_or(zone.name.column, |corner| corner.column);
            let corners: Result<_, _> = corners.iter().map(|corner| build_point(*corner)).collect();
            MapArea::from(place(column, MapPolygon::new(corners?))?)
        }
        WrittenShape::Circle { centre, radius_m } => {
            let (centre, radius) = (build_point(*centre)?, build_length(*radius_m)?);
            MapArea::from(place(radius_m.column, MapCircle::new(centre, radius))?)
        }
    };
    Ok(MapZone { name: zone.name.value.clone(), duty, margin, area })
}

fn build_length(length_m: InText<f64>) -> Result<Clearance, ZoneParsingError> {
    place(length_m.column, Clearance::new(length_m.value))
}

fn build_point(point: InText<[f64; 2]>) -> Result<MapPoint, ZoneParsingError> {
    let [x_m, y_m] = point.value;
    place(point.column, MapPoint::new(x_m, y_m))
}

fn place<T>(column: usize, made: Result<T, ShapeError>) -> Result<T, ZoneParsingError> {
    made.map_err(|fault| ZoneParsingError::Shape { column, fault })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_are_read_with_their_geometry() {
        let text = "school no-go margin=2m 3,4 9,4 9,8; crossing speed=0.3m/s circle 4,4 2m";
        let map = parse_zone_map(text).expect("zones");
        assert_eq!(map.zones()[0].margin.metres(), 2.0);
        assert_eq!(map.zones()[1].duty, ZoneDuty::Speed { limit_mps: 0.3 });
        let MapArea::Polygon(school) = &map.zones()[0].area else { panic!("it is a polygon") };
        assert_eq!(school.corners()[2], MapPoint::new(9.0, 8.0).expect("a point"));
        assert!(parse_zone_map("").expect("no zones").is_empty());
    }

    #[test]
    fn a_fault_is_reported_with_its_place() {
        for (text, column, expected) in [
            ("a no-go margin=-2m 1,1 2,2 3,1", 9, "length -2"),
            ("a speed=0m/s circle 1,1 2m", 1, "speed above 0"),
            ("a no-go 1,1 2,NaN 3,1", 13, "coordinate NaN"),
            ("a no-go 1,1 2,2", 9, "at least 3"),
            ("a no-go 0,0 2,2 2,0 0,2", 9, "cross"),
            ("a no-go circle 1,1 0m", 20, "radius must be"),
            ("a observe circle 1,1 1m; a observe circle 1,1 1m", 26, "two zones are named `a`"),
            ("a", 1, "no kind"),
        ] {
            let error = parse_zone_map(text).expect_err(text).to_string();
            assert!(error.contains(&format!("at character {column}:")), "{text}: {error}");
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
