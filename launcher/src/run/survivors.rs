//! Processes that a component has started and that have left its process group (`setsid`), found by
//! the variable that every process of a run inherits.
//!
//! Its mark names the launcher, so that the next one recognizes what a killed one has left.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::time::Duration;

use rustix::process::{Pid, Signal, geteuid, kill_process};

use super::process_stat::{read_parent, read_start};

/// The variable that names the run and the process in it: `MARK/NAME/`.
pub const VARIABLE: &str = "ARMOR_PROCESS";
/// Namespaces in which process ids and the times of process starts mean the same.
const NAMESPACES: [&str; 2] = ["/proc/self/ns/pid", "/proc/self/ns/time"];
/// How far up the parents of this process are searched.
const MAX_DEPTH: usize = 64;
/// Most searches: a process that starts others while it is being killed is found again.
const MAX_SEARCHES: u32 = 20;
/// Rest between two searches, in which a killed process ends.
const REST: Duration = Duration::from_millis(10);

/// Returns the mark of a run or an agent of this process: `PID-START-NAMESPACES-RANDOM/`, in hexadecimal
/// digits.
pub fn make_mark() -> String {
    let own = std::process::id();
    let started = read_start(own).unwrap_or_default();
    let random = armor_socket::random_id();
    format!("{own:x}-{started:x}-{}-{random:016x}/", name_namespaces())
}

/// Kills what launchers and agents of this user that have died have left, and returns its number.
pub fn kill_left_processes() -> usize {
    let mut killed = 0;
    let mut done: Vec<String> = Vec::new();
    while let Some(mark) = find_mark_of_dead(&done) {
        killed += kill_survivors(&mark);
        done.push(mark);
    }
    killed
}

/// The mark of a dead launcher, with its slash, that a process of this user carries.
fn find_mark_of_dead(done: &[String]) -> Option<String> {
    let namespaces = name_namespaces();
    let own = geteuid().as_raw();
    let is_own = |pid: &u32| fs::metadata(format!("/proc/{pid}")).is_ok_and(|it| it.uid() == own);
    list_pids().filter_map(|pid| u32::try_from(pid).ok()).filter(is_own).find_map(|pid| {
        let mark = read_mark(pid)?;
        let run = mark.split_inclusive('/').next()?;
        (is_of_dead(run, &namespaces) && !done.iter().any(|it| it == run)).then(|| run.to_owned())
    })
}

/// Whether the launcher that a mark names has died. One of other namespaces cannot be judged.
fn is_of_dead(mark: &str, own_namespaces: &str) -> bool {
    let fields: Vec<_> = mark.trim_end_matches('/').split('-').collect();
    let [pid, started, namespaces, _] = fields[..] else { return false };
    let number = |text: &str| u64::from_str_radix(text, 16).ok();
    let (Some(pid), Some(started)) =
        (number(pid).and_then(|it| u32::try_from(it).ok()), number(started))
    else {
        return false;
    };
    namespaces == own_namespaces && started > 0 && read_start(pid) != Some(started)
}

/// The inodes of the namespaces of this process.
fn name_namespaces() -> String {
    let inodes = NAMESPACES.map(|path| fs::metadata(path).map_or(0, |namespace| namespace.ino()));
    inodes.map(|inode| format!("{inode:x}")).join(".")
}

/// Kills every process whose variable begins with `mark`, and returns their number.
pub fn kill_survivors(mark: &str) -> usize {
    let mut killed = Vec::new();
    let mut has_found = true;
    for _ in 0..MAX_SEARCHES {
        let found = find_survivors(mark);
        // Twice in a row: the variables of a process that begins a program at this moment cannot be
        // read.
        if found.is_empty() && !has_found {
            break;
        }
        has_found = !found.is_empty();
        for pid in found {
            // It may have ended in this moment.
            let _ = kill_process(pid, Signal::KILL);
            if !killed.contains(&pid) {
                killed.push(pid);
            }
        }
        std::thread::sleep(REST);
    }
    killed.len()
}

/// Returns the mark of a process, if it has one and belongs to this user.
pub fn read_mark(pid: u32) -> Option<String> {
    let variables = fs::read(format!("/proc/{pid}/environ")).ok()?;
    let prefix = format!("{VARIABLE}=");
    let mut variables = variables.split(|byte| *byte == 0);
    let mark = variables.find_map(|variable| variable.strip_prefix(prefix.as_bytes()))?;
    String::from_utf8(mark.to_vec()).ok()
}

/// Only processes of this user can be read, and a process that has ended has no variables.
fn find_survivors(mark: &str) -> Vec<Pid> {
    let wanted = format!("{VARIABLE}={mark}");
    let is_marked = |pid: &i32| {
        let variables = fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
        variables.split(|byte| *byte == 0).any(|it| it.starts_with(wanted.as_bytes()))
    };
    // A shell that a component had started may have started this process.
    let above = std::iter::successors(Some(std::process::id()), |pid| read_parent(*pid));
    let above: Vec<_> = above.take(MAX_DEPTH).take_while(|pid| *pid > 1).collect();
    let is_above = |pid: &i32| u32::try_from(*pid).is_ok_and(|pid| above.contains(&pid));
    list_pids().filter(is_marked).filter(|pid| !is_above(pid)).filter_map(Pid::from_raw).collect()
}

fn list_pids() -> impl Iterator<Item = i32> {
    let processes = fs::read_dir("/proc").into_iter().flatten();
    processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
}

#[cfg(test)]
mod tests {
    use std::process::Command;
    use std::time::Instant;

    use super::*;

    #[test]
    fn only_processes_with_the_mark_are_killed() {
        let mark = format!("test-{:016x}/", armor_socket::random_id());
        let mut others = ["laser", "slam"].map(|name| {
            let mut command = Command::new("sleep");
            command.arg("600").env(VARIABLE, format!("{mark}{name}/"));
            command.spawn().expect("sleep runs")
        });
        // The variables of a process that begins a program at this moment cannot be read.
        let end = Instant::now() + Duration::from_secs(30);
        for (other, name) in others.iter().zip(["laser", "slam"]) {
            while read_mark(other.id()) != Some(format!("{mark}{name}/")) {
                assert!(Instant::now() < end, "{:?}", read_mark(other.id()));
                std::thread::sleep(REST);
            }
        }
        assert_eq!(kill_survivors(&format!("{mark}laser/")), 1);
        assert!(!others[0].wait().expect("it is ours").success());
        assert_eq!(others[1].try_wait().expect("it is ours"), None);
        assert_eq!(kill_survivors(&mark), 1);
        assert!(!others[1].wait().expect("it is ours").success());
        assert_eq!(kill_survivors(&mark), 0);
    }

    #[test]
    fn what_a_dead_launcher_has_left_is_recognized_by_its_mark() {
        let start = |mark: &str| {
            let mut command = Command::new("sleep");
            command.arg("600").env(VARIABLE, format!("{mark}laser/")).spawn().expect("sleep runs")
        };
        let own = make_mark();
        let mut launcher = Command::new("sleep").arg("600").spawn().expect("sleep runs");
        let (pid, started) = (launcher.id(), read_start(launcher.id()).expect("it runs"));
        let mark_in = |namespaces: &str| {
            format!("{pid:x}-{started:x}-{namespaces}-{:016x}/", armor_socket::random_id())
        };
        let (dead, elsewhere) = (mark_in(&name_namespaces()), mark_in("1.2"));
        assert!(!is_of_dead(&own, &name_namespaces()) && !is_of_dead(&dead, &name_namespaces()));
        let mut processes = [&dead, &own, &elsewhere].map(|mark| start(mark));
        launcher.kill().expect("it is ours");
        launcher.wait().expect("it is ours");
        assert!(is_of_dead(&dead, &name_namespaces()));
        // The variables of a process that begins a program at this moment cannot be read. A launcher of
        // another test may kill it, too.
        let end = Instant::now() + Duration::from_secs(30);
        while processes[0].try_wait().expect("it is ours").is_none() {
            assert!(Instant::now() < end, "it is not killed");
            kill_left_processes();
            std::thread::sleep(REST);
        }
        for process in &mut processes[1..] {
            assert_eq!(process.try_wait().expect("it is ours"), None);
            process.kill().expect("it is ours");
            process.wait().expect("it is ours");
        }
        // Process ids are used again; marks of another form are those of other programs.
        assert!(is_of_dead(
            &format!("{:x}-1-{}-7/", std::process::id(), name_namespaces()),
            &name_namespaces()
        ));
        for other in ["", "/", "0011223344556677/", "x-y-z-0/", "1-0-0-0/"] {
            assert!(!is_of_dead(other, &name_namespaces()), "{other}");
        }
    }
}
