//! How long a straight drive takes.

use armor_geo::{Clearance, MapPoint, MapSegment};
use armor_wire::quantity::{self, Dimension};

use crate::drawn_route::{DrawnLeg, DrawnRoute};
use crate::model::System;
use crate::site_map::{SiteMap, ZoneKind};

/// Parts of a drive that are compared with slow zones.
const PARTS: u32 = 128;
/// Longest time that is counted, in seconds: 31 years.
const MOST_S: f64 = 1e9;

/// The lengths of drives, from a point to another one for a robot of a radius.
pub trait DriveLengths {
    /// Returns the length in metres, at least the straight distance.
    fn length_m(&self, from: MapPoint, to: MapPoint, radius: Clearance) -> f64;
}

/// All drives are straight.
#[derive(Clone, Copy, Debug)]
pub struct StraightLengths;

impl DriveLengths for StraightLengths {
    fn length_m(&self, from: MapPoint, to: MapPoint, _radius: Clearance) -> f64 {
        from.distance_m(to)
    }
}

/// The times of a drive, in nanoseconds; without a nominal and a longest time, its speed is not known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DriveTime {
    pub(crate) least_ns: i128,
    /// At exactly its speed, and slower where a zone asks for it.
    pub(crate) nominal_ns: Option<i128>,
    pub(crate) most_ns: Option<i128>,
}

/// What determines the times of a route's drives.
pub(crate) struct Driving<'a> {
    pub(crate) route: &'a DrawnRoute,
    pub(crate) map: Option<&'a SiteMap>,
    /// The speed that the file gives to the component of the pace, in metres per second.
    pub(crate) usual_mps: Option<f64>,
    pub(crate) lengths: &'a dyn DriveLengths,
}

impl<'a> Driving<'a> {
    pub(crate) fn new(
        route: &'a DrawnRoute,
        map: Option<&'a SiteMap>,
        system: &System,
        lengths: &'a dyn DriveLengths,
    ) -> Self {
        let usual_mps = route.pace.as_ref().and_then(|pace| {
            let component = system.component(&pace.component.value)?;
            parse_speed(&component.parameter(&pace.port.value)?.value.value)
        });
        Self { route, map, usual_mps, lengths }
    }

    /// The time of a leg, or of a part of it.
    pub(crate) fn leg_time(&self, leg: &DrawnLeg, from: MapPoint, to: MapPoint) -> DriveTime {
        let own = leg.speed.as_ref().and_then(|speed| parse_speed(&speed.value));
        self.time(own.or(self.usual_mps), from, to)
    }

    /// The time of a drive to a rally point, at the usual speed.
    pub(crate) fn exit_time(&self, from: MapPoint, to: MapPoint) -> DriveTime {
        self.time(self.usual_mps, from, to)
    }

    fn time(&self, speed_mps: Option<f64>, from: MapPoint, to: MapPoint) -> DriveTime {
        let Some(speed_mps) = speed_mps else {
            return DriveTime { least_ns: 0, nominal_ns: None, most_ns: None };
        };
        let tolerance = self.route.tolerance;
        let straight_m = from.distance_m(to);
        let length_m = self.lengths.length_m(from, to, self.route.radius).max(straight_m);
        let least_s = straight_m / (speed_mps * (1.0 + tolerance));
        let (slow_m, slow_s) = self.slow_part(speed_mps, from, to);
        let rest_m = (length_m - slow_m).max(0.0);
        let nominal_s = rest_m / speed_mps + slow_s;
        DriveTime {
            least_ns: nanoseconds(least_s),
            nominal_ns: Some(nanoseconds(nominal_s)),
            most_ns: Some(nanoseconds(nominal_s / (1.0 - tolerance))),
        }
    }

    /// The metres of the straight drive within slow zones, and the time for them; rather too many than
    /// too few.
    fn slow_part(&self, speed_mps: f64, from: MapPoint, to: MapPoint) -> (f64, f64) {
        let zones = self.map.map(|map| map.zones.as_slice()).unwrap_or_default();
        let zones: Vec<_> = zones
            .iter()
            .filter(|zone| zone.kind == ZoneKind::Speed)
            .filter_map(|zone| Some((zone, zone.speed_mps.as_ref()?.value)))
            .filter(|(_, limit_mps)| *limit_mps < speed_mps)
            .map(|(zone, limit_mps)| {
                let margin = zone.margin.plus(self.route.radius).unwrap_or(zone.margin);
                (&zone.area.value, margin, limit_mps)
            })
            .collect();
        let whole = MapSegment::new(from, to);
        let near: Vec<_> =
            zones.iter().filter(|(area, margin, _)| whole.intrudes(area, *margin)).collect();
        if near.is_empty() {
            return (0.0, 0.0);
        }
        let part_m = whole.length_m() / f64::from(PARTS);
        let point = |number: u32| whole.point_at(f64::from(number) / f64::from(PARTS));
        let (mut slow_m, mut slow_s) = (0.0, 0.0);
        for number in 0..PARTS {
            let part = MapSegment::new(point(number), point(number + 1));
            let here = near.iter().filter(|(area, margin, _)| part.intrudes(area, *margin));
            if let Some(limit_mps) = here.map(|zone| zone.2).min_by(f64::total_cmp) {
                slow_m += part_m;
                slow_s += part_m / limit_mps;
            }
        }
        (slow_m, slow_s)
    }
}

fn parse_speed(text: &str) -> Option<f64> {
    let speed = quantity::parse_in(text, Dimension::Speed, "a speed").ok();
    speed.filter(|speed| *speed > 0.0)
}

fn nanoseconds(time_s: f64) -> i128 {
    (time_s.min(MOST_S) * 1e9).round() as i128
}
