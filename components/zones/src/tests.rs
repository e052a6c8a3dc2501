//! Distances of drawn zones, and of 1,000 random ones against the exact geometry of `armor-geo`.

use armor_geo::{MapCircle, MapPoint, MapPolygon, MapSegment};

use super::*;

fn corners(points: &[(f64, f64)]) -> Vec<MapPoint> {
    points.iter().map(|(x, y)| MapPoint::new(*x, *y).expect("a point")).collect()
}

fn polygon(points: &[(f64, f64)]) -> MapArea {
    MapPolygon::new(corners(points)).expect("a polygon").into()
}

fn circle(x_m: f64, y_m: f64, radius_m: f64) -> MapArea {
    let radius = Clearance::new(radius_m).expect("a radius");
    MapCircle::new(MapPoint::new(x_m, y_m).expect("a point"), radius).expect("a circle").into()
}

fn zone(name: &str, duty: ZoneDuty, margin_m: f64, area: MapArea) -> MapZone {
    MapZone { name: name.into(), duty, margin: Clearance::new(margin_m).expect("a margin"), area }
}

fn square(size_m: f64) -> MapArea {
    polygon(&[(0.0, 0.0), (size_m, 0.0), (size_m, size_m), (0.0, size_m)])
}

#[track_caller]
fn check_room(map: &ZoneMap, x_m: f64, y_m: f64, expected_m: f64) {
    let room_m = map.room_m(Point2::new(x_m, y_m));
    assert!((room_m - expected_m).abs() < 1e-9, "{room_m} m at {x_m}, {y_m}");
}

#[test]
fn a_no_go_zone_leaves_room_outside_of_its_margin() {
    let map = ZoneMap::new(vec![zone("a", ZoneDuty::NoGo, 0.5, square(4.0))]).expect("zones");
    check_room(&map, 6.0, 2.0, 1.5);
    check_room(&map, 7.0, 8.0, 4.5);
    check_room(&map, 2.0, 2.0, -2.5);
    check_room(&map, 0.0, 4.0, -0.5);
    assert_eq!(map.barriers()[0].outward(Point2::new(3.5, 1.0)).0.round(), 1.0);
    assert_eq!(map.barrier_at(Point2::new(4.6, 2.0), 0.2).map(Barrier::name), Some("a"));
    assert_eq!(map.barrier_at(Point2::new(4.8, 2.0), 0.2), None);
}

#[test]
fn of_several_stay_in_zones_one_is_enough() {
    let second = polygon(&[(3.0, 0.0), (9.0, 0.0), (9.0, 4.0), (3.0, 4.0)]);
    let zones = vec![
        zone("yard", ZoneDuty::StayIn, 0.0, square(4.0)),
        zone("hall", ZoneDuty::StayIn, 0.0, second),
    ];
    let map = ZoneMap::new(zones).expect("zones");
    assert_eq!((map.barriers().len(), map.barriers()[0].name()), (1, "yard or hall"));
    check_room(&map, 2.0, 2.0, 2.0);
    check_room(&map, 3.5, 2.0, 0.5);
    check_room(&map, -1.0, 2.0, -1.0);
    let (x, y) = map.barriers()[0].outward(Point2::new(-1.0, 2.0));
    assert!(x > 0.999 && y.abs() < 1e-3, "{x} {y}: back into the yard");
}

#[test]
fn speed_and_observed_zones_close_nothing() {
    let zones = vec![
        zone("crossing", ZoneDuty::Speed { limit_mps: 0.3 }, 0.25, circle(0.0, 0.0, 1.0)),
        zone("pond", ZoneDuty::Observe, 0.0, circle(5.0, 0.0, 1.0)),
    ];
    let map = ZoneMap::new(zones).expect("zones");
    let origin = Point2::default();
    assert_eq!(map.room_m(origin), f64::INFINITY);
    assert_eq!(map.speed_limits(origin).collect::<Vec<_>>(), [(0.3, -1.25)]);
    let observed: Vec<_> = map.observed(origin).map(|(zone, m)| (zone.name.clone(), m)).collect();
    assert_eq!(observed, [("pond".to_owned(), 4.0)]);
}

#[test]
fn zones_that_cannot_be_are_refused() {
    let observe = |name: &str| zone(name, ZoneDuty::Observe, 0.0, circle(0.0, 0.0, 1.0));
    let refused = |zones| ZoneMap::new(zones).expect_err("it is refused");
    assert_eq!(refused(vec![observe("a"), observe("a")]), ZoneMapError::SameName("a".into()));
    let many = (0..=MAX_ZONES).map(|number| observe(&number.to_string())).collect();
    assert_eq!(refused(many), ZoneMapError::TooMany(MAX_ZONES + 1));
    for limit_mps in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let slow = zone("a", ZoneDuty::Speed { limit_mps }, 0.0, circle(0.0, 0.0, 1.0));
        assert!(matches!(refused(vec![slow]), ZoneMapError::NoSpeed { .. }), "{limit_mps}");
    }
}

#[test]
fn rounded_distances_agree_with_the_exact_geometry() {
    let mut random = fastrand::Rng::with_seed(7);
    let mut compared = 0;
    while compared < 1_000 {
        let mut place = |range_m: f64| (random.f64() - 0.5) * range_m;
        let points: Vec<_> = (0..5).map(|_| (place(10.0), place(10.0))).collect();
        let (x_m, y_m) = (place(16.0), place(16.0));
        // Of five random points many make a polygon that crosses itself.
        let Ok(polygon) = MapPolygon::new(corners(&points)) else { continue };
        let area = MapArea::from(polygon);
        let found_m = Outline::new(&area).signed_distance_m(Point2::new(x_m, y_m));
        let at = MapPoint::new(x_m, y_m).expect("a point");
        let leg = MapSegment::new(at, at);
        if found_m < 0.0 {
            assert!(leg.stays_within(&area, Clearance::new(-found_m * 0.999_999).expect("m")));
            assert!(!leg.stays_within(&area, Clearance::new(-found_m * 1.000_001).expect("m")));
        } else {
            assert!(!leg.intrudes(&area, Clearance::new(found_m * 0.999_999).expect("m")));
            assert!(leg.intrudes(&area, Clearance::new(found_m * 1.000_001 + 1e-9).expect("m")));
        }
        compared += 1;
    }
}
