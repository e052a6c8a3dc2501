//! A mapper that is killed while a world is explored, at every second of the mission. What it was
//! given is recorded once and replayed, so that each kill is that of the same mission: the state as
//! it was written by then, half a second without a mapper, and the first two seconds of poses.

use armor_grid::Pose2;
use armor_grid_slam::config::Config;
use armor_grid_slam::continuation::{Continuation, KnownMap, MapperStart, judge_state};
use armor_grid_slam::pose::Pose as MapperPose;
use armor_grid_slam::recorder::StateRecorder;
use armor_grid_slam::slam::Slam;
use armor_grid_slam::state::{StateFit, StateHeader, encode_header};
use armor_simulator::laser::LaserModel;

use crate::trial::{MappedScan, Trial};
use crate::{conditions, is_full};

const RUN: &str = "00000000000000a1";
/// As the component does, seconds.
const WRITTEN_EVERY_S: f64 = 0.2;
/// From the kill until scans arrive again, seconds.
const DOWN_S: f64 = 0.5;
/// Scans from one kill to the next.
const KILLED_EVERY: usize = 10;
/// No kill in the first so many scans.
const BEGUN: usize = 100;
/// Poses after a kill, and before it, that are compared with the truth.
const COMPARED: usize = 20;
/// After a kill no pose may be farther from the truth, metres. The requirement is 0.1 m; where and why
/// it is missed is in docs/mapping.md.
const BOUND_M: f64 = 0.5;
/// … nor from the pose of a mapper that is not killed; in one aisle of the warehouse that one
/// itself moves by steps of 0.15 m.
const MOVED_M: f64 = 0.25;
/// Nor may it take longer to recognise its place: 2 s.
const LOST_SCANS: usize = 20;

pub fn config() -> Config {
    let mount = LaserModel::default().mount;
    let robot_from_laser = MapperPose::new(mount.x_m, mount.y_m, mount.yaw_rad);
    Config { robot_from_laser, ..Config::default() }
}

pub fn error_m(pose: &MapperPose, truth: &Pose2) -> f64 {
    (pose.x_m - truth.x_m).hypot(pose.y_m - truth.y_m)
}

pub fn greatest(errors_m: &[f64]) -> f64 {
    errors_m.iter().copied().fold(0.0, f64::max)
}

/// What a kill did: the greatest errors before and after it and the greatest distance from the poses
/// of the mapper that was not killed, metres, and how many scans the robot was lost.
struct KillResult {
    before_m: f64,
    after_m: f64,
    moved_m: f64,
    lost: usize,
}

/// A mission as it is mapped without a kill.
struct MappedMission {
    file: Vec<u8>,
    /// Of each scan: the pose, and how much of the file was written by then.
    poses: Vec<(MapperPose, usize)>,
}

fn map_mission(scans: &[MappedScan]) -> MappedMission {
    let fit = StateFit::of(&config());
    let mut file = encode_header(&StateHeader { run: RUN.into(), epoch: String::new(), fit });
    let (mut slam, mut recorder) = (Slam::new(config()), StateRecorder::default());
    let (mut written_s, mut poses) = (f64::NEG_INFINITY, Vec::new());
    for MappedScan { odometry, scan, .. } in scans {
        let estimate = slam.add(*odometry, scan);
        if estimate.drawn {
            recorder.scan_drawn(slam.travelled_m(), scan.clone());
        }
        if scan.stamp_s - written_s >= WRITTEN_EVERY_S {
            file.extend(recorder.take_batch(&slam, *odometry));
            written_s = scan.stamp_s;
        }
        poses.push((estimate.pose, file.len()));
    }
    MappedMission { file, poses }
}

/// Continues from a state; returns the number of scans for which the robot was lost, and the poses
/// after them.
fn continue_map(file: &[u8], scans: &[MappedScan]) -> (usize, Vec<MapperPose>) {
    let start = MapperStart { run: RUN, is_first: false };
    let known = judge_state(Some(file), start, &config(), &scans[0].scan);
    let Continuation::Known(known) = known else { panic!("the state is not continued") };
    let KnownMap { mut slam, mut search, .. } = *known;
    let mut seen = scans.iter().enumerate();
    let found = seen.find_map(|(lost, MappedScan { odometry, scan, .. })| {
        let robot = slam.find_place(&mut search, *odometry, scan)?;
        slam.place_robot(robot, *odometry, scan.stamp_s);
        Some(lost)
    });
    let lost = found.unwrap_or(scans.len());
    let rest = scans[lost..].iter().take(COMPARED);
    (lost, rest.map(|MappedScan { odometry, scan, .. }| slam.add(*odometry, scan).pose).collect())
}

/// What a kill at each second of a mission would have done.
fn kill_mapper(scans: &[MappedScan], mission: &MappedMission) -> Vec<KillResult> {
    let error = |number: usize, pose: &MapperPose| error_m(pose, &scans[number].truth);
    let mut kills = Vec::new();
    for number in (BEGUN..scans.len()).step_by(KILLED_EVERY) {
        let is_up = |later: &MappedScan| later.scan.stamp_s >= scans[number].scan.stamp_s + DOWN_S;
        let Some(first) = scans.iter().position(is_up) else { break };
        if first + 2 * COMPARED >= scans.len() {
            break;
        }
        let written = mission.poses[number].1;
        let (lost, after) = continue_map(&mission.file[..written], &scans[first..]);
        let (first, before) = (first + lost, number + 1 - COMPARED..number + 1);
        let before_m: Vec<_> =
            before.map(|number| error(number, &mission.poses[number].0)).collect();
        let after_m: Vec<_> =
            (first..).zip(&after).map(|(number, pose)| error(number, pose)).collect();
        let unkilled = mission.poses[first..].iter().zip(&after);
        let moved_m: Vec<_> = unkilled.map(|((pose, _), after)| pose.distance_m(after)).collect();
        kills.push(KillResult {
            before_m: greatest(&before_m),
            after_m: greatest(&after_m),
            moved_m: greatest(&moved_m),
            lost,
        });
    }
    kills
}

fn describe(mut errors_m: Vec<f64>) -> String {
    errors_m.sort_by(f64::total_cmp);
    let median_m = errors_m[errors_m.len() / 2];
    let off = errors_m.iter().filter(|error_m| **error_m > 0.1).count();
    format!("{median_m:.3} m, at most {:.3} m, {off} over 0.1 m", greatest(&errors_m))
}

/// Kills the mapper in one mission; returns the greatest error after a kill, and how far one moved the
/// pose at most, metres.
fn kill_in(world: &str, seed: u64) -> [f64; 2] {
    let scans = Trial::new(&format!("{world}.svg"), conditions(seed)).record();
    let mission = map_mission(&scans);
    let kills = kill_mapper(&scans, &mission);
    assert!(!kills.is_empty(), "{world}: a mission of {} scans", scans.len());
    let placed = mission.poses.iter().zip(&scans);
    let errors_m: Vec<_> = placed.map(|((pose, _), scan)| error_m(pose, &scan.truth)).collect();
    let all = |of: fn(&KillResult) -> f64| kills.iter().map(of).collect::<Vec<_>>();
    let lost = kills.iter().map(|kill| kill.lost).max().unwrap_or_default();
    println!(
        "{world}, seed {seed}: {} poses, {}; {} kills: before {}; after {}; moved by {}; \
         lost for {lost} scans",
        errors_m.len(),
        describe(errors_m),
        kills.len(),
        describe(all(|kill| kill.before_m)),
        describe(all(|kill| kill.after_m)),
        describe(all(|kill| kill.moved_m)),
    );
    assert!(lost <= LOST_SCANS, "{world}, seed {seed}: lost for {lost} scans");
    [greatest(&all(|kill| kill.after_m)), greatest(&all(|kill| kill.moved_m))]
}

#[test]
fn a_mapper_that_is_killed_in_three_rooms_is_back_where_it_was() {
    let [after_m, moved_m] = kill_in("rooms", 1);
    assert!(after_m <= 0.1, "{after_m} m");
    assert!(moved_m <= 0.1, "moved by {moved_m} m");
}

/// Two seeds, or the one in `ARMOR_SEED`.
#[test]
fn a_mapper_that_is_killed_in_any_world_is_back_where_it_was() {
    if !is_full() {
        println!("the mapper is killed in all worlds with ARMOR_FULL=1 only");
        return;
    }
    let one = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok());
    let seeds = one.map_or(1..=2, |seed: u64| seed..=seed);
    let mut missed = Vec::new();
    for world in ["office", "rooms", "ring", "hall", "warehouse"] {
        for seed in seeds.clone() {
            let [after_m, moved_m] = kill_in(world, seed);
            if after_m > BOUND_M || moved_m > MOVED_M {
                missed
                    .push(format!("{world}, seed {seed}: {after_m:.3} m, moved by {moved_m:.3} m"));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
