//! Whether a robot, whose place is known with a covariance, is near a zone or where it must not be.

use std::collections::{BTreeMap, BTreeSet};

use armor_grid::Point2;
use armor_zones::{Barrier, ZoneMap};

/// What the robot is and when something is reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FenceSettings {
    /// Radius of the circle around the robot's centre that encloses it, in metres.
    pub radius_m: f64,
    /// A zone is near if the robot's outline may be within this of its margin, in metres.
    pub near_m: f64,
    /// How many standard deviations of its place the robot is reckoned to be off at most.
    pub sigmas: f64,
    /// What is reported ends only when the robot is further away by this, in metres.
    pub release_m: f64,
}

/// Where a robot is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocatedRobot {
    /// Its place on the map.
    pub place: Point2,
    /// The covariance of the place: of x, of x and y, of y, in square metres.
    pub covariance_m2: [f64; 3],
}

impl LocatedRobot {
    /// Returns the standard deviation of its place in a direction of length 1, in metres.
    fn deviation_m(&self, (x, y): (f64, f64)) -> f64 {
        let [xx, xy, yy] = self.covariance_m2;
        // `max` takes the other one of a NaN.
        (x * x * xx + 2.0 * x * y * xy + y * y * yy).max(0.0).sqrt()
    }
}

/// What has begun or ended; distances are those of the robot's outline from the zone's margin.
#[derive(Clone, Debug, PartialEq)]
pub enum FenceNews {
    /// The robot is where it must not be, by more than its place is uncertain.
    Breach {
        /// The zone.
        zone: String,
        /// How far, in metres.
        depth_m: f64,
    },
    /// No breach is left.
    Back,
    /// A zone is near.
    Near {
        /// The zone.
        zone: String,
        /// How far it is away, in metres; negative within its margin.
        distance_m: f64,
    },
}

/// The zones, and what was reported about them.
#[derive(Debug)]
pub struct Fencing {
    settings: FenceSettings,
    zones: ZoneMap,
    near: BTreeSet<String>,
    breached: BTreeSet<String>,
    /// The nearest zone and its distance in metres, at the last pose.
    nearest: Option<(String, f64)>,
}

/// One zone, or the border of the stay-in zones, as seen from the robot.
struct Sighting {
    /// Of the robot's outline from the margin, in metres.
    distance_m: f64,
    /// By how much it may be more or less, in metres.
    uncertain_m: f64,
    is_barrier: bool,
}

impl Fencing {
    /// Starts without zones.
    pub fn new(settings: FenceSettings) -> Self {
        Self {
            settings,
            zones: ZoneMap::default(),
            near: BTreeSet::new(),
            breached: BTreeSet::new(),
            nearest: None,
        }
    }

    /// Takes the newest zones, replacing those before.
    pub fn zones_seen(&mut self, zones: ZoneMap) {
        self.zones = zones;
    }

    /// Forgets what was reported; the zones are kept. What still applies is reported again.
    pub fn reset_state(&mut self, settings: FenceSettings) {
        let zones = std::mem::take(&mut self.zones);
        *self = Self { zones, ..Self::new(settings) };
    }

    /// Returns the zone that the robot's outline is nearest to, and the distance from its margin in
    /// metres; negative inside.
    pub fn nearest(&self) -> Option<(&str, f64)> {
        self.nearest.as_ref().map(|(zone, distance_m)| (zone.as_str(), *distance_m))
    }

    /// Takes where the robot is; returns what has begun or ended, breaches first.
    ///
    /// A breach begins when the robot is past the margin by more than `sigmas` standard deviations
    /// of its place, in the direction of the border: it is reported only if it is almost certain. A
    /// zone is near as soon as the robot may be within `near_m` of it by as many. So the uncertain
    /// cases are near, and no breach.
    pub fn robot_seen(&mut self, robot: &LocatedRobot) -> Vec<FenceNews> {
        let sightings = self.list_sightings(robot);
        let nearest = sightings.iter().min_by(|a, b| a.1.distance_m.total_cmp(&b.1.distance_m));
        self.nearest = nearest.map(|(zone, sighting)| (zone.clone(), sighting.distance_m));
        let FenceSettings { near_m, release_m, .. } = self.settings;
        let (mut news, was_breached) = (Vec::new(), !self.breached.is_empty());
        for (zone, sighting) in &sightings {
            let Sighting { distance_m, uncertain_m, is_barrier } = *sighting;
            if is_barrier && distance_m + uncertain_m < 0.0 {
                if self.breached.insert(zone.clone()) {
                    news.push(FenceNews::Breach { zone: zone.clone(), depth_m: -distance_m });
                }
            } else if distance_m >= release_m {
                self.breached.remove(zone);
            }
        }
        self.breached.retain(|zone| sightings.contains_key(zone));
        if was_breached && self.breached.is_empty() {
            news.push(FenceNews::Back);
        }
        for (zone, Sighting { distance_m, uncertain_m, .. }) in &sightings {
            if distance_m - uncertain_m < near_m {
                if self.near.insert(zone.clone()) {
                    news.push(FenceNews::Near { zone: zone.clone(), distance_m: *distance_m });
                }
            } else if distance_m - uncertain_m > near_m + release_m {
                self.near.remove(zone);
            }
        }
        self.near.retain(|zone| sightings.contains_key(zone));
        news
    }

    fn list_sightings(&self, robot: &LocatedRobot) -> BTreeMap<String, Sighting> {
        let FenceSettings { radius_m, sigmas, .. } = self.settings;
        let barrier = |barrier: &Barrier| {
            let direction = barrier.outward(robot.place);
            let sighting = Sighting {
                distance_m: barrier.room_m(robot.place) - radius_m,
                uncertain_m: sigmas * robot.deviation_m(direction),
                is_barrier: true,
            };
            (barrier.name().to_owned(), sighting)
        };
        let observed = self.zones.observed(robot.place).map(|(zone, distance_m)| {
            // Nothing depends on it as much as on a barrier: the larger of both deviations will do.
            let [xx, _, yy] = robot.covariance_m2;
            let uncertain_m = sigmas * xx.max(yy).max(0.0).sqrt();
            let distance_m = distance_m - radius_m;
            (zone.name.clone(), Sighting { distance_m, uncertain_m, is_barrier: false })
        });
        self.zones.barriers().iter().map(barrier).chain(observed).collect()
    }
}

#[cfg(test)]
mod tests {
    use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon};
    use armor_zones::{MapZone, ZoneDuty};

    use super::*;

    const SETTINGS: FenceSettings =
        FenceSettings { radius_m: 0.2, near_m: 0.5, sigmas: 2.0, release_m: 0.1 };

    fn zone(name: &str, duty: ZoneDuty, margin_m: f64, area: MapArea) -> MapZone {
        let margin = Clearance::new(margin_m).expect("a margin");
        MapZone { name: name.into(), duty, margin, area }
    }

    fn square(size_m: f64) -> MapArea {
        let corners = [(0.0, 0.0), (size_m, 0.0), (size_m, size_m), (0.0, size_m)];
        let corners = corners.map(|(x, y)| MapPoint::new(x, y).expect("a point"));
        MapPolygon::new(corners.into()).expect("a polygon").into()
    }

    fn circle(x_m: f64, radius_m: f64) -> MapArea {
        let radius = Clearance::new(radius_m).expect("a radius");
        MapCircle::new(MapPoint::new(x_m, 0.0).expect("a point"), radius).expect("a circle").into()
    }

    fn fencing(zones: Vec<MapZone>) -> Fencing {
        let mut fencing = Fencing::new(SETTINGS);
        fencing.zones_seen(ZoneMap::new(zones).expect("zones"));
        fencing
    }

    /// What is reported with the robot at `x_m` on the x axis, in short.
    fn at(fencing: &mut Fencing, x_m: f64, deviation_m: f64) -> Vec<String> {
        let variance_m2 = deviation_m * deviation_m;
        let covariance_m2 = [variance_m2, 0.0, variance_m2];
        let robot = LocatedRobot { place: Point2::new(x_m, 0.0), covariance_m2 };
        let short = |news| match news {
            FenceNews::Breach { zone, depth_m } => format!("breach {zone} {depth_m:.2}"),
            FenceNews::Near { zone, distance_m } => format!("near {zone} {distance_m:.2}"),
            FenceNews::Back => "back".into(),
        };
        fencing.robot_seen(&robot).into_iter().map(short).collect()
    }

    #[test]
    fn near_breach_and_back_of_a_no_go_zone() {
        let mut fencing = fencing(vec![zone("pond", ZoneDuty::NoGo, 0.3, circle(0.0, 1.0))]);
        // The centre may come to 1.5 m.
        let none: [String; 0] = [];
        assert_eq!(at(&mut fencing, 3.0, 0.0), none);
        assert_eq!(fencing.nearest(), Some(("pond", 1.5)));
        assert_eq!(at(&mut fencing, 1.9, 0.0), ["near pond 0.40"]);
        assert_eq!(at(&mut fencing, 1.6, 0.0), none);
        assert_eq!(at(&mut fencing, 1.4, 0.0), ["breach pond 0.10"]);
        assert_eq!(at(&mut fencing, 1.55, 0.0), none, "not yet out by the release");
        assert_eq!(at(&mut fencing, 1.65, 0.0), ["back"]);
        assert_eq!(at(&mut fencing, 2.05, 0.0), none);
        assert_eq!(at(&mut fencing, 1.95, 0.0), none, "it was near all the time");
        assert_eq!(at(&mut fencing, 2.2, 0.0), none);
        assert_eq!(at(&mut fencing, 1.95, 0.0), ["near pond 0.45"]);
    }

    #[test]
    fn the_more_uncertain_the_place_the_earlier_near_and_the_later_a_breach() {
        let mut fencing = fencing(vec![zone("pond", ZoneDuty::NoGo, 0.0, circle(0.0, 1.0))]);
        assert_eq!(at(&mut fencing, 2.0, 0.2), ["near pond 0.80"]);
        let none: [String; 0] = [];
        assert_eq!(at(&mut fencing, 0.9, 0.2), none, "0.3 m deep, 0.4 m uncertain");
        assert_eq!(at(&mut fencing, 0.9, 0.1), ["breach pond 0.30"]);
    }

    #[test]
    fn only_the_uncertainty_across_the_border_counts() {
        let mut fencing = fencing(vec![zone("hall", ZoneDuty::NoGo, 0.0, square(4.0))]);
        let place = Point2::new(-0.1, 2.0);
        let along = LocatedRobot { place, covariance_m2: [0.0001, 0.0, 4.0] };
        assert!(matches!(fencing.robot_seen(&along)[..], [FenceNews::Breach { .. }, _]));
        fencing.reset_state(SETTINGS);
        let across = LocatedRobot { place, covariance_m2: [4.0, 0.0, 0.0001] };
        assert!(matches!(fencing.robot_seen(&across)[..], [FenceNews::Near { .. }]));
    }

    #[test]
    fn leaving_the_stay_in_zones_is_a_breach_and_observed_zones_are_only_near() {
        let zones = vec![
            zone("yard", ZoneDuty::StayIn, 0.0, circle(0.0, 3.0)),
            zone("pond", ZoneDuty::Observe, 0.0, circle(1.0, 0.5)),
            zone("crossing", ZoneDuty::Speed { limit_mps: 0.2 }, 0.0, circle(-1.0, 0.5)),
        ];
        let mut fencing = fencing(zones);
        assert_eq!(at(&mut fencing, 1.0, 0.0), ["near pond -0.70"]);
        assert_eq!(at(&mut fencing, 3.5, 0.0), ["breach yard 0.70", "near yard -0.70"]);
        assert_eq!(at(&mut fencing, 0.0, 0.0), ["back", "near pond 0.30"]);
        assert!(at(&mut fencing, -1.0, 0.0).is_empty(), "the driver slows down");
    }

    #[test]
    fn a_zone_that_is_taken_away_is_breached_no_more() {
        let mut fencing = fencing(vec![zone("pond", ZoneDuty::NoGo, 0.0, circle(0.0, 1.0))]);
        assert_eq!(at(&mut fencing, 0.0, 0.0), ["breach pond 1.20", "near pond -1.20"]);
        fencing.zones_seen(ZoneMap::default());
        assert_eq!(at(&mut fencing, 0.0, 0.0), ["back"]);
        assert_eq!(fencing.nearest(), None);
    }

    #[test]
    fn noise_at_a_border_is_no_flood_of_events() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut fencing = fencing(vec![zone("pond", ZoneDuty::NoGo, 0.0, circle(0.0, 1.0))]);
        // An hour of poses at 10 Hz, 2 cm of noise each, at the border of near and at that of a
        // breach.
        for (x_m, most) in [(1.7, 1), (1.2, 4)] {
            fencing.reset_state(SETTINGS);
            let mut count = 0;
            for _ in 0..36_000 {
                let noise_m = (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
                count += at(&mut fencing, x_m + 0.02 * noise_m, 0.02).len();
            }
            assert!(count <= most, "{count} events at {x_m} m");
        }
    }
}
