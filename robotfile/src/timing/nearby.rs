//! The zones near a robot: how far it is from each, for people. What must be exact is compared by the
//! predicates of `armor-geo` instead.

use armor_geo::{MapArea, MapPoint, MapSegment, PointLocation};

use crate::site_map::{SiteMap, ZoneKind};

/// Zones that are further away than this are not near.
const NEAR_M: f64 = 10.0;

/// A zone near a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneNearby {
    /// Its name.
    pub zone: String,
    /// What it means.
    pub kind: ZoneKind,
    /// The distance in metres between the rim of the robot and the boundary of the zone with its margin; 0
    /// where they meet. Of a zone to stay in: as long as the robot is within it.
    pub distance_m: f64,
    /// Whether the robot is in it, with a part of it and within the margin; of a zone to stay in: with all
    /// of it.
    pub is_inside: bool,
}

/// The zones near a robot of a radius, the nearest first.
pub(super) fn find_zones(map: &SiteMap, at: MapPoint, radius_m: f64) -> Vec<ZoneNearby> {
    let zones = map.zones.iter().map(|zone| {
        let margin_m = zone.margin.metres();
        // Negative within.
        let from_m = signed_distance_m(&zone.area.value, at);
        let (distance_m, is_inside) = match zone.kind {
            ZoneKind::StayIn => {
                let left_m = -from_m - margin_m - radius_m;
                (left_m.max(0.0), left_m >= 0.0)
            }
            ZoneKind::NoGo | ZoneKind::Speed | ZoneKind::Observe => {
                let left_m = from_m - margin_m - radius_m;
                (left_m.max(0.0), left_m <= 0.0)
            }
        };
        ZoneNearby { zone: zone.name.value.clone(), kind: zone.kind, distance_m, is_inside }
    });
    let is_near = |zone: &ZoneNearby| zone.distance_m <= NEAR_M;
    let mut near: Vec<_> = zones.filter(is_near).collect();
    near.sort_by(|one, other| one.distance_m.total_cmp(&other.distance_m));
    near
}

/// The distance of a point from the boundary of an area, negative within it.
fn signed_distance_m(area: &MapArea, at: MapPoint) -> f64 {
    let distance_m = match area {
        MapArea::Circle(circle) => {
            return circle.centre().distance_m(at) - circle.radius().metres();
        }
        MapArea::Polygon(polygon) => {
            let sides = polygon.edges().map(|side| distance_from_m(side, at));
            sides.fold(f64::INFINITY, f64::min)
        }
    };
    if area.locate(at) == PointLocation::Inside { -distance_m } else { distance_m }
}

/// The distance of a point from a segment.
pub(super) fn distance_from_m(segment: MapSegment, at: MapPoint) -> f64 {
    segment.point_at(segment.share_nearest_to(at)).distance_m(at)
}
