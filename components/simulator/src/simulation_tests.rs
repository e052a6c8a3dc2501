//! A whole robot in a small room: what its sensors measure, and that a seed repeats it.

use super::*;
use crate::slip::SlipModel;
use crate::world::WorldStart;

const ROOM: &[u8] = br#"<svg><rect x="-3" y="-3" width="6" height="6"/>
    <circle cx="1.5" cy="1.5" r="0.3"/><circle id="start"/></svg>"#;

fn simulation(models: Models, now_s: f64) -> Simulation {
    let world = World::parse("room.svg", ROOM).expect("a readable world");
    Simulation::new(world, models, now_s).expect("a free start")
}

/// Runs 20 s in ticks of a given length, turning and driving, and gives back all readings.
fn run(seed: u64, epoch_s: f64, tick_s: f64) -> Vec<Stamped> {
    let mut simulation = simulation(Models { seed, ..Models::default() }, epoch_s);
    let mut readings = Vec::new();
    let ticks = (20.0 / tick_s).round() as u32;
    for tick in 1..=ticks {
        let now_s = epoch_s + f64::from(tick) * tick_s;
        simulation.advance_to(now_s, &mut readings);
        simulation.command(0.6, 0.3, now_s, now_s);
    }
    readings
}

/// The readings as text without their times (NaN equals NaN there).
fn described(readings: &[Stamped]) -> Vec<String> {
    readings.iter().map(|stamped| format!("{:?}", stamped.reading)).collect()
}

#[test]
fn a_seed_repeats_the_whole_run_at_any_time_of_day() {
    let first = described(&run(3, 0.0, 0.05));
    assert_eq!(first, described(&run(3, 0.0, 0.05)));
    assert_eq!(first, described(&run(3, 1_795_000_000.0, 0.05)));
    assert_ne!(first, described(&run(4, 0.0, 0.05)));
}

#[test]
fn sensors_report_at_their_rates_with_exact_stamps() {
    let readings = run(1, 100.0, 0.05);
    let times = |wanted: fn(&SensorReading) -> bool| -> Vec<f64> {
        readings.iter().filter(|s| wanted(&s.reading)).map(|s| s.time_s).collect()
    };
    let scans = times(|r| matches!(r, SensorReading::Scan(_)));
    let odometry = times(|r| matches!(r, SensorReading::Odometry(_)));
    assert_eq!(scans.len(), 200);
    assert_eq!(odometry.len(), 400);
    assert_eq!(times(|r| matches!(r, SensorReading::Truth(_))), odometry);
    assert_eq!(times(|r| matches!(r, SensorReading::Battery { .. })).len(), 20);
    assert!(scans.windows(2).all(|pair| (pair[1] - pair[0] - 0.1).abs() < 1e-9));
    assert!(scans.iter().all(|scan| odometry.contains(scan)), "each scan has its odometry");
}

#[test]
fn odometry_comes_before_the_scan_of_its_instant() {
    let readings = run(1, 0.0, 0.05);
    let scan = readings.iter().position(|s| matches!(s.reading, SensorReading::Scan(_)));
    let before = &readings[..scan.expect("a scan")];
    let time_s = readings[before.len()].time_s;
    assert!(
        before
            .iter()
            .any(|s| { s.time_s == time_s && matches!(s.reading, SensorReading::Odometry(_)) })
    );
}

#[test]
fn collisions_are_published_at_first_and_when_they_happen() {
    let mut simulation = simulation(Models::default(), 0.0);
    let mut readings = Vec::new();
    for tick in 1..=200 {
        let now_s = f64::from(tick) * 0.05;
        simulation.command(1.0, 0.0, now_s, now_s);
        simulation.advance_to(now_s, &mut readings);
    }
    let counts: Vec<u64> = readings
        .iter()
        .filter_map(|s| {
            if let SensorReading::Collisions(count) = s.reading { Some(count) } else { None }
        })
        .collect();
    assert_eq!(counts, [0, 1]);
}

#[test]
fn without_commands_the_base_comes_to_rest_whatever_the_clock_does() {
    let mut simulation = simulation(Models::default(), 0.0);
    let mut readings = Vec::new();
    simulation.command(1.0, 0.0, 1e12, 0.0);
    simulation.advance_to(0.4, &mut readings);
    assert!(simulation.pose().x_m > 0.1, "it drives: {:?}", simulation.pose());
    // The process is stopped for a minute; then it runs on.
    for tick in 0..40 {
        simulation.advance_to(60.0 + f64::from(tick) * 0.05, &mut readings);
    }
    let rest = simulation.pose();
    assert!(rest.x_m < 0.5, "braked as soon as it ran on: {rest:?}");
    simulation.advance_to(62.4, &mut readings);
    assert_eq!(simulation.pose(), rest);
}

#[test]
fn a_clock_that_jumps_costs_no_time_to_catch_up_with() {
    let mut simulation = simulation(Models::default(), 0.0);
    let mut readings = Vec::new();
    for now_s in [1e6, 1e9, 5.0, -3600.0] {
        simulation.advance_to(now_s, &mut readings);
        assert!((simulation.time_s() - now_s).abs() < 1e-3, "{now_s}");
    }
    assert!(readings.len() < 20, "{}", readings.len());
}

#[test]
fn an_empty_battery_ends_all_driving() {
    let battery = BatteryModel { initial_level: 0.001, endurance_s: 1000.0, range_m: 1e9 };
    let mut simulation = simulation(Models { battery, ..Models::default() }, 0.0);
    let mut readings = Vec::new();
    for tick in 1..=100 {
        let now_s = f64::from(tick) * 0.05;
        simulation.command(0.3, 0.0, now_s, now_s);
        simulation.advance_to(now_s, &mut readings);
    }
    let x_m = simulation.pose().x_m;
    assert!((0.2..0.5).contains(&x_m), "a second of driving, then braking: {x_m}");
}

/// All readings of one kind in 20 s, with their times.
fn only<T>(readings: &[Stamped], kind: impl Fn(&SensorReading) -> Option<T>) -> Vec<(f64, T)> {
    readings.iter().filter_map(|s| Some((s.time_s, kind(&s.reading)?))).collect()
}

#[test]
fn every_sensor_reports_at_its_rate_and_the_camera_slower_without_a_subscriber() {
    let readings = run(1, 0.0, 0.05);
    let count =
        |kind: fn(&SensorReading) -> bool| readings.iter().filter(|s| kind(&s.reading)).count();
    assert_eq!(count(|r| matches!(r, SensorReading::Turn(_))), 1000);
    assert_eq!(count(|r| matches!(r, SensorReading::Heading(_))), 200);
    assert_eq!(count(|r| matches!(r, SensorReading::Position(_))), 20);
    assert_eq!(count(|r| matches!(r, SensorReading::Presence(_))), 400);
    assert_eq!(count(|r| matches!(r, SensorReading::Picture(_))), 20);
    let mut simulation = simulation(Models::default(), 0.0);
    simulation.watch(true);
    let mut readings = Vec::new();
    for tick in 1..=20 {
        simulation.advance_to(f64::from(tick) * 0.05, &mut readings);
    }
    let pictures = only(&readings, |r| matches!(r, SensorReading::Picture(_)).then_some(()));
    assert_eq!(pictures.len(), 10);
}

#[test]
fn the_gyroscope_feels_how_the_base_really_turns() {
    let slip = SlipModel { share: 0.5, ..SlipModel::default() };
    let drive = DriveModel { slip, ..DriveModel::default() };
    let mut simulation = simulation(Models { drive, ..Models::default() }, 0.0);
    let mut readings = Vec::new();
    for tick in 1..=60 {
        let now_s = f64::from(tick) * 0.05;
        simulation.command(0.0, 1.0, now_s, now_s);
        simulation.advance_to(now_s, &mut readings);
    }
    let turns =
        only(&readings, |r| if let SensorReading::Turn(rate) = r { Some(*rate) } else { None });
    let later: Vec<f64> = turns.iter().filter(|(at_s, _)| *at_s > 1.0).map(|t| t.1).collect();
    let mean = later.iter().sum::<f64>() / later.len() as f64;
    assert!((mean - 0.5).abs() < 0.005, "half of what the wheels turn: {mean}");
}

#[test]
fn a_person_walks_before_the_laser_and_into_the_base() {
    let drawing = br#"<svg><rect x="-3" y="-3" width="6" height="6"/><circle id="start"/>
        <path class="person" d="M2 0 H-2" data-speed="0.5"/></svg>"#;
    let world = World::parse("room.svg", drawing).expect("a readable world");
    let laser = LaserModel { sigma_m: 0.0, dropout: 0.0, ..LaserModel::default() };
    for (people, stop_m, collisions) in [(Manners::Stop, 0.75 + 0.18, 0), (Manners::Bump, 0.43, 1)]
    {
        let models = Models { laser, people, ..Models::default() };
        let mut simulation = Simulation::new(world.clone(), models, 0.0).expect("a free start");
        let mut readings = Vec::new();
        for tick in 1..=200 {
            simulation.advance_to(f64::from(tick) * 0.05, &mut readings);
        }
        let person = simulation.bodies()[0];
        assert!((person.x_m - stop_m).abs() < 0.002, "{people:?}: {person:?}");
        let scans =
            only(&readings, |r| if let SensorReading::Scan(s) = r { Some(s[135]) } else { None });
        // The laser sits 8 cm ahead of the middle.
        assert!(
            (f64::from(scans[0].1) - (2.0 - 0.05 - 0.25 - 0.08)).abs() < 0.01,
            "{}",
            scans[0].1
        );
        let last = f64::from(scans[scans.len() - 1].1);
        assert!((last - (person.x_m - 0.25 - 0.08)).abs() < 1e-3, "{last}");
        let reported =
            only(&readings, |r| if let SensorReading::Collisions(n) = r { Some(*n) } else { None });
        assert_eq!(reported[reported.len() - 1].1, collisions, "{people:?}");
        let bumps =
            only(&readings, |r| if let SensorReading::Bumper(b) = r { Some(*b) } else { None });
        let front = (people == Manners::Bump).then_some(ContactSide::Front);
        assert_eq!(bumps[bumps.len() - 1].1, front, "{people:?}");
    }
}

#[test]
fn robots_in_one_drawing_meet_where_they_are_drawn() {
    let drawing = br#"<svg><rect x="-3" y="-3" width="6" height="6"/>
        <circle id="start" cx="-2" data-heading="90"/>
        <circle class="start" id="blue" cx="1" cy="-1"/></svg>"#;
    let path = std::env::temp_dir().join(format!("armor-two-robots-{}.svg", std::process::id()));
    std::fs::write(&path, drawing).expect("a drawing");
    let place = |id: &str| {
        let start = WorldStart { id: id.to_owned(), otherwise: None };
        let world = World::read_from(&path, &start).expect("a readable world");
        Simulation::new(world, Models::default(), 0.0).expect("a free start")
    };
    let (mut red, mut blue) = (place("start"), place("blue"));
    std::fs::remove_file(&path).expect("the drawing");
    let mut readings = Vec::new();
    blue.step(&mut readings);
    let here = blue.world().sheet_from_map().then(blue.pose());
    red.other_seen(0, here, 0.2);
    red.other_seen(OTHERS, here, 9.0);
    red.step(&mut readings);
    // Red looks up the sheet: blue is 3 m to its right and 1 m ahead.
    let body = red.bodies()[0];
    assert!((body.x_m - 1.0).abs() < 1e-9 && (body.y_m + 3.0).abs() < 1e-9, "{body:?}");
    assert_eq!((red.bodies().len(), body.kind), (1, BodyKind::Robot));
}
