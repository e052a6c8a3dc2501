//! The message `Zones` into the zones of algorithms and back, and whether they are of the robot's
//! map frame.

use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon, ShapeError};
use armor_sdk::messages::{Point, Zone, ZoneRule, Zones};
use armor_zones::{MapZone, ZoneDuty, ZoneMap, ZoneMapError};
use thiserror::Error;

use crate::frame::FrameWatch;

/// Why a message holds no usable zones.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ZonesError {
    /// The shape or the margin of a zone.
    #[error("zone `{name}`: {fault}")]
    Shape {
        /// The zone.
        name: String,
        /// What is wrong with it.
        fault: ShapeError,
    },
    /// The zones together.
    #[error(transparent)]
    Map(#[from] ZoneMapError),
}

/// Returns the zones of a message.
///
/// # Errors
/// [`ZonesError`]: none of them is used then.
pub fn read_zones(message: &Zones) -> Result<ZoneMap, ZonesError> {
    let read = |zone| {
        read_zone(zone).map_err(|fault| ZonesError::Shape { name: zone.name.clone(), fault })
    };
    let zones: Result<Vec<MapZone>, ZonesError> = message.zones.iter().map(read).collect();
    Ok(ZoneMap::new(zones?)?)
}

fn read_zone(zone: &Zone) -> Result<MapZone, ShapeError> {
    let area = if zone.polygon.is_empty() {
        let centre = MapPoint::new(zone.centre.x, zone.centre.y)?;
        MapArea::from(MapCircle::new(centre, Clearance::new(zone.radius)?)?)
    } else {
        let corners = zone.polygon.iter().map(|corner| MapPoint::new(corner.x, corner.y));
        MapArea::from(MapPolygon::new(corners.collect::<Result<_, _>>()?)?)
    };
    let duty = match zone.kind {
        ZoneRule::NoGo => ZoneDuty::NoGo,
        ZoneRule::StayIn => ZoneDuty::StayIn,
        ZoneRule::Speed => ZoneDuty::Speed { limit_mps: zone.speed },
        ZoneRule::Observe => ZoneDuty::Observe,
    };
    Ok(MapZone { name: zone.name.clone(), duty, margin: Clearance::new(zone.margin)?, area })
}

/// Makes the message of the zones in a frame.
pub fn build_zones(stamp_s: f64, frame: &str, zones: &ZoneMap) -> Zones {
    let zones = zones.zones().iter().map(build_zone).collect();
    Zones { stamp: stamp_s, frame: frame.into(), zones }
}

fn build_zone(zone: &MapZone) -> Zone {
    let point = |at: MapPoint| Point { x: at.x_m(), y: at.y_m(), z: 0.0 };
    let (kind, speed) = match zone.duty {
        ZoneDuty::NoGo => (ZoneRule::NoGo, 0.0),
        ZoneDuty::StayIn => (ZoneRule::StayIn, 0.0),
        ZoneDuty::Speed { limit_mps } => (ZoneRule::Speed, limit_mps),
        ZoneDuty::Observe => (ZoneRule::Observe, 0.0),
    };
    let (name, margin) = (zone.name.clone(), zone.margin.metres());
    let empty = Zone { name, kind, margin, speed, ..Zone::default() };
    match &zone.area {
        MapArea::Polygon(polygon) => {
            Zone { polygon: polygon.corners().iter().map(|at| point(*at)).collect(), ..empty }
        }
        MapArea::Circle(circle) => {
            Zone { centre: point(circle.centre()), radius: circle.radius().metres(), ..empty }
        }
    }
}

/// The newest zones of an optional input, and whether they can be obeyed.
///
/// A component whose input is linked but has no zones of the robot's map frame does not know where
/// it may be: [`ZoneWatch::fault`] states why, and the robot must not drive by itself.
#[derive(Clone, Debug, Default)]
pub struct ZoneWatch {
    is_linked: bool,
    /// The frame of the newest zones, or why they are not usable.
    newest: Option<Result<String, ZonesError>>,
}

impl ZoneWatch {
    /// Takes whether something is linked to the input.
    pub fn expect_zones(&mut self, is_linked: bool) {
        self.is_linked = is_linked;
    }

    /// Takes a message; returns its zones if they are sound.
    pub fn zones_seen(&mut self, message: &Zones) -> Option<ZoneMap> {
        let zones = read_zones(message);
        self.newest = Some(zones.as_ref().map(|_| message.frame.clone()).map_err(Clone::clone));
        zones.ok()
    }

    /// Returns why the zones of the robot's map frame are not known; `None` if they are, or if the
    /// input is not linked.
    pub fn fault(&self, frames: &FrameWatch) -> Option<String> {
        match &self.newest {
            None if self.is_linked => Some("no zones have arrived yet".into()),
            None => None,
            Some(Err(error)) => Some(format!("the zones are not usable: {error}")),
            Some(Ok(frame)) if frames.is_usable(frame) => None,
            Some(Ok(frame)) => {
                let now = frames.frame().unwrap_or_default();
                Some(format!("the zones are in the frame {frame}, and the robot is in {now}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f64, y: f64) -> Point {
        Point { x, y, z: 0.0 }
    }

    fn message() -> Zones {
        let polygon = vec![corner(0.0, 0.0), corner(4.0, 0.0), corner(4.0, 3.0)];
        let school = Zone { name: "school".into(), margin: 2.0, polygon, ..Zone::default() };
        let (kind, speed, radius) = (ZoneRule::Speed, 0.3, 1.5);
        let centre = corner(8.0, 1.0);
        let crossing =
            Zone { name: "crossing".into(), kind, speed, centre, radius, ..Zone::default() };
        Zones { stamp: 3.0, frame: "map".into(), zones: vec![school, crossing] }
    }

    #[test]
    fn zones_come_back_from_their_message() {
        let zones = read_zones(&message()).expect("zones");
        assert_eq!(zones.zones()[1].duty, ZoneDuty::Speed { limit_mps: 0.3 });
        assert_eq!(build_zones(3.0, "map", &zones), message());
    }

    #[test]
    fn a_faulty_zone_is_refused_by_its_name() {
        let refused = |change: fn(&mut Zone), expected: &str| {
            let mut message = message();
            change(&mut message.zones[0]);
            let error = read_zones(&message).expect_err("it is refused").to_string();
            assert!(error.contains("school") && error.contains(expected), "{error}");
        };
        refused(|zone| zone.margin = f64::NAN, "length NaN");
        refused(|zone| zone.polygon.truncate(2), "at least 3");
        refused(|zone| zone.polygon.clear(), "radius");
        refused(|zone| zone.polygon[1].x = f64::INFINITY, "coordinate");
        refused(|zone| zone.kind = ZoneRule::Speed, "speed above 0");
    }

    #[test]
    fn zones_that_are_missing_or_of_another_epoch_are_a_fault() {
        let (mut watch, mut frames) = (ZoneWatch::default(), FrameWatch::default());
        assert_eq!(watch.fault(&frames), None, "the input is not linked");
        watch.expect_zones(true);
        assert!(watch.fault(&frames).is_some_and(|why| why.contains("no zones")));
        assert!(watch.zones_seen(&message()).is_some());
        assert_eq!(watch.fault(&frames), None, "no frame is known yet");
        frames.frame_seen("map#3f2a");
        let why = watch.fault(&frames).expect("another epoch");
        assert_eq!(why, "the zones are in the frame map, and the robot is in map#3f2a");
        watch.zones_seen(&Zones { frame: "map#3f2a".into(), ..message() });
        assert_eq!(watch.fault(&frames), None);
        let mut faulty = message();
        faulty.zones[0].margin = -1.0;
        assert_eq!(watch.zones_seen(&faulty), None);
        assert!(watch.fault(&frames).is_some_and(|why| why.contains("`school`")));
    }
}
