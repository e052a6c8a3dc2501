//! How near a robot truly came to the zones that it must not enter or leave.

use armor_geo::Clearance;
use armor_grid::Point2;
use armor_robotfile::site_map::{DrawnZone, SiteMap, ZoneKind};
use armor_zones::{MapZone, ZoneDuty, ZoneMap};

/// The least room that a robot had at a zone.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneRoom {
    /// The route of the robot; several, joined by a comma, that have one simulator.
    pub robot: String,
    /// The zone; several zones to stay in are one, joined by `or`.
    pub zone: String,
    /// The distance of the robot's outline from what it must keep out of; negative if it was within.
    pub room_m: f64,
    /// The margin that it should have kept.
    pub margin_m: f64,
}

impl ZoneRoom {
    /// Whether the robot was where it must not be.
    pub fn is_breach(&self) -> bool {
        self.room_m < 0.0
    }
}

/// The zones of a map, measured for one robot.
#[derive(Clone, Debug)]
pub struct ZoneMeter {
    robot: String,
    radius_m: f64,
    zones: ZoneMap,
    /// The least distance of the robot's centre, one for each barrier.
    least_m: Vec<f64>,
    margins_m: Vec<f64>,
}

impl ZoneMeter {
    /// Of the zones of a map, for a robot of this radius.
    pub fn new(map: Option<&SiteMap>, robot: String, radius_m: f64) -> Self {
        let drawn = map.map(|map| map.zones.as_slice()).unwrap_or_default();
        let zones = ZoneMap::new(drawn.iter().filter_map(read_zone).collect()).unwrap_or_default();
        let margins_m = zones.barriers().iter().map(|barrier| {
            let names: Vec<&str> = barrier.name().split(" or ").collect();
            let of_it = drawn.iter().filter(|zone| names.contains(&zone.name.value.as_str()));
            of_it.map(|zone| zone.margin.metres()).fold(f64::INFINITY, f64::min)
        });
        let margins_m: Vec<_> = margins_m.collect();
        Self { robot, radius_m, least_m: vec![f64::INFINITY; margins_m.len()], zones, margins_m }
    }

    /// Takes a true position of the robot.
    pub fn take_position(&mut self, x_m: f64, y_m: f64) {
        for (least_m, barrier) in self.least_m.iter_mut().zip(self.zones.barriers()) {
            *least_m = least_m.min(barrier.room_m(Point2::new(x_m, y_m)));
        }
    }

    /// The least room at each zone; none before the first position.
    pub fn rooms(&self) -> impl Iterator<Item = ZoneRoom> + '_ {
        let barriers = self.zones.barriers().iter().zip(&self.least_m).zip(&self.margins_m);
        let measured = barriers.filter(|((_, least_m), _)| least_m.is_finite());
        measured.map(|((barrier, least_m), margin_m)| ZoneRoom {
            robot: self.robot.clone(),
            zone: barrier.name().to_owned(),
            room_m: least_m - self.radius_m,
            margin_m: *margin_m,
        })
    }
}

/// None of a zone that closes nothing. The margin is compared afterwards.
fn read_zone(zone: &DrawnZone) -> Option<MapZone> {
    let duty = match zone.kind {
        ZoneKind::NoGo => ZoneDuty::NoGo,
        ZoneKind::StayIn => ZoneDuty::StayIn,
        ZoneKind::Speed | ZoneKind::Observe => return None,
    };
    let (name, area) = (zone.name.value.clone(), zone.area.value.clone());
    Some(MapZone { name, duty, margin: Clearance::ZERO, area })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const FILE: &str = r#"<armor version="1"><system name="one"><component name="w" kind="patrol"/></system>
      <mission goal="a"><map>
        <zone name="pond" kind="no-go" margin="0.5m" shape="2,-1 4,-1 4,1 2,1"/>
        <zone name="yard" kind="stay-in" margin="0.1m" shape="-5,-5 5,-5 5,5 -5,5"/>
        <zone name="slow" kind="speed" speed="1m/s" shape="-5,-5 5,-5 5,5 -5,5"/>
      </map><place name="a" initial="1"/></mission></armor>"#;

    #[test]
    fn the_least_room_of_the_whole_drive_is_reported() {
        let read = armor_robotfile::read(Path::new("a.xml"), &mut |_| Ok(FILE.into()));
        let mission = read.configuration.and_then(|it| it.mission).expect("a mission");
        let mut meter = ZoneMeter::new(mission.map.as_ref(), "red".into(), 0.25);
        assert_eq!(meter.rooms().count(), 0, "nothing was measured");
        for x_m in [0.0, 1.5, 2.125, 0.0] {
            meter.take_position(x_m, 0.0);
        }
        let rooms: Vec<_> = meter.rooms().collect();
        let [pond, yard] = rooms.as_slice() else { panic!("{rooms:?}") };
        assert!((pond.room_m + 0.375).abs() < 1e-9 && pond.is_breach(), "{pond:?}");
        assert!((yard.room_m - 2.625).abs() < 1e-9 && !yard.is_breach(), "{yard:?}");
        assert_eq!((pond.margin_m, yard.margin_m), (0.5, 0.1));
    }
}
