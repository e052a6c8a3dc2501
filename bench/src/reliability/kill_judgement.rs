//! What kills of the mapper show: how soon it gives a pose again, how true that pose is, and whether
//! anything is driven in a frame of before. No IO and no clock.

use std::time::Instant;

use super::echoes::{SeenFrame, SeenMarking};
use super::report::{FaultReport, TimeGoal};

/// How many poses after a kill, and before it, are compared with the truth.
pub const COMPARED: usize = 20;
/// The goals of a mapper that was killed.
const BACK_GOAL_S: f64 = 3.0;
const ERROR_GOAL_M: f64 = 0.1;
/// Rows of kills after which no pose could be judged. The first two are misses. The third is not: the
/// mission was over before a pose had to come back.
const MISSED: &str = "kills after which no pose came back";
const UNCOMPARED: &str = "kills after which no pose could be compared with the truth";
const OVER_BEFORE: &str = "kills with the mission over within 3 s, before a pose could be compared";
/// Row of poses near a kill without a truth before and after them, as the last one of a mission.
const WITHOUT_TRUTH: &str = "poses that could not be compared with the truth";

/// A kill of the mapper.
#[derive(Clone, Copy, Debug)]
pub struct MapperKill {
    pub at: Instant,
    /// The same moment in system time, as the stamps.
    pub stamp_s: f64,
}

impl MapperKill {
    /// Whether a pose is of a scan after the kill. Its arrival does not show that: a pose that the
    /// killed mapper had sent may arrive after the kill.
    pub fn is_before(&self, pose: &SeenFrame) -> bool {
        pose.stamp_s > self.stamp_s
    }
}

/// Adds what a run shows; returns whether after each kill a pose came back in time and near the truth,
/// and no path was in an outdated frame. The goal of the report allows one late pose in 20; here each
/// counts, so that the files of its run are kept.
pub fn judge_run(
    report: &mut FaultReport,
    world: &str,
    kills: &[MapperKill],
    seen: &SeenRun,
) -> bool {
    let mut is_good = true;
    for (number, kill) in kills.iter().enumerate() {
        is_good &= judge_kill(report, world, *kill, kills.get(number + 1), seen);
    }
    let SeenRun { poses, paths, .. } = seen;
    let first = poses.first().map(|pose| pose.frame.as_str()).unwrap_or_default();
    let changed = poses.iter().filter(|pose| pose.frame != first).count() as u64;
    report.add_count("poses in a frame of another epoch", changed, None);
    // A path of a frame that has ended is driven if it comes after the first pose of the new one.
    let is_outdated = |path: &&SeenFrame| {
        let current = poses.iter().rev().find(|pose| pose.at < path.at);
        current.is_some_and(|pose| pose.frame != path.frame)
    };
    let outdated = paths.iter().filter(is_outdated).count() as u64;
    report.add_count("paths", paths.len() as u64, None);
    report.add_count("paths in another frame than the pose", outdated, Some(0));
    is_good && outdated == 0
}

/// Adds what a kill shows; returns whether a pose came back in time and near the truth. Poses after the
/// next kill do not count: another process has sent them.
fn judge_kill(
    report: &mut FaultReport,
    world: &str,
    kill: MapperKill,
    next: Option<&MapperKill>,
    seen: &SeenRun,
) -> bool {
    let SeenRun { poses, truth, .. } = seen;
    let is_of_next = |pose: &SeenFrame| next.is_some_and(|next| next.is_before(pose));
    let later: Vec<_> =
        poses.iter().filter(|pose| kill.is_before(pose) && !is_of_next(pose)).collect();
    let earlier = poses.iter().rev().filter(|pose| !kill.is_before(pose));
    let Some(first) = later.first() else {
        return judge_kill_without_pose(report, world, kill, seen, MISSED);
    };
    let after = compare_poses(later.iter().copied().take(COMPARED), truth);
    let before = compare_poses(earlier.take(COMPARED), truth);
    report.add_count(WITHOUT_TRUTH, before.without_truth + after.without_truth, None);
    let Some(after_m) = after.greatest_m else {
        return judge_kill_without_pose(report, world, kill, seen, UNCOMPARED);
    };
    report.add_count("kills", 1, None);
    let back_s = first.at.saturating_duration_since(kill.at).as_secs_f64();
    report.add_time("from the kill to the next pose", back_s, Some(TimeGoal::P95(BACK_GOAL_S)));
    let row = |when: &str| format!("{world}: greatest error of the {COMPARED} poses {when}");
    report.add_distance(&row("after a kill"), after_m, Some(ERROR_GOAL_M));
    let mut before_text = "not known".to_owned();
    if let Some(before_m) = before.greatest_m {
        report.add_distance(&row("before a kill"), before_m, None);
        before_text = format!("{before_m:.3} m");
    }
    eprintln!(
        "{world}: a pose again after {back_s:.2} s, off by {after_m:.3} m, before {before_text}"
    );
    back_s <= BACK_GOAL_S && after_m <= ERROR_GOAL_M
}

/// Adds a kill after which no pose could be judged, in the row `miss` unless the mission was over before
/// a pose had to come back; returns whether it was. A mission that has ended elsewhere than at its goal
/// may have failed because of the kill.
fn judge_kill_without_pose(
    report: &mut FaultReport,
    world: &str,
    kill: MapperKill,
    seen: &SeenRun,
    miss: &str,
) -> bool {
    let home = seen.markings.iter().find(|marking| marking.is_home);
    let left_s = home.map(|home| home.at.saturating_duration_since(kill.at).as_secs_f64());
    if let Some(left_s) = left_s.filter(|left_s| *left_s <= BACK_GOAL_S) {
        report.add_count(OVER_BEFORE, 1, None);
        eprintln!("{world}: no pose after a kill {left_s:.2} s before the mission was over");
        return true;
    }
    report.add_count(miss, 1, Some(0));
    let ending = left_s.map_or("the mission did not reach its goal".to_owned(), |left_s| {
        format!("the mission lasted {left_s:.2} s more")
    });
    eprintln!("{world}: one more of the {miss}; {ending}");
    false
}

/// Poses, compared with the truth.
struct PoseComparison {
    /// The greatest distance from the truth at the poses' stamps; infinite if one is not a number, and
    /// `None` if no pose could be compared.
    greatest_m: Option<f64>,
    /// The number of poses for which there is no truth.
    without_truth: u64,
}

fn compare_poses<'a>(
    poses: impl Iterator<Item = &'a SeenFrame>,
    truth: &[SeenFrame],
) -> PoseComparison {
    let mut comparison = PoseComparison { greatest_m: None, without_truth: 0 };
    for pose in poses {
        let Some((x, y)) = interpolate_place(truth, pose.stamp_s) else {
            comparison.without_truth += 1;
            continue;
        };
        let error_m = (pose.x - x).hypot(pose.y - y);
        // `f64::max` ignores what is not a number.
        let error_m = if error_m.is_nan() { f64::INFINITY } else { error_m };
        comparison.greatest_m = Some(comparison.greatest_m.map_or(error_m, |it| it.max(error_m)));
    }
    comparison
}

/// Where the robot was at a time between two true poses.
fn interpolate_place(truth: &[SeenFrame], stamp_s: f64) -> Option<(f64, f64)> {
    let after = truth.partition_point(|one| one.stamp_s < stamp_s);
    let (before, after) = (truth.get(after.checked_sub(1)?)?, truth.get(after)?);
    let share = (stamp_s - before.stamp_s) / (after.stamp_s - before.stamp_s);
    Some((before.x + share * (after.x - before.x), before.y + share * (after.y - before.y)))
}

/// What was published in a run.
pub struct SeenRun {
    pub poses: Vec<SeenFrame>,
    pub truth: Vec<SeenFrame>,
    pub paths: Vec<SeenFrame>,
    pub markings: Vec<SeenMarking>,
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_pose_is_compared_with_the_truth_of_its_time() {
        let read = |stamp: f64, x: f64| {
            let line = format!(
                r#"{{"value":{{"stamp":{stamp},"frame":"map","pose":{{"pose":{{"position":{{"x":{x},"y":0}}}}}}}}}}"#
            );
            SeenFrame::read(&line).expect("a pose")
        };
        let truth = [read(1.0, 10.0), read(2.0, 20.0)];
        assert_eq!(interpolate_place(&truth, 1.5), Some((15.0, 0.0)));
        assert_eq!(interpolate_place(&truth, 0.5), None);
        assert_eq!(interpolate_place(&truth, 2.5), None);
        let poses = [read(1.5, 15.25), read(1.2, 12.0), read(9.0, 99.0)];
        let comparison = compare_poses(poses.iter(), &truth);
        assert_eq!((comparison.greatest_m, comparison.without_truth), (Some(0.25), 1));
        let comparison = compare_poses(poses[2..].iter(), &truth);
        assert_eq!((comparison.greatest_m, comparison.without_truth), (None, 1));
        // What is not a number is no small error, wherever it stands.
        for at in 0..2 {
            let mut poses = poses.clone();
            poses[at].y = f64::NAN;
            let greatest_m = compare_poses(poses.iter(), &truth).greatest_m;
            assert_eq!(greatest_m, Some(f64::INFINITY), "pose {at}");
        }
        assert!(SeenFrame::read("{}").is_none() && SeenFrame::read("no JSON").is_none());
    }

    /// A run with poses every 0.1 s until 10 s, and the mission home at `home_s`. The processes end
    /// later. Its stamps begin at 0.
    fn draw_run(begin: Instant, home_s: Option<f64>) -> SeenRun {
        let at = |seconds: f64| begin + Duration::from_secs_f64(seconds);
        let frame = |tenths: u32| {
            let stamp_s = f64::from(tenths) / 10.0;
            SeenFrame { at: at(stamp_s), stamp_s, frame: "map".into(), x: stamp_s, y: 0.0 }
        };
        let home = home_s.map(|home_s| SeenMarking { at: at(home_s), is_home: true });
        let under_way = SeenMarking { at: begin, is_home: false };
        SeenRun {
            poses: (0..=100).map(frame).collect(),
            truth: (0..=400).map(frame).collect(),
            paths: Vec::new(),
            markings: [under_way].into_iter().chain(home).collect(),
        }
    }

    /// Judges a run of [`draw_run`]; returns whether it is good, and the table.
    fn judge(begin: Instant, killed_s: &[f64], seen: &SeenRun) -> (bool, String) {
        let mut report = FaultReport::default();
        let kill = |stamp_s: &f64| MapperKill {
            at: begin + Duration::from_secs_f64(*stamp_s),
            stamp_s: *stamp_s,
        };
        let kills: Vec<_> = killed_s.iter().map(kill).collect();
        let is_good = judge_run(&mut report, "rooms", &kills, seen);
        assert_eq!(is_good, report.meets_goals(), "{}", report.to_markdown());
        (is_good, report.to_markdown())
    }

    fn row(name: &str, count: u32) -> String {
        format!("| {name} | {count} |")
    }

    #[test]
    fn a_kill_without_a_pose_is_a_miss_only_if_the_mission_lasted_long_enough() {
        let begin = Instant::now();
        let judge = |home_s, killed_s| judge(begin, &[killed_s], &draw_run(begin, home_s));
        // 10.0: the mission was home already.
        for home_s in [10.0, 10.02, 10.07, 12.9] {
            let (is_good, text) = judge(Some(home_s), 10.02);
            assert!(is_good && text.contains(&row(OVER_BEFORE, 1)), "home at {home_s} s: {text}");
            assert!(!text.contains(&row("kills", 1)) && !text.contains(MISSED), "{text}");
        }
        // The mission continued without a pose, or did not reach its goal.
        for home_s in [Some(13.2), Some(40.0), None] {
            let (is_good, text) = judge(home_s, 10.02);
            assert!(!is_good && text.contains(&row(MISSED, 1)), "home at {home_s:?} s: {text}");
            assert!(!text.contains(OVER_BEFORE), "{text}");
        }
        let (is_good, text) = judge(Some(10.07), 9.95);
        assert!(is_good && text.contains(&row("kills", 1)), "{text}");
        assert!(!text.contains(OVER_BEFORE) && !text.contains(MISSED), "{text}");
    }

    #[test]
    fn a_pose_after_the_next_kill_is_no_pose_after_the_first() {
        let begin = Instant::now();
        let mut seen = draw_run(begin, Some(10.0));
        seen.poses.retain(|pose| pose.stamp_s <= 2.0 || pose.stamp_s > 6.2);
        let (is_good, text) = judge(begin, &[2.02, 6.02], &seen);
        assert!(!is_good && text.contains(&row(MISSED, 1)), "{text}");
        assert!(text.contains(&row("kills", 1)), "the second kill: {text}");
        let back = "| from the kill to the next pose, s | 1 | 0.280 | 0.280 | 0.280 | p95 ≤ 3.00 s | yes |";
        assert!(text.contains(back), "{text}");
    }

    #[test]
    fn a_pose_that_comes_back_late_is_no_good_run() {
        let begin = Instant::now();
        for (back_s, is_early) in [(4.9, true), (5.2, false)] {
            let mut seen = draw_run(begin, Some(10.0));
            seen.poses.retain(|pose| pose.stamp_s <= 2.0 || pose.stamp_s >= back_s);
            let (is_good, text) = judge(begin, &[2.02], &seen);
            assert_eq!(is_good, is_early, "back at {back_s} s: {text}");
            assert!(text.contains(&row("kills", 1)), "{text}");
        }
    }

    #[test]
    fn a_pose_that_the_killed_mapper_had_sent_is_of_before_the_kill() {
        let begin = Instant::now();
        let mut seen = draw_run(begin, Some(10.0));
        seen.poses.retain(|pose| pose.stamp_s <= 2.0 || pose.stamp_s >= 2.45);
        // The last pose before the gap arrives 5 ms after the kill at 2.02 s, and is wrong.
        let in_flight = seen.poses.iter_mut().rfind(|pose| pose.stamp_s <= 2.0).expect("a pose");
        in_flight.at = begin + Duration::from_secs_f64(2.025);
        in_flight.y = 0.5;
        let (is_good, text) = judge(begin, &[2.02], &seen);
        assert!(is_good, "{text}");
        assert!(text.contains("next pose, s | 1 | 0.480 | 0.480 | 0.480 |"), "{text}");
        let before =
            "rooms: greatest error of the 20 poses before a kill, m | 1 | 0.500 | 0.500 | 0.500 |";
        assert!(text.contains(before), "{text}");
        // Nothing but that pose.
        seen.poses.retain(|pose| pose.stamp_s <= 2.0);
        let (is_good, text) = judge(begin, &[2.02], &seen);
        assert!(!is_good && text.contains(&row(MISSED, 1)), "{text}");
    }

    #[test]
    fn a_kill_is_judged_only_by_poses_with_a_truth() {
        let begin = Instant::now();
        let judge_changed = |change: &dyn Fn(&mut SeenRun), home_s| {
            let mut seen = draw_run(begin, Some(home_s));
            change(&mut seen);
            judge(begin, &[2.02], &seen)
        };
        // No truth at all, or none of after the kill.
        for last_s in [-1.0, 2.0] {
            let end = |seen: &mut SeenRun| seen.truth.retain(|truth| truth.stamp_s <= last_s);
            let (is_good, text) = judge_changed(&end, 10.0);
            assert!(!is_good && text.contains(&row(UNCOMPARED, 1)), "until {last_s} s: {text}");
            assert!(!text.contains(&row("kills", 1)), "{text}");
        }
        let (is_good, text) = judge_changed(&|seen| seen.truth.truncate(21), 4.0);
        assert!(is_good && text.contains(&row(OVER_BEFORE, 1)), "the mission was over: {text}");
        // The truth ends earlier than the poses: those that have one are compared.
        let (is_good, text) = judge_changed(&|seen| seen.truth.truncate(26), 10.0);
        assert!(is_good && text.contains(&row("kills", 1)), "{text}");
        assert!(text.contains(&row(WITHOUT_TRUTH, 15)), "{text}");
        let (is_good, text) = judge_changed(&|seen| seen.poses[30].x = f64::NAN, 10.0);
        assert!(!is_good && text.contains("| inf |"), "a pose that is not a number: {text}");
    }
}
