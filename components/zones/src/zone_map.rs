//! All zones of a map.

use std::collections::BTreeSet;

use armor_geo::{Clearance, MapArea};
use armor_grid::Point2;
use thiserror::Error;

use crate::barrier::Barrier;
use crate::outline::Outline;

/// More zones than any site has; what a robot computes at each step grows with them.
pub const MAX_ZONES: usize = 256;
/// Corners of all zones together: a distance from every edge is then about 40 µs.
pub const MAX_ZONE_CORNERS: usize = 8_192;

/// What a zone requires of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ZoneDuty {
    /// It must not enter.
    NoGo,
    /// It must not leave. Of several such zones, it must be in one.
    StayIn,
    /// It must not be faster.
    Speed {
        /// The limit, in metres per second.
        limit_mps: f64,
    },
    /// Nothing.
    Observe,
}

/// An area of the map that requires something of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct MapZone {
    /// Its name.
    pub name: String,
    /// What it requires.
    pub duty: ZoneDuty,
    /// What the robot's outline must keep from it.
    pub margin: Clearance,
    /// Where it is.
    pub area: MapArea,
}

/// Zones that cannot be together, or one that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ZoneMapError {
    /// Too many.
    #[error("there are {0} zones; at most {MAX_ZONES} are allowed")]
    TooMany(usize),
    /// Too many corners.
    #[error(
        "the zones have {0} corners; at most {MAX_ZONE_CORNERS} are allowed: draw them coarser"
    )]
    TooManyCorners(usize),
    /// A name twice.
    #[error("two zones are named `{0}`; rename one")]
    SameName(String),
    /// A speed zone without a limit.
    #[error(
        "the speed of zone `{name}` is {limit_mps} m/s; a speed zone needs a finite speed above 0"
    )]
    NoSpeed {
        /// The zone.
        name: String,
        /// Its limit.
        limit_mps: f64,
    },
}

/// All zones of a map, checked, and laid out for measuring.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZoneMap {
    zones: Vec<MapZone>,
    barriers: Vec<Barrier>,
    /// Outline with margin, and limit in metres per second.
    speeds: Vec<(Outline, f64, f64)>,
    /// Position in `zones`, and outline with margin.
    observed: Vec<(usize, Outline, f64)>,
}

impl ZoneMap {
    /// Takes the zones of a map.
    ///
    /// # Errors
    /// [`ZoneMapError`].
    pub fn new(zones: Vec<MapZone>) -> Result<Self, ZoneMapError> {
        check(&zones)?;
        let mut map = Self { zones, ..Self::default() };
        let (mut names, mut stay_in) = (Vec::new(), Vec::new());
        for (index, zone) in map.zones.iter().enumerate() {
            let (outline, margin_m) = (Outline::new(&zone.area), zone.margin.metres());
            match zone.duty {
                ZoneDuty::NoGo => map.barriers.push(Barrier::no_go(&zone.name, outline, margin_m)),
                ZoneDuty::StayIn => {
                    names.push(zone.name.as_str());
                    stay_in.push((outline, margin_m));
                }
                ZoneDuty::Speed { limit_mps } => map.speeds.push((outline, margin_m, limit_mps)),
                ZoneDuty::Observe => map.observed.push((index, outline, margin_m)),
            }
        }
        if !stay_in.is_empty() {
            map.barriers.push(Barrier::stay_in(&names, stay_in));
        }
        Ok(map)
    }

    /// Returns the zones in their order.
    pub fn zones(&self) -> &[MapZone] {
        &self.zones
    }

    /// Returns whether there is none.
    pub fn is_empty(&self) -> bool {
        self.zones.is_empty()
    }

    /// Returns the borders that no robot may cross: one for each no-go zone, and one for all stay-in
    /// zones together.
    pub fn barriers(&self) -> &[Barrier] {
        &self.barriers
    }

    /// Returns the least room that any barrier leaves at a point, in metres; infinite without one.
    pub fn room_m(&self, point: Point2) -> f64 {
        self.barriers.iter().map(|barrier| barrier.room_m(point)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the first barrier that leaves less than `room_m` at a point.
    pub fn barrier_at(&self, point: Point2, room_m: f64) -> Option<&Barrier> {
        self.barriers.iter().find(|barrier| barrier.room_m(point) < room_m)
    }

    /// Returns each speed zone's limit in metres per second, and the distance of a point from the
    /// zone and its margin in metres; negative inside.
    pub fn speed_limits(&self, point: Point2) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.speeds.iter().map(move |(outline, margin_m, limit_mps)| {
            (*limit_mps, outline.signed_distance_m(point) - margin_m)
        })
    }

    /// Returns each observed zone, and the distance of a point from the zone and its margin in
    /// metres; negative inside.
    pub fn observed(&self, point: Point2) -> impl Iterator<Item = (&MapZone, f64)> + '_ {
        self.observed.iter().map(move |(index, outline, margin_m)| {
            (&self.zones[*index], outline.signed_distance_m(point) - margin_m)
        })
    }
}

fn check(zones: &[MapZone]) -> Result<(), ZoneMapError> {
    if zones.len() > MAX_ZONES {
        return Err(ZoneMapError::TooMany(zones.len()));
    }
    let corners = zones.iter().map(|zone| match &zone.area {
        MapArea::Polygon(polygon) => polygon.corners().len(),
        MapArea::Circle(_) => 1,
    });
    let corners: usize = corners.sum();
    if corners > MAX_ZONE_CORNERS {
        return Err(ZoneMapError::TooManyCorners(corners));
    }
    let mut names = BTreeSet::new();
    for zone in zones {
        if !names.insert(&zone.name) {
            return Err(ZoneMapError::SameName(zone.name.clone()));
        }
        if let ZoneDuty::Speed { limit_mps } = zone.duty
            && !(limit_mps.is_finite() && limit_mps > 0.0)
        {
            return Err(ZoneMapError::NoSpeed { name: zone.name.clone(), limit_mps });
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
