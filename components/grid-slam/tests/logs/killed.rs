//! The public logs with a mapper that is killed again and again, and continues from what it has
//! written.
//!
//! All of it with `ARMOR_FULL`: five logs, 20 kills each; prints a table (`--nocapture`). Without,
//! one log with 5 kills.

use crate::config;
use crate::recorded::{Recorded, recorded};
use armor_evaluation::relations::{ScanRelation, judge_relations, summarize_by_kind};
use armor_evaluation::trajectory::ScanTrajectory;
use armor_grid_slam::continuation::{Continuation, KnownMap, MapperStart, judge_state};
use armor_grid_slam::recorder::StateRecorder;
use armor_grid_slam::slam::Slam;
use armor_grid_slam::state::{StateFit, StateHeader, encode_header};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

const RUN: &str = "00000000000000a1";
/// As the component does, seconds of the log.
const WRITTEN_EVERY_S: f64 = 0.2;
/// From the kill until scans arrive again, seconds of the log.
const DOWN_S: f64 = 1.5;

/// What came out.
struct KilledRun {
    poses: ScanTrajectory,
    /// Scans after a kill until the robot was recognised, for each kill.
    searched: Vec<usize>,
    /// Bytes of the state at the end, and all that was written.
    len: usize,
    seconds: f64,
    /// Time that it took to compose the batches, seconds.
    composing_s: f64,
}

/// Maps a log, killed before these scans.
fn mapped(scans: &[Recorded], kills: &BTreeSet<usize>) -> KilledRun {
    let config = config();
    let fit = StateFit::of(&config);
    let mut file = encode_header(&StateHeader { run: RUN.into(), epoch: String::new(), fit });
    let (mut slam, mut recorder) = (Slam::new(config), StateRecorder::default());
    let (mut numbers, mut searched) = (Vec::new(), Vec::new());
    let (mut written_s, mut dead_until_s) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let (mut search, mut composing) = (None, Duration::ZERO);
    for (index, Recorded { number, odometry, scan }) in scans.iter().enumerate() {
        if kills.contains(&index) {
            let known =
                judge_state(Some(&file), MapperStart { run: RUN, is_first: false }, &config, scan);
            let Continuation::Known(known) = known else { panic!("the state is not continued") };
            let KnownMap { slam: restored, search: begun, recorder: continued, len, .. } = *known;
            assert_eq!(len, file.len());
            (slam, recorder, search) = (restored, continued, Some(begun));
            // What was not written yet is lost with the mapper.
            numbers.truncate(slam.scans());
            dead_until_s = scan.stamp_s + DOWN_S;
            searched.push(0);
        }
        if scan.stamp_s < dead_until_s {
            continue;
        }
        if let Some(looking) = &mut search {
            let found = slam.find_place(looking, *odometry, scan);
            searched.iter_mut().last().into_iter().for_each(|count| *count += 1);
            let Some(robot) = found else { continue };
            slam.place_robot(robot, *odometry, scan.stamp_s);
            search = None;
        }
        let estimate = slam.add(*odometry, scan);
        numbers.push(*number);
        if estimate.drawn {
            recorder.scan_drawn(slam.travelled_m(), scan.clone());
        }
        if scan.stamp_s - written_s >= WRITTEN_EVERY_S {
            let begun = Instant::now();
            file.extend(recorder.take_batch(&slam, *odometry));
            composing += begun.elapsed();
            written_s = scan.stamp_s;
        }
    }
    let stamps = scans.iter().map(|one| one.scan.stamp_s);
    let seconds = stamps.clone().fold(f64::MIN, f64::max) - stamps.fold(f64::MAX, f64::min);
    let poses = numbers.into_iter().zip(slam.trajectory()).collect();
    let (len, composing_s) = (file.len(), composing.as_secs_f64());
    KilledRun { poses, searched, len, seconds, composing_s }
}

/// Mean error of all relations, metres and degrees.
fn mean_errors(poses: &ScanTrajectory, relations: &[ScanRelation]) -> [f64; 2] {
    let all = &summarize_by_kind(&judge_relations(poses, relations).unwrap())["all"];
    [all.metres.mean, all.degrees.mean]
}

/// Kills a mapper at `count` random scans; returns the errors as parts of those without kills.
fn check(name: &str, count: usize, seed: u64) {
    let Some((scans, relations)) = recorded(name) else { return };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut kills = BTreeSet::new();
    while kills.len() < count {
        kills.insert(10 + random.next_u64() as usize % (scans.len() - 20));
    }
    let whole = mapped(&scans, &BTreeSet::new());
    let killed = mapped(&scans, &kills);
    let is_known = |number: &usize| killed.poses.contains_key(number);
    let both = relations.iter().filter(|it| is_known(&it.from) && is_known(&it.to));
    let both: Vec<_> = both.cloned().collect();
    let (without, with) = (mean_errors(&whole.poses, &both), mean_errors(&killed.poses, &both));
    let part = [0, 1].map(|kind| with[kind] / without[kind]);
    let mut searched = killed.searched.clone();
    searched.sort_unstable();
    println!(
        "{name:>13}, seed {seed}: {count} kills, {:.4} m {:.3} deg instead of {:.4} m {:.3} deg \
         ({:.3} and {:.3} of it) over {} of {} relations; scans until recognised: median {}, \
         most {}; {:.2} MB written, {:.0} B/s of the log, in {:.3} s",
        with[0],
        with[1],
        without[0],
        without[1],
        part[0],
        part[1],
        both.len(),
        relations.len(),
        searched[searched.len() / 2],
        searched.last().unwrap(),
        whole.len as f64 / 1e6,
        whole.len as f64 / whole.seconds,
        whole.composing_s,
    );
    assert!(part.iter().all(|part| *part <= 1.1), "{name}: {part:?}");
}

#[test]
fn a_killed_mapper_makes_the_same_map() {
    if std::env::var_os("ARMOR_FULL").is_none() {
        return check("freiburg-079", 5, 1);
    }
    let asked = std::env::var("ARMOR_LOG").ok();
    let logs = ["intel", "aces", "freiburg-079", "edmonton", "acapulco"];
    for name in logs.into_iter().filter(|name| asked.as_deref().is_none_or(|log| log == *name)) {
        check(name, 20, 1);
    }
}
