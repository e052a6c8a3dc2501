//! Routes over drawn grids.

use armor_grid::{Geometry, Grid, Occupancy, Point2, Pose2};
use armor_robotfile::{Code, Configuration, Findings, check, read};

use crate::{SiteGround, examine_drives, with_path_lengths};

/// A grid of cells of a metre, top row first, whose lower left corner is at (0, 0): `#` is a wall, `.` is
/// free, all else is unknown.
fn grid(rows: &[&str]) -> Grid<Occupancy> {
    let (width, height) = (rows[0].len(), rows.len());
    let geometry = Geometry { origin: Point2::default(), resolution_m: 1.0, width, height };
    let cells = rows.iter().rev().flat_map(|row| row.bytes()).map(|byte| match byte {
        b'#' => Occupancy::Occupied,
        b'.' => Occupancy::Free,
        _ => Occupancy::Unknown,
    });
    Grid::from_values(geometry, cells.collect()).expect("rows of one length")
}

/// Two rooms with a door of three cells at the top.
const ROOMS: [&str; 7] = [
    "...........",
    "...........",
    "...........",
    ".....#.....",
    ".....#.....",
    ".....#.....",
    ".....#.....",
];

fn configuration(marks: &str, route: &str) -> Configuration {
    let text = format!(
        "<armor version='1'><system><component name='way' kind='patrol'/>\
         <component name='driver' kind='driver'><parameter name='speed' value='1m/s'/></component>\
         </system><mission goal='over' safe='hold'><map><point name='P0' at='1.5 0.5'/>\
         <point name='P1' at='9.5 0.5'/><point name='P2' at='2.5 2.5'/>{marks}</map>\
         <route name='red' mover='way.route' pace='driver.speed' start='P0' out='over' {route}\
         </route><place name='over'/><place name='hold'/></mission></armor>"
    );
    let reading = read("a.xml".as_ref(), &mut |_| Ok(text.as_bytes().to_vec()));
    let reading = check(reading, &[], None);
    assert!(reading.is_valid(), "{:?}", reading.findings);
    reading.configuration.expect("it is valid")
}

fn examine_at(rows: &[&str], at: Pose2, marks: &str, route: &str) -> Findings {
    let configuration = configuration(marks, route);
    let mission = configuration.mission.as_ref().expect("a mission");
    let zones = mission.map.as_ref().map(|map| map.zones.as_slice()).unwrap_or_default();
    let ground = SiteGround::new(grid(rows), at, zones);
    examine_drives(mission, &configuration.system, &ground)
}

fn examine(rows: &[&str], marks: &str, route: &str) -> Vec<(Code, String)> {
    let found = examine_at(rows, Pose2::IDENTITY, marks, route);
    found.iter().map(|finding| (finding.code, finding.message.clone())).collect()
}

#[track_caller]
fn expect_one(found: &[(Code, String)], code: Code, part: &str) {
    let [(own, message)] = found else { panic!("{found:?} instead of {code:?}") };
    assert!(*own == code && message.contains(part), "{message} instead of {part}");
}

const LEG: &str = "><leg name='l1' to='P1'/>";

#[test]
fn a_leg_may_lead_around_a_wall_unless_it_is_straight() {
    assert_eq!(examine(&ROOMS, "", LEG), []);
    let straight = "><leg name='l1' to='P1' way='straight'/>";
    expect_one(
        &examine(&ROOMS, "", straight),
        Code::PathBlocked,
        "the straight line of l1 is not free: a wall at 5.5 0.5",
    );
    assert_eq!(examine(&ROOMS, "", "><leg name='l1' to='P2' way='straight'/>"), []);
}

#[test]
fn what_blocks_a_leg_is_named() {
    let mut closed: Vec<String> = ROOMS.map(str::to_owned).into();
    for row in &mut closed {
        row.replace_range(5..6, "#");
    }
    let closed: Vec<&str> = closed.iter().map(String::as_str).collect();
    let blocked = |rows: &[&str], marks: &str, route: &str, part: &str| {
        expect_one(&examine(rows, marks, route), Code::PathBlocked, part);
    };
    blocked(&closed, "", LEG, "no path over the grid leads along l1: a wall at 5.5");
    let fog: Vec<String> = closed.iter().map(|row| row.replace('#', "?")).collect();
    let fog: Vec<&str> = fog.iter().map(String::as_str).collect();
    blocked(&fog, "", LEG, "does not know what is at 5.5");
    // The door is three metres wide, and what is beyond the border is not known.
    assert_eq!(examine(&ROOMS, "", "radius='0.9m'><leg name='l1' to='P1' way='free'/>").len(), 0);
    let wide = "radius='1.9m'><leg name='l1' to='P1'/>";
    let found = examine(&ROOMS, "", wide);
    assert!(found.iter().all(|it| it.0 == Code::PathBlocked) && !found.is_empty(), "{found:?}");
    // The straight line of the leg keeps out of this zone; the only path does not.
    let door = "<zone name='door' kind='no-go' shape='4,4 7,4 7,7 4,7'/>";
    blocked(&ROOMS, door, LEG, "zone door at");
    let room = "<zone name='room' kind='stay-in' shape='0,0 11,0 11,3.5 0,3.5'/>";
    blocked(&ROOMS, room, LEG, "l1");
    let far = "<point name='P3' at='20 0.5'/>";
    blocked(&ROOMS, far, "><leg name='l1' to='P3'/>", "20.0 0.5 is not on the grid");
}

#[test]
fn every_exit_has_a_path_from_every_end_of_its_leg() {
    let rally = "<rally name='R1' at='9.5 1.5'/>";
    let route = "><leg name='l1' to='P2' by='1min'/><otherwise on='blocked late' do='rally'/>";
    let mut closed: Vec<String> = ROOMS.map(str::to_owned).into();
    closed.iter_mut().for_each(|row| row.replace_range(5..6, "#"));
    let closed: Vec<&str> = closed.iter().map(String::as_str).collect();
    expect_one(
        &examine(&closed, rally, route),
        Code::PathBlocked,
        "no path over the grid leads from l1 to R1: a wall at 5.5",
    );
    assert_eq!(examine(&ROOMS, rally, route), []);
}

#[test]
fn a_rally_point_that_is_nearer_by_path_is_named() {
    let near = "<rally name='R1' at='6.5 0.5'/><rally name='R2' at='1.5 6.5'/>";
    let route = "><leg name='l1' to='P2' by='1min'/><otherwise on='blocked late' do='rally'/>";
    expect_one(
        &examine(&ROOMS, near, route),
        Code::RallyFarther,
        "from l1 the path over the grid to R2 is",
    );
    let named = route.replace("do='rally'", "do='rally' to='R2'");
    assert_eq!(examine(&ROOMS, near, &named), []);
}

#[test]
fn the_battery_must_last_for_the_path_and_not_the_straight_line() {
    // 8 m straight, about 12 m around the wall; at 1 m/s less a fifth.
    let with = |endurance: &str| {
        examine(&ROOMS, "", &format!("endurance='{endurance}'><leg name='l1' to='P1'/>"))
    };
    expect_one(&with("12s"), Code::BatteryEmpty, "red.l1 may end after");
    assert_eq!(with("20s"), []);
}

#[test]
fn a_grid_may_be_turned_and_moved() {
    // The grid by a quarter turn to the left, and its pose a quarter turn to the right.
    let turned: Vec<String> = (0..11)
        .map(|row| (0..7).map(|column| char::from(ROOMS[column].as_bytes()[10 - row])).collect())
        .collect();
    let turned: Vec<&str> = turned.iter().map(String::as_str).collect();
    let at = Pose2::new(0.0, 7.0, -std::f64::consts::FRAC_PI_2);
    let straight = "><leg name='l1' to='P1' way='straight'/>";
    let found = examine_at(&turned, at, "", straight);
    let messages: Vec<_> = found.iter().map(|finding| finding.message.as_str()).collect();
    assert_eq!(messages, ["the straight line of l1 is not free: a wall at 5.5 0.5"]);
}

#[test]
fn a_path_around_a_wall_begins_and_ends_in_its_own_directions() {
    let configuration = configuration("", LEG);
    let mission = configuration.mission.as_ref().expect("a mission");
    let ground = SiteGround::new(grid(&ROOMS), Pose2::IDENTITY, &[]);
    let [start, end] = [(1.5, 0.5), (9.5, 0.5)]
        .map(|(x_m, y_m)| armor_geo::MapPoint::new(x_m, y_m).expect("a point"));
    let radius = armor_geo::Clearance::ZERO;
    with_path_lengths(mission, &ground, |lengths| {
        let [first_rad, last_rad] =
            lengths.directions_rad(start, end, radius).expect("there is a path");
        assert!(first_rad > 0.5 && last_rad < -0.5, "{first_rad} {last_rad}: up, and down again");
        assert!(lengths.length_m(start, end, radius) > 10.0);
    });
}
