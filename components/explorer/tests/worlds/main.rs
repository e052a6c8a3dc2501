//! Explores the worlds of the missions in simulated time and comes home: how long it takes, how
//! much is seen, and that nothing is touched. `ARMOR_FULL=1` runs ten seeds of each world instead
//! of two; `--nocapture` shows the figures, `ARMOR_TRACE=1` every step.

mod delivery;
mod trial;

use delivery::Delays;
use trial::{Conditions, Report, Trial};

const CALM: Delays = Delays { least_s: 0.01, busy_s: 0.0, busy_share: 0.0 };
const BUSY: Delays = Delays { least_s: 0.02, busy_s: 0.2, busy_share: 0.04 };

/// The limits are those of `missions/office.xml`.
fn conditions(seed: u64) -> Conditions {
    Conditions {
        seed,
        explorer: armor_explorer::Settings::default(),
        driver: armor_driver::Settings {
            limits: armor_driver::Limits {
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

/// The first few, all ten with `ARMOR_FULL`, or the one in `ARMOR_SEED`.
fn seeds(few: u64) -> std::ops::RangeInclusive<u64> {
    let one = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok());
    let all = if std::env::var_os("ARMOR_FULL").is_some() { 10 } else { few };
    one.map_or(1..=all, |seed| seed..=seed)
}

/// Runs some seeds, all of which must be home within a time and touch nothing.
fn check(world: &str, few: u64, change: impl Fn(&mut Conditions), within_s: f64) {
    let mut faults = Vec::new();
    for seed in seeds(few) {
        let mut conditions = conditions(seed);
        change(&mut conditions);
        let report = Trial::new(world, conditions).run();
        println!("{world} seed {seed}: {}", line(&report));
        let home = report.home_s.is_some_and(|home_s| home_s <= within_s);
        if !home || report.collisions > 0 || report.explored < 0.98 {
            faults.push(seed);
        }
    }
    assert!(faults.is_empty(), "{world}: seeds {faults:?}");
}

fn line(report: &Report) -> String {
    let time = |time_s: Option<f64>| time_s.map_or("never".into(), |s| format!("{s:.1} s"));
    format!(
        "done {}, home {}, {:.1} m, {:.0} rad, slow {:.0} s, {} goals, {:.2} % seen, walls {:.3}, nearest {:.3} m, {} collisions, off {:.3} m",
        time(report.explored_s),
        time(report.home_s),
        report.way_m,
        report.turned_rad,
        report.slow_s,
        report.goals,
        100.0 * report.explored,
        report.wall_precision,
        report.nearest_m,
        report.collisions,
        report.pose_error_m,
    )
}

#[test]
fn the_office() {
    check("office.svg", 2, |_| {}, 130.0);
}

#[test]
fn three_rooms() {
    check("rooms.svg", 2, |_| {}, 60.0);
}

#[test]
fn the_office_on_a_busy_machine() {
    let busy = |conditions: &mut Conditions| {
        conditions.delays = BUSY;
        conditions.pose_jump_m = 0.02;
    };
    check("office.svg", 1, busy, 150.0);
}
