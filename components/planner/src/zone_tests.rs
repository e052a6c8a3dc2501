//! Paths among zones, checked with the exact geometry of `armor-geo`; 1,000 random ones also with a
//! search over all cells.

use std::cmp::Ordering;
use std::collections::VecDeque;

use armor_geo::{Clearance, MapArea, MapCircle, MapPoint, MapPolygon, MapSegment};
use armor_grid::{Cell, CostMap, Geometry, Point2};
use armor_zones::{MapZone, ZoneDuty};

use super::*;

const SETTINGS: PlannerSettings =
    PlannerSettings { radius_m: 0.18, margin_m: 0.05, speed_mps: 0.6, timeout_s: 0.5 };

/// A room of 8 m x 6 m at 10 cm.
const ROOM: Geometry =
    Geometry { origin: Point2::new(0.0, 0.0), resolution_m: 0.1, width: 80, height: 60 };

fn at(point: Point2) -> MapPoint {
    MapPoint::new(point.x_m, point.y_m).expect("a point")
}

fn polygon(corners: &[(f64, f64)]) -> Option<MapArea> {
    let corners = corners.iter().map(|(x, y)| MapPoint::new(*x, *y).expect("a point"));
    MapPolygon::new(corners.collect()).ok().map(MapArea::from)
}

fn circle(x_m: f64, y_m: f64, radius_m: f64) -> MapArea {
    let radius = Clearance::new(radius_m).expect("a radius");
    MapCircle::new(MapPoint::new(x_m, y_m).expect("a point"), radius).expect("a circle").into()
}

fn zone(name: &str, duty: ZoneDuty, margin_m: f64, area: MapArea) -> MapZone {
    MapZone { name: name.into(), duty, margin: Clearance::new(margin_m).expect("a margin"), area }
}

fn planned(map: &Grid<Occupancy>, zones: &[MapZone], from: Point2, to: Point2) -> Vec<Pose2> {
    let mut planning = Planning::new(SETTINGS);
    planning.map_seen(map.clone());
    planning.zones_seen(ZoneMap::new(zones.to_vec()).expect("zones"));
    planning.pose_seen(Pose2::new(from.x_m, from.y_m, 0.0));
    planning.goal_seen(1.0, Rank::Task, Pose2::new(to.x_m, to.y_m, 0.0));
    planning.step(1.0).expect("a path is published").to_vec()
}

/// Whether a robot of `radius_m` may drive straight from one point to another.
fn is_allowed(zones: &[MapZone], from: Point2, to: Point2, radius_m: f64) -> bool {
    let leg = MapSegment::new(at(from), at(to));
    let reach = |zone: &MapZone| Clearance::new(radius_m + zone.margin.metres()).expect("a length");
    let mut stay_in = zones.iter().filter(|zone| zone.duty == ZoneDuty::StayIn).peekable();
    let may_leave = stay_in.peek().is_none();
    let is_in = may_leave || stay_in.any(|zone| leg.stays_within(&zone.area, reach(zone)));
    let mut no_go = zones.iter().filter(|zone| zone.duty == ZoneDuty::NoGo);
    is_in && no_go.all(|zone| leg.compare_distance(&zone.area, reach(zone)) != Ordering::Less)
}

fn empty_room() -> Grid<Occupancy> {
    Grid::filled(ROOM, Occupancy::Free)
}

#[test]
fn it_leads_round_a_no_go_zone_and_its_margin() {
    let area = polygon(&[(3.0, 0.0), (5.0, 0.0), (5.0, 3.0), (3.0, 3.0)]).expect("a polygon");
    let zones = [zone("school", ZoneDuty::NoGo, 0.5, area)];
    let path = planned(&empty_room(), &zones, Point2::new(1.0, 1.0), Point2::new(7.0, 1.0));
    assert_eq!(path.last().map(|pose| pose.point()), Some(Point2::new(7.0, 1.0)));
    let highest_m = path.iter().map(|pose| pose.y_m).fold(0.0, f64::max);
    assert!((3.68..4.3).contains(&highest_m), "{highest_m} m");
}

#[test]
fn it_stays_in_and_reports_goals_that_are_not() {
    let area = polygon(&[(0.0, 0.0), (8.0, 0.0), (8.0, 2.0), (0.0, 2.0)]).expect("a polygon");
    let zones = vec![zone("yard", ZoneDuty::StayIn, 0.1, area)];
    let start = Point2::new(1.0, 1.0);
    assert!(!planned(&empty_room(), &zones, start, Point2::new(7.0, 1.5)).is_empty());
    let mut planning = Planning::new(SETTINGS);
    planning.map_seen(empty_room());
    planning.zones_seen(ZoneMap::new(zones).expect("zones"));
    planning.pose_seen(Pose2::new(1.0, 1.0, 0.0));
    planning.goal_seen(1.0, Rank::Task, Pose2::new(7.0, 1.85, 0.0));
    assert_eq!(planning.step(1.0), Some(&[][..]));
    assert_eq!(planning.goal_zone(), Some("yard"));
    planning.goal_seen(1.1, Rank::Task, Pose2::new(7.0, 1.5, 0.0));
    assert!(planning.step(1.1).is_some_and(|path| !path.is_empty()));
    assert_eq!(planning.goal_zone(), None);
}

#[test]
fn a_speed_zone_is_crossed_only_if_the_detour_takes_longer() {
    let lengths = |limit_mps: f64| {
        let area = polygon(&[(3.0, 0.0), (5.0, 0.0), (5.0, 3.0), (3.0, 3.0)]).expect("a polygon");
        let zones = [zone("crossing", ZoneDuty::Speed { limit_mps }, 0.0, area)];
        let path = planned(&empty_room(), &zones, Point2::new(1.0, 1.0), Point2::new(7.0, 1.0));
        path.iter().map(|pose| pose.y_m).fold(0.0, f64::max)
    };
    // The detour is about 2 m longer, and the zone 2 m wide.
    assert!(lengths(0.5) < 1.5, "0.7 s are lost in the zone");
    assert!(lengths(0.1) > 3.0, "17 s would be lost in the zone");
}

#[test]
fn from_a_zone_that_has_appeared_it_leads_out_by_the_shortest_way() {
    let area = polygon(&[(2.0, 1.0), (6.0, 1.0), (6.0, 5.0), (2.0, 5.0)]).expect("a polygon");
    let zones = [zone("school", ZoneDuty::NoGo, 0.2, area)];
    // Half a metre from the left edge; the goal is to the right.
    let path = planned(&empty_room(), &zones, Point2::new(2.5, 3.0), Point2::new(7.5, 3.0));
    assert_eq!(path.last().map(|pose| pose.point()), Some(Point2::new(7.5, 3.0)));
    let map = ZoneMap::new(zones.to_vec()).expect("zones");
    let rooms: Vec<f64> = path.iter().map(|pose| map.room_m(pose.point())).collect();
    let inside = rooms.iter().take_while(|room_m| **room_m < SETTINGS.radius_m).count();
    assert!((8..=11).contains(&inside), "{inside} cells to the left edge: {rooms:?}");
    assert!(rooms[0] > -0.76 && rooms[..=inside].is_sorted(), "never deeper: {rooms:?}");
    assert!(rooms[inside..].iter().all(|room_m| *room_m >= SETTINGS.radius_m), "{rooms:?}");
}

#[test]
fn a_new_zone_changes_the_path_immediately() {
    let mut planning = Planning::new(SETTINGS);
    planning.map_seen(empty_room());
    planning.pose_seen(Pose2::new(1.0, 3.0, 0.0));
    let goal = Pose2::new(7.0, 3.0, 0.0);
    planning.goal_seen(1.0, Rank::Task, goal);
    let middle_m = |path: Option<&[Pose2]>| {
        let path = path.expect("a path is published");
        path.iter().find(|pose| pose.x_m > 4.0).map(|pose| (pose.y_m - 3.0).abs())
    };
    assert!(middle_m(planning.step(1.0)).expect("a path") < 0.2);
    let school = zone("school", ZoneDuty::NoGo, 0.0, circle(4.0, 3.0, 1.0));
    planning.zones_seen(ZoneMap::new(vec![school]).expect("zones"));
    planning.goal_seen(1.1, Rank::Task, goal);
    assert!(middle_m(planning.step(1.1)).expect("a path") > 1.18);
}

#[test]
fn while_the_zones_are_not_known_every_path_is_empty() {
    let mut planning = Planning::new(SETTINGS);
    planning.map_seen(empty_room());
    planning.pose_seen(Pose2::new(1.0, 3.0, 0.0));
    planning.goal_seen(1.0, Rank::Task, Pose2::new(7.0, 3.0, 0.0));
    planning.set_zones_known(false);
    assert_eq!(planning.step(1.0), Some(&[][..]));
    planning.set_zones_known(true);
    assert!(planning.step(1.1).is_some_and(|path| path.len() > 2));
}

/// One to four zones, and walls in every second room.
fn random_site(random: &mut fastrand::Rng, number: usize) -> (Grid<Occupancy>, Vec<MapZone>) {
    let mut map = empty_room();
    for _ in 0..if number.is_multiple_of(2) { 6 } else { 0 } {
        let (column, row) = (random.i32(0..80), random.i32(0..60));
        let (columns, rows) = (random.i32(1..12), random.i32(1..12));
        for cell in (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r))) {
            if let Some(known) = map.get_mut(Cell::new(column + cell.0, row + cell.1)) {
                *known = Occupancy::Occupied;
            }
        }
    }
    let mut zones = Vec::new();
    let wanted = random.usize(1..=4);
    while zones.len() < wanted {
        let (x_m, y_m) = (8.0 * random.f64(), 6.0 * random.f64());
        let size_m = 0.2 + 1.8 * random.f64();
        let area = if random.bool() {
            Some(circle(x_m, y_m, size_m))
        } else {
            let mut corner = || {
                let off = |share: f64| (share - 0.5) * 3.0 * size_m;
                (x_m + off(random.f64()), y_m + off(random.f64()))
            };
            let corners: Vec<_> = (0..5).map(|_| corner()).collect();
            polygon(&corners)
        };
        // Of five random corners many make a polygon that crosses itself.
        let Some(area) = area else { continue };
        let margin_m = if random.bool() { 0.0 } else { 0.5 * random.f64() };
        let name = zones.len().to_string();
        zones.push(zone(&name, ZoneDuty::NoGo, margin_m, area));
    }
    if random.u8(..4) == 0 {
        let area = circle(4.0, 3.0, 2.0 + 2.0 * random.f64());
        zones.push(zone("site", ZoneDuty::StayIn, 0.1, area));
    }
    (map, zones)
}

/// Whether a search over all cells gets from one to another, by what the walls and the zones leave
/// open for a robot of `radius_m`.
fn is_connected(
    map: &Grid<Occupancy>,
    zones: &[MapZone],
    radius_m: f64,
    from: Point2,
    to: Point2,
) -> bool {
    let by = Inflation { radius_m, comfort_m: radius_m, weight: 0.0, unknown_weight: None };
    let walls = CostMap::new(map, &by);
    let needed_m = radius_m + ROOM.resolution_m * std::f64::consts::FRAC_1_SQRT_2;
    let centre = |cell| ROOM.centre(cell);
    let open =
        |cell| walls.is_open(cell) && is_allowed(zones, centre(cell), centre(cell), needed_m);
    let (start, end) = (ROOM.cell_at(from), ROOM.cell_at(to));
    if !open(start) || !open(end) {
        return false;
    }
    let mut seen = Grid::filled(ROOM, false);
    seen[start] = true;
    let mut queue = VecDeque::from([start]);
    while let Some(cell) = queue.pop_front() {
        if cell == end {
            return true;
        }
        for next in cell.neighbours() {
            if seen.get(next) == Some(&false) && open(next) {
                seen[next] = true;
                queue.push_back(next);
            }
        }
    }
    false
}

#[test]
fn a_thousand_random_paths_keep_out_of_closed_zones_and_none_is_missed() {
    let mut random = fastrand::Rng::with_seed(19);
    let (mut found, mut closed) = (0, 0);
    for number in 0..1_000 {
        let (map, zones) = random_site(&mut random, number);
        let mut place = || Point2::new(8.0 * random.f64(), 6.0 * random.f64());
        let (from, to) = (place(), place());
        let path = planned(&map, &zones, from, to);
        let starts_free = is_allowed(&zones, from, from, SETTINGS.radius_m + 0.1);
        for leg in path.windows(2).filter(|_| starts_free) {
            let (here, there) = (leg[0].point(), leg[1].point());
            let is_free = is_allowed(&zones, here, there, SETTINGS.radius_m);
            assert!(is_free, "{number}: {here:?} to {there:?} among {zones:?}");
        }
        if let Some(end) = path.last() {
            let is_free = is_allowed(&zones, end.point(), end.point(), SETTINGS.radius_m);
            assert!(is_free, "{number}: it ends at {end:?} among {zones:?}");
        }
        if is_connected(&map, &zones, SETTINGS.radius_m, from, to) {
            assert!(!path.is_empty(), "{number}: no path from {from:?} to {to:?} among {zones:?}");
            found += 1;
        } else {
            closed += usize::from(path.is_empty());
        }
    }
    assert!(found > 200 && closed > 200, "{found} found, {closed} closed");
}
