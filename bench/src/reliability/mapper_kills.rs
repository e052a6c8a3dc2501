//! Kills of the mapper in simulated missions, on one host, without namespaces. What they show is judged
//! in `kill_judgement.rs`.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use super::dice::FaultDice;
use super::echoes::{EchoFollower, SeenFrame, SeenMarking};
use super::interrupt::{rest, wait_until};
use super::kill_judgement::{COMPARED, MapperKill, SeenRun, judge_run};
use super::options::ReliabilityOptions;
use super::report::FaultReport;

const WORLDS: [&str; 5] = ["office", "rooms", "ring", "hall", "warehouse"];
/// A component that dies five times in 60 s is given up.
const BETWEEN_KILLS_S: (f64, f64) = (16.0, 22.0);
/// The time for the mission to begin, and for a pose to come back.
const PATIENCE: Duration = Duration::from_secs(30);
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

/// When a system began, by the clock of this process and in system time.
#[derive(Clone, Copy, Debug)]
struct SystemBegin {
    at: Instant,
    stamp_s: f64,
}

impl SystemBegin {
    /// Now. System time is the wall clock at the start of the registry, and passes as the monotonic
    /// clock from then on.
    fn now() -> Result<Self> {
        let stamp_s = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64();
        Ok(Self { at: Instant::now(), stamp_s })
    }

    /// A kill that was just made: what the killed process sent is of scans before it.
    fn note_kill(self) -> MapperKill {
        let at = Instant::now();
        MapperKill { at, stamp_s: self.stamp_s + at.duration_since(self.at).as_secs_f64() }
    }
}

/// A run of the mission that explores a world. Dropping it ends everything.
struct ExploringMission {
    program: PathBuf,
    begun: SystemBegin,
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
        let begun = SystemBegin::now()?;
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
        Ok(Self {
            program: program.to_owned(),
            begun,
            registry,
            run,
            poses,
            truth,
            paths,
            markings,
        })
    }

    /// Kills the mapper again and again, `most` times at most, until the mission ends.
    fn kill_until_home(&self, most: usize, dice: &mut FaultDice) -> Result<Vec<MapperKill>> {
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
                kills.push(self.begun.note_kill());
            }
            wait_s = dice.draw_between(BETWEEN_KILLS_S.0, BETWEEN_KILLS_S.1);
        }
        let _ = wait_until(PATIENCE, "a pose", || {
            let last = kills.last();
            let poses = self.poses.list();
            let later = poses
                .iter()
                .filter(|pose| last.is_none_or(|last: &MapperKill| last.is_before(pose)));
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
