//! The public logs made worse, to see what the mapper bears: wheels that drift twice as much, fewer
//! scans, fewer beams, a shorter sight, another beginning.
//!
//! All of it with `ARMOR_FULL`; prints a table (`--nocapture`). Without, one log as a sample.

use crate::config;
use crate::recorded::{Recorded, numbered, recorded};
use armor_evaluation::relations::{ScanRelation, judge_relations, summarize_by_kind};
use armor_grid_slam::pose::Pose;
use armor_grid_slam::slam::Slam;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

const LOGS: [&str; 5] = ["intel", "aces", "freiburg-079", "edmonton", "acapulco"];
/// What is put onto the odometry, which has as much already: share of the distance, heading for
/// each metre, and noise as a share of both.
const SCALE: f64 = 0.02;
const BIAS_RADPM: f64 = 0.0061;
const NOISE: f64 = 0.03;
/// Errors below these do not count as lost, only as less exact: metres and degrees.
const BEARABLE: [f64; 2] = [0.35, 3.0];

/// A revisit this far off is counted as one that was not recognised, metres.
const LOST_M: f64 = 0.5;

/// Where it is lost: one and a half to four metres between scans, in corridors and halls. Printed
/// all the same.
const LOST: [(&str, &str); 5] = [
    ("aces", "every 2nd scan"),
    ("aces", "every 3rd scan"),
    ("edmonton", "every 3rd scan"),
    ("acapulco", "every 2nd scan"),
    ("acapulco", "every 3rd scan"),
];

type Worse = (&'static str, fn(&[Recorded]) -> Vec<Recorded>);

const WAYS: [Worse; 9] = [
    ("as it is", |scans| scans.to_vec()),
    ("drift twice, seed 1", |scans| drifting(scans, 1)),
    ("drift twice, seed 2", |scans| drifting(scans, 2)),
    ("every 2nd scan", |scans| scans.iter().step_by(2).cloned().collect()),
    ("every 3rd scan", |scans| scans.iter().step_by(3).cloned().collect()),
    ("every 2nd beam", |scans| scans.iter().map(thinned).collect()),
    ("sees 8 m", |scans| scans.iter().map(|scan| cut(scan, 8.0)).collect()),
    ("from the middle on", |scans| scans[scans.len() / 2..].to_vec()),
    ("odometry turned", |scans| scans.iter().map(turned).collect()),
];

/// The same trajectory with more error in every motion.
fn drifting(scans: &[Recorded], seed: u64) -> Vec<Recorded> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // A sum of three even numbers is normal enough; deviation 1.
    let mut normal = || {
        let even = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        2.0 * std::iter::repeat_with(even).take(3).sum::<f64>()
    };
    let (mut odometry, mut before) = (scans[0].odometry, scans[0].odometry);
    let worse = |one: &Recorded| {
        let motion = before.inverse() * one.odometry;
        let (way_m, turn_rad) = (motion.x_m.hypot(motion.y_m), motion.yaw_rad.abs());
        let drift = Pose::new(
            motion.x_m * SCALE + NOISE * way_m * normal(),
            motion.y_m * SCALE + NOISE * way_m * normal(),
            BIAS_RADPM * way_m + NOISE * (0.2 * way_m + turn_rad) * normal(),
        );
        (odometry, before) = (odometry * motion * drift, one.odometry);
        Recorded { odometry, ..one.clone() }
    };
    scans.iter().map(worse).collect()
}

fn thinned(one: &Recorded) -> Recorded {
    let mut half = one.clone();
    half.scan.ranges_m = one.scan.ranges_m.iter().step_by(2).copied().collect();
    half.scan.increment_rad *= 2.0;
    half
}

fn cut(one: &Recorded, far_m: f32) -> Recorded {
    let mut near = one.clone();
    let seen = |&range_m: &f32| if range_m < far_m { range_m } else { f32::INFINITY };
    near.scan.ranges_m = one.scan.ranges_m.iter().map(seen).collect();
    near.scan.range_max_m = f64::from(far_m);
    near
}

fn turned(one: &Recorded) -> Recorded {
    Recorded { odometry: Pose::new(20.0, -7.0, 2.3) * one.odometry, ..one.clone() }
}

/// Maps the scans; gives a line of the table, and whether the errors can be borne.
fn judged(scans: &[Recorded], relations: &[ScanRelation]) -> (String, bool) {
    let mut slam = Slam::new(config());
    for one in scans {
        slam.add(one.odometry, &one.scan);
    }
    let judged = judge_relations(&numbered(scans, &slam), relations).unwrap();
    let kinds = summarize_by_kind(&judged);
    let revisits = judged.iter().filter(|one| one.relation.kind == "revisit");
    let lost = revisits.clone().filter(|one| one.metres > LOST_M).count();
    let lost = 100.0 * lost as f64 / revisits.count().max(1) as f64;
    let error =
        |kind: &str| kinds.get(kind).map(|errors| [errors.metres.mean, errors.degrees.mean]);
    let cell = |kind: &str| {
        error(kind).map_or("–".into(), |[metres, degrees]| format!("{metres:.3} / {degrees:.2}"))
    };
    let revisit = error("revisit").unwrap();
    let is_borne = revisit.iter().zip(BEARABLE).all(|(error, most)| *error <= most);
    (format!("{} | {} | {lost:.1} | {}", cell("next"), cell("revisit"), slam.closures()), is_borne)
}

fn check(logs: &[&str], ways: &[Worse]) {
    let mut lost = Vec::new();
    println!(
        "| log | made worse by | next, m / deg | revisit, m / deg | off by more than 0.5 m, % | closures |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for name in logs {
        let Some((scans, relations)) = recorded(name) else { return };
        for (way, worse) in ways {
            let (line, is_borne) = judged(&worse(&scans), &relations);
            println!("| {name} | {way} | {line} |");
            if !is_borne && !LOST.contains(&(name, way)) {
                lost.push(format!("{name}, {way}: {line}"));
            }
        }
    }
    assert!(lost.is_empty(), "lost: {lost:#?}");
}

#[test]
fn logs_made_worse_are_mapped() {
    if std::env::var_os("ARMOR_FULL").is_some() {
        let chosen = |name: &&str| std::env::var("ARMOR_LOG").map_or(true, |log| log == **name);
        let logs: Vec<_> = LOGS.into_iter().filter(chosen).collect();
        check(&logs, &WAYS);
    } else {
        check(&["aces"], &WAYS[1..3]);
    }
}
