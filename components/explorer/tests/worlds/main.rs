//! Explores the worlds of the missions in simulated time and comes home: how long it takes, how
//! much is seen, that nothing is touched, and that the robot knows where it is. The gate runs two
//! worlds, `ARMOR_FULL=1` all five with ten seeds each; `--nocapture` shows the figures.

mod delivery;
mod kills;
mod replays;
mod table;
mod trial;

use delivery::Delays;
use trial::{Conditions, Report, Trial};

const CALM: Delays = Delays { least_s: 0.01, busy_s: 0.0, busy_share: 0.0 };
const BUSY: Delays = Delays { least_s: 0.02, busy_s: 0.2, busy_share: 0.04 };

/// The limits are those of `missions/office.xml`.
fn conditions(seed: u64) -> Conditions {
    Conditions {
        seed,
        explorer: armor_explorer::ExplorerSettings::default(),
        planner: armor_planner::PlannerSettings::default(),
        driver: armor_driver::DriverSettings {
            limits: armor_driver::DriveLimits {
                speed_mps: 0.9,
                turn_radps: 1.8,
                acceleration_mps2: 1.5,
                turn_acceleration_radps2: 5.0,
            },
            ..Default::default()
        },
        delays: CALM,
        pose_late_s: 0.05,
        pose_jump_m: 0.0,
    }
}

/// The first few seeds; all ten with `ARMOR_FULL`; or the one in `ARMOR_SEED`.
fn seeds(few: u64) -> std::ops::RangeInclusive<u64> {
    let one = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok());
    let all = if is_full() { 10 } else { few };
    one.map_or(1..=all, |seed| seed..=seed)
}

fn is_full() -> bool {
    std::env::var_os("ARMOR_FULL").is_some()
}

/// What every run must keep to.
struct Limits {
    /// Home within this, in seconds.
    home_s: f64,
    /// At the end the robot knows where it is to within this, in metres.
    off_m: f64,
}

/// Runs some seeds, all of which must keep to the limits, having seen all there is and touched
/// nothing.
fn check(world: &str, few: u64, change: impl Fn(&mut Conditions), limits: Limits) {
    let mut reports = Vec::new();
    for seed in seeds(few) {
        let mut conditions = conditions(seed);
        change(&mut conditions);
        let report = Trial::new(world, conditions).run();
        println!("{world} seed {seed}: {}", table::line(&report));
        reports.push((seed, report));
    }
    println!("{}\n{}", table::HEAD, table::row(world, &reports));
    let is_good = |report: &Report| {
        report.home_s.is_some_and(|home_s| home_s <= limits.home_s)
            && report.collisions == 0
            && report.explored >= 0.98
            && report.pose_error_m <= limits.off_m
    };
    let faults: Vec<u64> =
        reports.iter().filter(|(_, report)| !is_good(report)).map(|(seed, _)| *seed).collect();
    assert!(faults.is_empty(), "{world}: seeds {faults:?}");
}

/// A world that only the full run explores.
fn check_in_full(world: &str, home_s: f64) {
    if is_full() {
        check(world, 10, |_| {}, Limits { home_s, off_m: 0.10 });
    } else {
        println!("{world} is explored with ARMOR_FULL=1 only");
    }
}

/// `missions/office.xml` gives it 150 s to explore and 60 s for the return.
const OFFICE_S: f64 = 210.0;

#[test]
fn the_office() {
    check("office.svg", 2, |_| {}, Limits { home_s: OFFICE_S, off_m: 0.10 });
}

#[test]
fn three_rooms() {
    check("rooms.svg", 2, |_| {}, Limits { home_s: 60.0, off_m: 0.10 });
}

#[test]
fn the_office_on_a_busy_machine() {
    let busy = |conditions: &mut Conditions| {
        conditions.delays = BUSY;
        conditions.pose_jump_m = 0.02;
    };
    // What it believes jumps by some centimetres, as set above.
    check("office.svg", 1, busy, Limits { home_s: OFFICE_S, off_m: 0.20 });
}

#[test]
fn a_corridor_ring() {
    check_in_full("ring.svg", 200.0);
}

#[test]
fn a_hall_with_pillars() {
    check_in_full("hall.svg", 200.0);
}

#[test]
fn a_warehouse() {
    check_in_full("warehouse.svg", 250.0);
}
