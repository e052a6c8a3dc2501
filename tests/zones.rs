//! A robot among zones, with real processes in simulated time: where it truly was, and how fast.

use std::path::{Path, PathBuf};

use crate::fixture::{Folder, run_to_end};

/// The carpet of missions/zones.xml, as the least and the largest x and y in metres.
const CARPET: [(f64, f64); 2] = [(1.1, 2.2), (-0.5, 0.5)];
/// Its crossing: the centre, in metres.
const CROSSING: (f64, f64) = (2.25, -1.5);
/// The radius of the robot, in metres.
const RADIUS_M: f64 = 0.18;

fn mission() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/zones.xml")
}

/// Reads where the robot truly was: stamps in seconds, x and y in metres.
fn read_truth(folder: &Path) -> Vec<[f64; 3]> {
    let text = std::fs::read_to_string(folder.join("truth.csv")).expect("truth.csv");
    let row = |line: &str| {
        let numbers = line.split(',').skip(1).take(3).map(|number| number.parse::<f64>());
        let numbers: Vec<f64> = numbers.map(|number| number.expect("a number")).collect();
        [numbers[0], numbers[1], numbers[2]]
    };
    text.lines().skip(1).map(row).collect()
}

fn outside_m(value: f64, (least, most): (f64, f64)) -> f64 {
    (least - value).max(value - most).max(0.0)
}

// Slow (about half a minute): a lap through a hall and two rooms at five times real time.
#[test]
fn the_robot_is_never_in_the_no_go_zone_and_slow_at_the_crossing() {
    let folder = Folder::new("zones");
    let file = mission().display().to_string();
    let arguments = ["run", &file, "--headless", "--out", "zones"];
    let (code, log, err) = run_to_end(&mut folder.armor(&arguments));
    assert_eq!(code, 0, "{log}{err}");
    let truth = read_truth(&folder.path().join("zones"));
    assert!(truth.len() > 100, "{} true poses", truth.len());
    let to_carpet = |[_, x_m, y_m]: &[f64; 3]| {
        outside_m(*x_m, CARPET[0]).hypot(outside_m(*y_m, CARPET[1])) - RADIUS_M
    };
    let nearest_m = truth.iter().map(to_carpet).fold(f64::INFINITY, f64::min);
    assert!(nearest_m > 0.0, "the robot touched the carpet: {nearest_m:.3} m");
    // Within the circle by more than the pose is off, so that the robot knows it.
    let is_at_crossing =
        |x_m: f64, y_m: f64| (x_m - CROSSING.0).hypot(y_m - CROSSING.1) < 0.7 + RADIUS_M - 0.1;
    let mut speeds_mps: Vec<f64> = Vec::new();
    let mut elsewhere_mps = 0.0_f64;
    // Speeds over about half a second: the stamps of a pose have jitter.
    for pair in truth.windows(6) {
        let ([from_s, ..], [to_s, ..]) = (pair[0], pair[5]);
        let speed_mps = (pair[5][1] - pair[0][1]).hypot(pair[5][2] - pair[0][2]) / (to_s - from_s);
        if pair.iter().all(|[_, x_m, y_m]| is_at_crossing(*x_m, *y_m)) {
            speeds_mps.push(speed_mps);
        } else if pair.iter().all(|[_, x_m, y_m]| !is_at_crossing(*x_m, *y_m)) {
            elsewhere_mps = elsewhere_mps.max(speed_mps);
        }
    }
    let fastest_mps = speeds_mps.iter().copied().fold(0.0, f64::max);
    println!(
        "zones: {nearest_m:.2} m from the carpet, {fastest_mps:.2} m/s at the crossing, \
         {elsewhere_mps:.2} m/s elsewhere"
    );
    assert!(speeds_mps.len() > 10 && fastest_mps < 0.35, "{fastest_mps} m/s: {speeds_mps:?}");
    assert!(elsewhere_mps > 0.5, "{elsewhere_mps} m/s");
}

// The zones of missions/drawn.xml are in its <map> only: the planner and the driver get them from there.
#[test]
fn a_robot_obeys_the_zones_that_its_mission_draws() {
    let folder = Folder::new("zones-drawn");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/drawn.xml");
    let file = file.display().to_string();
    let (code, log, err) =
        run_to_end(&mut folder.armor(&["run", &file, "--headless", "--out", "drawn"]));
    assert_eq!(code, 0, "{log}{err}");
    let truth = read_truth(&folder.path().join("drawn"));
    let is_slow = |x_m: f64, y_m: f64| (x_m - 4.2).hypot(y_m) < 0.7 + RADIUS_M - 0.1;
    let (mut slow_mps, mut slow, mut elsewhere_mps) = (0.0_f64, 0, 0.0_f64);
    for pair in truth.windows(6) {
        let ([from_s, ..], [to_s, ..]) = (pair[0], pair[5]);
        let speed_mps = (pair[5][1] - pair[0][1]).hypot(pair[5][2] - pair[0][2]) / (to_s - from_s);
        if pair.iter().all(|[_, x_m, y_m]| is_slow(*x_m, *y_m)) {
            (slow_mps, slow) = (slow_mps.max(speed_mps), slow + 1);
        } else if pair.iter().all(|[_, x_m, y_m]| !is_slow(*x_m, *y_m)) {
            elsewhere_mps = elsewhere_mps.max(speed_mps);
        }
    }
    println!("zones: {slow_mps:.2} m/s at the drawn crossing, {elsewhere_mps:.2} m/s elsewhere");
    assert!(slow > 10 && slow_mps < 0.35, "{slow_mps} m/s in {slow} stretches");
    assert!(elsewhere_mps > 0.5, "{elsewhere_mps} m/s");
}

#[test]
fn a_breach_leads_to_the_safe_place() {
    let folder = Folder::new("zones-breach");
    let file = mission().display().to_string();
    let zones = "chart.zones=here no-go circle 0.3,0 0.6m";
    let arguments = ["run", &file, "--headless", "--out", "breach", "--set", zones];
    let (code, log, err) = run_to_end(&mut folder.armor(&arguments));
    assert_ne!(code, 0, "{log}{err}");
    assert!(log.contains("broken-in: rounds -> hold"), "{log}{err}");
    let rolled = read_truth(&folder.path().join("breach"));
    let furthest_m = rolled.iter().map(|[_, x_m, y_m]| x_m.hypot(*y_m)).fold(0.0, f64::max);
    assert!(furthest_m < 1.0, "it drove {furthest_m:.2} m after the breach");
}

/// The drawn mission with a fence that its route names; a zone that nothing draws lies around the robot.
fn breach_of_a_drawn_route(name: &str, exits: &str) -> (Folder, String) {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let text = std::fs::read_to_string(missions.join("drawn.xml")).expect("missions/drawn.xml");
    let world = missions.join("worlds/office.svg");
    let fence = "<component name=\"fence\" kind=\"fence\"/>\n    <link from=\"mapper.pose\" \
                 to=\"fence.pose\"/>\n    <link from=\"chart.zones\" to=\"fence.zones\"/>\n  </system>";
    let text = text
        .replace("worlds/office.svg", world.to_str().expect("UTF-8"))
        .replace("</system>", fence)
        .replace("patience=\"1min\"", "patience=\"2s\" fence=\"fence\"")
        .replace("<otherwise on=\"lost-link blocked late recall\" do=\"rally\"/>", exits);
    let folder = Folder::new(name);
    let file = folder.write("drawn.xml", &text).display().to_string();
    let zones = "chart.zones=here no-go circle 0.3,0 0.6m";
    let arguments = ["run", &file, "--headless", "--out", "breach", "--set", zones];
    let (code, log, err) = run_to_end(&mut folder.armor(&arguments));
    assert_ne!(code, 0, "{log}{err}");
    (folder, format!("{log}{err}"))
}

#[test]
fn a_breach_leads_a_drawn_route_to_its_safe_place() {
    let exits = "<otherwise on=\"lost-link blocked late recall\" do=\"rally\"/>";
    let (folder, log) = breach_of_a_drawn_route("zones-route-breach", exits);
    assert!(log.contains("red.l1.breach: red.l1 -> hold"), "{log}");
    let rolled = read_truth(&folder.path().join("breach"));
    let furthest_m = rolled.iter().map(|[_, x_m, y_m]| x_m.hypot(*y_m)).fold(0.0, f64::max);
    assert!(furthest_m < 1.0, "it drove {furthest_m:.2} m after the breach");
}

// Slow (about ten seconds): the robot drives out of the zone to its rally point, and no operator resumes its leg.
#[test]
fn a_breach_leads_a_drawn_route_to_its_rally_point() {
    let exits = "<otherwise on=\"lost-link blocked late recall breach\" do=\"rally\"/>";
    let (_folder, log) = breach_of_a_drawn_route("zones-route-rally", exits);
    for fired in [
        "red.l1.breach: red.l1 -> red.l1.to-R1",
        "the robot is back where it may be",
        "red.l1.to-R1.done: red.l1.to-R1 -> red.l1.at-R1",
        "red.l1.at-R1.over: red.l1.at-R1 -> hold",
    ] {
        assert!(log.contains(fired), "{fired}: {log}");
    }
}

#[test]
fn a_goal_in_a_zone_leads_to_the_safe_place() {
    let folder = Folder::new("zones-goal");
    let file = mission().display().to_string();
    let zones = "chart.zones=room no-go 2.5,0.5 6,0.5 6,2.8 2.5,2.8";
    let arguments = ["run", &file, "--headless", "--out", "goal", "--set", zones];
    let (code, log, err) = run_to_end(&mut folder.armor(&arguments));
    assert_ne!(code, 0, "{log}{err}");
    assert!(log.contains("forbidden: rounds -> hold"), "{log}{err}");
}
