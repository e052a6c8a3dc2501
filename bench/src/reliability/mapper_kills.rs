//! Kills of the mapper in simulated missions: how soon it gives a pose again, how true that pose is,
//! and whether anything is driven in a frame of before. On one host, without namespaces.

use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use parking_lot::Mutex;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use super::dice::FaultDice;
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
    let SeenRun { poses, truth, paths, ended } = seen;
    for killed in kills {
        let later: Vec<_> = poses.iter().filter(|pose| pose.at > *killed).collect();
        let earlier: Vec<_> = poses.iter().filter(|pose| pose.at <= *killed).collect();
        let Some(first) = later.first() else {
            // Home before the mapper could be back: nothing to measure.
            if ended.duration_since(*killed).as_secs_f64() > BACK_GOAL_S {
                report.add_count("kills after which no pose came back", 1, Some(0));
                let began = poses.first().map_or(*killed, |pose| pose.at);
                let killed_s = killed.duration_since(began).as_secs_f64();
                eprintln!("{world}: no pose after the kill at {killed_s:.2} s of poses");
                is_good = false;
            }
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

/// A message with a frame, and a place if it is a pose.
#[derive(Clone, Debug)]
struct SeenFrame {
    at: Instant,
    stamp_s: f64,
    frame: String,
    x: f64,
    y: f64,
}

impl SeenFrame {
    fn read(line: &str) -> Option<Self> {
        let message: Value = serde_json::from_str(line).ok()?;
        let value = &message["value"];
        let position = &value["pose"]["pose"]["position"];
        Some(Self {
            at: Instant::now(),
            stamp_s: value["stamp"].as_f64()?,
            frame: value["frame"].as_str()?.to_owned(),
            x: position["x"].as_f64().unwrap_or(f64::NAN),
            y: position["y"].as_f64().unwrap_or(f64::NAN),
        })
    }
}

/// What was published in a run.
struct SeenRun {
    poses: Vec<SeenFrame>,
    truth: Vec<SeenFrame>,
    paths: Vec<SeenFrame>,
    ended: Instant,
}

/// A run of the mission that explores a world. Dropping it ends everything.
struct ExploringMission {
    program: PathBuf,
    registry: String,
    run: Child,
    poses: Follower,
    truth: Follower,
    paths: Follower,
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
        let follow = |data| {
            // Until the components are registered, there is nothing to follow.
            wait_until(PATIENCE, data, || Follower::start(program, &registry, data))
        };
        let (poses, truth) = (follow("mapper.pose")?, follow("simulator.truth")?);
        let paths = follow("planner.path")?;
        Ok(Self { program: program.to_owned(), registry, run, poses, truth, paths })
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
            let is_back = self.poses.count_since(last) >= COMPARED || self.poses.has_ended();
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
            poses: self.poses.seen.lock().clone(),
            truth: self.truth.seen.lock().clone(),
            paths: self.paths.seen.lock().clone(),
            ended: Instant::now(),
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

/// `armor echo` of one output, read by a thread.
struct Follower {
    echo: Child,
    seen: Arc<Mutex<Vec<SeenFrame>>>,
    reading: std::thread::JoinHandle<()>,
}

impl Follower {
    /// Starts to follow; nothing if there is no such data yet.
    fn start(program: &Path, registry: &str, data: &str) -> Result<Option<Self>> {
        let mut echo = Command::new(program)
            .args(["echo", data, "--format", "json", "--registry", registry])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let mut lines = BufReader::new(echo.stdout.take().context("a pipe")?);
        let mut first = String::new();
        lines.read_line(&mut first)?;
        let Some(first) = SeenFrame::read(&first) else {
            let _ = echo.kill();
            echo.wait()?;
            return Ok(None);
        };
        let seen = Arc::new(Mutex::new(vec![first]));
        let list = Arc::clone(&seen);
        let reading = std::thread::spawn(move || read_on(lines, &list));
        Ok(Some(Self { echo, seen, reading }))
    }

    /// Whether the system has ended, and `armor echo` with it.
    fn has_ended(&self) -> bool {
        self.reading.is_finished()
    }

    fn count_since(&self, since: Option<Instant>) -> usize {
        let seen = self.seen.lock();
        seen.iter().rev().take_while(|one| since.is_none_or(|since| one.at > since)).count()
    }
}

impl Drop for Follower {
    fn drop(&mut self) {
        let _ = self.echo.kill();
        let _ = self.echo.wait();
    }
}

fn read_on(lines: BufReader<ChildStdout>, seen: &Mutex<Vec<SeenFrame>>) {
    for line in lines.lines().map_while(Result::ok) {
        if let Some(one) = SeenFrame::read(&line) {
            seen.lock().push(one);
        }
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
}
