//! Kills of the mapper in simulated missions: how soon it gives a pose again, how true that pose is,
//! and whether anything is driven in a frame of before. On one host, without namespaces.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use super::dice::FaultDice;
use super::echoes::{EchoFollower, SeenFrame, SeenMarking};
use super::interrupt::{rest, wait_until};
use super::options::ReliabilityOptions;
use super::report::{FaultReport, TimeGoal};

const WORLDS: [&str; 5] = ["office", "rooms", "ring", "hall", "warehouse"];
/// A component that dies five times in 60 s is given up.
const BETWEEN_KILLS_S: (f64, f64) = (16.0, 22.0);
/// The time for the mission to begin, and for a pose to come back.
const PATIENCE: Duration = Duration::from_secs(30);
/// How many poses after a kill, and before it, are compared with the truth.
const COMPARED: usize = 20;
/// The goals of a mapper that was killed.
const BACK_GOAL_S: f64 = 3.0;
const ERROR_GOAL_M: f64 = 0.1;
/// Rows of kills after which no pose came: those that a mapper should have survived, and those after
/// which the mission did not last long enough to show it.
const MISSED: &str = "kills after which no pose came back";
const OVER_BEFORE: &str = "kills with the mission over within 3 s, before a pose came back";

/// Kills, and measures.
///
/// # Errors
/// If a mission cannot be run.
pub fn run_mapper_kills(program: &Path, options: &ReliabilityOptions) -> Result<FaultReport> {
    let mut report = FaultReport::default();
    let mut dice = FaultDice::new(options.seed);
    let folder = std::env::temp_dir().join(format!("armor-bench-{}", std::process::id()));
    if let Some(unknown) = options.worlds.iter().find(|world| !WORLDS.contains(&world.as_str())) {
        bail!("the mapper is not killed in a world `{unknown}`, but in {}", WORLDS.join(", "));
    }
    let is_wanted =
        |world: &str| options.worlds.is_empty() || options.worlds.iter().any(|one| one == world);
    let worlds: Vec<_> = WORLDS.into_iter().filter(|world| is_wanted(world)).collect();
    for (number, world) in worlds.iter().enumerate() {
        // The first worlds get those that cannot be shared out evenly.
        let mut left = (options.kills + worlds.len() - 1 - number) / worlds.len();
        while left > 0 {
            let files = folder.join(format!("{world}-{left}"));
            let mission = ExploringMission::start(program, world, &files)?;
            let kills = mission.kill_until_home(left, &mut dice)?;
            let seen = mission.end();
            left = left.saturating_sub(kills.len().max(1));
            if judge_run(&mut report, world, &kills, &seen) {
                let _ = std::fs::remove_dir_all(files);
            } else {
                eprintln!("{world}: the files of this run are kept in {}", files.display());
            }
        }
    }
    // Fails if files were kept.
    let _ = std::fs::remove_dir(folder);
    Ok(report)
}

/// Adds what a run shows; returns whether each pose came back, and near the truth.
fn judge_run(report: &mut FaultReport, world: &str, kills: &[Instant], seen: &SeenRun) -> bool {
    let mut is_good = true;
    let SeenRun { poses, truth, paths, markings } = seen;
    let home_at = markings.iter().find(|marking| marking.is_home).map(|marking| marking.at);
    for killed in kills {
        let later: Vec<_> = poses.iter().filter(|pose| pose.at > *killed).collect();
        let earlier: Vec<_> = poses.iter().filter(|pose| pose.at <= *killed).collect();
        let Some(first) = later.first() else {
            is_good &= judge_kill_without_pose(report, world, *killed, home_at);
            continue;
        };
        report.add_count("kills", 1, None);
        let back_s = first.at.duration_since(*killed).as_secs_f64();
        let goal = Some(TimeGoal::P95(BACK_GOAL_S));
        report.add_time("from the kill to the next pose", back_s, goal);
        let after = find_greatest_error(later.iter().copied().take(COMPARED), truth);
        let before = find_greatest_error(earlier.iter().rev().copied().take(COMPARED), truth);
        eprintln!(
            "{world}: a pose again after {back_s:.2} s, off by {after:.3} m, before {before:.3} m"
        );
        is_good &= after <= ERROR_GOAL_M;
        let row = |when: &str| format!("{world}: greatest error of the {COMPARED} poses {when}");
        report.add_distance(&row("before a kill"), before, None);
        report.add_distance(&row("after a kill"), after, Some(ERROR_GOAL_M));
    }
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

/// Adds a kill after which no pose came. Returns whether the mission was over before a pose had to come
/// back. A mission that has ended elsewhere than at its goal may have failed because of the kill.
fn judge_kill_without_pose(
    report: &mut FaultReport,
    world: &str,
    killed: Instant,
    home_at: Option<Instant>,
) -> bool {
    let left_s = home_at.map(|home_at| home_at.saturating_duration_since(killed).as_secs_f64());
    match left_s {
        Some(left_s) if left_s <= BACK_GOAL_S => {
            report.add_count(OVER_BEFORE, 1, None);
            eprintln!("{world}: no pose after a kill {left_s:.2} s before the mission was over");
            true
        }
        Some(left_s) => {
            report.add_count(MISSED, 1, Some(0));
            eprintln!(
                "{world}: no pose after a kill, though the mission lasted {left_s:.2} s more"
            );
            false
        }
        None => {
            report.add_count(MISSED, 1, Some(0));
            eprintln!("{world}: no pose after a kill, and the mission did not reach its goal");
            false
        }
    }
}

/// The greatest distance of poses from the truth at their stamps.
fn find_greatest_error<'a>(poses: impl Iterator<Item = &'a SeenFrame>, truth: &[SeenFrame]) -> f64 {
    let errors = poses.filter_map(|pose| {
        let (x, y) = interpolate_place(truth, pose.stamp_s)?;
        Some((pose.x - x).hypot(pose.y - y))
    });
    errors.fold(0.0, f64::max)
}

/// Where the robot was at a time between two true poses.
fn interpolate_place(truth: &[SeenFrame], stamp_s: f64) -> Option<(f64, f64)> {
    let after = truth.partition_point(|one| one.stamp_s < stamp_s);
    let (before, after) = (truth.get(after.checked_sub(1)?)?, truth.get(after)?);
    let share = (stamp_s - before.stamp_s) / (after.stamp_s - before.stamp_s);
    Some((before.x + share * (after.x - before.x), before.y + share * (after.y - before.y)))
}

/// What was published in a run.
struct SeenRun {
    poses: Vec<SeenFrame>,
    truth: Vec<SeenFrame>,
    paths: Vec<SeenFrame>,
    markings: Vec<SeenMarking>,
}

/// A run of the mission that explores a world. Dropping it ends everything.
struct ExploringMission {
    program: PathBuf,
    registry: String,
    run: Child,
    poses: EchoFollower<SeenFrame>,
    truth: EchoFollower<SeenFrame>,
    paths: EchoFollower<SeenFrame>,
    markings: EchoFollower<SeenMarking>,
}

impl ExploringMission {
    fn start(program: &Path, world: &str, folder: &Path) -> Result<Self> {
        let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
        let registry = TcpListener::bind("127.0.0.1:0")?.local_addr()?.to_string();
        let world = missions.join(format!("worlds/{world}.svg"));
        let run = Command::new(program)
            .arg("run")
            .arg(missions.join("explore-and-map.xml"))
            .args(["--headless", "--quiet", "--registry", &registry])
            .args(["--set", &format!("simulator.world={}", world.display())])
            .args(["--set", "simulator.speed=1"])
            .arg("--out")
            .arg(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .context("starting the mission")?;
        // Until the components are registered, there is nothing to follow.
        let follow = |data| {
            wait_until(PATIENCE, data, || {
                EchoFollower::start(program, &registry, data, SeenFrame::read)
            })
        };
        let (poses, truth) = (follow("mapper.pose")?, follow("simulator.truth")?);
        let paths = follow("planner.path")?;
        let data = "executive.marking";
        let markings = wait_until(PATIENCE, data, || {
            EchoFollower::start(program, &registry, data, SeenMarking::read)
        })?;
        Ok(Self { program: program.to_owned(), registry, run, poses, truth, paths, markings })
    }

    /// Kills the mapper again and again, `most` times at most, until the mission ends.
    fn kill_until_home(&self, most: usize, dice: &mut FaultDice) -> Result<Vec<Instant>> {
        let mut kills = Vec::new();
        let mut wait_s = dice.draw_between(3.0, 10.0);
        while kills.len() < most {
            let next = Instant::now() + Duration::from_secs_f64(wait_s);
            while Instant::now() < next {
                rest(Duration::from_millis(20))?;
                if self.poses.has_ended() {
                    return Ok(kills);
                }
            }
            if let Some(pid) = self.find_mapper()? {
                kill_process(pid, Signal::KILL)?;
                kills.push(Instant::now());
            }
            wait_s = dice.draw_between(BETWEEN_KILLS_S.0, BETWEEN_KILLS_S.1);
        }
        let _ = wait_until(PATIENCE, "a pose", || {
            let last = kills.last().copied();
            let poses = self.poses.list();
            let later = poses.iter().filter(|pose| last.is_none_or(|last| pose.at > last));
            let is_back = later.count() >= COMPARED || self.poses.has_ended();
            Ok(is_back.then_some(()))
        });
        Ok(kills)
    }

    fn find_mapper(&self) -> Result<Option<Pid>> {
        let listed = Command::new(&self.program)
            .args(["ps", "--format", "json", "--registry", &self.registry])
            .output()?;
        let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
        let mut lines = listed.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let mapper = lines.find(|line| line["name"] == "mapper");
        let pid = mapper.and_then(|line| i32::try_from(line["pid"].as_i64()?).ok());
        Ok(pid.and_then(Pid::from_raw))
    }

    fn end(self) -> SeenRun {
        SeenRun {
            poses: self.poses.list(),
            truth: self.truth.list(),
            paths: self.paths.list(),
            markings: self.markings.list(),
        }
    }
}

impl Drop for ExploringMission {
    fn drop(&mut self) {
        if let Ok(pid) = i32::try_from(self.run.id())
            && let Some(pid) = Pid::from_raw(pid)
        {
            let _ = kill_process(pid, Signal::TERM);
        }
        let _ = self.run.wait();
    }
}

#[cfg(test)]
mod tests {
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
        assert_eq!(find_greatest_error(poses.iter(), &truth), 0.25);
        assert!(SeenFrame::read("{}").is_none() && SeenFrame::read("no JSON").is_none());
    }

    /// A run with poses every 0.1 s until 10 s, and the mission home at `home_s`. The processes end
    /// later.
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

    #[test]
    fn a_kill_without_a_pose_is_a_miss_only_if_the_mission_lasted_long_enough() {
        let begin = Instant::now();
        let judge = |home_s, killed_s: f64| {
            let mut report = FaultReport::default();
            let kills = [begin + Duration::from_secs_f64(killed_s)];
            let is_good = judge_run(&mut report, "rooms", &kills, &draw_run(begin, home_s));
            assert_eq!(is_good, report.meets_goals());
            (is_good, report.to_markdown())
        };
        let row = |name: &str| format!("| {name} | 1 |");
        for home_s in [10.07, 10.02, 12.9] {
            let (is_good, text) = judge(Some(home_s), 10.02);
            assert!(is_good && text.contains(&row(OVER_BEFORE)), "home at {home_s} s: {text}");
            assert!(!text.contains(&row("kills")) && !text.contains(MISSED), "{text}");
        }
        // The mission went on without a pose, or did not reach its goal.
        for home_s in [Some(13.2), Some(40.0), None] {
            let (is_good, text) = judge(home_s, 10.02);
            assert!(!is_good && text.contains(&row(MISSED)), "home at {home_s:?} s: {text}");
            assert!(!text.contains(OVER_BEFORE), "{text}");
        }
        let (is_good, text) = judge(Some(10.07), 9.95);
        assert!(is_good && text.contains(&row("kills")), "{text}");
        assert!(!text.contains(OVER_BEFORE) && !text.contains(MISSED), "{text}");
    }
}
