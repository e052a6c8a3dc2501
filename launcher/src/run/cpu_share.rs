//! A share of the processors' time for a component: `cpu.max` of its control group (cgroups(7),
//! version 2).
//!
//! A group that contains processes itself, and passes this controller on, becomes one for threads: no
//! group in it takes processes. So this process, and what it has started, move from the group that it
//! divides into a leaf in it before.

use std::fmt::{self, Display, Formatter};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use rustix::fs::{Access, access};

use super::control_group::{self, ControlGroup, GroupObstacle};
use super::process_stat::read_parent;

/// The period in which the kernel measures the time, in microseconds; its default.
const PERIOD_US: u64 = 100_000;
/// What the name of the leaf begins with; the process id follows.
const LEAF: &str = "armor-own-";
/// How many times the processes of a group are moved: each may start another one meanwhile.
const MAX_MOVES: u32 = 8;
/// How far up the parents of a process are searched for this one.
const MAX_DEPTH: usize = 64;
const PROCESSES: &str = "cgroup.procs";
const PASSED_ON: &str = "cgroup.subtree_control";
/// The root has none, and may contain processes and pass on all controllers.
const TYPE: &str = "cgroup.type";

/// Why no share can be kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ShareObstacle {
    /// No groups can be made.
    NoGroup(GroupObstacle),
    /// The group of this process has no controller of the processors' time.
    NoController,
    /// Another process is in the group.
    Shared(u32),
    /// The file with which controllers are passed on belongs to another user.
    NotWritable(PathBuf),
    /// The kernel refuses it.
    Refused(String),
}

/// Limits the group of a process that begins, in thousandths of one processor.
///
/// # Errors
/// If it has no group, or the kernel refuses it.
pub fn limit(group: Option<&Path>, permille: u32) -> Result<()> {
    let group = group.context("cpu cannot be limited: the process has no control group")?;
    let quota_us = u64::from(permille) * PERIOD_US / 1000;
    let file = group.join("cpu.max");
    fs::write(&file, format!("{quota_us} {PERIOD_US}"))
        .with_context(|| format!("cpu cannot be limited: {}", file.display()))
}

/// Returns why this process can keep no share, and what to do. Prepares its group for shares.
pub fn refuse() -> Option<String> {
    let obstacle = prepare().err()?;
    let remedy = obstacle.remedy();
    Some(format!("cpu cannot be limited: {obstacle}: {remedy}"))
}

/// Returns why a run that this process would start could keep no share, and changes nothing.
pub fn foresee_obstacle() -> Option<ShareObstacle> {
    let own = match control_group::find_own() {
        Ok(own) => own,
        Err(obstacle) => return Some(ShareObstacle::NoGroup(obstacle)),
    };
    foresee_in(&own, std::process::id(), &read_parent)
}

/// As [`foresee_obstacle`], for the group `group` that the process `own` is in.
fn foresee_in(
    group: &Path,
    own: u32,
    find_parent: &dyn Fn(u32) -> Option<u32>,
) -> Option<ShareObstacle> {
    if !has_word(&group.join("cgroup.controllers")) {
        return Some(ShareObstacle::NoController);
    }
    let passed_on = group.join(PASSED_ON);
    if access(&passed_on, Access::WRITE_OK).is_err() {
        return Some(ShareObstacle::NotWritable(passed_on));
    }
    // The root may contain processes.
    if !group.join(TYPE).exists() {
        return None;
    }
    let processes = match list_processes(group) {
        Ok(processes) => processes,
        Err(error) => return Some(ShareObstacle::Refused(error.to_string())),
    };
    let foreign = processes.into_iter().find(|pid| !is_started_by(*pid, own, find_parent));
    foreign.map(ShareObstacle::Shared)
}

/// Passes the controller on to the groups within this one, if it has it.
pub fn pass_on(group: &Path) {
    if has_word(&group.join("cgroup.controllers")) && !has_word(&group.join(PASSED_ON)) {
        // Without it, the guard of a process that needs it reports what is missing.
        let _ = fs::write(group.join(PASSED_ON), "+cpu");
    }
}

/// Returns the group that this process divides, from the one in which it is.
pub fn leave_leaf(own: PathBuf) -> PathBuf {
    let name = own.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    match name.starts_with(LEAF) {
        true => own.parent().map(Path::to_owned).unwrap_or(own),
        false => own,
    }
}

fn prepare() -> Result<(), ShareObstacle> {
    let own = control_group::find_own().map_err(ShareObstacle::NoGroup)?;
    divide(&own, std::process::id(), &read_parent)?;
    let trial = ControlGroup::make().map_err(ShareObstacle::NoGroup)?;
    let refused = |error: io::Error| ShareObstacle::Refused(error.to_string());
    let process = trial.make_for("trial").map_err(refused)?;
    match process.path().join("cpu.max").exists() {
        true => Ok(()),
        false => Err(ShareObstacle::NoController),
    }
}

/// Has the group pass the controller on. `own` is this process, which is in the group or its leaf.
fn divide(
    group: &Path,
    own: u32,
    find_parent: &dyn Fn(u32) -> Option<u32>,
) -> Result<(), ShareObstacle> {
    if !has_word(&group.join("cgroup.controllers")) {
        return Err(ShareObstacle::NoController);
    }
    let refused = |error: io::Error| ShareObstacle::Refused(error.to_string());
    for _ in 0..MAX_MOVES {
        if group.join(TYPE).exists() && !list_processes(group).map_err(refused)?.is_empty() {
            move_processes(group, own, find_parent)?;
            continue;
        }
        if has_word(&group.join(PASSED_ON)) {
            return Ok(());
        }
        match fs::write(group.join(PASSED_ON), "+cpu") {
            Ok(()) => return Ok(()),
            // A process has come meanwhile.
            Err(error) if error.kind() == io::ErrorKind::ResourceBusy => {}
            Err(error) => return Err(refused(error)),
        }
    }
    Err(ShareObstacle::Refused("its processes start others all the time".into()))
}

fn list_processes(group: &Path) -> io::Result<Vec<u32>> {
    let text = fs::read_to_string(group.join(PROCESSES))?;
    Ok(text.lines().filter_map(|line| line.parse().ok()).collect())
}

/// Moves this process and those that it has started from the group into a leaf of it.
fn move_processes(
    group: &Path,
    own: u32,
    find_parent: &dyn Fn(u32) -> Option<u32>,
) -> Result<(), ShareObstacle> {
    let refused = |error: io::Error| ShareObstacle::Refused(error.to_string());
    let processes = list_processes(group).map_err(refused)?;
    let is_foreign = |pid: &&u32| !is_started_by(**pid, own, find_parent);
    if let Some(pid) = processes.iter().find(is_foreign) {
        return Err(ShareObstacle::Shared(*pid));
    }
    if has_word(&group.join(PASSED_ON)) {
        // It is one for threads, in which no leaf takes processes.
        fs::write(group.join(PASSED_ON), "-cpu").map_err(refused)?;
    }
    let leaf = group.join(format!("{LEAF}{own}"));
    match fs::create_dir(&leaf) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(refused(error)),
        _ => {}
    }
    for pid in processes {
        match fs::write(leaf.join(PROCESSES), pid.to_string()) {
            // It has ended.
            Err(error) if error.raw_os_error() == Some(rustix::io::Errno::SRCH.raw_os_error()) => {}
            done => done.map_err(refused)?,
        }
    }
    Ok(())
}

/// Whether `own` has started the process, or one that has started it, or is it. One that has ended
/// counts as such.
fn is_started_by(pid: u32, own: u32, find_parent: &dyn Fn(u32) -> Option<u32>) -> bool {
    let line = std::iter::successors(Some(pid), |pid| find_parent(*pid));
    let line: Vec<_> = line.take(MAX_DEPTH).take_while(|pid| *pid > 1).collect();
    line.contains(&own) || find_parent(pid).is_none()
}

/// Whether the controller is in a list of controllers.
fn has_word(list: &Path) -> bool {
    let list = fs::read_to_string(list).unwrap_or_default();
    list.split_whitespace().any(|word| word.trim_start_matches('+') == "cpu")
}

impl ShareObstacle {
    /// Returns what to do.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NoGroup(GroupObstacle::NotMounted) => {
                "boot with `systemd.unified_cgroup_hierarchy=1`, or leave cpu out"
            }
            Self::NoGroup(GroupObstacle::OldKernel) => "use Linux 5.14 or newer, or leave cpu out",
            Self::NoGroup(GroupObstacle::NotOwn)
            | Self::NoController
            | Self::Shared(_)
            | Self::NotWritable(_) => {
                "start in a group of its own, with `systemd-run --user --scope -p Delegate=yes \
                 armor run …` or `Delegate=yes` in the service of systemd, or leave cpu out"
            }
            Self::Refused(_) => "leave cpu out",
        }
    }
}

impl Display for ShareObstacle {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoGroup(obstacle) => obstacle.fmt(f),
            Self::NotWritable(file) => {
                write!(f, "this user may not write {}", file.display())
            }
            Self::NoController => {
                f.write_str("the control group of this process has no controller `cpu`")
            }
            Self::Shared(pid) => {
                write!(f, "process {pid} is in the control group of this process, too")
            }
            Self::Refused(why) => write!(f, "the kernel refuses it ({why})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with the files of a group: its controllers and its processes.
    fn make_group(name: &str, controllers: &str, processes: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("armor-share-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir(&path).expect("a folder");
        fs::write(path.join("cgroup.controllers"), controllers).expect("a file");
        fs::write(path.join(PASSED_ON), "").expect("a file");
        fs::write(path.join(PROCESSES), processes).expect("a file");
        path
    }

    #[test]
    fn a_share_is_a_quota_of_each_period() {
        let group = make_group("quota", "cpu", "");
        for (permille, expected) in
            [(500, "50000 100000"), (1500, "150000 100000"), (10, "1000 100000")]
        {
            limit(Some(&group), permille).expect("it is written");
            let written = fs::read_to_string(group.join("cpu.max")).expect("a file");
            assert_eq!(written, expected);
        }
        let why = limit(None, 500).expect_err("no group").to_string();
        assert!(why.contains("no control group"), "{why}");
        let _ = fs::remove_dir_all(group);
    }

    #[test]
    fn the_controller_is_passed_on_if_there_is_one() {
        let none = make_group("none", "pids memory cpuset", "");
        assert_eq!(divide(&none, 7, &|_| None), Err(ShareObstacle::NoController));
        pass_on(&none);
        assert!(!has_word(&none.join(PASSED_ON)), "cpuset is another one");
        let one = make_group("one", "cpuset cpu", "");
        divide(&one, 7, &|_| None).expect("it is passed on");
        assert!(has_word(&one.join(PASSED_ON)));
        for group in [none, one] {
            let _ = fs::remove_dir_all(group);
        }
    }

    #[test]
    fn only_a_group_without_other_processes_is_left() {
        let parent = |pid| match pid {
            8 => Some(7),
            9 => Some(1),
            10 => Some(8),
            1 => Some(0),
            _ => None,
        };
        let own = make_group("own", "cpu", "7\n8\n10\n11\n");
        move_processes(&own, 7, &parent).expect("all are its own, and one has ended");
        fs::write(own.join(TYPE), "domain").expect("a file");
        // Nothing takes the processes out of the file of this folder.
        assert!(divide(&own, 7, &parent).is_err());
        assert!(!has_word(&own.join(PASSED_ON)), "only an empty group may pass it on");
        let leaf = own.join("armor-own-7");
        assert_eq!(fs::read_to_string(leaf.join(PROCESSES)).expect("a file"), "11", "the last one");
        assert_eq!(leave_leaf(leaf), own);
        assert_eq!(leave_leaf(own.clone()), own);
        let shared = make_group("shared", "cpu", "7\n9\n");
        assert_eq!(move_processes(&shared, 7, &parent), Err(ShareObstacle::Shared(9)));
        assert!(!shared.join("armor-own-7").exists());
        for group in [own, shared] {
            let _ = fs::remove_dir_all(group);
        }
    }

    #[test]
    fn what_would_refuse_a_share_is_foreseen_without_a_change() {
        let parent = |pid| match pid {
            8 => Some(7),
            9 => Some(1),
            1 => Some(0),
            _ => None,
        };
        let none = make_group("foreseen-none", "memory", "7\n");
        assert_eq!(foresee_in(&none, 7, &parent), Some(ShareObstacle::NoController));
        let own = make_group("foreseen-own", "cpu memory", "7\n8\n");
        fs::write(own.join(TYPE), "domain").expect("a file");
        assert_eq!(foresee_in(&own, 7, &parent), None, "the launcher moves into a leaf");
        fs::write(own.join(PROCESSES), "7\n8\n9\n").expect("a file");
        assert_eq!(foresee_in(&own, 7, &parent), Some(ShareObstacle::Shared(9)));
        // The root may contain processes of others.
        fs::remove_file(own.join(TYPE)).expect("a file");
        assert_eq!(foresee_in(&own, 7, &parent), None);
        assert!(!has_word(&own.join(PASSED_ON)) && !own.join("armor-own-7").exists());
        fs::remove_file(own.join(PASSED_ON)).expect("a file");
        let found = foresee_in(&own, 7, &parent).expect("it cannot be written");
        assert!(found.to_string().contains("cgroup.subtree_control"), "{found}");
        assert!(found.remedy().contains("Delegate=yes"));
        for group in [none, own] {
            let _ = fs::remove_dir_all(group);
        }
    }

    #[test]
    fn a_host_keeps_a_share_or_the_reason_names_the_remedy() {
        if let Some(why) = refuse() {
            assert!(why.starts_with("cpu cannot be limited: ") && why.contains("leave cpu out"));
        }
    }
}
