//! A mapper that is killed while it drives through a hall, in memory.

use super::*;
use crate::pose::{Point, Pose};
use crate::record_bytes::seal_records;
use crate::scan::BeamReach;
use crate::state::{StateHeader, encode_header};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

const RUN: &str = "00000000000000a1";
/// A mapper after the first one.
const LATER: MapperStart<'_> = MapperStart { run: RUN, is_first: false };

/// A hall of 12 x 8 m with a corner cut off and a pillar, in the frame of its middle.
fn range_m(pose: &Pose, angle_rad: f64) -> f64 {
    let walls =
        [[1.0, 0.0, 6.0], [-1.0, 0.0, 6.0], [0.0, 1.0, 4.0], [0.0, -1.0, 4.0], [0.6, 0.8, 5.0]];
    let (sin, cos) = (pose.yaw_rad + angle_rad).sin_cos();
    let to = |[x, y, far]: [f64; 3]| {
        let (towards, gap) = (x * cos + y * sin, far - x * pose.x_m - y * pose.y_m);
        if towards > 1e-9 { gap / towards } else { f64::INFINITY }
    };
    let pillar = Point { x_m: -3.0 - pose.x_m, y_m: -2.0 - pose.y_m };
    let (ahead_m, aside_m) =
        (pillar.x_m * cos + pillar.y_m * sin, pillar.y_m * cos - pillar.x_m * sin);
    let depth_m = (0.25 - aside_m * aside_m).max(0.0).sqrt();
    let is_hit = aside_m.abs() < 0.5 && ahead_m > depth_m;
    let pillar_m = if is_hit { ahead_m - depth_m } else { f64::INFINITY };
    walls.map(to).into_iter().fold(pillar_m, f64::min)
}

fn seen_scan(truth: &Pose, stamp_s: f64) -> MapperScan {
    let angle = |index: i32| f64::from(index - 120).to_radians();
    let ranges_m = (0..=240).map(|index| range_m(truth, angle(index)) as f32).collect();
    MapperScan {
        stamp_s,
        angle_min_rad: angle(0),
        increment_rad: 1f64.to_radians(),
        range_min_m: 0.05,
        range_max_m: 30.0,
        ranges_m,
    }
}

/// A robot in the hall whose odometry bends.
struct Drive {
    truth: Pose,
    odometry: Pose,
    stamp_s: f64,
}

impl Drive {
    fn new() -> Self {
        Self { truth: Pose::default(), odometry: Pose::default(), stamp_s: 100.0 }
    }

    fn go_on(&mut self) {
        self.truth = self.truth * Pose::new(0.1, 0.0, 0.05);
        self.odometry = self.odometry * Pose::new(0.102, 0.0, 0.052);
        self.stamp_s += 0.1;
    }

    fn scan(&self) -> MapperScan {
        seen_scan(&self.truth, self.stamp_s)
    }
}

fn header() -> Vec<u8> {
    let fit = StateFit::of(&Config::default());
    encode_header(&StateHeader { run: RUN.into(), epoch: String::new(), fit })
}

/// Maps `steps` scans from the begin on; returns the file.
fn mapped(drive: &mut Drive, steps: usize) -> Vec<u8> {
    let (mut slam, mut recorder) = (Slam::new(Config::default()), StateRecorder::default());
    let mut file = header();
    map_on(&mut slam, &mut recorder, &mut file, drive, steps);
    file
}

/// Returns the largest distance of the pose from the truth.
fn map_on(
    slam: &mut Slam,
    recorder: &mut StateRecorder,
    file: &mut Vec<u8>,
    drive: &mut Drive,
    steps: usize,
) -> f64 {
    let mut error_m: f64 = 0.0;
    for step in 0..steps {
        drive.go_on();
        let scan = drive.scan();
        let estimate = slam.add(drive.odometry, &scan);
        if estimate.drawn {
            recorder.scan_drawn(slam.travelled_m(), scan);
        }
        if step % 7 == 0 || step + 1 == steps {
            file.extend(recorder.take_batch(slam, drive.odometry));
        }
        error_m = error_m.max(estimate.pose.distance_m(&frame_pose(&drive.truth)));
    }
    error_m
}

/// The frame begins at the first scan.
fn frame_pose(truth: &Pose) -> Pose {
    (Pose::default() * Pose::new(0.1, 0.0, 0.05)).inverse() * *truth
}

fn known(file: &[u8], scan: &MapperScan) -> KnownMap {
    match judge_state(Some(file), LATER, &Config::default(), scan) {
        Continuation::Known(known) => *known,
        Continuation::First => panic!("it is the first"),
        Continuation::NewEpoch(refused) => panic!("{refused}"),
    }
}

/// Looks for the robot in at most `scans` scans.
fn find(known: &mut KnownMap, drive: &mut Drive, scans: usize) -> Option<Pose> {
    for _ in 0..scans {
        drive.go_on();
        let found = known.slam.find_place(&mut known.search, drive.odometry, &drive.scan());
        if let Some(robot) = found {
            known.slam.place_robot(robot, drive.odometry, drive.stamp_s);
            return Some(robot);
        }
    }
    None
}

#[test]
fn a_killed_mapper_continues_in_the_same_frame() {
    let mut drive = Drive::new();
    let mut file = mapped(&mut drive, 130);
    // The robot continues while nothing maps.
    (0..25).for_each(|_| drive.go_on());
    let mut known = known(&file, &drive.scan());
    assert_eq!((known.len, known.slam.scans()), (file.len(), 130));
    let found = find(&mut known, &mut drive, 2).expect("two scans suffice");
    let truth = frame_pose(&drive.truth);
    assert!(found.distance_m(&truth) < 0.1, "{found:?}, not {truth:?}");
    let KnownMap { mut slam, mut recorder, .. } = known;
    let error_m = map_on(&mut slam, &mut recorder, &mut file, &mut drive, 60);
    assert!(error_m < 0.1, "{error_m} m");
    assert_eq!(slam.trajectory().count(), 190);
    // What it has added is a state, too.
    let again = self::known(&file, &drive.scan());
    assert_eq!(again.slam.scans(), 190);
}

#[test]
fn a_robot_without_its_odometry_is_recognised_or_lost() {
    let mut drive = Drive::new();
    let file = mapped(&mut drive, 130);
    // After a power failure the robot stands elsewhere, and its odometry begins again.
    drive.truth = Pose::new(1.5, -1.0, 2.0);
    (drive.odometry, drive.stamp_s) = (Pose::default(), 5.0);
    let mut known = known(&file, &drive.scan());
    let found = find(&mut known, &mut drive, 30).expect("the hall is like nothing else");
    let truth = frame_pose(&drive.truth);
    assert!(found.distance_m(&truth) < 0.1, "{found:?}, not {truth:?}");
}

#[test]
fn a_robot_that_is_elsewhere_is_lost_until_the_search_is_over() {
    let mut drive = Drive::new();
    let file = mapped(&mut drive, 60);
    let mut known = known(&file, &drive.scan());
    let elsewhere = |range_m: &f32| 1.0 + 0.5 * (range_m * 7.0).sin().abs();
    for scan in 0..700 {
        let mut seen = drive.scan();
        seen.stamp_s += 0.1 * f64::from(scan);
        seen.ranges_m = seen.ranges_m.iter().map(elsewhere).collect();
        if known.search.is_over(seen.stamp_s) {
            assert!(scan > 590, "after a minute: {scan}");
            return;
        }
        let found = known.slam.find_place(&mut known.search, drive.odometry, &seen);
        assert_eq!(found, None);
    }
    panic!("the search has no end");
}

#[test]
fn a_state_that_does_not_fit_is_refused_with_the_reason() {
    let mut drive = Drive::new();
    let file = mapped(&mut drive, 40);
    let scan = drive.scan();
    let config = Config::default();
    let refused = |file: &[u8], config: &Config, scan: &MapperScan| match judge_state(
        Some(file),
        LATER,
        config,
        scan,
    ) {
        Continuation::NewEpoch(refused) => Some(refused),
        _ => None,
    };
    assert_eq!(refused(&file, &config, &scan), None);
    let coarse = Config { resolution_m: 0.1, ..config };
    assert_eq!(refused(&file, &coarse, &scan), Some(RefusedState::Parameters));
    let short = Config { reach: BeamReach { hit_m: 9.0, ..config.reach }, ..config };
    assert_eq!(refused(&file, &short, &scan), Some(RefusedState::Parameters));
    let mut other = scan.clone();
    other.ranges_m.pop();
    assert_eq!(refused(&file, &config, &other), Some(RefusedState::Sensor));
    assert_eq!(refused(&header(), &config, &scan), Some(RefusedState::Empty));
    let mut damaged = file.clone();
    damaged[file.len() / 2] ^= 4;
    assert!(matches!(refused(&damaged, &config, &scan), Some(RefusedState::File(_))));
    assert!(matches!(refused(b"", &config, &scan), Some(RefusedState::File(_))));
    // Without a state of this run, only its first mapper begins the first frame; or the next one, if
    // that has died before.
    for (found, run) in [(None, RUN), (Some(&file[..]), "another run")] {
        let first = MapperStart { run, is_first: true };
        assert!(matches!(judge_state(found, first, &config, &scan), Continuation::First));
        let later = judge_state(found, MapperStart { run, is_first: false }, &config, &scan);
        assert!(matches!(later, Continuation::NewEpoch(RefusedState::Gone)));
    }
    let not_begun = mark_not_begun(RUN);
    let found = judge_state(Some(&not_begun), LATER, &config, &scan);
    assert!(matches!(found, Continuation::First));
}

/// Whatever is in the file, with whatever sums: it is refused, or a map that can be continued.
#[test]
fn no_content_of_a_state_is_a_panic() {
    let mut drive = Drive::new();
    let file = mapped(&mut drive, 30);
    let scan = drive.scan();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut refused, mut continued) = (0, 0);
    for _ in 0..400 {
        let mut damaged = file.clone();
        for _ in 0..1 + random.next_u64() % 3 {
            let at = header().len() + random.next_u64() as usize % (file.len() - header().len());
            damaged[at] = random.next_u64() as u8;
        }
        seal_records(&mut damaged[header().len()..]);
        match judge_state(Some(&damaged), LATER, &Config::default(), &scan) {
            Continuation::Known(mut known) => {
                continued += 1;
                let place = known.slam.find_place(&mut known.search, drive.odometry, &scan);
                known.slam.place_robot(place.unwrap_or_default(), drive.odometry, drive.stamp_s);
                known.slam.add(drive.odometry, &scan);
                let moved = drive.odometry * Pose::new(0.5, 0.0, 0.0);
                known.slam.add(moved, &scan);
            }
            _ => refused += 1,
        }
    }
    assert!(refused > 0 && continued > 0, "{refused} refused, {continued} continued");
}

#[test]
fn what_is_written_of_a_scan_is_bounded() {
    let mut drive = Drive::new();
    let (mut slam, mut recorder) = (Slam::new(Config::default()), StateRecorder::default());
    let mut file = Vec::new();
    map_on(&mut slam, &mut recorder, &mut file, &mut drive, 100);
    let before = file.len();
    map_on(&mut slam, &mut recorder, &mut file, &mut drive, 100);
    let per_scan = (file.len() - before) / 100;
    assert!(per_scan < 1500, "{per_scan} bytes of each scan, of 241 beams");
    assert!(recorder.take_batch(&slam, drive.odometry).is_empty(), "nothing is new");
}
