//! The example missions, as a newcomer runs them: the office, the rounds and the survey in
//! simulation, the replay on every public log.

use std::path::{Path, PathBuf};
use std::time::Instant;

use armor_evaluation::map_score::{MapScore, score_map};
use armor_grid::{Geometry, Grid, Occupancy, Point2};
use armor_simulator::world::World;

use crate::fixture::{Folder, run_to_end};

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("in the workspace").into()
}

/// Reads a map in the `map_server` format, as the map writer writes it.
fn map(folder: &Path) -> Grid<Occupancy> {
    let yaml = std::fs::read_to_string(folder.join("map.yaml")).expect("map.yaml");
    let value = |key: &str| {
        let line = yaml.lines().find_map(|line| line.strip_prefix(key)).expect("its key");
        line.trim_matches([':', ' ', '[', ']']).to_owned()
    };
    let resolution_m: f64 = value("resolution").parse().expect("a resolution");
    let origin = value("origin");
    let mut corner = origin.split(", ").map(|number| number.parse::<f64>().expect("metres"));
    let (x_m, y_m) = (corner.next().expect("x"), corner.next().expect("y"));
    let pgm = std::fs::read(folder.join("map.pgm")).expect("map.pgm");
    let header = pgm.splitn(4, |byte| *byte == b'\n').take(3).map(<[u8]>::len).sum::<usize>() + 3;
    let size = String::from_utf8_lossy(&pgm[..header]);
    let mut size = size.lines().nth(1).expect("a size").split(' ').map(str::parse::<usize>);
    let (width, height) = (size.next().expect("width"), size.next().expect("height"));
    let (width, height) = (width.expect("a number"), height.expect("a number"));
    let cells = pgm[header..].chunks_exact(width).rev().flatten().map(|grey| match grey {
        0 => Occupancy::Occupied,
        254 => Occupancy::Free,
        _ => Occupancy::Unknown,
    });
    let geometry = Geometry { origin: Point2::new(x_m, y_m), resolution_m, width, height };
    Grid::from_values(geometry, cells.collect()).expect("as many cells as its size requires")
}

// Slow (one to two minutes): the robot drives through the whole office in real time.
#[test]
fn the_office_is_explored_mapped_and_left_for_home() {
    let folder = Folder::new("office");
    let file = root().join("missions/office.xml");
    let start = Instant::now();
    let file = file.display().to_string();
    let (code, _, log) =
        run_to_end(&mut folder.armor(&["run", &file, "--headless", "--out", "office"]));
    let seconds = start.elapsed().as_secs_f64();
    assert_eq!(code, 0, "not home after {seconds:.0} s:\n{log}");

    let out = folder.path().join("office");
    let world = World::read(&root().join("missions/worlds/office.svg")).expect("the world");
    let drawn = map(&out);
    let truth = world.free_space(drawn.geometry().resolution_m).expect("its free space");
    // Two cells of tolerance: one for the error of the estimated pose, one for a cell's edge.
    let MapScore { wall_recall, wall_precision, free_recall, free_precision } =
        score_map(&drawn, &truth, 2.0);
    println!(
        "office: {seconds:.0} s; walls {:.1} % found, {:.1} % right; free space {:.1} % found, {:.1} % right",
        wall_recall * 100.0,
        wall_precision * 100.0,
        free_recall * 100.0,
        free_precision * 100.0
    );
    assert!(wall_recall > 0.80 && wall_precision > 0.85, "walls: {wall_recall} {wall_precision}");
    assert!(free_recall > 0.85 && free_precision > 0.95, "free: {free_recall} {free_precision}");
    let picture = std::fs::metadata(out.join("map.png")).expect("map.png");
    assert!(picture.len() > 5_000, "a picture of {} bytes", picture.len());
}

// Slow (about a minute): a large hall, even at four times real time.
#[test]
fn a_hall_with_people_is_explored_and_mapped_at_four_times_real_time() {
    let folder = Folder::new("explore-and-map");
    let file = root().join("missions/explore-and-map.xml").display().to_string();
    let (code, log, _) =
        run_to_end(&mut folder.armor(&["run", &file, "--headless", "--out", "hall"]));
    assert_eq!(code, 0, "{log}");
    for step in ["explored: explore -> return", "arrived: return -> home"] {
        assert!(log.contains(step), "{step} in\n{log}");
    }
    let world = World::read(&root().join("missions/worlds/hall.svg")).expect("the world");
    let drawn = map(&folder.path().join("hall"));
    let truth = world.free_space(drawn.geometry().resolution_m).expect("its free space");
    let MapScore { wall_precision, free_recall, .. } = score_map(&drawn, &truth, 2.0);
    println!(
        "hall: walls {:.1} % right, free space {:.1} % found",
        wall_precision * 100.0,
        free_recall * 100.0
    );
    assert!(wall_precision > 0.75 && free_recall > 0.95, "{wall_precision} {free_recall}");
}

/// The waypoints of missions/patrol.xml, in metres on the map.
const ROUTE: [(f64, f64); 5] = [(3.6, 1.5), (3.4, -1.6), (0.0, -2.0), (0.0, 2.0), (0.0, 0.0)];

// Slow (about a minute): a mapping tour and one lap in real time.
#[test]
fn the_patrol_completes_its_rounds() {
    let folder = Folder::new("patrol");
    let file = root().join("missions/patrol.xml").display().to_string();
    let arguments = ["run", &file, "--headless", "--out", "patrol", "--set", "patrol.laps=1"];
    let (code, _, log) = run_to_end(&mut folder.armor(&arguments));
    assert_eq!(code, 0, "{log}");
    let trajectory = std::fs::read_to_string(folder.path().join("patrol/trajectory.csv"));
    let way: Vec<Vec<f64>> = trajectory
        .expect("trajectory.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|number| number.parse().expect("a number")).collect())
        .collect();
    for (x_m, y_m) in ROUTE {
        let distances = way.iter().map(|row| (row[2] - x_m).hypot(row[3] - y_m));
        let nearest_m = distances.fold(f64::INFINITY, f64::min);
        assert!(nearest_m < 0.35, "never nearer than {nearest_m:.2} m to {x_m},{y_m}");
    }
}

/// The ends of the legs of missions/drawn.xml, in metres on the map.
const LEGS: [(f64, f64); 3] = [(6.0, 0.0), (2.15, -3.0), (0.0, 0.0)];

// Slow (about half a minute): the legs of a drawing in the office.
#[test]
fn a_drawn_mission_drives_its_legs_and_stays_out_of_the_kitchen() {
    let folder = Folder::new("drawn");
    let file = root().join("missions/drawn.xml").display().to_string();
    let (code, log, _) =
        run_to_end(&mut folder.armor(&["run", &file, "--headless", "--out", "drawn"]));
    assert_eq!(code, 0, "{log}");
    for step in ["red.l1.done: red.l1 -> red.l2", "red.s1.done: red.s1 -> red.l4", "red.l5.done"] {
        assert!(log.contains(step), "{step} in\n{log}");
    }
    let trajectory = std::fs::read_to_string(folder.path().join("drawn/trajectory.csv"));
    let rows: Vec<Vec<f64>> = trajectory
        .expect("trajectory.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|number| number.parse().expect("a number")).collect())
        .collect();
    for (x_m, y_m) in LEGS {
        let distances = rows.iter().map(|row| (row[2] - x_m).hypot(row[3] - y_m));
        let nearest_m = distances.fold(f64::INFINITY, f64::min);
        assert!(nearest_m < 0.4, "never nearer than {nearest_m:.2} m to {x_m},{y_m}");
    }
    let in_kitchen = rows.iter().filter(|row| row[2] < -1.4 && row[3] < -1.2).count();
    assert_eq!(in_kitchen, 0, "of {} positions", rows.len());
}

// Slow (about a minute): three rounds through two rooms in real time.
#[test]
fn three_rounds_are_counted_and_each_place_has_its_route() {
    let folder = Folder::new("rounds");
    let file = root().join("missions/rounds.xml").display().to_string();
    let (code, log, _) =
        run_to_end(&mut folder.armor(&["run", &file, "--headless", "--out", "rounds"]));
    assert_eq!(code, 0, "{log}");
    for (step, times) in [("first-seen: first-room", 3), ("second-seen: ", 2), ("round is 3", 1)] {
        assert_eq!(log.matches(step).count(), times, "{step} in\n{log}");
    }
    let trajectory = std::fs::read_to_string(folder.path().join("rounds/trajectory.csv"));
    let trajectory = trajectory.expect("trajectory.csv");
    let rows = trajectory.lines().skip(1).map(|line| {
        let mut numbers = line.split(',').skip(2).map(|number| number.parse::<f64>());
        let mut next = || numbers.next().expect("a column").expect("a number");
        (next(), next())
    });
    let rows: Vec<_> = rows.collect();
    // The robot must visit both rooms; only places of the mission send it there.
    for room in [(3.6, 1.5), (3.4, -1.6)] {
        let is_there = |row: &(f64, f64)| (row.0 - room.0).hypot(row.1 - room.1) < 0.5;
        let visits = rows.windows(2).filter(|pair| !is_there(&pair[0]) && is_there(&pair[1]));
        assert!(visits.count() >= 3, "{room:?} is not visited three times");
    }
    let journal = folder.path().join("rounds/executive.journal").display().to_string();
    let (code, printed, log) = run_to_end(&mut folder.armor(&["mission", "replay", &journal]));
    assert_eq!(code, 0, "{log}");
    assert!(printed.contains("with route=3.4,-1.6, stay=2s"), "{printed}");
    assert!(printed.trim_end().ends_with("= over; round is 3; ended at its goal"), "{printed}");
}

// Slow (about a minute): the battery drains and the robot returns to its dock in real time.
#[test]
fn a_weak_battery_ends_the_survey_at_the_dock() {
    let folder = Folder::new("survey");
    let file = root().join("missions/survey.xml").display().to_string();
    let mut arguments = vec!["run", &file, "--headless", "--out", "survey"];
    for set in ["simulator.battery_level=0.36", "simulator.battery_endurance=200s"] {
        arguments.extend(["--set", set]);
    }
    let (code, log, _) = run_to_end(&mut folder.armor(&arguments));
    assert_eq!(code, 0, "{log}");
    for step in ["weak: explore -> return", "there: return -> at-dock", "dock.leave: dock.docked"] {
        assert!(log.contains(step), "{step} in\n{log}");
    }
}

/// Maps a log twice in parallel, so that both runs compete; returns both trajectories.
fn mapped_twice(folder: &Folder, log: &Path) -> [Vec<u8>; 2] {
    let file = root().join("missions/map-from-log.xml").display().to_string();
    let set = format!("player.file={}", log.display());
    let run = |out: &str| {
        let arguments = ["run", &file, "--set", &set, "--headless", "--out", out];
        let (code, _, text) = run_to_end(&mut folder.armor(&arguments));
        assert_eq!(code, 0, "{text}");
        std::fs::read(folder.path().join(out).join("trajectory.csv")).expect("trajectory.csv")
    };
    std::thread::scope(|scope| {
        let other = scope.spawn(|| run("other"));
        [run("one"), other.join().expect("it ended")]
    })
}

// Slow (about half a minute): two mappers compete for the processor on purpose.
#[test]
fn a_log_gives_the_same_trajectory_to_the_byte_each_time() {
    let Some(data) = std::env::var_os("ARMOR_DATA").map(PathBuf::from) else {
        assert!(std::env::var_os("CI").is_none(), "ARMOR_DATA is not set");
        println!("skipped: ARMOR_DATA is not set");
        return;
    };
    // Of all the logs, this one has the most timestamps that go backwards.
    let folder = Folder::new("played-twice");
    let [one, other] = mapped_twice(&folder, &data.join("laser/intel.log.gz"));
    assert!(one.len() > 910 * 20, "{} bytes", one.len());
    assert!(one == other, "two runs differ");
}

/// Name and number of scans of each log.
const LOGS: [(&str, usize); 5] =
    [("intel", 910), ("aces", 440), ("freiburg-079", 4791), ("edmonton", 340), ("acapulco", 861)];

// Slow (minutes): more than 7,000 scans, mapped one by one without loss.
#[test]
fn every_scan_of_every_log_is_mapped() {
    let Some(data) = std::env::var_os("ARMOR_DATA").map(PathBuf::from) else {
        assert!(std::env::var_os("CI").is_none(), "ARMOR_DATA is not set");
        println!("skipped: ARMOR_DATA is not set");
        return;
    };
    let folder = Folder::new("replay");
    let file = root().join("missions/map-from-log.xml").display().to_string();
    for (name, scans) in LOGS {
        let log = data.join("laser").join(format!("{name}.log.gz"));
        let set = format!("player.file={}", log.display());
        let arguments = ["run", &file, "--set", &set, "--headless", "--out", name];
        let (code, _, text) = run_to_end(&mut folder.armor(&arguments));
        assert_eq!(code, 0, "{name}:\n{text}");
        let out = folder.path().join(name);
        let csv = std::fs::read_to_string(out.join("trajectory.csv")).expect("trajectory.csv");
        let mut lines = csv.lines();
        assert_eq!(lines.next(), Some("scan,timestamp_s,x_m,y_m,theta_rad"));
        let numbers: Vec<usize> = lines
            .map(|line| line.split(',').next().and_then(|n| n.parse().ok()).expect("scan"))
            .collect();
        assert_eq!(numbers, (0..scans).collect::<Vec<_>>(), "{name}: every scan, once, in order");
        assert!(std::fs::metadata(out.join("map.png")).is_ok_and(|png| png.len() > 5_000));
    }
}
